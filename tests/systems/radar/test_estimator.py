"""`registration` against a matrix filter in other coordinates, hostile records, its own limits."""

import math
from functools import lru_cache
from typing import Any

import numpy as np
import pymap3d
import pytest

from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.systems.radar.estimator import BIASES, KNOWN, YOUNG, Registration, site
from tests.support.radar import (
    BIAS,
    NOISE,
    RADARS,
    TRUTH,
    ecef,
    first,
    float_outputs,
    float_states,
    polar,
    records,
)

NAMES = [f"{b}_bias" for b in BIASES]


def jacobian(point: Any, radar: Any) -> Any:
    """dX/d(rho, e, n), by differences."""
    step = np.array([1.0, 1e-5, 1e-5])
    columns = []
    for k in range(3):
        d = np.zeros(3)
        d[k] = step[k]
        columns.append((ecef(point + d, radar) - ecef(point - d, radar)) / (2.0 * step[k]))
    return np.stack(columns, axis=1)


class Textbook:
    """The filter as matrices, positions in ECEF by pymap3d; one run."""

    def __init__(self, p0: Any, fade: float = 0.1) -> None:
        self.x, self.P, self.fade = np.zeros(6), np.diag(p0) ** 2, fade
        self.track: list[Any] = []
        self.memory = 1.0

    def step(self, samples: Any, weight: float) -> None:
        if not self.track:
            self.track, self.memory = [[s, 0.0 * s, 0.0 * s] for s in samples], 2.0 / 3.0
            return
        m, dt, expected = self.memory, 0.1, []
        for track, sample in zip(self.track, samples, strict=True):
            p, v, a = track
            ahead = p + dt * v + dt * dt / 2 * a
            r = sample - ahead
            theta = 1.0 - m
            track[0] = ahead + (1.0 - theta**3) * r
            track[1] = v + dt * a + 1.5 * m**2 * (1.0 + theta) * r / dt
            track[2] = a + 2.0 * m**3 * r / dt**2
            expected.append(ahead)
        self.memory = max(m - m * m / 3.0, self.fade)
        if m > YOUNG:
            return
        J, seen = [], np.zeros(3)
        for k, (at, radar) in enumerate(zip(expected, RADARS, strict=True)):
            b = self.x[3 * k : 3 * k + 3]
            c = np.array([b[0], *np.clip(b[1:], -KNOWN, KNOWN)])
            free = polar(at, radar) - c
            J.append(jacobian(free, radar))
            seen = seen + (-1.0) ** k * (at - ecef(free, radar) + J[k] @ (b - c))
        H = np.concatenate([J[0], -J[1]], axis=1)
        R = H @ np.diag(np.tile(NOISE, 2) ** 2) @ H.T / weight**2
        K = self.P @ H.T @ np.linalg.inv(H @ self.P @ H.T + R)
        self.x = self.x + K @ (samples[0] - samples[1] - seen)
        A = np.eye(6) - K @ H
        self.P = A @ self.P @ A.T + K @ R @ K.T


@pytest.mark.parametrize(
    "p0, noise", [((40.0, 0.35), 0.0), ((40.0, 0.35), 1.0), ((1e4, 10.0), 0.0), ((1e3, 1.0), 1.0)]
)
def test_is_the_kalman_filter(p0: Any, noise: float) -> None:
    u = records(noise=noise, steps=250)
    x = float_states(u, first(*p0))
    book = Textbook(np.tile([p0[0], *2 * [math.radians(p0[1])]], 2))
    unit = np.tile([p0[0], *2 * [math.radians(p0[1])]], 2)
    for k in range(len(u)):
        book.step([u[k, 1:4], u[k, 4:7]], x["weight"][k - 1] if not x["wide"][k] else 1e-9)
        if k in (20, 60, 249):
            s = np.array([[x[f"s{i}{j}"][k] for j in range(6)] for i in range(6)]) * unit[:, None]
            sd = np.sqrt(np.diag(book.P))
            state = np.array([x[f"bias_{i}"][k] + x[f"rest_{i}"][k] for i in range(6)]) * unit
            assert (state - book.x) / sd == pytest.approx(np.zeros(6), abs=2e-3)
            assert (s @ s.T - book.P) / np.outer(sd, sd) == pytest.approx(
                np.zeros((6, 6)), abs=2e-3
            )


