"""Attitudes whose error is a small turn: their derivatives, and two filters with one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight import Input, Output, Param
from boresight.kalman import Attitude, Kalman, Measurement, State, Textbook, vector
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import CompiledFloat, Emitted

DT = 0.01
UP, FIELD = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, -2.0])


class Turn(Kalman):
    """Attitude and gyro bias from a gyro and two vectors that are known."""

    inputs = (
        *vector(Input, "g", "xyz", -5.0, 5.0, "rad/s"),
        *vector(Input, "a", "xyz", -4.0, 4.0),
        *vector(Input, "m", "xyz", -4.0, 4.0),
        Input("m_new", 0.0, 1.0),
    )
    params = (Param("r", 4e-3, 1e-4, 1.0),)
    states = (
        Attitude("q", sd=(0.3, 0.3, 0.8), sd_max=1.0),
        *vector(State, "b", "xyz", -0.125, 0.125, "rad/s", sd=0.02, sd_max=0.03),
    )
    outputs = tuple(Output("q" + c, tolerance=1e-4) for c in "wxyz")

    def f(self, x: Any, u: Any, p: Any) -> Any:
        return {"q": DT * (u.g - x.b)}

    def noise(self, x: Any, u: Any, p: Any) -> Any:
        return {"q": 1e-8, "b": 1e-12}

    def measure(self, x: Any, u: Any, p: Any) -> Any:
        z, h = x.q.observed(u.a, (0.0, 0.0, 1.0))
        zm, hm = x.q.observed(u.m, (0.0, 1.0, -2.0))
        field = Measurement(zm[0], hm[0], p.r, valid=u.m_new > 0.5, gate=5.0)
        return [Measurement(z[0], h[0], p.r), Measurement(z[1], h[1], p.r), field]


class Body(Turn):
    """The same vectors as they are seen, with an H that depends on the attitude."""

    def measure(self, x: Any, u: Any, p: Any) -> Any:
        up, field = x.q.to_body((0.0, 0.0, 1.0)), x.q.to_body((0.0, 1.0, -2.0))
        rows = [Measurement(z, h, p.r) for z, h in zip(u.a, up, strict=True)]
        valid = u.m_new > 0.5
        return rows + [Measurement(z, h, p.r, valid) for z, h in zip(u.m, field, strict=True)]


class Components(Turn):
    """By the quaternion's components themselves."""

    def measure(self, x: Any, u: Any, p: Any) -> Any:
        w, i, j, k = x.q.q
        east = [1.0 - 2.0 * (j * j + k * k), 2.0 * (i * j - w * k), 2.0 * (i * k + w * j)]
        ahead = sum(e * a for e, a in zip(east, u.a, strict=True))
        return [*super().measure(x, u, p)[:2], Measurement(0.0, ahead, p.r)]


def rotation(v: np.ndarray) -> np.ndarray:
    return Rotation.from_rotvec(v).as_matrix()


def motion(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Inputs (n, 10) of a body that turns, and its attitudes (n, 3, 3)."""
    draw, c = np.random.default_rng(4), rotation(np.array([0.1, -0.05, 0.3]))
    bias, rows, truth = np.array([0.01, -0.005, 0.008]), [], []
    for k in range(n):
        rate = np.array([0.3 * np.sin(0.01 * k), 0.2, 0.3 * np.cos(0.02 * k)])
        c = c @ rotation(rate * DT)
        up, field = (c.T @ v + draw.normal(0.0, 0.05, 3) for v in (UP, FIELD))
        rows.append([*(rate + bias + draw.normal(0.0, 1e-3, 3)), *up, *field, k % 5 == 0])
        truth.append(c)
    return np.array(rows), np.array(truth)


@pytest.mark.parametrize("filter", [Turn, Body, Components])
def test_float64_is_the_textbook(filter: type[Kalman]) -> None:
    inputs, _ = motion(150)
    book = Textbook(filter(), floor=True).run(inputs).outputs
    result = CompiledFloat(Build(filter())).run(inputs).outputs
    for name, values in book.items():
        assert np.abs(result[name] - values).max() < 1e-9


@pytest.mark.parametrize("filter", [Turn, Body])
def test_it_finds_the_attitude(filter: type[Kalman]) -> None:
    inputs, truth = motion(1500)
    run = Emitted(Build(filter(), config="small-1024")).run(inputs)
    q = np.stack([run.outputs["q" + c] for c in "wxyz"], axis=1)
    found = Rotation.from_quat(q[-300:], scalar_first=True)
    angle = np.degrees((found.inv() * Rotation.from_matrix(truth[-300:])).magnitude())
    assert np.sqrt(np.mean(angle**2)) < 0.7 and not run.n_saturated


def test_fixed_point_is_near() -> None:
    inputs, _ = motion(600)
    build = Build(Turn())
    fixed, floating = Emitted(build).run(inputs), CompiledFloat(build).run(inputs)
    for name, values in floating.outputs.items():
        assert np.abs(fixed.outputs[name] - values).max() < 2e-5


def test_what_an_attitude_costs() -> None:
    schedule = Build(Turn()).core.parts[0].schedule
    assert schedule.latency < 460 and schedule.interval < 600
