"""Inertial navigation with satellite fixes: attitude, velocity, position, biases of both sensors.

Gyro and accelerometer 100 times a second, position and velocity of a receiver when it has them,
late, and of an antenna that is somewhere else on the body. Axes are east, north, up over a flat
earth. The outputs are those of the predicted state: they leave before the correction begins. The
filter asks for the larger register file, ``--config small-1024``.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from boresight import Input, Output, Param, ops
from boresight.kalman import Attitude, Kalman, Measurement, State, vector

DT = 0.01  # s
LARGEST = 2.0  #: velocity of the antenna about the sensor, and gained within the delay, m/s.
GRAVITY = np.array([0.0, 0.0, 9.81])


class InsGnss(Kalman):
    """Inertial navigation with late satellite fixes of an antenna beside it, 15 error states."""

    name = "ins_gnss"
    inputs = (
        *vector(Input, "g", "xyz", -5.0, 5.0, "rad/s", meaning="mean body rate of the step"),
        *vector(Input, "a", "xyz", -50.0, 50.0, "m/s^2", meaning="mean specific force of it"),
        *vector(Input, "gnss_p", "enu", -4096.0, 4096.0, "m", missing="hold", meaning="the fix"),
        *vector(Input, "gnss_v", "enu", -64.0, 64.0, "m/s", missing="hold", meaning="its velocity"),
        Input("new", 0.0, 1.0, valid_of=("gnss_pe", "gnss_ve"), meaning="1: there is a fix"),
    )
    params = (
        Param("r_p", 1.0, 0.01, 64.0, "m^2", "variance of a position"),
        Param("r_v", 0.01, 1e-3, 0.25, "m^2/s^2", "variance of a velocity"),
        Param("q_g", 4e-10, 1e-12, 1e-6, "rad^2", "noise of the turn in a step"),
        Param("q_a", 1e-6, 1e-9, 0.01, "m^2/s^2", "noise of the velocity in a step"),
        Param("q_p", 1e-7, 0.0, 1e-3, "m^2", "noise of the position in a step"),
        Param("q_bg", 2e-12, 1e-15, 1e-9, "rad^2/s^2", "walk of the gyro's bias in a step"),
        Param("q_ba", 1e-9, 1e-13, 1e-6, "m^2/s^4", "walk of the accelerometer's bias in a step"),
        Param("delay", 0.1, 0.0, 0.25, "s", "age of a fix when it comes"),
        *vector(Param, "lever_", "xyz", 0.0, -4.0, 4.0, "m", "antenna, body axes"),
    )
    states = (
        Attitude("q", sd=(0.035, 0.035, 0.14)),
        *vector(State, "v", "enu", -64.0, 64.0, "m/s", sd=0.5),
        *vector(State, "p", "enu", -4096.0, 4096.0, "m", sd=2.0, sd_max=7.0),
        *vector(State, "bg", "xyz", -0.0625, 0.0625, "rad/s", sd=0.004),
        *vector(State, "ba", "xyz", -1.0, 1.0, "m/s^2", sd=0.1),
    )
    outputs = (
        *(Output("q" + c, tolerance=5e-5) for c in "wxyz"),
        *(Output("v" + c, "m/s", tolerance=2e-3) for c in "enu"),
        *(Output("p" + c, "m", tolerance=5e-3) for c in "enu"),
    )
    prior = dither = True

    def f(self, x: Any, u: Any, p: Any) -> dict[str, Any]:
        """Strapdown; the force in the axes of the middle of the step."""
        turned = (0.5 * DT) * np.cross(u.g, u.a)
        force = x.q.to_nav(u.a + turned - x.ba)
        return {"q": DT * (u.g - x.bg), "v": x.v + DT * (force - GRAVITY), "p": x.p + DT * x.v}

    def noise(self, x: Any, u: Any, p: Any) -> dict[str, Any]:
        """White noise of both sensors, and biases that wander."""
        return {"q": p.q_g, "v": p.q_a, "p": p.q_p, "bg": p.q_bg, "ba": p.q_ba}

    def measure(self, x: Any, u: Any, p: Any) -> list[Measurement]:
        """Position and velocity of the antenna when the fix was taken."""
        lever = np.array([p.lever_x, p.lever_y, p.lever_z])
        sweep = [ops.saturated(c, LARGEST) for c in np.cross(u.g, lever)]
        delta_v = [ops.saturated(c, LARGEST) for c in u.a * p.delay]
        half = 0.5 * p.delay
        offset = [k + half * a - p.delay * s for k, a, s in zip(lever, delta_v, sweep, strict=True)]
        place = x.p - p.delay * x.v + x.q.to_nav(offset) - (half * p.delay) * GRAVITY
        moving = [s - a for s, a in zip(sweep, delta_v, strict=True)]
        speed = x.v + x.q.to_nav(moving) + p.delay * GRAVITY
        fixes = ((u.gnss_p, place, p.r_p), (u.gnss_v, speed, p.r_v))
        return [
            Measurement(z, h, r, valid=u.new > 0.5)
            for measured, expected, r in fixes
            for z, h in zip(measured, expected, strict=True)
        ]
