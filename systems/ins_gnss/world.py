"""A vehicle and a drone: inertial sensors, and a receiver with late and missing fixes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.errors import require_choice
from boresight.sim.rotations.rotation import (
    quaternion_multiply,
    rotate,
    rotation_vector_to_quaternion,
)
from boresight.sim.rotations.zyx import quaternions_of
from boresight.sim.worlds.world import BatchedWorld
from boresight.systems.ins_gnss.estimator import DT, GRAVITY
from boresight.systems.worlds.navigation import rates_and_forces

FIX_STEPS = 10  #: steps from one fix to the next.
START_RAD = (0.02, 0.02, 0.1)  #: standard deviations of the attitude at first, axes east to up.
GYRO_BIAS, ACC_BIAS = 0.003, 0.08  #: standard deviations [rad/s], [m/s^2].
GYRO_NOISE, ACC_NOISE = 2e-3, 0.05  #: of a sample.
FIX_M, FIX_M_S = 1.0, 0.1  #: of a fix.


def _vehicle(t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Velocity (n, 3) and Euler angles (n, 3): along the road, through bends, over hills."""
    speed = (14.0 + 5.0 * np.sin(0.11 * t)) * (1.0 - np.exp(-t / 6.0))
    heading = 1.2 * np.sin(0.13 * t) + 0.04 * t
    pitch = 0.05 * np.sin(0.17 * t)
    roll = 0.03 * np.sin(0.9 * t)
    level = speed * np.cos(pitch)
    v = np.stack([level * np.cos(heading), level * np.sin(heading), speed * np.sin(pitch)], axis=1)
    return v, np.stack([roll, -pitch, heading], axis=1)


def _drone(t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The same of a drone: it leans into every acceleration, and turns as it likes."""
    w = np.array([0.9, 0.7, 0.5])
    amplitude = np.array([4.0, 3.5, 1.5])
    v = amplitude * np.sin(w * t[:, None]) * (1.0 - np.exp(-t[:, None] / 3.0))
    lean = np.gradient(v[:, :2], DT, axis=0) / GRAVITY[2]
    heading = 0.3 * t + 0.5 * np.sin(0.4 * t)
    cosine, sine = np.cos(heading), np.sin(heading)
    roll = sine * lean[:, 0] - cosine * lean[:, 1]
    pitch = cosine * lean[:, 0] + sine * lean[:, 1]
    return v, np.stack([roll, pitch, heading], axis=1)


#: Velocity and Euler angles over time, by name.
CARRIERS = {"vehicle": _vehicle, "drone": _drone}


class Journey(BatchedWorld):
    """Two minutes of a carrier at 100 Hz, fixes at 10 Hz, a run for each seed.

    ``carrier`` is one of `CARRIERS`, any other is an `InputError`; ``seeds`` are of noise, biases
    and the error of the attitude at first; there are no fixes in the ``outages`` [s]; ``delay`` is
    the age of a fix when it comes [s], whole steps; ``lever`` (3,) is from the inertial sensor to
    the antenna, body axes [m].
    """

    def __init__(
        self,
        carrier: str = "vehicle",
        seeds: Sequence[int] = (1,),
        outages: Sequence[tuple[float, float]] = ((60.0, 80.0),),
        delay: float = 0.1,
        lever: tuple[float, float, float] = (0.8, -0.3, 1.2),
        steps: int = 12_000,
    ) -> None:
        super().__init__(seeds)
        require_choice("world journey, carrier", carrier, CARRIERS)
        self.carrier, self.outages, self.steps = carrier, tuple(outages), steps
        self.delay_steps, self.lever = round(delay / DT), np.array(lever)

    def pieces(self) -> Iterator[Mapping[str, FloatArray]]:
        runs = [self._run(seed) for seed in self.seeds]
        yield {name: np.stack([run[name] for run in runs], axis=1) for name in runs[0]}

    def _run(self, seed: int) -> dict[str, FloatArray]:
        """Columns (n,) of one run; arrays here begin so early that the first fix is known."""
        draw, n, first = np.random.default_rng([seed, 15]), self.steps, self.delay_steps + 1
        t = DT * np.arange(-first, n)
        v, euler = CARRIERS[self.carrier](np.maximum(t, 0.0))
        q = quaternion_multiply(
            rotation_vector_to_quaternion(draw.normal(0.0, START_RAD)), quaternions_of(euler)
        )
        rate, force = rates_and_forces(q, v, -GRAVITY, DT)
        v, q = v[1:], q[1:]
        p = np.cumsum(DT * v, axis=0)
        p -= p[first - 1]
        fix = np.concatenate(
            [
                p + rotate(q, self.lever) + draw.normal(0.0, FIX_M, p.shape),
                v + rotate(q, np.cross(rate, self.lever)) + draw.normal(0.0, FIX_M_S, p.shape),
            ],
            axis=1,
        )[:n]
        k = np.arange(n)
        missing = k % FIX_STEPS != 0
        for begin, end in self.outages:
            missing |= (begin <= DT * k) & (DT * k < end)
        fix[missing] = np.nan
        span = slice(first - 1, first - 1 + n)
        gyro = rate[span] + draw.normal(0.0, GYRO_BIAS, 3) + draw.normal(0.0, GYRO_NOISE, (n, 3))
        acc = force[span] + draw.normal(0.0, ACC_BIAS, 3) + draw.normal(0.0, ACC_NOISE, (n, 3))
        parts = {"g": ("xyz", gyro), "a": ("xyz", acc)}
        parts |= {"gnss_p": ("enu", fix[:, :3]), "gnss_v": ("enu", fix[:, 3:])}
        named = {f"{n}{c}": x[:, i] for n, (axes, x) in parts.items() for i, c in enumerate(axes)}
        truth = {"q": ("wxyz", q[span]), "v": ("enu", v[span]), "p": ("enu", p[span])}
        return named | {
            f"{n}{c}_true": x[:, i] for n, (axes, x) in truth.items() for i, c in enumerate(axes)
        }
