"""Runs of the board: built, driven, judged, read and shown."""

import dataclasses

import numpy as np
import pytest

from boresight.gateware.attitude.system.interface import FIELDS, FORMATS, ORDERS, WORDS, update_of
from boresight.gateware.boards.frames import Decoder, Kind
from boresight.model.errors import InputError
from boresight.sim.attitude.board.faults import WRONG_VALUES, is_good, trial_log
from boresight.sim.attitude.board.run import (
    Judgement,
    Line,
    inertial_words,
    judge,
    read_trace,
    run_board,
    stimulus,
    writes,
)
from boresight.sim.attitude.worlds import synthetic_log
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.rotations.rotation import quaternion_conjugate, quaternion_multiply
from boresight.sim.rtl.simulators import SimulationFailed
from tests.support.attitude.board.icarus_run import run_in_icarus
from tests.support.attitude.board.shared import COMPLEMENTARY, MEKF, odd_board

from .conftest import UPDATES

# -- the complete board against the integer models, word by word; and a judge that bites ----------


def test_every_frame_equals_the_models(board, what, plain) -> None:
    verdict = judge(board, what, plain, filter=COMPLEMENTARY, source=2)
    assert (verdict.mismatches, verdict.first, verdict.lost) == (0, "", 0)
    assert np.array_equal(np.diff(plain.frames[:, 0] & 0xFFFF), np.ones(UPDATES - 1))
    assert verdict.updates == len(plain.frames) == len(plain.trace.samples) == UPDATES
    assert verdict.lines >= 2 and verdict.fields >= 2
    assert plain.dropped == plain.trace.violations == len(plain.trace.framing_errors) == 0


