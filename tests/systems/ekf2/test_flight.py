"""PX4's EKF2: the filter on its world, in C and RTL; its experiment and page."""

from __future__ import annotations

import numpy as np
import pytest

from boresight.gateware.synthesis.routed import core_blocks
from boresight.gateware.synthesis.targets import TARGETS
from boresight.model.errors import InputError
from boresight.sim.experiments.seeds import Runs
from boresight.sim.rotations.rotation import rotate
from boresight.systems.ekf2.estimator import DT, GRAVITY_NED, KINDS, UNITS
from boresight.systems.ekf2.experiment import CONFIG
from boresight.systems.ekf2.experiment import Ekf2 as Experiment
from boresight.systems.ekf2.world import NOISE, Flight
from tests.support.estimators import core_of


@pytest.fixture(scope="module")
def flown() -> dict[str, Runs]:
    return {name: Experiment().run_case(name, range(1, 3)) for name in ("flight", "outage")}


def test_navigates_with_and_without_satellites(flown: dict[str, Runs]) -> None:
    ours, blind = (flown[name].pooled() for name in ("flight", "outage"))
    assert ours["attitude_rms"] < 1.0 and ours["velocity_rms"] < 0.15
    assert ours["position_rms"] < 0.4 and ours["wind_rms"] < 0.4 and ours["terrain_rms"] < 0.3
    assert ours["fixed_float_max"] < 1e-3 and ours["saturated_sum"] == 0.0
    assert 1.0 < blind["drift_max"] < 20.0 and ours["drift_max"] == 0.0


def test_sensors_and_rows_lead_to_the_truth() -> None:
    world = Flight((3,), steps=2000)
    (columns,) = world.pieces()
    (again,) = world.pieces()
    assert all(np.array_equal(columns[n], again[n]) for n in columns)
    column = {name: values[:, 0] for name, values in columns.items()}
    q, v, p = (
        np.stack([column[f"{n}{c}_true"] for c in axes], axis=1)
        for n, axes in (("q", "wxyz"), ("v", "ned"), ("p", "ned"))
    )
    force = np.stack([column[f"a{c}"] for c in "xyz"], axis=1)
    apart = rotate(q, force)[1:] + GRAVITY_NED - np.diff(v, axis=0) / DT
    # Bias of 0.05 m/s^2, noise of 0.2, and half a step of rotation.
    assert np.abs(apart.mean(axis=0)).max() < 0.3 and apart.std(axis=0).max() < 0.3
    assert np.abs(np.diff(p, axis=0) - DT * v[:-1]).max() < 1e-9
    kind = column["kind"]
    for name, of_axis in (("velocity", v), ("position", p)):
        axis = np.stack([column[f"axis_{c}"] for c in "xyz"], axis=1)
        here = (kind == KINDS.index(name)) & (axis[:, 2] == 0.0)
        error = column["z"][here] / UNITS[name] - np.sum(axis * of_axis, axis=1)[here]
        assert here.sum() >= 200 and 0.8 < error.std() / NOISE[name] < 1.2
        assert np.allclose(np.sqrt(column["r"][here]) / UNITS[name], NOISE[name])
    used = {KINDS[int(k)] for k in kind}
    assert used == {*KINDS} - {"body_velocity", "gravity"}


def test_what_is_not_there() -> None:
    (columns,) = Flight(steps=1000, without=("field",), outage=(2.0, 5.0)).pieces()
    kind, here = columns["kind"][:, 0], slice(200, 500)
    assert not (kind == KINDS.index("field")).any()
    assert not (kind[here] == KINDS.index("velocity")).any()
    assert (kind[:200] == KINDS.index("velocity")).any()
    with pytest.raises(InputError, match="world flight, without: wanted .* found 'sonar'"):
        Flight(without=("sonar",))


def test_it_fits_the_smallest_part() -> None:
    core = core_of("ekf2", CONFIG)
    microcode, data = core_blocks(core.machine, core.image, TARGETS["xc6slx9"].family.memory_shapes)
    assert core.schedule.interval <= 3300 and data == 11 and microcode + data <= 26
