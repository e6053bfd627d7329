"""The classical attitude EKF: quaternion and gyro bias, all six measurements, seven states.

* State: q (body to navigation, additive errors e) and the gyro's bias b; covariance 7 x 7.
* Prediction: q <- q dq, dq the three-term series of the turn (w - b) dt;
  e <- R(dq) e - (dt/2) Xi(q) e_b; process noise of the gyro (white) and of its bias (random walk).
* Specific force over g measures up; the field over its reference strength measures (0, h, d),
  the reference direction. Six scalar measurements; those of the field only when there is a sample.

**Basis.** P is kept in navigation axes, P~ = R(q)^T P R(q) with R(q) p = p q: component 0 is the
error of the norm s, 1..3 half the small rotation about east, north, up (e, n, u), and 4..6 the bias
(body). It is the same filter, and there the prediction leaves the attitude's block alone but for
the bias, and a measurement, turned to navigation axes too, touches one component or two; with
y = C f / g, y' = C m / F::

    y_E / 2         = -n            y'_E / 2                    = h u - d n
    y_N / 2         =  e            (d y'_N - h y'_U) / 2       = e
    (y_U - 1) / 2   =  s            (h y'_N + d y'_U - 1) / 2   = s

Two pairs measure the same component; they are combined first, by their variances (exactly what two
scalar updates in turn give), so four rank-one updates use all six. After the correction q <- c q (c
normalised) the basis turns, P~ <- R(c)^T P~ R(c), which is not on the way to the outputs.

**Robustness** (not textbook): the accelerometer's noise grows with | |f|^2/g^2 - 1 |; the field's
strength is gated against its slowly followed reference.

**Scale.** Covariances are held times ``scale`` squared; the bias is counted in 1/16 rad/s so that
its variance is of the attitude's size.
"""

from __future__ import annotations

import dataclasses
from typing import Any

from boresight.model import ops
from boresight.model.algebra import covariance
from boresight.model.algebra import quaternion_filter as parts
from boresight.model.algebra.quaternion import NOT_UNIT, dot, matrix, multiply, right_matrix, turn
from boresight.model.attitude.table import params_of
from boresight.model.declarations import GRAVITY
from boresight.model.estimator import Estimator, State
from boresight.model.nine_axis import INPUTS, OUTPUTS

BIAS_UNIT = 16.0  #: s; the bias state of the covariance is bias times this.
BIAS_LIMIT = 0.125  #: rad/s, largest bias that is learnt.
NOISE_LIMIT = 4.0  #: largest measurement noise times scale / 2.
UNEVEN_LIMIT = 0.5  #: largest | |f|^2/g^2 - 1 | that the noise grows with.
STEP_LIMIT = 0.125  #: largest root of a process noise density, times scale.
BIAS_P0 = 0.2  #: variance of the bias before the first alignment, scaled.
ALIGNED = 1.0 / 16.0  #: squared level over vertical force below which the tilt is aligned.
FOUND = 2.0**-11  #: squared east field over north field below which the heading is found.
#: Squared level force, over g, and squared east field from which on an alignment says something:
#: without a force, or with less than 1/16 of the field level, nothing is aligned.
LEAST_FORCE, LEAST_FIELD = 2.0**-6, FOUND / 16.0

#: Bits of the output ``status``.
STATUS_BITS = {
    0: "aligning: no attitude yet",
    1: "heading not aligned: no magnetometer sample so far",
    3: "no magnetometer sample",
    4: "magnetometer sample not used: field strength outside its gate",
}


