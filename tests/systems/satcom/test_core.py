"""Every form of `satcom` and `satcom_pointing` gives the same words, whatever comes.

A drive with turns, blows and gaps, and records that no vehicle gives; both programs in random turns
in one core, the second on the attitude of the first; and the loop closed.
"""

from typing import Any

import numpy as np
import pytest

from boresight.sim.accuracy.manoeuvres import WITHIN, within
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import level_of, make_level
from boresight.systems.satcom.estimator import Satcom
from boresight.systems.satcom.pointing import SatcomPointing

DT = 0.02
MODES = ("drive", "tumble", "blind", "restarts", *WITHIN)


def records(mode: str, steps: int, rng: np.random.Generator) -> Any:
    """Inputs (steps, 10) of `Satcom`."""
    if mode in WITHIN:
        u = within(Satcom(), mode, steps, rng)
        u[0, 0] = -DT
        return u
    u = np.zeros((steps, 10))
    u[:, 0] = DT
    u[:, 1:4] = np.cumsum(rng.normal(0.0, 0.02, (steps, 3)), axis=0).clip(-8.0, 8.0)
    u[:, 4:7] = [0.0, 0.0, -9.80665] + rng.normal(0.0, 0.05, (steps, 3))
    u[:, 7] = rng.normal(0.0, 0.06, steps).clip(-0.5, 0.5)
    u[:, 8] = rng.uniform(-1.0, 1.0, steps)
    u[:, 9] = rng.random(steps) < 0.2
    if mode == "tumble":
        u[:, 4:7] = rng.normal(0.0, 20.0, (steps, 3))
    elif mode == "blind":  # the variance of the heading comes to its limit
        u[:, 0], u[:, 9] = 0.2, 0.0
        u[:, 1:4] = rng.normal(0.0, 1e-3, (steps, 3))
    elif mode == "restarts":
        u[rng.random(steps) < 0.02, 0] = -0.1
    u[0, 0] = -DT
    return u


def places(steps: int, rng: np.random.Generator) -> Any:
    """Inputs (steps, 10) of `SatcomPointing`: turning attitudes, the whole earth."""
    u = rng.uniform([-0.5, -1.0, -500.0], [0.5, 1.0, 20e3], (steps, 3))
    u[::17] = [0.0, 110.5 / 180.0, 0.0]  # below the satellite
    q = rng.normal(size=(steps, 4))
    attitude = q / np.linalg.norm(q, axis=1, keepdims=True)
    return np.concatenate([attitude, rng.uniform(-7.9, 7.9, (steps, 3)), u], axis=1)


SOAK = pytest.mark.soak


@pytest.mark.parametrize(
    "config, steps",
    [("small", 60), *(pytest.param(c, 20_000, marks=SOAK) for c in ("small", "fast"))],
)
def test_both_in_turns_in_one_core(config: str, steps: int) -> None:
    """RTL, C and interpreter: words, saturations, cycles."""
    rng = np.random.default_rng(1)
    params = [{"gyro_sd": 0.05, "bias_density": 1e-3}, None]
    build = Build(Satcom(), SatcomPointing(), config=config, params=params)
    parts = [records(m, -(-steps // len(MODES)), rng) for m in MODES]
    values = [np.concatenate(parts)[:steps], places(3 * steps // 4, rng)]
    runs = {
        name: level_of(name).run_together([make_level(name, build, k) for k in (0, 1)], values)
        for name in ("fixed", "c", "rtl")
    }
    for k, wanted in enumerate(runs["fixed"]):
        for name in ("c", "rtl"):
            assert not runs[name][k].fault
            assert (runs[name][k].words == wanted.words).all(), (name, k)
            assert (runs[name][k].saturated == wanted.saturated).all(), (name, k)
        interval = build.core.parts[k].schedule.interval
        assert (runs["rtl"][k].interval_cycles == interval).all()
    status, pointing = (np.rint(run.outputs["status"]).astype(int) for run in runs["c"])
    assert np.bitwise_or.reduce(status) & 7 == 7
    if steps > 1000:
        assert np.bitwise_or.reduce(status) == 15 and np.bitwise_or.reduce(pointing) == 3
