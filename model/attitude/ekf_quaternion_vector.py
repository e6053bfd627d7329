"""Four-state extended Kalman filter of Ma Long et al. (2014), option (a): vector measurements.

State, prediction and basis as in `model.attitude.ekf_quaternion`. The measurement is the specific
force and the field themselves, h(q) = C^T v with v = (0, 0, g) and v the field at the site,
R = diag(Qa, Qm), as six scalar updates. h is quadratic in q: H q = 2 h, so the innovation is
z - h = z - H q / 2.

In the basis L(q) the Jacobian of a vector r = C^T v is H = 2 [r, r x]: for the first component
(r_x; 0, -r_z, r_y), and so on. It needs no products of its own. Everything is divided by 2 |v|: by
2 g, and for the field by 2 x 64 uT.

While aligning the covariance is held at a large value and the noise at a small one: each sample is
one Gauss-Newton step to the attitude; after 16 samples with both vectors the filter starts.
"""

from __future__ import annotations

import dataclasses
from typing import Any

from boresight.model import ops
from boresight.model.algebra.covariance import (
    covariance_of,
    covariance_states,
    element_names,
    reduced,
)
from boresight.model.algebra.quaternion import NOT_UNIT, conjugate_turn, dot, matrix, multiply
from boresight.model.algebra.quaternion_filter import (
    ALIGN_NOISE,
    ALIGN_P,
    P0,
    SCALE,
    attitude_outputs,
    attitude_states,
    body_covariance,
    body_turned,
    correction_of,
    force_gate,
    gyro_params,
    initial_variance,
    is_full,
    normalised,
    predicted_attitude,
    restarted,
    squared_force,
    status_word,
    sum_of,
    update,
)
from boresight.model.declarations import GRAVITY
from boresight.model.estimator import Estimator, Param, State
from boresight.model.nine_axis import INPUTS, OUTPUTS

__all__ = ["STATUS_BITS", "EkfQuaternionVector"]

FIELD_UNIT = 64.0  #: uT
FIELD_LIMIT = 100.0  #: uT, largest component of the field at the site.
NOISE_LIMIT = 4.0  #: largest noise of a measurement times scale.
ALIGN_STEPS = 16  #: samples that an alignment takes.

#: Bits of the output ``status``.
STATUS_BITS = {
    0: "aligning: no attitude yet",
    2: "accelerometer not used: specific force outside its gate",
    3: "no magnetometer sample",
}


def _field(axis: str, default: float) -> Param:
    return Param(
        f"field_{axis}",
        default,
        -FIELD_LIMIT,
        FIELD_LIMIT,
        "uT",
        f"field at the site, {axis} "
        "component: an east component other than 0 makes the heading count from true "
        "north instead of magnetic north",
    )


def _noise(sensor: str, unit: str, default: float, low: float, high: float) -> tuple[Param, ...]:
    return tuple(
        Param(
            f"{sensor}_sd_{axis}",
            default,
            low,
            high,
            unit,
            f"noise of a sample of body axis {axis}: small trusts it, large the gyro",
        )
        for axis in "xyz"
    )


class EkfQuaternionVector(Estimator):
    """Four-state EKF with vector measurements."""

    name = "ekf_quaternion_vector"
    summary = "quaternion EKF, 4 states, specific force and field as vector measurements"
    inputs = INPUTS
    params = (
        dataclasses.replace(SCALE, default=16.0),
        dataclasses.replace(P0, default=0.06),
        *gyro_params(0.1),
        *_noise("acc", "m/s^2", 3.0, 0.005, 64.0),
        *_noise("mag", "uT", 15.0, 0.05, 512.0),
        _field("east", 0.0),
        _field("north", 14.7),
        _field("up", -40.6),
        *force_gate(0.0),
        Param("mag_min_sq", 4.0, 0.01, 4e3, "uT^2", "squared field below which there is no sample"),
    )
    states = (
        *attitude_states(),
        State("unaligned", -1.0, 0.0, "", -1.0),  # -1: not begun, 0: aligned
        *covariance_states(4, lambda i: ALIGN_P),
    )
    outputs = OUTPUTS
    restarts = True
    status_bits = STATUS_BITS
    urgent = 7

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """One sample: see the module docstring."""
        progress = ops.where(u.dt < 0.0, -1.0, x.unaligned)
        aligning = progress < 0.0
        q, dq = predicted_attitude(x, [0.5 * w * u.dt for w in (u.gx, u.gy, u.gz)])
        before = covariance_of(x, 4)
        full = is_full(before)
        a = body_covariance(before, dq, u, p, full)
        c_nb = matrix(q)

        force, field = (u.ax, u.ay, u.az), (u.mx, u.my, u.mz)
        _, acc_bad = squared_force(force, p)
        mag_bad = dot(field, field) < p.mag_min_sq
        site = [v * (1.0 / FIELD_UNIT) for v in (p.field_east, p.field_north, p.field_up)]
        vectors = (
            (force, 0.5 / GRAVITY, c_nb[2], 1.0, acc_bad, (p.acc_sd_x, p.acc_sd_y, p.acc_sd_z)),
            (
                field,
                0.5 / FIELD_UNIT,
                [
                    ops.bounded(r, -4.0, 4.0, "field", unless=NOT_UNIT)
                    for r in conjugate_turn(c_nb, site)
                ],
                3.0 * (FIELD_LIMIT * FIELD_LIMIT) / (FIELD_UNIT * FIELD_UNIT),
                mag_bad,
                (p.mag_sd_x, p.mag_sd_y, p.mag_sd_z),
            ),
        )

        error: list[Any] = [0.0] * 4  # correction so far
        for z, unit, r, square, bad, deviations in vectors:
            weight = unit * p.scale
            for k in range(3):
                noise = ops.where(
                    aligning, ALIGN_NOISE, ops.saturated(weight * deviations[k], NOISE_LIMIT)
                )
                # H / (2 |v|): the norm, then r x
                after, last = (k + 1) % 3, (k + 2) % 3
                h = [(0, r[k]), (1 + after, -r[last]), (1 + last, r[after])]
                column = [
                    ops.bounded(
                        ops.where(bad, 0.0, sum_of(v * a[i][j] for j, v in h)), -8.0, 8.0, "P H"
                    )
                    for i in range(4)
                ]
                s = sum_of(v * column[j] for j, v in h) + noise * noise
                nu = unit * z[k] - 0.5 * r[k] - sum_of(v * error[j] for j, v in h)
                gain: list[list[Any]] = []
                move: list[Any] = []
                update(gain, move, column, s, nu, NOISE_LIMIT * NOISE_LIMIT + square)
                a = reduced(a, gain[0])
                error = [
                    ops.saturated(d + g * move[0], 2.0) for d, g in zip(error, gain[0], strict=True)
                ]

        correction = correction_of([1.0 + error[0], *error[1:]])
        raw = multiply(q, correction)
        q_new, shrink = normalised(raw)
        count = ops.where(acc_bad | mag_bad, progress, progress + 1.0 / ALIGN_STEPS)
        count = ops.where(aligning, count, 0.0)
        first = ops.where(count < 0.0, ALIGN_P, initial_variance(p))
        covariance = body_turned(a, correction, full, aligning, first)
        return (
            {
                **restarted(q_new, u),
                "unaligned": ops.bounded(count, -1.0, 0.0, "counts up to 0"),
                **{name: covariance[i][j] for name, i, j in element_names(4)},
            },
            attitude_outputs(
                raw, q_new, shrink, status_word({0: aligning, 2: acc_bad, 3: mag_bad})
            ),
        )