class EkfBias(Estimator):
    """Seven-state EKF: quaternion and gyro bias."""

    name = "ekf_bias"
    summary = "EKF of quaternion and gyro bias, 7 states, six scalar measurements"
    inputs = INPUTS
    params = (
        parts.SCALE,
        dataclasses.replace(parts.P0, default=0.05),
        *params_of(
            """
            bias_p0_sd 0.0035 1e-05 0.25 rad/s
                initial standard deviation of the gyro's bias; times 16 times scale it counts as at
                most 0.5
            gyro_density 0.0035 1e-05 1 rad/sqrt(s)
                gyro white noise: small trusts the gyro, large the measurements
            bias_density 0.0001 1e-08 0.1 rad/s/sqrt(s)
                random walk of the gyro's bias: small keeps it, large lets it wander
            acc_sd 0.35 0.002 8 g
                noise of a specific force sample at rest: small trusts it, large the gyro
            acc_sd_per_g 0.4 0 8 -
                growth of that noise with | |f|^2/g^2 - 1 |, which counts as at most 0.5
            mag_sd 0.4 0.002 8 -
                noise of a field sample, relative to the field: small trusts it, large the gyro
            mag_gate 0.2 0.01 3.9 -
                relative deviation of the squared field from its reference beyond which a sample is
                not used
            mag_rate_per_s 0.15 0 15 1/s
                how fast the reference of the field (strength and dip) follows
            mag_min_sq 4 0.01 4000 uT^2
                squared field below which there is no sample
            """
        ),
    )
    states = (
        *parts.attitude_states(),
        *(
            State(f"bias_{axis}", -BIAS_LIMIT, BIAS_LIMIT * (1 - 2.0**-31), "rad/s")
            for axis in "xyz"
        ),
        State("unaligned", -1.0, 0.0, "", -1.0),  # -1: yes, 0: no
        State("heading_unknown", -1.0, 0.0, "", -1.0),  # -1/2: but the reference field is learnt
        State("field_h", 0.0, 127.9, "uT", 20.0),
        State("field_v", -127.9, 127.9, "uT", -40.0),
        *covariance.covariance_states(7, lambda i: parts.ALIGN_P if i < 4 else BIAS_P0),
    )
    outputs = OUTPUTS
    restarts = True
    least_word = 20
    start_deg = {20: 3.0, 21: 1.5, 24: 0.2, 25: 0.15, 26: 0.08, 27: 0.06, 28: 0.02}
    status_bits = STATUS_BITS
    urgent = 7

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        aligning = u.dt + x.unaligned < 0.0
        seeking = u.dt + x.heading_unknown < 0.0

        # Prediction.
        q, _ = parts.predicted_attitude(
            x,
            [
                0.5 * (w * u.dt) - 0.5 * (b * u.dt)
                for w, b in ((u.gx, x.bias_x), (u.gy, x.bias_y), (u.gz, x.bias_z))
            ],
        )
        c_nb = matrix(q)
        before = covariance.covariance_of(x, 7)
        full = parts.is_full(before)
        bias_full = before[4][4] + before[5][5] + before[6][6] >= parts.TRACE_LIMIT
        a = self._predicted(before, c_nb, u, p, full, bias_full)

        # Vectors in navigation axes, over g and over the reference field.
        force = [v * (1.0 / GRAVITY) for v in (u.ax, u.ay, u.az)]
        y = turn(c_nb, force)
        field = turn(c_nb, (u.mx, u.my, u.mz))
        inverse = ops.rsqrt(x.field_h * x.field_h + x.field_v * x.field_v)
        h, d = (ops.bounded(v * inverse, -1.0, 1.0, "direction") for v in (x.field_h, x.field_v))
        m = [ops.saturated(v * inverse, 16.0) for v in field]

        # What counts.
        field_sq = dot((u.mx, u.my, u.mz), (u.mx, u.my, u.mz))
        missing = field_sq < p.mag_min_sq
        odd = ops.absolute(dot(m, m) - 1.0) > p.mag_gate
        rejected = missing | (odd & ~seeking)
        unused = rejected | aligning
        fresh = aligning | (seeking & ~missing)  # nothing but this sample counts
        tilt_only = unused | seeking  # tilt from the accelerometer alone

        # Noise, scaled standard deviations over 2.
        uneven = ops.saturated(ops.absolute(dot(force, force) - 1.0), UNEVEN_LIMIT)
        acc_sd = ops.saturated(p.acc_sd + p.acc_sd_per_g * uneven, 16.0)
        acc_r, mag_r = (
            ops.bounded(root * root, 0.0, 16.0, "variance")
            for root in (
                ops.where(fresh, parts.ALIGN_NOISE, ops.saturated(0.5 * sd * p.scale, NOISE_LIMIT))
                for sd in (acc_sd, p.mag_sd)
            )
        )
        root = ops.rsqrt(acc_r + mag_r)
        share = ops.bounded(mag_r * root, 0.0, 4.0, "root of a variance") * root
        # Of the accelerometer, in what both measure.
        share = ops.where(tilt_only, 1.0, ops.saturated(share, 1.0))
        both_r = acc_r * share

        def combined(acc: Any, mag: Any) -> Any:
            mag = ops.bounded(mag, -32.0, 32.0, "field")
            return mag + share * ops.bounded(acc - mag, -64.0, 64.0, "difference")

        measured = [
            combined(0.5 * y[2] - 0.5, 0.5 * (h * m[1] + d * m[2]) - 0.5),
            combined(0.5 * y[1], 0.5 * (d * m[1] - h * m[2])),
            -0.5 * y[0],
            0.5 * m[0],
        ]

        # Scalar updates: norm, east, north, then the field's east component, along h u - d n.
        gains: list[list[Any]] = []
        moves: list[Any] = []
        for k, variance in ((0, both_r), (1, both_r), (2, acc_r)):
            column = covariance.updated_column(a, k, gains)
            s = a[k][k] + variance - parts.sum_of(g[k] * g[k] for g in gains)
            parts.update(gains, moves, column, s, measured[k] - parts.moved(gains, moves, k))
        # Without a field a heading variance at its limit is cut by an update without innovation.
        heading = {3: h, 2: -d}
        parts.update_along(a, gains, moves, heading, mag_r, measured[3], ~unused, ~(unused & ~full))

        # Correction, normalisation, angles.
        turned = parts.correction_of(
            [(1.0 if k == 0 else 0.0) + parts.moved(gains, moves, k) for k in range(4)]
        )
        raw = multiply(turned, q)
        q_new, shrink = parts.normalised(raw)

        bias = [
            ops.saturated(
                ops.where(aligning, 0.0, b + (1.0 / BIAS_UNIT) * parts.moved(gains, moves, k, 8.0)),
                BIAS_LIMIT,
            )
            for k, b in ((4, x.bias_x), (5, x.bias_y), (6, x.bias_z))
        ]
        # Saturated near zero, a difference keeps bits that a word for the whole squares lacks.
        level = ALIGNED * y[2] - (y[0] * y[0] + y[1] * y[1] + LEAST_FORCE)
        tilted = ops.saturated(level, 1.0) < 0.0
        unaligned = aligning & (tilted | (u.dt < 0.0))
        learnt = x.heading_unknown > -0.75
        north = FOUND * m[1] - (m[0] * m[0] + LEAST_FIELD)
        not_north = ops.saturated(north, 2.0**-3) < 0.0
        heading_found = seeking & learnt & ~(unused | not_north)
        unfinished = unaligned | (seeking & ~heading_found)
        bias_p0 = ops.saturated(BIAS_UNIT * p.bias_p0_sd * p.scale, parts.P0_LIMIT)
        attitude = ops.where(unfinished, parts.ALIGN_P, parts.initial_variance(p))
        start = [*[attitude] * 4, *[bias_p0 * bias_p0] * 3]  # of an alignment, or after it
        after = self._turned(
            covariance.downdated(a, gains, aligning), turned, (full, bias_full), fresh, start
        )

        # The reference follows strength and dip, which need no heading.
        level_sq = ops.saturated(field[0] * field[0] + field[1] * field[1], 2.0**16)
        level = ops.saturated(level_sq * ops.rsqrt(level_sq), 256.0)
        rate = ops.where(seeking, 1.0, ops.saturated(p.mag_rate_per_s * u.dt, 1.0))
        rate = ops.where(rejected, 0.0, rate)
        field_h = x.field_h + rate * (level - x.field_h)
        field_v = x.field_v + rate * (field[2] - x.field_v)

        status = parts.status_word({0: aligning, 1: seeking, 3: missing, 4: rejected & ~missing})
        return (
            {
                **parts.restarted(q_new, u),
                **{f"bias_{axis}": b for axis, b in zip("xyz", bias, strict=True)},
                "unaligned": ops.where(unaligned, -1.0, 0.0),
                "heading_unknown": ops.where(
                    seeking & ~heading_found,
                    ops.where(aligning, -1.0, ops.where(missing, x.heading_unknown, -0.5)),
                    0.0,
                ),
                "field_h": ops.saturated(field_h, 128.0),
                "field_v": ops.saturated(field_v, 128.0),
                **{name: after[i][j] for name, i, j in covariance.element_names(7)},
            },
            parts.attitude_outputs(raw, q_new, shrink, status),
        )

    @staticmethod
    def _predicted(
        p0: covariance.Symmetric, c_nb: Any, u: Any, p: Any, full: Any, bias_full: Any
    ) -> covariance.Symmetric:
        """Phi P Phi^T + Q with Phi = [1, -G; 0, 1], G = dt/2 C, on (rotation, bias)."""
        step = ops.saturated(ops.where(full, 0.0, (0.5 / BIAS_UNIT) * u.dt), 2.0**-7)
        g = [
            [
                ops.bounded(step * c, -(2.0**-7), 2.0**-7, "half a step", unless=NOT_UNIT)
                for c in row
            ]
            for row in c_nb
        ]
        rotation, bias = range(1, 4), range(4, 7)

        def part(i: int, j: int, row: Any, meaning: str) -> Any:
            """P_ij less a row of G times a row of P."""
            value = p0[i][j] - dot(*row)
            return ops.bounded(value, -covariance.BELOW_ONE, covariance.BELOW_ONE, meaning)

        # U = A - B G^T,  B' = B - G D,  A' = U - G B'^T
        a = {
            (i, j): part(i, j, ([p0[i][k] for k in bias], g[j - 1]), "part of P")
            for i in rotation
            for j in rotation
        }
        b = {
            (i, j): part(i, j, (g[i - 1], [p0[k][j] for k in bias]), "covariance")
            for i in rotation
            for j in bias
        }
        root = ops.saturated(0.5 * p.gyro_density * p.scale, STEP_LIMIT)
        noise = root * ops.maximum(u.dt, 0.0)
        walk = ops.saturated(BIAS_UNIT * p.bias_density * p.scale, STEP_LIMIT)
        walk_noise = walk * ops.maximum(u.dt, 0.0)

        def element(i: int, j: int) -> Any:
            if i == 0:
                if j not in rotation:
                    return p0[0][j]
                return part(0, j, (g[j - 1], [p0[0][k] for k in bias]), "covariance")
            if j in rotation:
                value = a[i, j] - dot(g[i - 1], [b[j, k] for k in bias])
                if i == j:
                    value = value + ops.where(full, 0.0, root * noise)
            elif i in rotation:
                return b[i, j]
            elif i == j:
                value = p0[i][j] + ops.where(bias_full, 0.0, walk * walk_noise)
            else:
                return p0[i][j]
            return covariance.bounded_element(value, i, j)

        return covariance.symmetric(7, element)

    @staticmethod
    def _turned(
        a: covariance.Symmetric,
        correction: list[Any],
        full: tuple[Any, Any],
        fresh: Any,
        first: list[Any],
    ) -> covariance.Symmetric:
        """The attitude's part in the basis of the corrected quaternion; ``first`` after aligning.

        ``full``: whether the traces of attitude and bias are at their limits.
        """
        c, _ = parts.normalised(correction)

        def element(i: int, j: int, value: Any) -> Any:
            grown = parts.above_rounding(value, full[i >= 4]) if i == j else value
            return covariance.bounded_element(
                ops.where(fresh, first[i] if i == j else 0.0, grown), i, j
            )

        return covariance.partly_turned(right_matrix(c), a, element)
