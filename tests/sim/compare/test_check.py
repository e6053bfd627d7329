"""The proof itself: it passes on the shipped filter and fails on every kind of fault."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest

import boresight.sim.compare.check
import boresight.sim.records.segments
from boresight.disk.output import OutputFile
from boresight.model.errors import InputError
from boresight.model.estimators import estimator
from boresight.model.estimators.complementary import Complementary
from boresight.sim.compare.check import LevelResult, check, compare_rtl
from boresight.sim.compare.divergence import load_reproducer, replay_reproducer
from boresight.sim.records.bundled import bundled
from boresight.sim.records.files import read_record
from boresight.sim.rtl.cosim import RtlRun


@pytest.fixture(scope="module")
def log():
    return read_record(bundled("ximu_walk"))


@pytest.mark.parametrize("config", ["small", "fast"])
def test_all_levels_agree_on_recorded_data(log, config):
    result = check(estimator("complementary"), log, config=config, steps=1500)
    assert result.good
    levels = {(r.level, r.simulator): r for r in result.levels}
    assert levels["fixed", "interpreter"].n_total == 1500
    assert levels["c", "gcc"].n_total == 1500
    rtl = levels["rtl", "verilator"]
    assert (rtl.n_total, rtl.n_mismatch) == (1500, 0)
    assert rtl.cycles_min == rtl.cycles_max == rtl.cycles_predicted
    assert result.accuracy.largest("attitude") < 1e-4
    assert result.accuracy.saturated_updates == 0


def test_as_printed_agrees_too(log):
    result = check(estimator("complementary_as_printed"), log, steps=200, simulator="verilator")
    assert result.good


def fault(pattern, change):
    def hook(verilog):
        out, count = re.subn(pattern, change, verilog)
        assert count, "the fault must be there"
        return out

    return hook


def test_a_wrong_table_word_is_found_by_name_step_and_cycle(log, tmp_path):
    file = tmp_path / "reproducer.json"
    hook = fault(
        r"(tables0\[(?:5\d\d|[6-9]\d\d)\] = 32'd)(\d+);", lambda m: f"{m[1]}{int(m[2]) ^ 64};"
    )
    result = check(
        estimator("complementary"),
        log,
        config="fast",
        steps=30,
        simulator="verilator",
        verilog_hook=hook,
        reproducer=OutputFile(file, "check"),
    )
    assert not result.good
    rtl = result.levels[-1]
    assert rtl.n_mismatch > 0
    assert re.fullmatch(
        r"rtl: first difference in value rsqrt_\w+, step \d+, cycle \d+: "
        r"wanted -?\d+, found -?\d+",
        rtl.divergence,
    )
    data = load_reproducer(file)
    assert data["level"] == "rtl" and len(data["inputs"]) == 1
    assert data["step"] == rtl.first_wrong
    assert replay_reproducer(file) == []  # the core itself is sound


def test_a_late_output_fails_even_with_right_words(log):
    # One more word in the ROM: the program is a cycle longer than the schedule says.
    result = check(estimator("complementary"), log, steps=5, simulator="verilator", levels=("rtl",))
    level = result.levels[0]
    assert level.good
    assert not LevelResult(**{**vars(level), "cycles_max": level.cycles_max + 1}).good
    assert not LevelResult(**{**vars(level), "interval_max": level.interval_max + 1}).good
    assert not LevelResult(**{**vars(level), "n_total": 0}).good


def test_a_hanging_core_fails(log):
    # A program that never asks for input.
    hook = fault(r"(    rom0\[\d+\] = 54'[dh])[0-9a-f]+;", r"\g<1>0;")
    result = check(
        estimator("complementary"),
        log,
        steps=3,
        simulator="verilator",
        levels=("rtl",),
        verilog_hook=hook,
    )
    assert not result.good
    assert result.levels[0].error


def test_a_wrong_c_model_is_found_by_name(log, monkeypatch):
    class Wrong(boresight.sim.compare.check.CModel):
        def update(self, inputs):
            out, flags = super().update(inputs)
            out[7, 0] ^= 1
            return out, flags

    monkeypatch.setattr(boresight.sim.compare.check, "CModel", Wrong)
    result = check(estimator("complementary"), log, steps=20, levels=("c",))
    assert not result.good
    assert result.levels[0].n_mismatch == 1
    assert result.levels[0].divergence.startswith("c: first difference in value")


def test_a_c_model_wrong_in_a_state_alone_fails(log, monkeypatch):
    """Its outputs and its flag are right; a later update would show it, or none."""

    class Wrong(boresight.sim.compare.check.CModel):
        def update(self, inputs):
            out, flags = super().update(inputs)
            out[19, n_outputs:] ^= 1  # nothing but the states, in the last update
            return out, flags

    n_outputs = len(estimator("complementary").compile().outputs)
    monkeypatch.setattr(boresight.sim.compare.check, "CModel", Wrong)
    result = check(estimator("complementary"), log, steps=20, levels=("c",))
    assert not result.good
    assert (result.levels[0].n_mismatch, result.levels[0].first_wrong) == (1, 19)


def test_a_c_model_wrong_in_its_flag_alone_fails(log, monkeypatch):
    class Wrong(boresight.sim.compare.check.CModel):
        def update(self, inputs):
            out, flags = super().update(inputs)
            flags[5] ^= True
            return out, flags

    monkeypatch.setattr(boresight.sim.compare.check, "CModel", Wrong)
    result = check(estimator("complementary"), log, steps=20, levels=("c",))
    assert (result.levels[0].n_mismatch, result.levels[0].first_wrong) == (1, 5)


@pytest.fixture(scope="module")
def rtl_run(core):
    """A run as the schedule says, and what the interpreter would have said."""
    rows, n = 6, len(core.program.outputs)
    words = np.arange(rows * n).reshape(rows, n)
    run = RtlRun(
        words.copy(),
        np.zeros(rows, dtype=bool),
        np.tile(core.schedule.latencies, (rows, 1)),
        np.full(rows, core.schedule.interval),
    )
    return run, words, np.zeros(rows, dtype=bool)


def changed(run, name, place, by):
    """The run with one number of one array another."""
    array = getattr(run, name).copy()
    array[place] = array[place] + by if array.dtype != bool else not array[place]
    return dataclasses.replace(run, **{name: array})


def test_rtl_as_the_schedule_says_is_good(core, rtl_run):
    run, words, flags = rtl_run
    level = compare_rtl(core, Complementary(), run, words, flags, "verilator")
    assert level.good and level.n_total == 6 and level.first_wrong is None


def test_rtl_with_a_wrong_word_or_flag_fails(core, rtl_run):
    run, words, flags = rtl_run
    last = len(core.program.outputs) - 1
    for name, place in (("outputs", (3, 0)), ("outputs", (3, last)), ("saturated", 3)):
        wrong = changed(run, name, place, 1)
        level = compare_rtl(core, Complementary(), wrong, words, flags, "verilator")
        assert not level.good
        assert (level.n_mismatch, level.first_wrong) == (1, 3)


@pytest.mark.parametrize("by", [-1, 1])
def test_every_output_must_come_in_its_cycle(core, rtl_run, by):
    """Also those that are not urgent, whose cycles no figure shows."""
    run, words, flags = rtl_run
    for output in range(len(core.program.outputs)):
        late = changed(run, "latency_cycles", (2, output), by)
        level = compare_rtl(core, Complementary(), late, words, flags, "verilator")
        assert not level.good and level.n_mismatch == 0
        assert level.error == "output cycles differ from the schedule"


def test_an_update_may_not_take_longer_than_the_interval(core, rtl_run):
    run, words, flags = rtl_run
    late = changed(run, "interval_cycles", 4, 1)
    assert not compare_rtl(core, Complementary(), late, words, flags, "verilator").good


def test_segments_must_join(log, monkeypatch):
    class Wrong(boresight.sim.records.segments.CModel):
        def update(self, inputs):
            out, flags = super().update(inputs)
            out[7, -1] ^= 1  # the last step of the first of twelve segments
            return out, flags

    monkeypatch.setattr(boresight.sim.records.segments, "CModel", Wrong)
    result = check(estimator("complementary"), log, steps=96, levels=("fixed",))
    assert not result.good
    assert "after step" in result.levels[0].divergence


def test_missing_simulator_fails(log, monkeypatch):
    monkeypatch.setattr(
        "boresight.sim.rtl.simulators._missing", lambda name: f"{name} not found: install it"
    )
    result = check(estimator("complementary"), log, steps=3, simulator="icarus", levels=("rtl",))
    assert not result.good
    assert result.levels[0].error == "icarus not found: install it"
    assert result.levels[0].line().endswith("FAILED    icarus not found: install it")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"levels": ("rtl", "silicon")}, r"^levels: wanted some of .*, found 'silicon'; .*$"),
        ({"simulator": "modelsim"}, r"^simulator: wanted one of .*, found 'modelsim'; .*$"),
        ({"steps": 0}, r"^steps: wanted 1 or more, found 0; .*$"),
        ({"word": 17}, r"^word: wanted 18 to 32 bits, found 17; .*$"),
        ({"params": {"kp_roll_per_s": -1.0}}, r"^parameter kp_roll_per_s: wanted 0 to 32 1/s, .*$"),
        ({"params": {"kp_roll_per_s": float("nan")}}, r"^parameter kp_roll_per_s: wanted .*nan.*$"),
        ({"params": {"gain": 1.0}}, r"^parameter gain: wanted one of .*, found 'gain'; .*$"),
    ],
)
def test_bad_options_are_refused(log, options, message):
    with pytest.raises(InputError, match=message):
        check(estimator("complementary"), log, **{"steps": 3, **options})


def test_parameters_reach_every_level(log):
    plain = check(estimator("complementary"), log, steps=60, simulator="verilator")
    moved = check(
        estimator("complementary"),
        log,
        steps=60,
        simulator="verilator",
        params={"kp_roll_per_s": 4.0, "declination_ht": 0.1},
    )
    assert moved.good
    assert not np.array_equal(plain.outputs, moved.outputs)


@pytest.mark.parametrize("word", [18, 24])
def test_other_widths(log, word):
    result = check(estimator("complementary"), log, word=word, steps=300, levels=("fixed", "c"))
    assert result.exact
    assert result.accuracy.good == (word > 18)
    assert ("rounding" in result.accuracy.culprit) == (word == 18)


def test_stalls_change_no_word(log):
    from boresight.gateware.core import build_core
    from boresight.model.estimator import input_words
    from boresight.sim.records.feed import feed
    from boresight.sim.records.segments import interpret
    from boresight.sim.rtl.cosim import RtlSimulation

    e = estimator("complementary")
    program = e.compile()
    words = input_words(program, feed(e, log).inputs[:60, :, None])[:, :, 0]
    core = build_core(program, "small", urgent=e.urgent)
    run = RtlSimulation(
        core.verilog(instances=False),
        word=32,
        n_inputs=len(program.inputs),
        n_outputs=len(program.outputs),
        lanes=1,
    ).run(words, max_interval=core.schedule.interval, stall=9)
    assert np.array_equal(run.outputs, interpret(program, words).outputs)
    assert run.interval_cycles.min() > core.schedule.interval
