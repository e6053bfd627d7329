"""The complementary filter of Ma Long et al. (2014), improved, in Euler angles z-x'-y''.

`ma2014_cf` is the paper's own. The differences (evidence: `docs/systems/complementary.md`):

* Attitude C_bn = Rz(psi) Rx(theta) Ry(gamma), angles in half turns, wrapped by the word itself.
* Prediction by Euler rates, eq. (3) for this Euler sequence, midpoint rule.
* Levelling, eq. (4): the specific force, turned by the predicted rotation and levelled with the
  filter's own angles, must be vertical; its horizontal part over g is the residual.
* Tilt compensation and heading, eq. (5)-(7).
* Three proportional-integral channels, eq. (9)-(13). The integrals are kept in body axes, where
  they are the gyro's bias, because the Euler channels exchange their meaning at a pole.
* Near |theta| = 90 deg: the prediction is limited, passing the pole re-maps the angles
  (theta -> pi - theta, gamma + pi, psi + pi), and a roll correction turns the heading back by
  sin(theta) times itself, so that together they are a rotation about a horizontal axis.
"""

from __future__ import annotations

import math
from typing import Any

from boresight.model import ops
from boresight.model.algebra.angles import unit_angle_ht
from boresight.model.algebra.quaternion import cross, of_half_angles
from boresight.model.algebra.quaternion_filter import named_outputs, status_word
from boresight.model.attitude.table import params_of
from boresight.model.declarations import GRAVITY
from boresight.model.estimator import Estimator, State
from boresight.model.nine_axis import INPUTS, OUTPUTS

SEC_LIMIT = 64.0  #: largest 1/cos(theta); reached at |theta| = 89.1 deg.
HALF_STEP_LIMIT = 0.5  #: rad, roll step of the midpoint rule.
HEADING_STEP_LIMIT = 0.25  #: half turns, heading step of one prediction.
RESIDUAL_LIMIT = 0.0625  #: half turns, heading residual that a correction uses.
BIAS_LIMIT = 1.0 / 32.0  #: rad/s, largest gyro bias that is learnt.
BIAS_STEP_LIMIT = 2.0**-10  #: rad/s, largest change of the learnt bias in one sample.
VECTOR_LIMIT = 16.0  #: largest component of the vector whose direction is taken.
FIELD_SCALE = 0.0625  #: 1/uT; brings the field (|m| / 16) to the size of the force (m/s^2).
FIELD_UNKNOWN = -1024.0  #: uT^2, mean squared field that says: heading not aligned yet.

#: Bits of the output ``status``.
STATUS_BITS = {
    0: "aligning: no attitude yet",
    1: "heading not aligned: no magnetometer sample with a level field so far",
    2: "accelerometer not used: specific force outside its gate",
    3: "no magnetometer sample, or no level field",
    4: "magnetometer sample not used: field strength outside its gate",
    5: "gyro at or beyond its full scale",
    6: "near vertical: 1/cos(pitch) limited",
    7: "passed the vertical: angles re-mapped",
}


