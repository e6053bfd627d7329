"""`satcom` against a matrix filter with numerical Jacobians, scipy's angles, and hostile input."""

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.model.errors import InputError
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.systems.satcom.estimator import BIAS_UNIT, Satcom
from tests.support.compiled_float import compiled_float

GRAVITY = 9.80665
DT = 0.02
SCALE = 8.0
DEFAULT = {p.name: p.default for p in Satcom.params}


SCALE_16 = {"scale": 16.0, "p0_sd": 0.03, "bias_p0_sd": 0.003, "roll_sd": 1e-3, "pitch_sd": 1e-3}


def left(p: Any) -> Any:
    """p q = left(p) q, the Hamilton product, scalar first."""
    a, b, c, d = p
    return np.array([[a, -b, -c, -d], [b, a, -d, c], [c, d, a, -b], [d, -c, b, a]])


def right(q: Any) -> Any:
    """p q = right(q) p."""
    a, b, c, d = q
    return np.array([[a, -b, -c, -d], [b, a, d, -c], [c, -d, a, b], [d, c, -b, a]])


def xi(q: Any) -> Any:
    return left(q)[:, 1:]


def rotation(q: Any) -> Any:
    """scipy's rotation of (..., 4), scalar first."""
    return Rotation.from_quat(np.roll(q, -1, axis=-1))


def angles(q: Any) -> Any:
    """Roll, pitch, heading [rad]."""
    return rotation(q).as_euler("ZYX")[..., ::-1]


def wrapped(angle: Any) -> Any:
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


class Textbook:
    """The seven-state filter in fixed coordinates, as the patent writes it; one run."""

    def __init__(self, p: Any, dt: float = DT) -> None:
        self.p, self.dt = SimpleNamespace(**{**DEFAULT, **p}), dt
        self.restart()

    def restart(self) -> None:
        heading = math.pi * self.p.start_heading
        self.q = np.array([math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2)])
        self.bias = np.zeros(3)
        basis = right(self.q)
        self.P = np.zeros((7, 7))
        self.P[:4, :4] = basis @ np.diag([0.0, *[(self.p.p0_sd / 2) ** 2] * 3]) @ basis.T
        self.P[4:, 4:] = self.p.bias_p0_sd**2 * np.eye(3)
        self.psi, self.drift, self.since = heading, 0.0, 0.0

    def step(self, gyro: Any, force: Any, error: float, beam: float, tracking: bool) -> Any:
        p, dt = self.p, self.dt
        half = 0.5 * dt * (gyro - self.bias)
        y = half @ half
        dq = np.array([1 - y / 2 + y * y / 24, *(half * (1 - y / 6 + y * y / 120))])
        q = left(self.q) @ dq
        F = np.eye(7)
        F[:4, :4], F[:4, 4:] = right(dq), -dt / 2 * xi(q)
        Q = np.zeros((7, 7))
        Q[:4, :4] = (dt / 2 * p.gyro_sd) ** 2 * xi(q) @ xi(q).T
        Q[4:, 4:] = p.bias_density**2 * dt * np.eye(3)
        P = F @ self.P @ F.T + Q

        phi, theta, psi = angles(q)
        rate = (math.sin(phi) * gyro[1] + math.cos(phi) * gyro[2]) / math.cos(theta)
        used = tracking and abs(error) <= p.tracking_gate
        self.psi += dt * (rate - self.drift)
        self.since = min(self.since + dt, 1.0)
        if used:
            e = error + wrapped(self.psi - math.pi * beam)
            self.psi -= min(2 * p.damping * p.cutoff * self.since, 1.0) * e
            self.drift += p.cutoff**2 * self.since * e
            self.since = 0.0

        tilt = right(q).T @ P[:4, :4] @ right(q)
        known = tilt[1, 1] + tilt[2, 2] < (p.tilt_known_sd / 2) ** 2
        nav = rotation(q).apply(force) + [0.0, 0.0, GRAVITY]
        self.moving = bool(known and (np.abs(nav) > [p.delta_x, p.delta_y, p.delta_z]).any())
        grown = p.adapt if self.moving else 1.0
        z = np.array(
            [
                math.atan2(-force[1], -force[2]),
                math.asin(np.clip(force[0] / GRAVITY, -1, 1)),
                self.psi,
            ]
        )
        R = np.diag([grown * p.roll_sd, grown * p.pitch_sd, p.heading_sd]) ** 2
        step = 1e-5
        H = np.zeros((3, 7))
        for k, e in enumerate(np.eye(4)):
            H[:, k] = wrapped(angles(q + step * e) - angles(q - step * e)) / (2 * step)
        rows = slice(0, 3 if used else 2)
        H, R, residual = H[rows], R[rows, rows], wrapped(z - angles(q))[rows]
        K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
        move = K @ residual
        A = np.eye(7) - K @ H
        if known or residual[:2] @ residual[:2] < (math.pi / 90) ** 2:  # else it is still unknown
            P = A @ P @ A.T + K @ R @ K.T
        raw, self.bias = q + move[:4], self.bias + move[4:]
        self.q = raw / np.linalg.norm(raw)
        J = np.eye(7)
        J[:4, :4] = (np.eye(4) - np.outer(self.q, self.q)) / np.linalg.norm(raw)
        self.P = J @ P @ J.T
        return angles(self.q)


