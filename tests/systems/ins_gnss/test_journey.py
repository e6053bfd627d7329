"""Inertial navigation with satellite fixes: the filter on its world."""

from __future__ import annotations

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.sim.experiments.seeds import Runs
from boresight.systems.ins_gnss.estimator import DT, GRAVITY
from boresight.systems.ins_gnss.experiment import InsGnss as Experiment
from boresight.systems.ins_gnss.world import CARRIERS, Journey


@pytest.fixture(scope="module")
def flown() -> dict[str, Runs]:
    return {name: Experiment().run_case(name, range(1, 3)) for name in ("vehicle", "drone")}


@pytest.mark.parametrize("name", CARRIERS)
def test_navigates_and_bridges_an_outage(flown: dict[str, Runs], name: str) -> None:
    found = flown[name].pooled()
    assert found["attitude_rms"] < 1.0 and found["position_rms"] < 0.4
    assert found["velocity_rms"] < 0.1 and found["drift_max"] < 20.0
    assert found["fixed_float_max"] < 2e-4 and found["saturated_sum"] == 0.0


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


def test_an_unknown_carrier_is_refused() -> None:
    with pytest.raises(InputError, match="carrier: wanted one of vehicle, drone, found 'ship'"):
        Journey("ship")
