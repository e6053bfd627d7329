"""`mls_attitude` against a matrix filter, any start, the printed equations, hostile input."""

import itertools
import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.model.algebra.quaternion import right_matrix
from boresight.model.declarations import GRAVITY
from boresight.model.errors import InputError
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.systems.mls.estimator import ALIGN_STEPS, MlsAttitude
from boresight.systems.mls.world import SensorErrors, deck, records

EXACT = SensorErrors(0.0, (0.0, 0.0, 0.0), 0.0, 0.0, 0.0)
SCALE = 96.0


def rotation(q: Any) -> Any:
    return Rotation.from_quat(np.roll(q, -1, axis=-1))


def run(rows: Any, params: Any = None, level: str = "float", **options: Any) -> Any:
    return make_level(level, Build(MlsAttitude(**options), params=[params])).run(rows)


def quaternions(out: Any) -> Any:
    return np.stack([out[f"q{a}"] for a in "wxyz"], axis=1)


def turned(p: Any, q: Any) -> Any:
    """Angles between attitudes [deg]."""
    return np.degrees((rotation(p).inv() * rotation(q)).magnitude())


@pytest.fixture(scope="module")
def rows() -> Any:
    return records(deck("table", 3.0, 4, 75.0), 4)


@pytest.fixture(scope="module")
def corrected(rows: Any) -> Any:
    return run(rows).outputs


def seen(q: Any) -> Any:
    """C^T V of gravity and of the field, over their strength; C of (23), quadratic in q."""
    w, x, y, z = q
    c = [
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]
    dip = math.radians(54.0)
    return np.concatenate([c[2], np.transpose(c) @ [math.cos(dip), 0.0, -math.sin(dip)]])


def textbook(rows: Any, q: Any, r_sd: float = 0.05) -> Any:
    """Quaternions (n, 4) by dense matrices: four states, six components at once, P left alone."""
    unit, out = np.eye(4), []
    cov = (0.5 * 0.01) ** 2 * unit
    for row in rows:
        dt = abs(row[0])
        f = np.array(right_matrix(np.roll(Rotation.from_rotvec(dt * row[1:4]).as_quat(), 1)))
        q, cov = f @ q, f @ cov @ f.T + (1.5 * math.radians(0.3) * dt) ** 2 * unit
        h = np.stack([(seen(q + e) - seen(q - e)) / 2.0 for e in unit], axis=1)
        gain = cov @ h.T @ np.linalg.inv(h @ cov @ h.T + r_sd**2 * np.eye(6))
        q = q + gain @ (np.concatenate([row[4:7] / GRAVITY, row[7:] / 50.0]) - seen(q))
        q, cov = q / np.linalg.norm(q), (unit - gain @ h) @ cov
        out.append(q)
    return np.array(out)


def test_is_the_matrix_filter_of_four_states(rows: Any, corrected: Any) -> None:
    """Begun where the filter has aligned."""
    after = ALIGN_STEPS
    q = quaternions(corrected)
    assert turned(textbook(rows[after:], q[after - 1]), q[after:]).max() < 0.003
    # Another R would show.
    assert turned(textbook(rows[after:], q[after - 1], 0.06), q[after:]).max() > 0.02


@pytest.mark.parametrize("order, bound", [(3, 2e-6), (4, 4e-8)])
def test_picard_order(order: int, bound: float) -> None:
    """A step of 0.1 rad, as the matrix exponential but for 2.6e-7 and 2.3e-9 rad."""
    e = MlsAttitude(picard=order)
    half = 0.05 * np.array([0.6, -0.48, 0.64])
    dq = np.array(e._picard(list(half)))
    exact = np.roll(Rotation.from_rotvec(2.0 * half).as_quat(), 1)
    dq = dq / np.linalg.norm(dq)
    angle = 2.0 * np.linalg.norm(dq[1:] - exact[1:])
    assert bound / 100 < angle < bound


