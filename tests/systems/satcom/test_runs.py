"""Figures of a flight: claims in short, and errors that are known beforehand."""

import dataclasses

import numpy as np
import pytest

from boresight.sim.levels.level import Run
from boresight.systems.satcom import runs as flight
from boresight.systems.satcom.cases import CASES
from boresight.systems.satcom.estimator import Satcom
from boresight.systems.satcom.runs import ANGLES, SETTLED_S, figures_of, fly

BEGUN = round(50 * SETTLED_S)


def test_claims_hold_and_what_was_printed_fails(runs) -> None:
    good = runs["adaptive"].pooled()
    assert max(good["roll_rms"], good["pitch_rms"]) < 0.06 and good["heading_rms"] < 0.1
    assert good["hit_rate"] > 0.99 and good["false_rate"] < 0.01
    assert good["bias_error_max"] < 0.05 and good["loss_db_99_max"] < 0.5
    assert good["fixed_float_max"] < 0.005 and good["fixed_float_rms"] < 0.001
    assert good["status_differs_sum"] == 0 == good["saturated_sum"]
    for name in ("fixed_r", "printed_roll"):
        assert runs[name].pooled()["worst_rms"] > 1.0, name


def test_innovations_are_honest_where_r_is(runs) -> None:
    for axis in ANGLES:
        one = runs["declared"].pooled()
        assert 0.7 < one[f"nis_{axis}"] < 1.35 and abs(one[f"rho_{axis}"]) < 0.15
    cautious = runs["adaptive"].pooled()
    assert cautious["nis_roll"] < 0.5 and cautious["nis_heading"] < 0.5
    assert [len(run) for run in runs["adaptive"].each] == [3, 3]


def test_figures_of_known_errors(adaptive, monkeypatch) -> None:
    fleet, loops = adaptive
    n, zero = len(loops.inputs), np.zeros(loops.inputs.shape[:2])
    half = 180.0
    wrong = {"roll": 3.0, "pitch": 1.0, "heading": -2.0, "heading_pi": 4.0}
    truth = {
        "roll": fleet.drive.ride.euler[:, 0] / np.pi,
        "pitch": fleet.drive.ride.euler[:, 1] / np.pi,
        "heading": fleet.heading / np.pi,
        "heading_pi": fleet.heading / np.pi,
    }
    outputs = {name: zero + truth[name][:, None] + off / half for name, off in wrong.items()}
    outputs["roll"][:BEGUN] += 0.5
    outputs["pitch"][:, 1] -= 4.0 / half  # of the second run -3
    outputs["heading"] += 2.0  # a turn more is the same heading
    outputs |= {f"bias_{a}": zero + fleet.bias[:, :, k] for k, a in enumerate("xyz")}
    outputs["bias_y"][-1, 0] += np.radians(0.01)
    moving = fleet.drive.accelerated
    outputs["status"] = zero + np.where(moving, 1.0, 2.0)[:, None]
    fleet = dataclasses.replace(fleet, losses_db=[])
    fleet.start()
    fleet.losses_db.extend(np.linspace(0.0, 1.0, n)[:, None] * [1.0, 2.0])
    saturated = np.arange(n)[:, None] < [3, 4]
    known = dataclasses.replace(loops, run=Run(outputs, saturated=saturated))
    monkeypatch.setattr(flight, "_beside_float", lambda *a: ({"apart": 1.0}, []))
    found = figures_of(CASES["adaptive"], fleet, known).figures
    assert found["roll_rms"] == pytest.approx([3.0, 3.0])
    assert found["pitch_rms"] == pytest.approx([1.0, 3.0]) == found["pitch_max"]
    assert found["heading_rms"] == pytest.approx([2.0, 2.0])
    assert found["loop_rms"] == pytest.approx([4.0, 4.0])
    assert found["worst_rms"] == pytest.approx([3.0, 3.0])
    assert found["bias_error_max"] == pytest.approx([0.01, 0.0], abs=1e-9)
    assert found["bias_y_end"] == pytest.approx([-0.39, -0.4])
    assert found["loss_db_max"] == pytest.approx([1.0, 2.0])
    first = BEGUN / (n - 1)
    assert found["loss_db_99_max"] == pytest.approx((1.0 - 0.01 * (1.0 - first)) * np.array([1, 2]))
    assert found["hit_rate"].tolist() == [1.0, 1.0] and found["false_rate"].tolist() == [0.0, 0.0]
    assert found["tracking_used"] == pytest.approx(moving[BEGUN:].mean() * np.ones(2))
    assert found["saturated_sum"].tolist() == [3.0, 4.0] and found["apart"].tolist() == [1.0, 1.0]


def test_float64_is_run_beside(adaptive) -> None:
    """Its difference and its status words are those of a wrong output that is told."""
    fleet, loops = adaptive
    honest = figures_of(CASES["adaptive"], fleet, loops).figures
    bent = {**loops.outputs, "roll": loops.outputs["roll"].copy()}
    bent["roll"][100, 1] += 0.5 / 180.0
    bent["status"] = loops.outputs["status"].copy()
    bent["status"][[3, 5, 8], 0] += 4.0
    told = dataclasses.replace(loops, run=dataclasses.replace(loops.run, outputs=bent))
    found = figures_of(CASES["adaptive"], fleet, told).figures
    assert found["fixed_float_max"] == pytest.approx([honest["fixed_float_max"][0], 0.5], abs=5e-3)
    assert found["status_differs_sum"].tolist() == [3.0, 0.0]
    assert found["status_share"].tolist() == [3.0 / len(loops.inputs), 0.0]
    assert found["agreed_max"] == pytest.approx([0.0, 0.5], abs=5e-3)
    assert (found["nis_roll"] == honest["nis_roll"]).all()


def test_fly(monkeypatch, adaptive) -> None:
    """The case's own filter, parameters and vehicles."""
    asked = []

    def close(fleet, level, keep):
        build = level.build
        asked.append((build.estimators[0].printed_roll, dict(build.params[0]), fleet.seeds))
        return level.name

    monkeypatch.setattr(flight, "close_loop", close)
    monkeypatch.setattr(flight, "figures_of", lambda case, fleet, loops: (case.meaning, loops))
    assert fly(CASES["fixed_r"], range(4, 6)) == ("R fixed", "c")
    fly(CASES["printed_roll"], range(1))
    assert asked == [(False, {"adapt": 1.0}, range(4, 6)), (True, {}, range(1))]
    assert Satcom(roll="printed").printed_roll
