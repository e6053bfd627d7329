"""Inertial navigation with satellite fixes: the filter on its world."""

from __future__ import annotations

import re
from types import SimpleNamespace

import numpy as np
import pytest

import boresight
from boresight.model.errors import InputError
from boresight.sim.experiments.seeds import Runs
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.worlds.loop import Loop, close_loop, parting
from boresight.systems.ins_gnss import experiment
from boresight.systems.ins_gnss.estimator import DT, GRAVITY, InsGnss
from boresight.systems.ins_gnss.runs import CASES, CONFIG, SETTLED_S, figures_of, run
from boresight.systems.ins_gnss.world import CARRIERS, Journey
from tests.support.experiments import result_of
from tests.support.pages import ROOT


@pytest.fixture(scope="module")
def flown() -> dict[str, Runs]:
    return {name: run(name, range(1, 3)) for name in ("vehicle", "drone")}


@pytest.mark.parametrize("name", CARRIERS)
def test_navigates_and_bridges_an_outage(flown: dict[str, Runs], name: str) -> None:
    found = flown[name].pooled()
    assert found["attitude_rms"] < 1.0 and found["position_rms"] < 0.4
    assert found["velocity_rms"] < 0.1 and found["drift_max"] < 20.0
    assert found["fixed_float_max"] < 2e-4 and found["saturated_sum"] == 0.0


@pytest.mark.soak
@pytest.mark.parametrize(
    ("carrier", "median", "worst"), [("vehicle", 13e-5, 2e-4), ("drone", 8e-5, 1e-4)]
)
def test_fixed_point_is_near_float64_whatever_the_noise(
    carrier: str, median: float, worst: float
) -> None:
    largest = np.concatenate(
        [run(carrier, range(seed, seed + 1)).figures["fixed_float_max"] for seed in range(1, 11)]
    )
    print(f"{carrier}: median {np.median(largest):.2g} deg, worst {largest.max():.2g} deg")
    assert np.median(largest) < median and largest.max() < worst


@pytest.mark.parametrize("carrier", CARRIERS)
def test_sensors_lead_to_the_truth(carrier: str) -> None:
    """Dead reckoning with the gyro and accelerometer, less their errors, ends where it should."""
    world = Journey(carrier, (3,), steps=2000)
    (columns,) = world.pieces()
    (again,) = world.pieces()
    assert all(np.array_equal(columns[n], again[n], equal_nan=True) for n in columns)
    column = {name: values[:, 0] for name, values in columns.items()}
    v = np.stack([column[f"v{c}_true"] for c in "enu"], axis=1)
    p = np.stack([column[f"p{c}_true"] for c in "enu"], axis=1)
    q = np.stack([column[f"q{c}_true"] for c in "wxyz"], axis=1)
    force = np.stack([column[f"a{c}"] for c in "xyz"], axis=1)
    w, u = q[:, :1], q[:, 1:]
    turned = force + 2.0 * np.cross(u, np.cross(u, force) + w * force)
    accelerations = np.diff(v, axis=0) / DT
    apart = turned[1:] - GRAVITY - accelerations
    # Bias of 0.08 m/s^2, noise of 0.05, and half a step of rotation.
    assert np.abs(apart.mean(axis=0)).max() < 0.4 and apart.std(axis=0).max() < 0.2
    assert np.abs(np.diff(p, axis=0) - DT * v[1:]).max() < 1e-9
    fixes = np.flatnonzero(np.isfinite(column["gnss_pe"]))
    assert (np.diff(fixes) == 10).all()
    late = np.stack([column[f"gnss_p{c}"] for c in "enu"], axis=1)[fixes[1:]] - p[fixes[1:] - 10]
    assert np.abs(late.mean(axis=0)).max() < 1.8 and 0.6 < late.std(axis=0).max() < 1.6


@pytest.mark.parametrize("steps", [40, pytest.param(12_000, marks=pytest.mark.soak)])
def test_the_rtl_is_the_c(steps: int) -> None:
    def loop(level: str) -> Loop:
        world = Journey("drone", steps=steps)
        with make_level(level, Build(InsGnss(), config=CONFIG)) as made:
            return close_loop(world, made)

    assert parting(InsGnss(), loop("c"), loop("rtl")) is None


def test_float64_is_the_textbook() -> None:
    world = Journey("drone", steps=60)
    with make_level("c", Build(InsGnss(), config=CONFIG)) as level:
        record = close_loop(world, level).record(InsGnss(), "begin")
    (result,) = boresight.check("ins_gnss", record, levels=("c",), config=CONFIG)["results"]
    assert result.good and result.textbook
    assert all(d.largest < 1e-9 for d in result.textbook), result.lines()


def test_an_unknown_carrier_is_refused() -> None:
    with pytest.raises(InputError, match="carrier: wanted one of vehicle, drone, found 'ship'"):
        Journey("ship")


def test_figures_of_known_errors(monkeypatch: pytest.MonkeyPatch) -> None:
    n, begun = 10_000, round(SETTLED_S / DT)
    names = [f"{k}{c}" for k, axes in (("q", "wxyz"), ("v", "enu"), ("p", "enu")) for c in axes]
    truth = {name: np.zeros((n, 2)) for name in names}
    truth["qw"] += 1.0
    out = {name: values.copy() for name, values in truth.items()}
    half = np.radians(3.0) / 2.0
    out["qw"][begun:, 1], out["qx"][begun:, 1] = -np.cos(half), -np.sin(half)  # the same turn
    out["ve"] += 0.3
    out["vn"] += 0.4
    out["pu"] += 2.0
    out["pu"][6_500] = 7.0  # within the outage
    out["pu"][:begun] = 50.0
    inputs = np.zeros((n, 2, len(InsGnss.inputs)))
    loop = SimpleNamespace(
        outputs=out, truth=truth, inputs=inputs, run=SimpleNamespace(saturated=inputs[..., 0] > 0)
    )
    floats = SimpleNamespace(outputs={name: values[:, 0] for name, values in out.items()})
    monkeypatch.setattr("boresight.systems.ins_gnss.runs.run_forms", lambda *a, **k: [[floats]])
    found = figures_of(CASES["vehicle"], Journey(seeds=(1, 2)), loop).figures  # type: ignore[arg-type]
    assert found["attitude_rms"] == pytest.approx([0.0, 3.0]) == found["attitude_max"]
    assert found["velocity_rms"] == pytest.approx([0.5, 0.5])
    assert found["position_rms"] == pytest.approx([2.0, 2.0])
    assert found["drift_max"] == pytest.approx([7.0, 7.0])


def test_the_experiment(flown: dict[str, Runs], monkeypatch: pytest.MonkeyPatch) -> None:
    result = result_of(experiment.InsGnss(jobs=1), run, CASES, flown, monkeypatch)
    missed = {t.part for t in result.targets if not t.good}
    assert missed == {"velocity", "position"} | {t.part for t in result.targets if "5 s" in t.name}
    assert result.pages["ins_gnss.html"].count("<svg") == 2


def test_the_cycles_on_the_page() -> None:
    page = (ROOT / "docs" / "systems" / "ins_gnss.md").read_text(encoding="utf-8")
    schedule = Build(InsGnss(), config=CONFIG).core.schedule
    (row,) = re.findall(r"predicted state in (\d+) to (\d+) cycles.*?after ([\d,]+)", page)
    found = (min(schedule.latencies), max(schedule.latencies), schedule.interval)
    assert tuple(int(x.replace(",", "")) for x in row) == found