def motion(seed: int, steps: int = 400, dt: float = DT) -> Any:
    """Records (steps, n_inputs): restart, then a drive with turns, slopes, blows and gaps."""
    rng = np.random.default_rng(seed)
    t = dt * np.arange(steps)
    roll = 0.2 * np.sin(0.9 * t + seed)
    pitch = 0.15 * np.sin(1.3 * t) + 0.3 * np.sin(0.2 * t)
    heading = 2.0 + 0.4 * t + 0.5 * np.sin(0.7 * t)
    attitude = Rotation.from_euler("ZYX", np.stack([heading, pitch, roll], axis=1))
    gyro = np.zeros((steps, 3))
    gyro[1:] = (attitude[:-1].inv() * attitude[1:]).as_rotvec() / dt
    pushed = np.where((t > 3.0)[:, None] & (t < 5.0)[:, None], [2.0, -1.5, 0.4], 0.0)
    force = attitude.inv().apply(pushed - [0.0, 0.0, GRAVITY])
    u = np.zeros((steps, 10))
    u[:, 0] = dt
    u[:, 1:4] = gyro + [0.005, -0.007, 0.009] + rng.normal(0.0, 1e-3, gyro.shape)
    u[:, 4:7] = force + rng.normal(0.0, 0.05, force.shape)
    u[::10, 7] = rng.normal(0.0, 0.004, len(t[::10]))
    u[::10, 8] = wrapped(heading + rng.normal(0.0, 0.01, len(t)))[::10] / math.pi
    u[::10, 9] = 1.0
    u[150:200, 9] = 0.0
    u[260, 7] = 0.3  # beyond the gate
    u[0, 0], u[0, 9] = -dt, 0.0
    return u


PARAMS = {"start_heading": 2.05 / math.pi, "cutoff": 1.5}


def textbook_run(u: Any, params: Any) -> tuple[Any, Textbook]:
    book = Textbook(params, u[1, 0])
    return np.array([book.step(r[1:4], r[4:7], r[7], r[8], r[9] > 0.5) for r in u[1:]]), book


def float_run(u: Any, params: Any = None, estimator: Any = None) -> dict[str, Any]:
    """Outputs and final states; angles [rad] under "angles"."""
    out, states = compiled_float(estimator or Satcom(), u[:, :, None], params)
    results: dict[str, Any] = {name: values[:, 0] for name, values in out.items()}
    results["angles"] = math.pi * np.stack(
        [results[n] for n in ("roll", "pitch", "heading")], axis=1
    )
    results["state"] = {name: values[-1, 0] for name, values in states.items()}
    return results


@pytest.mark.parametrize("params", [{}, {"adapt": 1.0, "tracking_gate": 0.5}, {"p0_sd": 0.09}])
def test_is_the_seven_state_filter(params: Any) -> None:
    u = motion(1)
    wanted, book = textbook_run(u, {**PARAMS, **params})
    result = float_run(u, {**PARAMS, **params})
    assert np.abs(wrapped(result["angles"][1:] - wanted)).max() < 1e-8
    assert np.abs([result[f"bias_{a}"][-1] for a in "xyz"] - book.bias).max() < 1e-9
    x = result["state"]
    basis = np.zeros((7, 7))
    basis[:4, :4], basis[4:, 4:] = right(book.q), BIAS_UNIT * np.eye(3)
    P = (SCALE * x["finer"]) ** 2 * (basis.T @ book.P @ basis)
    assert np.abs(P[0]).max() < 1e-12  # of the norm nothing is left
    for i in range(6):
        for j in range(i, 6):
            assert x[f"p{i}{j}"] == pytest.approx(P[i + 1, j + 1], abs=1e-9)
    assert wrapped(math.pi * x["heading_pi"] - book.psi) == pytest.approx(0.0, abs=1e-8)
    assert math.pi * x["drift"] == pytest.approx(book.drift, abs=1e-9)


