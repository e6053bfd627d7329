"""Four-state extended Kalman filter of Ma Long et al. (2014), option (b): a measured quaternion.

The paper only cites its filter (Marins 2001, Sabatini 2006); this is the reconstruction. The state
is the quaternion q, body to navigation, with additive errors and a full 4 x 4 covariance.

* Prediction: q <- q dq, dq the three-term series of the turn w dt; P <- F P F^T + Q with F = R(dq),
  the matrix of that product, and Q = (dt/2)^2 Xi Qg Xi^T, Qg the gyro's variances.
* Measurement: up from the specific force and east from up and the field of the same sample
  (levelling and tilt-compensated heading, as a rotation matrix) are the measured quaternion q_m;
  H = I, R = Xi diag(s^2/4) Xi^T, s the static angle noise about the body's axes. Because Xi has
  orthonormal columns these are three scalar updates along them, with the innovations
  Xi^T (q_m - q) = vec(q* q_m). Without a field of that sample there is no measurement.

**Basis.** P is kept as P~ = L(q)^T P L(q), L(q) = [q, Xi(q)]: component 0 is the error of the norm,
1..3 are half the small rotation about the body's axes. It is the same filter: F becomes
diag(1, C(dq)^T), Q and R diagonal, H unit vectors; and after the correction q <- q c (c normalised)
the basis turns, P~ <- L(c)^T P~ L(c), which is not on the way to the outputs.
"""

from __future__ import annotations

from typing import Any

from boresight.model import ops
from boresight.model.algebra import covariance
from boresight.model.algebra import quaternion_filter as parts
from boresight.model.algebra.quaternion import cross, dot, left_matrix, matrix, multiply
from boresight.model.attitude.table import params_of
from boresight.model.estimator import Estimator, Param, State
from boresight.model.nine_axis import INPUTS, OUTPUTS

NOISE_LIMIT = 4.0  #: largest angle noise times scale / 2.
LEAST_TRACE = 0.25  #: 1 + trace of the error rotation below which its root is held: 151 deg.
ALIGNED_TRACE = 3.9  #: 1 + trace of the error rotation from which on it counts as small: 18 deg.

_GYRO_SD = "standard deviation of a gyro sample (root of Qg): small trusts the gyro, "
_GYRO_SD += "large the measurements"
_ANGLE_SD = "static noise of the measured attitude about body {} (s): small trusts the "
_ANGLE_SD += "measurement, large the gyro"

#: Bits of the output ``status``.
STATUS_BITS = {
    0: "aligning: no attitude yet",
    2: "no measurement: specific force outside its gate",
    3: "no measurement: no magnetometer sample, or no horizontal field",
}


