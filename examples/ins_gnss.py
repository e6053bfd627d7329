"""Inertial navigation with satellite fixes: an extended Kalman filter of 15 error states.

Attitude, velocity, position and the biases of gyro and accelerometer at 100 Hz; position and
velocity of a receiver at 10 Hz, with gaps. It asks for the larger register file::

    boresight simulate ins_gnss.py:Journey ins_gnss.py:Ins --on fixed --config small-1024
    boresight covariance ins_gnss.py:Ins --updates 20000

Axes are east, north, up over a flat earth; the receiver's antenna is where the inertial sensor is.
The outputs are those of the predicted state: they leave the core before the correction begins.
"""

import numpy as np

from boresight import Input, Output, Param, World
from boresight.kalman import Attitude, Kalman, Measurement, State, vector

DT = 0.01  # s
GRAVITY = np.array([0.0, 0.0, 9.81])


class Ins(Kalman):
    """Attitude, velocity, position, biases of gyro and accelerometer."""

    inputs = (
        *vector(Input, "g", "xyz", -5.0, 5.0, "rad/s"),
        *vector(Input, "a", "xyz", -50.0, 50.0, "m/s^2"),
        *vector(Input, "gnss_p", "enu", -4096.0, 4096.0, "m", missing="hold"),
        *vector(Input, "gnss_v", "enu", -64.0, 64.0, "m/s", missing="hold"),
        Input("new", 0.0, 1.0, valid_of=("gnss_pe", "gnss_ve")),
    )
    params = (
        Param("r_p", 1.0, 0.01, 100.0, "m^2", "variance of a position"),
        Param("r_v", 0.01, 1e-3, 1.0, "m^2/s^2", "variance of a velocity"),
        Param("q_g", 1e-9, 1e-12, 1e-3, "rad^2", "noise of the turn in a step"),
        Param("q_a", 1e-6, 1e-9, 0.1, "m^2/s^2", "noise of the velocity in a step"),
        Param("q_bg", 1e-13, 1e-15, 1e-6, "rad^2/s^2", "noise of the gyro's bias in a step"),
        Param("q_ba", 1e-10, 1e-13, 1e-3, "m^2/s^4", "noise of the accelerometer's bias in a step"),
    )
    states = (
        Attitude("q", sd=(0.1, 0.1, 0.5), sd_max=1.0),
        *vector(State, "v", "enu", -64.0, 64.0, "m/s", sd=1.0, sd_max=4.0),
        *vector(State, "p", "enu", -4096.0, 4096.0, "m", sd=5.0, sd_max=16.0),
        *vector(State, "bg", "xyz", -0.125, 0.125, "rad/s", sd=0.01, sd_max=0.03),
        *vector(State, "ba", "xyz", -1.0, 1.0, "m/s^2", sd=0.2, sd_max=0.5),
    )
    outputs = (
        *(Output("q" + c, tolerance=5e-5) for c in "wxyz"),
        *(Output("v" + c, "m/s", tolerance=2e-3) for c in "enu"),
        *(Output("p" + c, "m", tolerance=5e-3) for c in "enu"),
    )
    prior = True

    def f(self, x, u, p):
        """Strapdown: the turn in body axes, velocity and position in navigation axes."""
        force = x.q.to_nav(u.a - x.ba)
        return {"q": DT * (u.g - x.bg), "v": x.v + DT * (force - GRAVITY), "p": x.p + DT * x.v}

    def noise(self, x, u, p):
        """White noise of both sensors, and biases that wander."""
        return {"q": p.q_g, "v": p.q_a, "bg": p.q_bg, "ba": p.q_ba}

    def measure(self, x, u, p):
        """Position and velocity where the receiver has a new fix."""
        seen = ((u.gnss_p, x.p, p.r_p), (u.gnss_v, x.v, p.r_v))
        return [
            Measurement(z, h, r, valid=u.new > 0.5)
            for measured, expected, r in seen
            for z, h in zip(measured, expected, strict=True)
        ]


class Journey(World):
    """A vehicle that turns, climbs and accelerates; no fix from 30 to 40 s."""

    def __init__(self, steps=6000):
        self.steps, self.seed = steps, 1

    def draw(self, seed):
        """Noise of all sensors."""
        self.seed = seed

    def start(self):
        """At the origin, not quite level."""
        self.k, self.noise = 0, np.random.default_rng(self.seed)
        self.q = _turn(np.array([0.02, -0.03, 0.4]))
        self.v, self.p = np.zeros(3), np.zeros(3)

    def record(self, outputs):
        """One period; what the outputs say moves nothing."""
        if self.k == self.steps:
            return None
        t, draw = self.k * DT, self.noise.normal
        rate = np.array(
            [0.25 * np.sin(0.9 * t), 0.2 * np.cos(1.3 * t), 0.15 + 0.3 * np.sin(0.2 * t)]
        )
        moved = np.array([1.5 * np.sin(0.5 * t), 1.5 * np.cos(0.37 * t), 0.5 * np.sin(0.8 * t)])
        force = _matrix(self.q).T @ (moved + GRAVITY)
        self.p = self.p + DT * self.v
        self.v = self.v + DT * moved
        self.q = _times(self.q, _turn(DT * rate))
        gyro = rate + [0.004, -0.006, 0.003] + draw(0.0, 1e-3, 3)
        acc = force + [0.1, -0.08, 0.05] + draw(0.0, 0.05, 3)
        fix = np.concatenate([self.p + draw(0.0, 1.0, 3), self.v + draw(0.0, 0.1, 3)])
        if self.k % 10 or 30.0 <= t < 40.0:
            fix[:] = np.nan
        self.k += 1
        return {
            **{f"g{c}": v for c, v in zip("xyz", gyro, strict=True)},
            **{f"a{c}": v for c, v in zip("xyz", acc, strict=True)},
            **{
                f"gnss_{k}": v
                for k, v in zip(("pe", "pn", "pu", "ve", "vn", "vu"), fix, strict=True)
            },
            **{f"q{c}_true": v for c, v in zip("wxyz", self.q, strict=True)},
            **{f"v{c}_true": v for c, v in zip("enu", self.v, strict=True)},
            **{f"p{c}_true": v for c, v in zip("enu", self.p, strict=True)},
        }


def _times(p, q):
    """Hamilton's product."""
    v = p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:])
    return np.concatenate([[p[0] * q[0] - p[1:] @ q[1:]], v])


def _turn(angle):
    """Quaternion of a rotation vector [rad]."""
    half = 0.5 * np.linalg.norm(angle)
    return np.concatenate([[np.cos(half)], 0.5 * np.sinc(half / np.pi) * angle])


def _matrix(q):
    """Body to navigation."""
    k = np.cross(q[1:], np.eye(3)).T
    return np.eye(3) + 2.0 * q[0] * k + 2.0 * k @ k