def test_small_noise_counts_in_fixed_point() -> None:
    """At 200 Hz a record's noise is far below the last bit of what P0 needs."""
    u = motion(1, 2400, 0.005)
    wanted, _ = textbook_run(u, PARAMS)
    out = make_level("c", Build(Satcom(), params=[PARAMS])).run(u).outputs
    found = math.pi * np.stack([out[n] for n in ("roll", "pitch", "heading")], axis=1)[1:]
    assert np.degrees(np.abs(wrapped(found - wanted)).max()) < 3e-4


def still(roll: float, pitch: float, heading: float, steps: int = 400, e: float = 0.0) -> Any:
    """Exact sensors at rest [deg]; the beam on the satellite but for ``e`` [rad]."""
    attitude = Rotation.from_euler("ZYX", [heading, pitch, roll], degrees=True)
    u = np.zeros((steps, 10))
    u[:, 0] = DT
    u[:, 4:7] = attitude.inv().apply([0.0, 0.0, -GRAVITY])
    u[::5, 7], u[:, 8] = e, (heading + math.degrees(e)) / 180.0
    u[::5, 9] = 1.0
    u[0, 0], u[0, 9] = -DT, 0.0
    return u


@pytest.mark.parametrize("roll, pitch, heading", [(9, -6, 170), (-25, 20, -175), (30, 0, 60)])
def test_finds_its_attitude_at_rest(roll: float, pitch: float, heading: float) -> None:
    params = {"start_heading": ((heading + 3 + 180) % 360 - 180) / 180, "cutoff": 4.0}
    out = float_run(still(roll, pitch, heading, e=0.01), params)
    error = wrapped(out["angles"] - np.radians([roll, pitch, heading]))
    assert np.abs(error[-1]).max() < math.radians(0.05)
    assert not (out["status"][20:].astype(int) & 1).any()
    q = rotation([out[f"q{a}"][-1] for a in "wxyz"])
    assert out["angles"][-1] == pytest.approx(angles(np.roll(q.as_quat(), 1)), abs=1e-9)


def test_rates_are_free_of_bias() -> None:
    u = motion(1)
    out = float_run(u, PARAMS)
    for k, axis in enumerate("xyz"):
        assert out[f"rate_{axis}"][1:] == pytest.approx(u[1:, 1 + k] - out[f"bias_{axis}"][:-1])


@pytest.mark.parametrize(
    "axis, level, flagged",
    [(0, 0.19, False), (0, -0.21, True), (1, 0.21, True), (1, -0.19, False), (2, 0.49, False)]
    + [(2, 0.51, True), (2, -0.51, True)],
)
def test_external_acceleration(axis: int, level: float, flagged: bool) -> None:
    u = still(3.0, 0.0, 0.0)
    out = float_run(u)
    attitude = rotation([out[f"q{a}"][-1] for a in "wxyz"])
    pushed = np.array([0.0, 0.0, -GRAVITY])
    pushed[axis] += level
    u[-1, 4:7] = attitude.inv().apply(pushed)
    status = float_run(u)["status"].astype(int)
    assert (status[-1] & 1, status[-2] & 1) == (int(flagged), 0)


def test_restart_forgets() -> None:
    u = motion(1, 300)[:200]
    once, twice = float_run(u, PARAMS), float_run(np.concatenate([motion(2, 300)[:100], u]), PARAMS)
    assert (once["angles"][1:] == twice["angles"][101:]).all()
    assert (once["heading_pi"][1:] == twice["heading_pi"][101:]).all()


@pytest.mark.parametrize(
    "name, edge, others",
    [("p0_sd", 0.125, {}), ("bias_p0_sd", 1 / 64, {}), ("adapt", 128.0, SCALE_16)]
    + [("roll_sd", 0.01, {}), ("pitch_sd", 0.02, {"adapt": 50.0}), ("heading_sd", 0.5, SCALE_16)]
    + [("tilt_known_sd", 0.25, {}), ("gyro_sd", 0.0625, SCALE_16)]
    + [("bias_density", 2**-8, {})],
)
def test_refuses_what_scale_would_clamp(name: str, edge: float, others: Any) -> None:
    assert Satcom().param_values({**others, name: edge})[name] == edge
    with pytest.raises(InputError, match=rf"^parameter {name}: .*at most .* at a scale of"):
        Satcom().param_values({**others, name: 1.001 * edge})
