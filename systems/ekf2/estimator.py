"""PX4's EKF2: 24 error states, one scalar measurement in each update.

States, motion, measurements and noise are those of the published derivation of PX4-Autopilot
(`src/modules/ekf2/EKF/python/ekf_derivation`, of 2024, with terrain as the 24th state), in its
frames: navigation axes north, east, down; body axes forward, right, down; the attitude's error is a
small turn about navigation axes. The filter asks for ``--config small-2048``.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from boresight import Input, Output, Param, ops
from boresight.kalman import Attitude, Kalman, Measurement, State, vector
from boresight.model.declarations import GRAVITY

DT = 0.01  #: s
GRAVITY_NED = np.array([0.0, 0.0, GRAVITY])  #: m/s^2, north, east, down.
#: Kinds of measurements, by the number in the input ``kind``; 0 is none.
KINDS = (
    "nothing",
    "velocity",  # axis . v
    "position",  # axis . p; height as well, axis down
    "range",  # height above ground
    "heading",
    "airspeed",
    "field",  # axis . magnetometer
    "declination",
    "sideslip",  # axis right
    "drag",  # axis . specific force by drag
    "flow",  # line of sight's rate: axis right about x, axis back about y
    "body_velocity",  # axis . C^T v
    "gravity",  # axis . direction of the accelerometer's force at rest
)
#: Measured values come in these parts of their SI unit (fields: gauss), so that all are of a size.
UNITS = {name: 1.0 for name in KINDS} | {
    **{"velocity": 4.0, "heading": 16.0, "field": 16.0, "gravity": 16.0},
    **{"declination": 4.0, "sideslip": 4.0},
}
SLOWEST = 8.0  #: m/s forward through the air for sideslip; a 32nd of a gauss north for declination.
LOWEST = 2.0  #: m above ground for optical flow.
#: Largest derivatives of the measurements, in parts of `UNITS`: of the axis along the wind and
#: the drag, and of optical flow that sees 9 m/s from 3 m above ground.
STEEPEST = {"q": 64.0, "v": 4.0, "pd": 1.0, "terrain": 1.0, "wind_n": 1.0, "wind_e": 1.0}
_EPSILON = 0.125  #: m/s, of the norm of the airspeed.


class Ekf2(Kalman):
    """PX4's EKF2: attitude, velocity, position, biases, magnetic field, wind, terrain."""

    name = "ekf2"
    inputs = (
        *vector(Input, "g", "xyz", -8.0, 8.0, "rad/s", meaning="mean body rate of the step"),
        *vector(Input, "a", "xyz", -64.0, 64.0, "m/s^2", meaning="mean specific force of it"),
        Input("kind", 0.0, 15.0, missing=0.0, meaning="what is measured, of KINDS"),
        *vector(Input, "axis_", "xyz", -1.0, 1.0, missing=0.0, meaning="along which axis"),
        Input("z", -4096.0, 4096.0, missing=0.0, meaning="measured value, in its part of UNITS"),
        Input("r", 0.015625, 64.0, missing=1.0, meaning="variance of its noise, likewise"),
    )
    params: tuple[Param, ...] = (
        Param("q_g", 2.25e-8, 1e-10, 1e-5, "rad^2", "noise of the turn in a step"),
        Param("q_a", 1.2e-5, 1e-8, 0.01, "m^2/s^2", "noise of the velocity in a step"),
        Param("q_bg", 1e-10, 1e-12, 1e-8, "rad^2/s^2", "walk of the gyro's bias in a step"),
        Param("q_ba", 1e-9, 1e-11, 1e-6, "m^2/s^4", "walk of the accelerometer's bias in a step"),
        Param("q_field", 1e-10, 1e-11, 1e-6, "", "walk of the earth's field [G^2] in a step"),
        Param("q_body", 1e-10, 1e-11, 1e-6, "", "walk of the body's field [G^2] in a step"),
        Param("q_wind", 1e-4, 1e-7, 0.01, "m^2/s^2", "walk of the wind in a step"),
        Param("q_terrain", 1e-3, 1e-6, 0.25, "m^2", "walk of the terrain in a step"),
        Param("drag", 0.01, 0.0, 0.03125, "1/m", "air's density over twice the ballistic one"),
        Param("rotor", 0.1, 0.0, 0.5, "1/s", "drag of the rotors by momentum"),
    )
    states = (
        Attitude("q", sd=(0.05, 0.05, 0.2)),
        *vector(State, "v", "ned", -64.0, 64.0, "m/s", sd=1.0, sd_max=1.98),
        *vector(State, "p", "ned", -4096.0, 4096.0, "m", sd=4.0, sd_max=7.9),
        *vector(State, "bg", "xyz", -0.125, 0.125, "rad/s", sd=0.01),
        *vector(State, "ba", "xyz", -1.0, 1.0, "m/s^2", sd=0.1),
        *(
            State(f"m{a}", -1.0, 1.0, "", b, sd=0.05, sd_max=0.1)
            for a, b in zip("ned", (0.2, 0.0, 0.45), strict=True)
        ),
        *vector(State, "mb", "xyz", -1.0, 1.0, "", sd=0.05, sd_max=0.1),
        *(State("wind_" + a, -32.0, 32.0, "m/s", sd=4.0, sd_max=6.0) for a in "ne"),
        State("terrain", -512.0, 512.0, "m", sd=4.0, sd_max=7.9),
    )
    outputs = (
        *(Output("q" + c, tolerance=5e-5) for c in "wxyz"),
        *(Output("v" + c, "m/s", tolerance=2e-3) for c in "ned"),
        *(Output("p" + c, "m", tolerance=5e-3) for c in "ned"),
        *(Output("wind_" + a, "m/s", tolerance=5e-3) for a in "ne"),
        Output("terrain", "m", tolerance=5e-3),
    )
    prior = True

    def f(self, x: Any, u: Any, p: Any) -> dict[str, Any]:
        """Strapdown, to the first order in the step."""
        return {
            "q": DT * (u.g - x.bg),
            "v": x.v + DT * (x.q.to_nav(u.a - x.ba) + GRAVITY_NED),
            "p": x.p + DT * x.v,
        }

    def noise(self, x: Any, u: Any, p: Any) -> dict[str, Any]:
        """White noise of both sensors; biases, fields, wind and terrain that wander."""
        walks = {"bg": p.q_bg, "ba": p.q_ba, "m": p.q_field, "mb": p.q_body}
        walks |= {"wind_n": p.q_wind, "wind_e": p.q_wind, "terrain": p.q_terrain}
        return {"q": p.q_g, "v": p.q_a} | walks

    def measure(self, x: Any, u: Any, p: Any) -> list[Measurement]:
        """The row of ``kind``: the sum of all rows, each times its unit or 0."""
        axis = np.array([u.axis_x, u.axis_y, u.axis_z])
        at = {name: u.kind < n + 0.5 for n, name in enumerate(KINDS)}
        active = {name: at[name] & ~at[KINDS[n]] for n, name in enumerate(KINDS[1:])}
        units = {name: ops.where(active[name], UNITS[name], 0.0) for name in active}
        axis_nav = x.q.to_nav(axis)  # an axis of the body
        above = x.terrain - x.pd
        # velocity along it: over ground, or through the air
        in_air = active["sideslip"] | active["drag"]
        wind = np.array([x.wind_n, x.wind_e, 0.0])
        air = np.array([ops.saturated(c, 32.0) for c in x.v - wind])
        speed = ops.sqrt(air @ air + _EPSILON * _EPSILON)
        moving = np.array([ops.where(in_air, a, v) for a, v in zip(air, x.v, strict=True)])
        along = ops.saturated(axis_nav @ moving, 64.0)
        upright = x.q.to_nav((0.0, 0.0, 1.0))[2]
        flow = ops.saturated(along, 16.0) * upright * (1.0 / ops.maximum(above, LOWEST))
        dragged = -(p.drag * speed + p.rotor) * along
        angle = math.pi * self._angle(x, air, along, active["declination"])
        # PX4's heading: the innovation is a turn about down
        nose = x.q.matrix
        turned = ops.wrap_ht(
            u.z * (1.0 / (UNITS["heading"] * math.pi)) - ops.atan2_ht(nose[1][0], nose[0][0])
        )
        down = -x.q.observed((1.0, 0.0, 0.0), (1.0, 0.0, 0.0))[1][1]
        field = np.array([x.mn, x.me, x.md])
        body = np.array([x.mbx, x.mby, x.mbz])
        h = (
            (units["velocity"] * axis) @ x.v
            + (units["position"] * axis) @ x.p
            + units["range"] * above
            + units["heading"] * down
            + units["airspeed"] * speed
            + units["field"] * (axis_nav @ field + axis @ body)
            + (units["declination"] + units["sideslip"]) * angle
            + units["drag"] * dragged
            + units["flow"] * flow
            + units["body_velocity"] * along
            - units["gravity"] * axis_nav[2]
        )
        z = ops.where(active["heading"], (UNITS["heading"] * math.pi) * turned, u.z)
        return [Measurement(z, h, u.r, gate=5.0, sd_max=64.0, slope_max=STEEPEST)]

    def _angle(self, x: Any, air: Any, along: Any, declination: Any) -> Any:
        """Half turns: declination of the field, or sideslip."""
        forward = x.q.to_nav((1.0, 0.0, 0.0)) @ air
        across = ops.where(declination, 256.0 * x.me, along)
        ahead = ops.where(declination, 256.0 * x.mn, forward)
        return ops.atan2_ht(across, ops.clip(ahead, SLOWEST, 256.0))
