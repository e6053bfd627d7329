"""The satcom experiment: cases, figures, verdicts, page; short drives stand in for long ones."""

import dataclasses
import json

import numpy as np
import pytest

from boresight.model.estimators.satcom import Satcom as Filter
from boresight.sim.experiments.satcom import experiment
from boresight.sim.experiments.satcom.experiment import AXES, CASES, SETTLED, Satcom, case_figures
from boresight.sim.experiments.satcom.flight import Flight, fly
from boresight.sim.worlds.satcom import Fleet
from boresight.sim.worlds.satcom_drive import Drive, drive, specification_drive


def cut(d: Drive, seconds: float) -> Drive:
    parts = {f.name: getattr(d, f.name)[: round(seconds * 50)] for f in dataclasses.fields(d)}
    return Drive(**parts)


@pytest.fixture(scope="module")
def flown() -> dict[str, dict[str, float]]:
    """Figures of a minute and a bit: accelerations before and after half a minute."""
    found = {}
    for name in ("adaptive", "fixed_r", "printed_roll"):
        fleet = Fleet(cut(specification_drive(), 70.0), (1,), **CASES[name].world)
        flight = fly(fleet, Filter(**CASES[name].options), CASES[name].params)
        found[name] = case_figures(CASES[name], fleet, flight)
    return found


def test_claims_hold_and_what_was_printed_fails(flown) -> None:
    good = flown["adaptive"]
    assert max(good["roll_deg"], good["pitch_deg"]) < 0.06 and good["heading_deg"] < 0.1
    assert good["hit_rate"] > 0.99 and good["false_rate"] < 0.01
    assert good["bias_error_deg_s"] < 0.05 and good["loss_db_99"] < 0.5
    assert good["fixed_float_deg"] < 0.005 and good["fixed_float_rms_deg"] < 0.001
    assert good["saturated"] == 0
    for name in ("fixed_r", "printed_roll"):
        assert flown[name]["worst_deg"] > 1.0, name


def test_figures_of_known_errors() -> None:
    fleet = Fleet(cut(specification_drive(), 66.0), (1, 2))
    flight = fly(Fleet(cut(fleet.drive, 0.1), (1, 2)), Filter())
    n = 3300
    error = np.zeros((n, 2, 4))
    error[:SETTLED] = 100.0
    error[SETTLED:, 0], error[SETTLED:, 1] = [3.0, 1.0, -2.0, 0.0], [-3.0, 1.0, 2.0, 4.0]
    loss = np.full((n, 2), 9.0)
    loss[SETTLED:] = np.linspace(0.0, 1.0, n - SETTLED)[:, None]
    status = np.where(fleet.drive.accelerated, 1, 2)[:, None].repeat(2, axis=1)
    bias = np.degrees(fleet.bias) + [0.0, -0.01, 0.0]
    known = dataclasses.replace(
        flight, bias=bias, error=error, loss_db=loss, status=status, saturated=3
    )
    found = case_figures(CASES["adaptive"], fleet, known)
    rms = [3.0, 1.0, 2.0, np.sqrt(8.0)]
    assert [found[f"{axis}_deg"] for axis in AXES] == pytest.approx(rms)
    assert (found["worst_deg"], found["max_deg"], found["saturated"]) == (3.0, 3.0, 3.0)
    assert found["bias_error_deg_s"] == pytest.approx(0.01)
    assert found["loss_db_99"] == pytest.approx(0.99, abs=0.01) and found["loss_db_max"] == 1.0
    assert (found["hit_rate"], found["false_rate"]) == (1.0, 0.0)
    assert found["tracking_used"] == fleet.drive.accelerated[SETTLED:].mean()


def test_run(monkeypatch, flown) -> None:
    """Which case gives which target; the page has them all."""
    asked = []

    def short_flight(fleet: Fleet, estimator: Filter, params=None) -> Flight:
        asked.append((len(fleet.drive.q), len(fleet.seeds), fleet.seeds[0]))
        n = 60
        zero = np.zeros((n, len(fleet.seeds)))
        return Flight(np.zeros((n, len(fleet.seeds), 4)), zero, zero, zero, 0, zero, {})

    def figures(case, fleet, flight) -> dict[str, float]:
        return next(
            iter([flown["adaptive"] if case.params.get("adapt") is None else flown["fixed_r"]])
        )

    monkeypatch.setattr(experiment, "fly", short_flight)
    monkeypatch.setattr(experiment, "case_figures", figures)
    result = Satcom().run(seed=5, runs=12, say=lambda text: None)
    assert [a[1] for a in asked] == [12 if c.full else 10 for c in CASES.values()]
    assert {a[0] for a in asked} == {15000, len(drive("city").q)} and {a[2] for a in asked} == {5}
    verdicts = {t.name: t.good for t in result.targets}
    assert verdicts["fixed R diverges under manoeuvre"] and not verdicts["printed roll fails"]
    assert verdicts["pointing loss, 99 %"]
    for name in ("small", "fast"):
        limit = {"small": 1150, "fast": 600}[name]
        assert result.figures[f"satcom_interval_cycles_{name}"] <= limit
    for key in ("roll_deg", "pitch_deg", "heading_deg", "fixed_float_deg", "pointing_loss_db"):
        assert f"satcom_{key}" in result.figures
    json.dumps([result.figures, result.details], allow_nan=False)
    assert result.pages["satcom.html"].count('class="bad"') == list(verdicts.values()).count(False)
