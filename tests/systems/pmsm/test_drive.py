"""The sensorless drive: filter and controllers in a closed loop with their machine."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import boresight
from boresight.model.errors import InputError
from boresight.sim.experiments.seeds import Runs
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.worlds.loop import Loop, close_loop, parting
from boresight.systems.pmsm import experiment
from boresight.systems.pmsm.estimator import DT, Pmsm
from boresight.systems.pmsm.runs import SETTLED_S, figures_of, run
from boresight.systems.pmsm.world import LOADS_S, MACHINES, REVERSAL_S, SPEED, START_S, Motor
from tests.support.experiments import result_of
from tests.support.pages import ROOT


def loop(level: str, steps: int, seeds: Any = (1,)) -> Loop:
    world = Motor("known", seeds, steps)
    with make_level(level, Build(Pmsm()), runs=world.runs if len(seeds) > 1 else None) as made:
        return close_loop(world, made)


@pytest.fixture(scope="module")
def driven() -> Runs:
    return run("known", range(1, 3))


def test_starts_from_any_angle() -> None:
    """64 rotors, some opposite to the current of the forced start; at its end each is known."""
    outcome = loop("c", round(START_S / DT) + 1, range(1, 65))
    angle = (outcome.outputs["theta"] - outcome.truth["theta"] + 1.0) % 2.0 - 1.0
    assert np.abs(outcome.truth["theta"][0]).max() > 0.9
    assert np.abs(angle[-1]).max() < 0.02


def test_turns_back_under_load(driven: Runs) -> None:
    outcome = driven.pooled()
    assert outcome["angle_max"] < 3.0 and outcome["reversal_max"] < 0.3
    assert outcome["fixed_float_max"] < 0.0036 and outcome["loops_max"] < 1.0
    assert outcome["saturated_sum"] == 0.0


@pytest.mark.parametrize("level", ["rtl", pytest.param("fixed", marks=pytest.mark.soak)])
def test_levels_close_the_same_loop(level: str) -> None:
    assert parting(Pmsm(), loop("c", 300), loop(level, 300)) is None


@pytest.mark.soak
def test_the_whole_drive_in_rtl() -> None:
    assert parting(Pmsm(), loop("c", 16_000), loop("rtl", 16_000)) is None


def test_float64_is_the_textbook() -> None:
    record = loop("c", 200).record(Pmsm(), "start")
    (result,) = boresight.check("pmsm", record, levels=("c",))["results"]
    assert result.good and result.textbook
    assert all(d.largest < 1e-9 for d in result.textbook), result.lines()


def test_an_unknown_machine_is_refused() -> None:
    with pytest.raises(InputError, match="machine: wanted one of known, warm.*found 'cold'"):
        Motor("cold")


def test_figures_of_known_errors() -> None:
    n = 16_000
    t = DT * np.arange(n)
    back, begun = round(REVERSAL_S / DT), round(SETTLED_S / DT)
    omega = np.where(t[:, None] < REVERSAL_S, SPEED, SPEED - 9000.0 * (t[:, None] - REVERSAL_S))
    omega = np.repeat(np.maximum(omega, -SPEED), 2, axis=1)
    late = (LOADS_S[0][0] + LOADS_S[0][1]) / 2 + 0.01
    omega[round(late / DT), 1] -= 50.0
    theta = np.zeros((n, 2))
    wrong = np.full((n, 2), 1.5 / 180.0)
    wrong[: begun - 1] = 2.0 - 10.0 / 180.0  # ten degrees the other way
    wrong[back, 1] = -0.1
    inputs = np.zeros((n, 2, len(Pmsm.inputs)))
    outcome = figures_of(
        _loop(
            {"theta": theta + wrong, "omega": omega + 2.0}, {"theta": theta, "omega": omega}, inputs
        ),
        _loop({}, {"omega": omega[:, 0] + 0.25}, inputs),
    ).figures
    assert outcome["start_max"] == pytest.approx([10.0, 10.0])
    assert outcome["angle_max"] == pytest.approx([1.5, 18.0])
    assert outcome["angle_rms"][0] == pytest.approx(1.5)
    assert outcome["speed_rms"] == pytest.approx([2.0, 2.0])
    assert outcome["dip_max"] == pytest.approx([0.0, 50.0])
    assert outcome["reversal_max"] == pytest.approx([1710.0 / 9000.0] * 2, abs=2 * DT)
    assert outcome["loops_max"] == pytest.approx([0.25, 0.25])
    assert outcome["saturated_sum"].tolist() == [0.0, 3.0]


def _loop(outputs: Any, truth: Any, inputs: Any) -> Any:
    saturated = np.zeros(inputs.shape[:2], dtype=bool)
    saturated[5:8, 1] = True
    result = SimpleNamespace(saturated=saturated)
    return SimpleNamespace(outputs=outputs, truth=truth, inputs=inputs, run=result)


def test_the_experiment(driven: Runs, monkeypatch: pytest.MonkeyPatch) -> None:
    system = experiment.Pmsm(jobs=1)
    result = result_of(system, run, MACHINES, {"known": driven}, monkeypatch)
    assert [t.name for t in result.targets if not t.good] == []
    assert result.pages["pmsm.html"].count("<svg") == 3


def test_the_cycles_on_the_page() -> None:
    page = (ROOT / "docs" / "systems" / "pmsm.md").read_text(encoding="utf-8")
    for k, config in enumerate(("small", "fast")):
        schedule = Build(Pmsm(), config=config).core.schedule
        for head, value in (
            ("cycles from the currents to the voltage", max(schedule.latencies[:2])),
            ("cycles to the next record", schedule.interval),
        ):
            (row,) = re.findall(rf"\| {head} \| (\d+) \| (\d+) \|", page)
            assert int(row[k]) == value