@lru_cache(maxsize=1)
def level() -> Any:
    return make_level("c", Build(Registration()))


def compiled(u: Any, params: Any = None) -> Any:
    """A run of the integer C, parameters in its registers."""
    c = level()
    c.set_params(Registration().param_values(params))
    c.reset()
    return c.run(u)


WIDTHS = [(50.0, 0.5), (1e3, 10.0), (1e4, 10.0), (1e4, 15.0)]


@pytest.fixture(scope="module")
def free() -> Any:
    """Records without noise, and float64 from every one of `WIDTHS`, corrected late."""
    u = records(noise=0.0, steps=801)
    return u, float_outputs(u, [first(*p0) | {"correct_from": 70.05} for p0 in WIDTHS])


def test_noise_free_tracks_give_the_biases(free: Any) -> None:
    out = compiled(free[0], first(1e4, 15.0)).outputs
    error = [100.0 * abs(out[n][-1] / BIAS[k % 3] - 1.0) for k, n in enumerate(NAMES)]
    assert max(error[0], error[3]) < 2.0
    assert max(error[1:3] + error[4:]) < 0.15


def test_correction_begins_when_asked_and_is_exact(free: Any) -> None:
    u, floating = free
    on = (floating["status"][:, 3].astype(int) >> 5) & 1
    assert on[699:703].tolist() == [0, 0, 1, 1]
    values = np.stack([floating[f"{a}1_corrected"][:, 3] for a in "xyz"], axis=1)
    assert (values[:700] == u[:700, 1:4]).all()
    assert np.abs(values[702:] - TRUTH[702:801]).max() < 1.0
    assert np.abs(u[702:, 1:4] - TRUTH[702:801]).min(axis=0).max() > 500.0


def status(u: Any, params: Any = None) -> Any:
    return compiled(u, params).outputs["status"].astype(int)


def test_a_radar_that_misses_is_waited_for() -> None:
    u = records(noise=0.0, steps=200)
    u[100:110, 8] = 0.0
    u[100:110, 4:7] = u[99, 4:7]
    u[150:175, 7] = 0.0  # longer than the gap: the tracks begin anew
    s = status(u)
    assert (s[100:110] & 1).all() and not (s[110:150] & 3).any()
    assert (s[150:175] & 1).all() and (s[176:178] & 2).all() and not s[190] & 2
    out = compiled(u).outputs
    before, after = (np.array([out[n][k] for n in NAMES]) for k in (151, 174))
    assert (before == after).all()  # nothing is learnt meanwhile


def test_restart_forgets() -> None:
    u = records(noise=1.0, steps=120)
    once, twice = (
        compiled(v) for v in (u, np.concatenate([records(noise=1.0, seed=2, steps=90), u]))
    )
    for name in [*NAMES, "nis", "status"]:
        assert (once.outputs[name] == twice.outputs[name][90:]).all(), name


def test_sites_are_those_of_another_package() -> None:
    for where in (*RADARS, (-70.0, -33.0, 2400.0)):
        place, axes = site(*where)
        assert place == pytest.approx(pymap3d.geodetic2ecef(where[1], where[0], where[2]), abs=1e-3)
        up = np.array(pymap3d.enu2ecef(0.0, 0.0, 1e3, where[1], where[0], where[2])) - place
        assert up / 1e3 == pytest.approx(axes[2], abs=1e-6)
        east = np.array(pymap3d.enu2ecef(1e3, 0.0, 0.0, where[1], where[0], where[2])) - place
        assert east / 1e3 == pytest.approx(axes[0], abs=1e-6)


def test_error_covariance_is_that_of_the_biases() -> None:
    e, rng = Registration(), np.random.default_rng(1)
    states = {f"s{i}{j}": rng.normal(size=3) for i in range(6) for j in range(6)}
    names, p = e.error_covariance(states, e.param_values({"p0_azimuth_2": 2.0}))
    s = np.array([[states[f"s{i}{j}"][1] for j in range(6)] for i in range(6)])
    assert names == tuple(NAMES) and p.shape == (3, 6, 6)
    assert p[1, 0, 5] == pytest.approx((s @ s.T)[0, 5] * 1000.0 * 2.0 * math.radians(0.15))