def test_other_data_and_lost_samples_are_seen(board, what, plain) -> None:
    def verdict(what=what, run=plain) -> Judgement:
        return judge(board, what, run, filter=COMPLEMENTARY, source=2)

    counts, compass = what.counts.copy(), what.compass.copy()
    counts[UPDATES // 2, 2] += 1
    compass[0, 0] += 1
    assert verdict(dataclasses.replace(what, counts=counts)).mismatches > 0
    assert verdict(dataclasses.replace(what, compass=compass)).mismatches > 0
    none = dataclasses.replace(plain, frames=plain.frames[:0], frame_ends=plain.frame_ends[:0])
    silent = verdict(run=none)
    assert (silent.mismatches, silent.updates) == (1, 0)
    samples, updates = (np.delete(v, 5) for v in (plain.trace.samples, plain.trace.updates))
    gone = dataclasses.replace(plain.trace, samples=samples, updates=updates)
    frames, ends = plain.frames[:-1], plain.frame_ends[:-1]
    lost = dataclasses.replace(plain, trace=gone, frames=frames, frame_ends=ends)
    assert verdict(run=lost).lost == 1


def test_latency_is_the_stated_one(board, what, plain) -> None:
    verdict = judge(board, what, plain, filter=COMPLEMENTARY, source=2)
    assert verdict.transfer_cycles == (board.system.transfer_cycles,) * 2
    assert sum(
        verdict.transfer_cycles[:1] + verdict.core_cycles[:1]
    ) == board.system.latency_cycles(COMPLEMENTARY)
    least, most = verdict.core_cycles
    assert least <= board.system.plan.lengths[COMPLEMENTARY] + 100  # 1 us at 100 MHz
    assert most == least + board.core.image.restarts[COMPLEMENTARY]  # the first: states are loaded


@pytest.mark.parametrize("word", WORDS)
def test_one_wrong_bit_is_seen(word: str, board, what, plain) -> None:
    frames = plain.frames.copy()
    frames[UPDATES // 2, WORDS.index(word)] ^= 1 << (20 if word == "header" else 0)
    verdict = judge(
        board, what, dataclasses.replace(plain, frames=frames), filter=COMPLEMENTARY, source=2
    )
    assert verdict.mismatches == 1 and f"update {UPDATES // 2}" in verdict.first


def test_magnetometer_counts(board, what) -> None:
    run = run_board(
        board,
        what,
        updates=960,
        settings={"filter": MEKF, "magnetic_source": 1, "compass_mode": 2, "output_divider": 1},
    )
    verdict = judge(board, what, run, filter=MEKF, source=1)
    assert (verdict.mismatches, verdict.first) == (0, "")
    # The compass wakes up with headings and has to be told.
    assert not run.trace.lines[0].counts and run.trace.lines[-1].counts
    assert verdict.fields >= 1
    last = update_of(run.frames[-1].tolist(), FORMATS[MEKF])
    assert not {"inertial_fault", "saturated", "beyond"} & set(last.flag_names)


def test_another_range_of_the_gyro_gives_the_same_attitude(board) -> None:
    """At +-150 deg/s a count is half of that at +-300 deg/s."""
    log = synthetic_log(seconds=1, rate_hz=1024, seed=1, acceleration=0.3)
    slow = stimulus(log, board, halvings=1)
    assert np.abs(slow.counts[:100, :3]).max() > 12_000
    settings = {"filter": COMPLEMENTARY, "output_divider": 1, "inertial_sens_avg": 0x0202}
    settings["order"] = next(o.mask for o in ORDERS if o.name == "restart_inertial")
    run = run_board(board, slow, updates=100, settings=settings)
    verdict = judge(board, slow, run, filter=COMPLEMENTARY, source=2)
    assert (verdict.mismatches, verdict.first) == (0, "")
    wide = run_board(
        board, stimulus(log, board), updates=100, settings={**settings, "inertial_sens_avg": 0x0402}
    )
    names = [WORDS.index(name) for name in ("heading", "pitch", "roll")]
    apart = (run.frames[:, names] - wide.frames[:, names]) * (180.0 / 2**31)
    assert np.abs(apart).max() < 0.05


def test_a_command_of_the_host_reaches_the_sensor(board, what) -> None:
    """Another SENS_AVG than the reader's: seen, and put right by a new start."""
    settings = {"filter": COMPLEMENTARY, "inertial_command": 0xB803}
    run = run_board(board, what, updates=20, settings=settings)
    names = board.system.events
    seen = {n for _, bits in run.trace.events for k, n in enumerate(names) if bits >> k & 1}
    assert {"inertial_config_error", "inertial_restart"} <= seen and len(run.trace.updates) == 20


def test_an_input_beyond_its_range_is_told() -> None:
    """By the header's highest bit: a host that wrote 3.5 for an input of 0 to 3."""
    board = odd_board()
    what = stimulus(synthetic_log(seconds=1, rate_hz=1024, seed=5), board)
    for target, is_beyond in ((7 << 28, True), (5 << 28, False)):
        settings = {"filter": 0, "output_divider": 1, "feed_target": target, "feed_offset": 0}
        run = run_board(board, what, updates=10, settings=settings)
        verdict = judge(board, what, run, filter=0, source=2, feed={"target": target, "offset": 0})
        assert (verdict.mismatches, verdict.first) == (0, "") and len(run.frames) == 10
        assert (FIELDS["beyond"].of(run.frames[:, 0]) == is_beyond).all()


def test_divider(board, what) -> None:
    settings = {"filter": COMPLEMENTARY, "output_divider": 4}
    run = run_board(board, what, updates=60, settings=settings)
    assert len(run.frames) == 60 // 4 and run.dropped == 0


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


def test_every_frame_of_an_estimator_with_registers_a_held_field_and_flags() -> None:
    board = odd_board()
    plan = board.system.plan
    assert plan.feed.holds and list(plan.feed.registers) == ["target", "offset"]
    words = {"target": 5 << 28, "offset": -(1 << 28)}
    what = stimulus(synthetic_log(seconds=1, rate_hz=1024, seed=5), board)
    settings = {"filter": 0, "output_divider": 1, **{f"feed_{k}": v for k, v in words.items()}}
    settings["feed_offset"] &= 0xFFFF_FFFF
    run = run_board(board, what, updates=UPDATES, settings=settings)
    verdict = judge(board, what, run, filter=0, source=2, feed=words)
    assert (verdict.mismatches, verdict.first, verdict.lost) == (0, "", 0)
    assert verdict.updates == len(run.frames) == UPDATES and verdict.fields >= 2
    cycles = board.system.latency_cycles(0) - board.system.transfer_cycles
    assert verdict.core_cycles == (cycles, cycles)
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


# -- the bench's events, read from their text -----------------------------------------------------

TEXT = "10 R 1\n22 S\n30 U 0\n32 B c0\n33 N 1f\n36 E\n40 L 1 -7 8 -9 2\n50 F 2 a0\n70 V 4\n"


def test_events_are_read() -> None:
    trace = read_trace(TEXT)
    assert trace.ready.tolist() == [[10, 1]] and trace.data == b"\xc0" and trace.violations == 4
    assert trace.lines == (Line(40, True, (-7, 8, -9), 2),)
    assert (trace.events, trace.faults) == ([(33, 0x1F)], [(50, 2, 0xA0)])


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


# -- trials of faults --------------------------------------------------------------------------

TURNED = {"seen_after_s": 0.1, "fault": "adis.fast_turn_z"}


@pytest.mark.parametrize(
    "changes, good",
    [
        ({}, True),
        ({"dropped": 1}, False),
        ({"during_deg": 1.3}, False),
        ({"seen_after_s": 0.1, "dropped": 1}, True),
        ({"seen_after_s": 0.1, "back_after_s": None}, False),
        ({"seen_after_s": 0.1, "after_deg": 1.1}, False),
        ({"seen_after_s": 0.1, "during_deg": 5.1}, False),
        ({"during_deg": 1.3, "fault": "adis.force_stuck"}, True),
        ({"during_deg": 1.3, "fault": "adis.force_saturated"}, False),
        ({**TURNED, "during_deg": 11.9, "after_deg": 2.9}, True),
        ({**TURNED, "during_deg": 12.1}, False),
        ({**TURNED, "after_deg": 3.1}, False),
    ],
)
def test_what_counts_as_good(changes: dict, good: bool) -> None:
    angles = {"before_deg": 1.0, "during_deg": 1.1, "after_deg": 1.0}
    row = {"fault": "hmr.glitches", "seen_after_s": None, "dropped": 0, "back_after_s": 0.01}
    assert is_good(row | angles | changes) == good


def test_only_these_rows_of_the_force_and_how_wrong() -> None:
    log = trial_log()
    for fault in ("force_stuck", "force_saturated"):
        after = WRONG_VALUES[fault](log, 100, 140)
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
    log = trial_log()
    after = WRONG_VALUES[f"fast_turn_{'xyz'[axis]}"](log, 1200, 1489)
    full = (np.abs(inertial_words(after)[:, :3]) == 24000).sum(axis=0)
    assert full[axis] == pytest.approx(102, abs=5) and full.sum() == full[axis]
    turn = quaternion_multiply(quaternion_conjugate(log.attitude), after.attitude)
    degrees = np.degrees(2.0 * np.arctan2(turn[:, 1 + axis], turn[:, 0]))
    assert abs(degrees[:1200]).max() < 1e-9
    assert degrees[1489:] == pytest.approx(330.0 * 0.1818, abs=0.2)