def test_finds_any_attitude() -> None:
    """Half a second later within noise, whatever the start; the status says when."""
    worst = 0.0
    for heading, roll, pitch in itertools.product((0, 77, 180, -110), (-25, 25), (-20, 15)):
        what = deck("sea_5", 0.5, 3, heading)
        tilt = np.roll(Rotation.from_euler("YX", [pitch, roll], degrees=True).as_quat(), 1)
        q = np.roll((rotation(what.q) * rotation(tilt)).as_quat(), 1, axis=-1)
        u = records(type(what)(what.euler, q, what.lift), heading % 7)
        out = run(u).outputs
        status = out["status"].astype(int)
        assert (status[:ALIGN_STEPS] == 1).all() and not status[ALIGN_STEPS:].any()
        worst = max(worst, turned(q, quaternions(out))[ALIGN_STEPS:].max())
    assert worst < 2.5


def test_exact_sensors_give_the_exact_attitude() -> None:
    for dip, motion in ((54.0, "rolling"), (-20.0, "table")):
        what = deck(motion, 1.0, 2, -60.0)
        out = run(records(what, 2, EXACT, dip_deg=dip), {"dip": dip / 180.0}).outputs
        assert turned(what.q, quaternions(out))[ALIGN_STEPS:].max() < 1e-3


def test_a_missing_field_only_counts_as_missing(rows: Any) -> None:
    u = rows.copy()
    u[:60, 7:] = 0.0
    u[1000:1100, 7:] = 0.0
    status = run(u).outputs["status"].astype(int)
    assert (status[:60] == 3).all() and (status[60 : 60 + ALIGN_STEPS] == 1).all()
    assert (status[1000:1100] == 2).all() and not status[1100:].any()


def test_restart_forgets(rows: Any) -> None:
    once = run(rows[:400]).outputs
    twice = run(np.concatenate([rows[900:1200], rows[:400]])).outputs
    for name, value in once.items():
        assert (twice[name][301:] == value[1:]).all(), name


def test_one_step_by_hand() -> None:
    """P after a step without a measurement that counts: turned, and the noise of the gyro added."""
    e = MlsAttitude()
    p = SimpleNamespace(**e.param_values())
    x = {s.name: np.float64(s.initial) for s in e.states}
    x |= {"unaligned": 0.0, "p00": 4e-4, "p11": 1e-4, "p22": 2e-4, "p01": 5e-5}
    u = dict(zip([i.name for i in e.inputs], [0.01, 0, 0, 2.0, 0, 0, 0, 0, 0, 9.8], strict=True))
    a = e._predicted(
        [[x["p00"], x["p01"], 0.0], [x["p01"], x["p11"], 0.0], [0.0, 0.0, x["p22"]]],
        e._picard([0.0, 0.0, 0.01]),
        SimpleNamespace(**u),
        p,
    )
    c = Rotation.from_rotvec([0.0, 0.0, 0.02]).as_matrix()
    before = np.array([[4e-4, 5e-5, 0], [5e-5, 1e-4, 0], [0, 0, 2e-4]])
    noise = (0.5 * 0.9 * math.radians(1.0) * 0.01 * SCALE) ** 2
    assert np.array(a, dtype=float) == pytest.approx(c.T @ before @ c + noise * np.eye(3), abs=1e-9)


@pytest.mark.parametrize(
    "name, edge", [("p0_sd", 1.0), ("acc_sd", 8.0 * GRAVITY), ("mag_sd", 512.0)]
)
def test_refuses_what_scale_would_clamp(name: str, edge: float) -> None:
    assert MlsAttitude().param_values({"scale": 64.0, name: edge / 64.0})[name] == edge / 64.0
    with pytest.raises(InputError, match=rf"^parameter {name}: .*at most .* at a scale of"):
        MlsAttitude().param_values({"scale": 64.0, name: 1.001 * edge / 64.0})