class Complementary(Estimator):
    """Euler-angle complementary filter with consistent kinematics."""

    name = "complementary"
    summary = "Euler-angle complementary filter (Ma Long 2014), consistent z-x'-y'' kinematics"
    inputs = INPUTS
    params = params_of(
        """
        kp_pitch_per_s 0.4 0 32 1/s
            pitch: small trusts the gyro, large the accelerometer; corner frequency kp/(2 pi) Hz
        kp_roll_per_s 0.4 0 32 1/s
            roll: as kp_pitch_per_s
        kp_heading_per_s 0.15 0 32 1/s
            heading: small trusts the gyro, large the magnetometer
        ki_pitch_per_s2 0.0003 0 1 1/s^2
            pitch: how fast the gyro's bias is learnt
        ki_roll_per_s2 0.0003 0 1 1/s^2
            roll: as ki_pitch_per_s2
        ki_heading_per_s2 0.004 0 1 1/s^2
            heading: as ki_pitch_per_s2
        declination_ht 0 -1 0.999 ht
            magnetic declination, east positive; 0 gives magnetic heading
        acc_min_sq 4 0 80000 (m/s^2)^2
            squared specific force below which the accelerometer is not used
        acc_max_sq 80000 0 80000 (m/s^2)^2
            squared specific force above which the accelerometer is not used; the default leaves
            the gate open
        mag_min_sq 9 0 4000 uT^2
            squared level field below which there is no sample
        mag_gate 0.4 0 3.9 -
            relative deviation of the squared field from its slow mean beyond which the sample
            is not used
        mag_rate_per_s 0.1 0 15 1/s
            how fast that mean follows
        gyro_max_sq 1180 0 4800 (rad/s)^2
            squared rate from which on the gyro counts as saturated: a little less than its full
            scale
        """
    )
    states = (
        State("heading_ht", -1.0, 1.0, "ht"),
        State("pitch_ht", -1.0, 1.0, "ht"),
        State("roll_ht", -1.0, 1.0, "ht"),
        *(
            State(f"bias_{axis}", -BIAS_LIMIT, BIAS_LIMIT * (1 - 2.0**-31), "rad/s")
            for axis in "xyz"
        ),
        State("sin_pitch", -1.0, 1.0, ""),
        State("cos_pitch", -1.0, 1.0, "", 1.0),
        State("sin_roll", -1.0, 1.0, ""),
        State("cos_roll", -1.0, 1.0, "", 1.0),
        State("sec_pitch", 0.0, SEC_LIMIT, "", 1.0),
        State("tan_pitch", -SEC_LIMIT, SEC_LIMIT, ""),
        State("unknown", -2.0, 0.0, "", -2.0),  # -2: pitch and roll, -1: pitch, 0: neither
        State("since_mag", -1.0, 0.999, "s"),  # below 0 behind restarts
        State("field_sq", FIELD_UNKNOWN, 2e5, "uT^2", FIELD_UNKNOWN),
    )
    outputs = OUTPUTS
    restarts = True
    start_deg = {18: 0.5, 20: 0.1, 22: 0.04, 23: 0.02}  # but for the vertical: status bit 6
    status_bits = STATUS_BITS
    urgent = 7  # Euler angles and quaternion; the status word may follow

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """One sample: see the module docstring; equation numbers are the paper's."""
        sp, cp, sr, cr = x.sin_pitch, x.cos_pitch, x.sin_roll, x.cos_roll
        force, field = (u.ax, u.ay, u.az), (u.mx, u.my, u.mz)

        # Rotation vector of the step, rad and half turns: r = (w - b) dt.
        r = tuple(
            ops.bounded(
                w * u.dt - b * u.dt, -2.0, 2.0, "at most 2 rad a sample", unless="it turns faster"
            )
            for w, b in ((u.gx, x.bias_x), (u.gy, x.bias_y), (u.gz, x.bias_z))
        )
        r_ht = tuple(w * (1.0 / math.pi) for w in r)

        d_pitch, d_roll, d_heading = self._predict(x, r, r_ht)

        # A vector of the new body frame seen in the old one, v + r x v, then levelled by the old
        # angles, eq. (5): forward is along the level y axis.
        def level(v: tuple[Any, Any, Any]) -> tuple[Any, Any, Any]:
            v = tuple(a + c for a, c in zip(v, cross(r, v), strict=True))
            down = cr * v[2] - sr * v[0]
            return cr * v[0] + sr * v[2], cp * v[1] - sp * down, down

        # Start: roll from the first sample, pitch from the second, heading from the first field
        # (eq. 2 of the levelling; one arc tangent serves all three).
        restart = u.dt < 0.0
        leveling_roll = restart | (x.unknown < -1.5)
        leveling = restart | (x.unknown < 0.0)
        force_x, force_y, force_z = level(force)
        field_x, field_y, _ = level(field)
        opposite = ops.saturated(
            ops.where(leveling, ops.where(leveling_roll, -u.ax, u.ay), FIELD_SCALE * field_x),
            VECTOR_LIMIT,
        )
        adjacent = ops.saturated(
            ops.where(leveling, ops.where(leveling_roll, u.az, force_z), FIELD_SCALE * field_y),
            VECTOR_LIMIT,
        )
        reference = ops.named(
            "reference", ops.wrap_ht(ops.where(leveling, 0.0, x.heading_ht + p.declination_ht))
        )
        level_sq = opposite * opposite + adjacent * adjacent
        inverse = ops.rsqrt(level_sq)
        angle = unit_angle_ht(opposite, adjacent, inverse)
        # Residual of the heading before the step, psi - psi_m, eq. (7); while levelling: -angle.
        residual = ops.named("residual", ops.wrap_ht(reference - angle))

        # Which measurements count. field_sq is negative as long as the heading is not known.
        force_sq = force[0] * force[0] + force[1] * force[1] + force[2] * force[2]
        acc_bad = (force_sq - p.acc_min_sq) * (p.acc_max_sq - force_sq) < 0.0
        field_sq = field[0] * field[0] + field[1] * field[1] + field[2] * field[2]
        no_field = level_sq < FIELD_SCALE * FIELD_SCALE * p.mag_min_sq
        mag_missing = leveling | no_field
        since_mag = ops.saturated(x.since_mag + u.dt, 1.0)
        deviation = field_sq - x.field_sq
        mag_odd = ops.absolute(deviation) > p.mag_gate * x.field_sq
        mag_unused = mag_missing | mag_odd
        first_field = ~mag_missing & (x.field_sq < 0.0)

        # Proportional corrections, eq. (13).
        dt_g = ops.where(leveling | acc_bad, 0.0, u.dt * (1.0 / GRAVITY))
        # Residual of levelling times dt, in g s: g times the small angle, over g.
        tilt_pitch = ops.saturated(dt_g * -force_y, 0.5)
        tilt_roll = ops.saturated(dt_g * force_x, 0.5)
        c_pitch = p.kp_pitch_per_s * (1.0 / math.pi) * tilt_pitch
        c_roll = ops.saturated(p.kp_roll_per_s * (1.0 / math.pi) * tilt_roll, 0.25)
        c_roll = ops.saturated(c_roll * x.sec_pitch, 0.25)
        heading_error = ops.saturated(ops.where(mag_unused, 0.0, residual), RESIDUAL_LIMIT)

        pitch = ops.wrap_ht(x.pitch_ht + d_pitch - c_pitch)
        passed = ops.absolute(pitch) > 0.5
        half_turn = ops.bounded(ops.where(passed, -1.0, 0.0), -1.0, 0.0, "half a turn")
        pitch = ops.wrap_ht(half_turn + ops.flip(passed, pitch))
        pitch = ops.wrap_ht(ops.where(leveling, ops.where(leveling_roll, 0.0, -residual), pitch))
        roll = ops.wrap_ht(x.roll_ht + d_roll - c_roll + half_turn)
        roll = ops.wrap_ht(ops.where(leveling_roll, -residual, roll))
        heading = ops.named(
            "heading_predicted", ops.wrap_ht(x.heading_ht + d_heading + sp * c_roll + half_turn)
        )
        heading = ops.wrap_ht(
            heading
            - ops.where(
                first_field,
                residual,
                ops.saturated(p.kp_heading_per_s * since_mag, 1.0) * heading_error,
            )
        )

        # Integral, eq. (13), as the gyro's bias in body axes.
        i_pitch = ops.saturated(p.ki_pitch_per_s2 * tilt_pitch, BIAS_STEP_LIMIT)
        i_roll = ops.saturated(p.ki_roll_per_s2 * tilt_roll, BIAS_STEP_LIMIT)
        i_heading = ops.saturated(
            ops.saturated(p.ki_heading_per_s2 * (since_mag * math.pi), BIAS_LIMIT) * heading_error,
            BIAS_STEP_LIMIT,
        )
        across = cp * i_heading - sp * i_roll
        bias = (
            x.bias_x + cr * i_pitch - sr * across,
            x.bias_y + cp * i_roll + sp * i_heading,
            x.bias_z + sr * i_pitch + cr * across,
        )

        # Attitude as a quaternion, q = qz(psi) qx(theta) qy(gamma), and trigonometry for the next
        # sample from the same half angles.
        (sh, ch), (sp2, cp2), (sr2, cr2) = (
            ops.sincos_ht(0.5 * angle) for angle in (heading, pitch, roll)
        )
        q = of_half_angles((sp2, cp2), (sr2, cr2), (sh, ch))
        cos_pitch = ops.bounded(1.0 - 2.0 * sp2 * sp2, -1.0, 1.0, "cosine")
        sin_pitch = ops.bounded(2.0 * sp2 * cp2, -1.0, 1.0, "sine")
        near_vertical = cos_pitch < 1.0 / SEC_LIMIT
        limited = ops.bounded(
            ops.where(near_vertical, 1.0 / SEC_LIMIT, cos_pitch), 1.0 / SEC_LIMIT, 1.0, "cosine"
        )
        sec_pitch = ops.bounded(1.0 / limited, 0.0, SEC_LIMIT, "reciprocal")

        follow = x.field_sq + ops.saturated(p.mag_rate_per_s * since_mag, 1.0) * deviation
        field_mean = ops.where(mag_missing, x.field_sq, ops.where(first_field, field_sq, follow))
        field_mean = ops.where(leveling, FIELD_UNKNOWN, field_mean)
        rate_sq = u.gx * u.gx + u.gy * u.gy + u.gz * u.gz
        field_odd = ~(mag_missing | (x.field_sq < 0.0)) & mag_odd
        flags = (
            leveling,
            field_mean < 0.0,
            acc_bad,
            mag_missing & ~leveling,
            field_odd,
            rate_sq >= p.gyro_max_sq,
            near_vertical,
            passed,
        )
        status = status_word(dict(enumerate(flags)))

        after = {
            "heading_ht": heading,
            "pitch_ht": pitch,
            "roll_ht": roll,
            **{
                f"bias_{axis}": ops.saturated(b, BIAS_LIMIT)
                for axis, b in zip("xyz", bias, strict=True)
            },
            "sin_pitch": sin_pitch,
            "cos_pitch": cos_pitch,
            "sin_roll": ops.bounded(2.0 * sr2 * cr2, -1.0, 1.0, "sine"),
            "cos_roll": ops.bounded(1.0 - 2.0 * sr2 * sr2, -1.0, 1.0, "cosine"),
            "sec_pitch": sec_pitch,
            "tan_pitch": ops.bounded(sin_pitch * sec_pitch, -SEC_LIMIT, SEC_LIMIT, "tangent"),
            "unknown": ops.where(
                acc_bad, ops.where(restart, -2.0, x.unknown), ops.where(leveling_roll, -1.0, 0.0)
            ),
            "since_mag": ops.where(mag_missing, since_mag, 0.0),
            "field_sq": field_mean,
        }
        out = named_outputs((pitch, roll, heading), q, status)
        return after, out

    def _predict(self, x: Any, r: tuple[Any, ...], r_ht: tuple[Any, ...]) -> tuple[Any, Any, Any]:
        """Increments of pitch, roll and heading [half turns] by the midpoint rule.

        Consistent eq. (3) for Rz Rx Ry, with the rate turned by roll, u = cg wx + sg wz,
        a = cg wz - sg wx::

            theta' = u      psi' = a / cos(theta)      gamma' = wy - sin(theta) psi'

        The trigonometry at the middle of the step comes from that at its start by a rotation of
        second order, sin(y + h) = sin y + h (cos y - h/2 sin y), and
        sec(y + h) = sec y (1 + x + x^2 + h^2/2), x = h tan y.
        """
        sp, cp, sr, cr = x.sin_pitch, x.cos_pitch, x.sin_roll, x.cos_roll
        half_pitch = 0.5 * (cr * r[0] + sr * r[2])
        half_roll = ops.saturated(
            0.5 * (r[1] - x.tan_pitch * (cr * r[2] - sr * r[0])), HALF_STEP_LIMIT
        )
        sp = self._turn(sp, cp, half_pitch)
        sr, cr = self._turn(sr, cr, half_roll), self._turn(cr, -sr, half_roll)
        grow = ops.saturated(half_pitch * x.tan_pitch, 8.0)
        sec = ops.saturated(
            x.sec_pitch * (1.0 + grow + grow * grow + 0.5 * half_pitch * half_pitch), SEC_LIMIT
        )
        d_heading = ops.saturated(sec * (cr * r_ht[2] - sr * r_ht[0]), HEADING_STEP_LIMIT)
        return cr * r_ht[0] + sr * r_ht[2], r_ht[1] - sp * d_heading, d_heading

    @staticmethod
    def _turn(sine: Any, cosine: Any, angle: Any) -> Any:
        """sin(y + h) = sin y + h (cos y - h/2 sin y)."""
        inner = ops.bounded(cosine - 0.5 * (angle * sine), -2.0, 2.0, "near a cosine")
        turned = sine + angle * inner
        return ops.bounded(turned, -2.0, 2.0, "near a sine", unless="a sample turns by radians")
