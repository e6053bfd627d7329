"""The complementary filter of Ma Long et al. (2014) as printed: eq. (3) to (7), (13) and Table 4.

Angles in half turns, C = Rz(heading) Rx(pitch) Ry(roll). One sample:

* (4): pitch and roll of the specific force. (5) to (7): heading of the field, levelled with them.
* (3): the gyro's rates as Euler rates, integrated by the midpoint rule.
* (13): x = x' - Kp e - I, I += Ki e, with e = x' - x_m, in three separate channels.

The printed eq. (3) belongs to another Euler sequence than (4) to (7); `Ma2014Cf` takes the rates of
theirs, and the printed ones with ``as_printed``. The paper prints no unit of time: gains are those
of a sample. The filter of the paper's algorithm that also works near the vertical and on a moving
vehicle is `complementary`.
"""

from __future__ import annotations

import math
from typing import Any

from boresight.model import ops
from boresight.model.algebra.angles import unit_angle_ht
from boresight.model.algebra.quaternion import of_half_angles
from boresight.model.algebra.quaternion_filter import named_outputs, status_word
from boresight.model.estimator import Estimator, Param, State
from boresight.model.nine_axis import INPUTS, OUTPUTS

#: Bits of the output ``status``.
STATUS_BITS = {
    0: "aligning: no attitude yet",
    3: "no magnetometer sample: the heading is that of the gyro",
}
_CHANNELS = ("pitch", "roll", "heading")
_KP = (0.1414, 0.1414, 0.1)  #: Table 4.
_KI = (5e-7, 5e-5, 5e-7)
_INTEGRAL = 2.0**-6  #: half turns, largest integral.
_LEAST_COSINE = 2.0**-5  #: smallest magnitude of the cosine that eq. (3) divides by.
_LEAST_FORCE_SQ = 0.01  #: (m/s^2)^2, least squared force whose direction is right.


class Ma2014Cf(Estimator):
    """Complementary filter of Ma Long et al. (2014) with the gains of its Table 4.

    It begins with the angles of the first sample with a field. A sample without one leaves the
    heading to the gyro. With Kp = 0 and Ki = 0 the angles are the gyro's, with Kp = 1 and Ki = 0
    those of the accelerometer and the magnetometer.
    """

    name = "ma2014_cf"
    summary = "complementary filter of Ma Long 2014, equations and gains as printed"
    inputs = INPUTS
    params = (
        *(
            Param(f"kp_{n}", k, 0.0, 1.0, "", f"Kp of a sample, {n}: small trusts the gyro")
            for n, k in zip(_CHANNELS, _KP, strict=True)
        ),
        *(
            Param(f"ki_{n}", k, 0.0, 2.0**-10, "", f"Ki of a sample, {n}")
            for n, k in zip(_CHANNELS, _KI, strict=True)
        ),
        Param("field_east", 0.0, -100.0, 100.0, "uT", "east part of the field at the site"),
        Param("field_north", 28.0, -100.0, 100.0, "uT", "north part of the field at the site"),
    )
    states = (
        *(State(n, -1.0, 1.0, "ht") for n in _CHANNELS),
        # Half turns a sample; with the unit ht the last place would be 2^-31 of them.
        *(State(f"i_{n}", -_INTEGRAL, _INTEGRAL) for n in _CHANNELS),
        State("unknown", -1.0, 0.0, "", -1.0),  # -1: no attitude yet, 0: one
    )
    outputs = OUTPUTS
    restarts = True
    status_bits = STATUS_BITS
    urgent = 3  # the angles; quaternion and status word follow

    def __init__(self, as_printed: bool = False) -> None:
        """Take the Euler rates of z-x'-y'', or eq. (3) ``as_printed``, those of z-y'-x''.

        Then the heading is wrong by 2 to 4 deg; the name is ``ma2014_cf_as_printed``.
        """
        self.as_printed = as_printed
        if as_printed:
            self.name = "ma2014_cf_as_printed"

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        # (4): up in the body's axes gives sine and cosine of the pitch and of the roll.
        force_sq = u.ax * u.ax + u.ay * u.ay + u.az * u.az
        inverse = ops.rsqrt(ops.maximum(force_sq, _LEAST_FORCE_SQ))
        right, st, up = (ops.saturated(a * inverse, 1.0) for a in (u.ax, u.ay, u.az))
        level_sq = right * right + up * up
        secant = ops.rsqrt(level_sq)
        ct = ops.saturated(level_sq * secant, 1.0)
        sg, cg = ops.saturated(-right * secant, 1.0), ops.saturated(up * secant, 1.0)

        # (5), (7)
        missing = u.mx * u.mx + u.my * u.my + u.mz * u.mz < 1.0
        hx = cg * u.mx + sg * u.mz
        hy = st * (sg * u.mx - cg * u.mz) + ct * u.my
        east, north = p.field_east, p.field_north
        measured = (
            unit_angle_ht(st, ct),
            unit_angle_ht(sg, cg),
            ops.atan2_ht(hx * north - hy * east, hx * east + hy * north),
        )

        # (3), at the middle of the step.
        starting = (u.dt < 0.0) | (x.unknown < 0.0)
        before = (x.pitch, x.roll, x.heading)
        turn = [w * (u.dt * (1.0 / math.pi)) for w in (u.gx, u.gy, u.gz)]
        d_pitch, d_roll, _ = self._increments(x.pitch, x.roll, turn)
        increments = self._increments(
            ops.wrap_ht(x.pitch + 0.5 * d_pitch), ops.wrap_ht(x.roll + 0.5 * d_roll), turn
        )

        after = {"unknown": ops.where(starting & missing, -1.0, 0.0)}
        for n, angle, d, seen in zip(_CHANNELS, before, increments, measured, strict=True):
            ahead = ops.wrap_ht(angle + d)
            # (13)
            e = ops.wrap_ht(ahead - seen)
            if n == "heading":
                e = ops.where(missing, 0.0, e)
            i = ops.saturated(getattr(x, f"i_{n}") + getattr(p, f"ki_{n}") * e, _INTEGRAL)
            after[f"i_{n}"] = ops.where(starting, 0.0, i)
            filtered = ahead - getattr(p, f"kp_{n}") * e - i
            after[n] = ops.wrap_ht(ops.where(starting, seen, filtered))
        out = tuple(after[n] for n in _CHANNELS)
        q = of_half_angles(*(ops.sincos_ht(0.5 * angle) for angle in out))
        return after, named_outputs(out, q, status_word({0: after["unknown"] < 0.0, 3: missing}))

    def _increments(self, theta: Any, gamma: Any, turn: Any) -> tuple[Any, Any, Any]:
        """Pitch, roll and heading of a small turn about the body's axes, eq. (3)."""
        (st, ct), (sg, cg), (tx, ty, tz) = ops.sincos_ht(theta), ops.sincos_ht(gamma), turn
        if self.as_printed:
            across, cosine = st * ty + ct * tz, cg
        else:
            across, cosine = cg * tz - sg * tx, ct
        size = ops.bounded(
            ops.maximum(ops.absolute(cosine), _LEAST_COSINE), _LEAST_COSINE, 1.0, "cosine"
        )
        heading = ops.saturated(ops.flip(cosine < 0.0, across * (1.0 / size)), 1.0)
        if self.as_printed:
            return tx + sg * heading, ct * ty - st * tz, heading
        return cg * tx + sg * tz, ty - st * heading, heading
