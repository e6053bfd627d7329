"""Random motions of `ahrs.Sensors`, some beyond full scale, with VQF beside.

All hundred: ``pytest -m soak -s`` of this file
(docs/systems/mekf.md).
"""

from __future__ import annotations

import ahrs
import numpy as np
import pytest

from boresight.model.nine_axis import INPUTS
from boresight.sim.accuracy.figures import attitude_errors
from boresight.sim.accuracy.peers import peer, run_peer
from boresight.sim.attitude.robustness.runs import Campaign, counted, run_ours
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.rotations.outputs import attitude_of
from boresight.sim.rotations.rotation import quaternion_multiply

MEKF = Campaign("full", (), ("mekf",), ())
#: rad/s: rates of up to 41 are clamped to what `mekf` takes.
LIMIT = next(i.high for i in INPUTS if i.name == "gx")


def record(seed: int) -> NineAxis:
    """1,000 samples at 100 Hz; the field's horizontal part is north."""
    sensors = ahrs.Sensors(num_samples=1000, rng=np.random.default_rng(seed))
    east, north, _ = sensors.reference_magnetic_vector_enu
    half = 0.5 * np.arctan2(east, north)
    declined = np.array([np.cos(half), 0.0, 0.0, np.sin(half)])
    return NineAxis(
        f"seed {seed}",
        np.arange(1000) / sensors.frequency,
        np.clip(sensors.gyroscopes, -LIMIT, LIMIT),
        sensors.accelerometers,
        sensors.magnetometers_enu / 1000.0,
        quaternion_multiply(declined, np.asarray(sensors.quaternions)),
    )


@pytest.mark.parametrize(
    "seeds", [range(10, 16), pytest.param(range(100), marks=pytest.mark.soak)], ids=["few", "all"]
)
def test_it_is_no_worse_than_vqf(seeds: range) -> None:
    """RMSE: on average within 1.1 of VQF's, no record more than twice as bad, fixed as float."""
    rmse = []
    for seed in seeds:
        log = record(seed)
        fixed, exact = (attitude_of(run.outputs) for run in run_ours(MEKF, "mekf", log)[1])
        vqf = run_peer(peer("vqf_online"), log.record())
        rmse.append(
            [attitude_errors(q, log.attitude, counted(log))["total"] for q in (fixed, exact, vqf)]
        )
    fixed, exact, vqf = np.array(rmse).T
    ratios = fixed / vqf
    print(f"mean {fixed.mean():.2f} and {vqf.mean():.2f} deg, largest ratio {ratios.max():.2f}")
    assert fixed.mean() < 1.1 * vqf.mean() < 6.0
    assert ratios.max() < 2.0
    assert np.abs(fixed - exact).max() < 5e-4