class EkfQuaternion(Estimator):
    """Four-state EKF with a measured quaternion, H = I."""

    name = "ekf_quaternion"
    summary = "quaternion EKF, 4 states, measured quaternion with H = I (as in Ma Long 2014)"
    inputs = INPUTS
    params = (
        parts.SCALE,
        parts.P0,
        *(Param(f"gyro_sd_{axis}", 0.1, 0.0, 2.0, "rad/s", _GYRO_SD) for axis in "xyz"),
        *(
            Param(f"angle_sd_{axis}", 0.5, 2e-4, 4.0, "rad", _ANGLE_SD.format(axis))
            for axis in "xyz"
        ),
        *params_of("""
            acc_min_sq 1.5 1.5 1.6e4 (m/s^2)^2
                squared specific force below which it is not used
            acc_max_sq 1.6e4 1 1.6e4 (m/s^2)^2
                squared specific force above which it is not used; the default leaves the gate open
                up to 12.9 g
            mag_min_sq 4 0.01 4e3 uT^2
                squared horizontal field below which there is no measurement
            """),
    )
    states = (
        *parts.attitude_states(),
        State("unaligned", -1.0, 0.0, "", -1.0),  # -1: yes, 0: no
        *covariance.covariance_states(4, lambda i: parts.ALIGN_P),
    )
    outputs = OUTPUTS
    restarts = True
    start_deg = {18: 0.08, 19: 0.04, 20: 0.02}  # once aligned: float64 takes rows, too
    status_bits = STATUS_BITS
    urgent = 7

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        aligning = u.dt + x.unaligned < 0.0
        q, dq = parts.predicted_attitude(x, [0.5 * w * u.dt for w in (u.gx, u.gy, u.gz)])
        before = covariance.covariance_of(x, 4)
        full = parts.is_full(before)
        a = _predicted(before, dq, u, p, full)

        # Measured navigation axes in the body: up, east, north.
        force, field = (u.ax, u.ay, u.az), (u.mx, u.my, u.mz)
        force_sq = ops.saturated(dot(force, force), 2.0**14)
        acc_bad = (force_sq - p.acc_min_sq) * (p.acc_max_sq - force_sq) < 0.0
        up = _unit(force, force_sq)
        across = cross(field, up)
        across_sq = ops.saturated(dot(across, across), 2.0**16)
        east = _unit(across, across_sq)
        mag_bad = across_sq < p.mag_min_sq
        bad = acc_bad | mag_bad

        # Error quaternion of the rotation C = sum of predicted axis times measured axis: half of
        # (C - C^T) is sin(angle) axis, and 1 + trace is 4 cos^2(angle / 2). Beyond 151 deg the
        # root is held, so that the innovation passes through zero at 180 deg, where its sign turns.
        axes = list(zip((east, cross(up, east), up), matrix(q), strict=True))
        vee = [
            ops.saturated(ops.where(bad, 0.0, 0.5 * total), 1.0)
            for total in (parts.sum_of(cross(m, r)[k] for m, r in axes) for k in range(3))
        ]
        trace = ops.saturated(1.0 + parts.sum_of(dot(m, r) for m, r in axes), 8.0)
        four_cos_sq = ops.bounded(ops.maximum(trace, LEAST_TRACE), LEAST_TRACE, 8.0, "held")
        inverse = ops.rsqrt(four_cos_sq)
        e = [ops.saturated(v * inverse, 2.0) for v in vee]  # sine of half the angle
        e_w = ops.saturated(0.5 * four_cos_sq * inverse, 2.0)  # its cosine

        # Three scalar updates along the unit vectors 1..3.
        gains: list[list[Any]] = []
        moves: list[Any] = []
        for k, sd in ((1, p.angle_sd_x), (2, p.angle_sd_y), (3, p.angle_sd_z)):
            noise = ops.saturated(0.5 * sd * p.scale, NOISE_LIMIT)
            s = a[k][k] + noise * noise - parts.sum_of(g[k] * g[k] for g in gains)
            parts.update(
                gains,
                moves,
                covariance.updated_column(a, k, gains),
                s,
                e[k - 1] - parts.moved(gains, moves, k),
            )

        # Correction: 1 + L move, or all of the error quaternion while aligning.
        start = [e_w, *e]
        move = [(1.0 if k == 0 else 0.0) + parts.moved(gains, moves, k) for k in range(4)]
        correction = parts.correction_of(
            [ops.where(aligning, s, m) for s, m in zip(start, move, strict=True)]
        )
        raw = multiply(q, correction)
        q_new, shrink = parts.normalised(raw)

        first = parts.initial_variance(p)

        def element(i: int, j: int, value: Any) -> Any:
            grown = parts.above_rounding(value, full) if i == j else value
            begun = ops.where(aligning, first if i == j else 0.0, grown)
            return covariance.bounded_element(begun, i, j)

        # In the basis of the corrected quaternion: L(c)^T P L(c), c of length one.
        reduced = covariance.downdated(a, gains, bad)
        c, _ = parts.normalised(correction)
        after = covariance.congruence(left_matrix(c), reduced, element)
        unaligned = aligning & ((u.dt < 0.0) | bad | (trace < ALIGNED_TRACE))
        return (
            {
                **parts.restarted(q_new, u),
                "unaligned": ops.where(unaligned, -1.0, 0.0),
                **{name: after[i][j] for name, i, j in covariance.element_names(4)},
            },
            parts.attitude_outputs(
                raw, q_new, shrink, parts.status_word({0: aligning, 2: acc_bad, 3: mag_bad})
            ),
        )


def _predicted(a: covariance.Symmetric, dq: list[Any], u: Any, p: Any, full: Any) -> Any:
    """F P F^T + Q in the body basis, diag(1, C^T) P diag(1, C) + diag(0, (dt/2)^2 Qg), C(dq).

    Q is 0 where it is ``full``.
    """
    c = matrix(dq)
    step = u.dt * p.scale
    gyro_sds = p.gyro_sd_x, p.gyro_sd_y, p.gyro_sd_z
    deviations = [ops.saturated(0.5 * sd * step, parts.STEP_LIMIT) for sd in gyro_sds]

    def element(i: int, j: int, value: Any) -> Any:
        if i == j:
            value = value + ops.where(full, 0.0, deviations[i] * deviations[i])
        return covariance.bounded_element(value, i, j)

    turned = covariance.congruence(c, [row[1:] for row in a[1:]], element)
    columns = zip(*c, strict=True)
    norm = [covariance.part(dot(column, a[0][1:]), "covariance") for column in columns]
    return [[a[0][0], *norm], *([n, *row] for n, row in zip(norm, turned, strict=True))]


def _unit(v: Any, v_sq: Any) -> list[Any]:
    inverse = ops.rsqrt(v_sq)
    return [ops.saturated(c * inverse, 1.0) for c in v]
