"""A level by its words, flags, states and cycles."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from boresight.gateware.core import Core
from boresight.model.attitude.complementary import Complementary
from boresight.sim.compare.results import CheckResult, LevelResult, verdict
from boresight.sim.levels.build import Build, Level, Run, run_of_words
from boresight.sim.levels.rtl import Simulated
from boresight.sim.rtl.simulation import RtlRun
from tests.support.faulty import rows_of


@pytest.fixture(scope="module")
def level(core: Core) -> Simulated:
    build = Build(Complementary(), config="fast")
    build.core = core  # type: ignore[misc]
    return Simulated(build)


@pytest.fixture(scope="module")
def rtl_run(core: Core) -> RtlRun:
    """A run as the schedule says."""
    rows, n = 6, len(core.program.outputs)
    return RtlRun(
        np.arange(rows * n).reshape(rows, n),
        *np.zeros((2, rows), dtype=bool),
        np.tile(core.schedule.latencies, (rows, 1)),
        np.full(rows, core.schedule.interval),
    )


@pytest.fixture(scope="module")
def wanted(core: Core, rtl_run: RtlRun) -> Run:
    """What the interpreter would have said, of one record more."""
    words = np.concatenate([rtl_run.outputs, rtl_run.outputs[:1]])
    flags = np.zeros(7, dtype=bool)
    return run_of_words(core.program, words, flags, states=np.ones((7, 2)), beyond=flags)


def compare(level: Level, run: Run, wanted: Run, seconds: float = 0.0) -> LevelResult:
    """A verdict, which is the same of two pieces."""
    whole, parts = LevelResult("rtl", "verilator"), LevelResult("rtl", "verilator")
    whole.add(level, run, wanted, 0)
    for start, stop in ((0, 2), (2, len(wanted.outputs["roll"]))):
        parts.add(level, rows_of(run, start, stop), rows_of(wanted, start, stop), start)
    result = whole.ended(seconds, "")
    assert parts.ended(seconds, "") == result
    return result


def changed(run: RtlRun, name: str, place: Any, by: int) -> RtlRun:
    """The run with one number of one array another."""
    array = getattr(run, name).copy()
    array[place] = array[place] + by if array.dtype != bool else not array[place]
    return dataclasses.replace(run, **{name: array})


def test_an_update_counts_if_a_word_or_flag_differs(
    level: Simulated, rtl_run: RtlRun, wanted: Run
) -> None:
    assert compare(level, level._run_of(rtl_run), wanted).good
    for name, place in (("outputs", (3, -1)), ("saturated", 3), ("beyond", 3)):
        result = compare(level, level._run_of(changed(rtl_run, name, place, 1)), wanted)
        assert (result.good, result.n_mismatch, result.first_wrong) == (False, 1, 3), name
    states = np.ones((6, 2))
    states[3, 0] = 2.0
    result = compare(level, dataclasses.replace(level._run_of(rtl_run), states=states), wanted)
    assert (result.n_mismatch, result.first_wrong) == (1, 3)


@pytest.mark.parametrize("by", [-1, 1])
def test_every_output_must_come_in_its_cycle(
    level: Simulated, rtl_run: RtlRun, wanted: Run, by: int
) -> None:
    """Also those that are not urgent, whose cycles no figure shows."""
    for output in range(rtl_run.outputs.shape[1]):
        late = level._run_of(changed(rtl_run, "latency_cycles", (2, output), by))
        result = compare(level, late, wanted)
        assert not result.good and result.first_wrong is None
        assert result.failure == result.error == "output cycles differ from the schedule"
        assert (result.n_total, result.n_mismatch) == (None, None)


@pytest.mark.parametrize("by", [-1, 1])
def test_every_interval_is_the_predicted_one(
    level: Simulated, rtl_run: RtlRun, wanted: Run, by: int
) -> None:
    other = level._run_of(changed(rtl_run, "interval_cycles", 4, by))
    assert compare(level, other, wanted).failure.startswith("interval predicted ")


def test_verdict(checked: CheckResult) -> None:
    """The same cause is told once, another one with its name."""
    assert verdict([checked, checked]) == "good"
    missing = LevelResult("rtl", "verilator", None, None, 0.0, error="no libpython")
    assert missing.line() == "rtl      verilator    FAILED"
    wrong = LevelResult("c", "gcc", 5, 2, 0.0)
    first, other = (dataclasses.replace(checked, levels=(level,)) for level in (missing, wrong))
    assert verdict([first, first]) == "FAILED: rtl in verilator: no libpython"
    assert str(first).splitlines()[-1] == verdict([first]) and str(first).count("libpython") == 1
    assert verdict([checked, other]) == (
        "FAILED: complementary on synthetic_60s: c in gcc: 2 of 5 updates differ"
    )
    none = dataclasses.replace(checked, levels=())
    assert verdict([none]) == "FAILED: no form was run"
