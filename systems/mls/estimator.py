"""Attitude of a deck under a landing-system array: quaternion Kalman filter at 1 kHz.

Wang Ding et al. (2018), section 3, with misprints corrected. Reference axes are magnetic
north, west, up; C = C(q), body to reference, Rz(heading) Ry(pitch) Rx(roll); (n) is their equation.

* q' = q w / 2 (20), a step of Picard's third order (19), or the fourth of (21), D = |w| dt::

      q <- q (1 - D^2/8 [+ D^4/384], (1/2 - D^2/48) w dt)        P <- F P F^T + (sd dt / 2)^2 1

* Measured are specific force and field, h = C^T V with V_a = (0, 0, g), V_m = F (cos a, 0, -sin a),
  a the dip: six scalar updates with the Jacobian (25). h is quadratic, H q = 2 h, so the innovation
  is z - h = z - H q / 2.

**Basis.** P is kept as L(q)^T P L(q), in which the Jacobian of
r = C^T V is 2 [r, r x]. Setting the norm of q back is a projection, (1 - q q^T)/|q|, of P too:
three states are left, half the small rotation about the body's axes, and the attitude is the same.
A correction k = (1, e) turns P by k/|k|^2, which is never longer than one.
With ``norm`` "free" q is n times a unit quaternion, h = n^2 r, H = 2 n [r, r x], all four states.

A record with dt < 0 starts anew: 32 Gauss-Newton steps to the attitude, whatever it is, the mean of
96 more, then P0.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from boresight import Estimator, Output, Param, State, ops
from boresight.model.algebra import covariance
from boresight.model.algebra import quaternion_filter as parts
from boresight.model.algebra.angles import roll_pitch_heading_ht
from boresight.model.algebra.quaternion import (
    conjugate_turn,
    dot,
    left_matrix,
    matrix,
    multiply,
    scaled_matrix,
    turn,
)
from boresight.model.declarations import GRAVITY
from boresight.model.errors import require
from boresight.model.nine_axis import INPUTS

FIELD_UNIT = 64.0  #: uT
FIELD_LIMIT = 100.0  #: uT, largest strength of the field at the site.
NO_FIELD = 1.0  #: uT^2, squared field below which there is no sample.
NOISE_LIMIT = 4.0  #: largest noise of a measurement times scale.
P0_LIMIT = 0.5  #: largest initial standard deviation times scale / 2.
ALIGN_STEPS = 128  #: samples with both vectors that an alignment takes, a quarter of them steps.
NORM_LIMIT = 2.0  #: largest norm of q, if that is free.
NORM_FLOOR = 2.0**-24  #: and the least variance of it.
MOVE_LIMIT = 0.5  #: largest component of a correction of q.
STEP_NOISE = 2.0**-8  #: noise of a step, scaled; less would amplify rounding.
MEAN_SLOPE = 0.5 * parts.ALIGN_P * ALIGN_STEPS  #: noise of the mean: two vectors see most axes.
MEAN_FROM = 0.75 * MEAN_SLOPE
_DEG = 0.017453292519943295
_PRINTED = ("corrected", "printed")
_OPTIONS: dict[str, tuple[Any, ...]] = {
    **{"picard": (3, 4), "process": _PRINTED, "measurement": _PRINTED, "innovation": _PRINTED},
    "norm": ("set", "free"),
}

#: Bits of the output ``status``.
STATUS_BITS = {0: "aligning: no attitude yet", 1: "no magnetometer sample"}


class MlsAttitude(Estimator):
    """Attitude of a deck from gyro, accelerometer and magnetometer.

    ``picard`` is the order of the transition, 3 or 4. As printed, ``process`` takes (18),
    q' = -w q / 2; ``measurement`` (24), h = C V; ``innovation`` (28), z - H q. ``norm`` of q is
    "set" to one or "free".
    """

    name = "mls_attitude"
    summary = "attitude of a moving deck: quaternion KF, Picard transition, six scalar updates"
    #: The words of the nine-axis filters, but other reference axes: so another order.
    inputs = (*INPUTS[:4], *INPUTS[7:], *INPUTS[4:7])
    params = (
        Param("scale", 96.0, 1.0, 256.0, "", "covariances are held times its square; `ekf_bias`"),
        Param("p0_sd", 0.01, 1e-4, 0.5, "rad", "attitude once aligned (root of P0)"),
        Param("gyro_sd", 0.9 * _DEG, 0.0, 1.0, "rad/s", "gyro sample (root of Q): small trusts it"),
        Param("acc_sd", 0.05 * GRAVITY, 0.005, 64.0, "m/s^2", "specific force (root of R)"),
        Param("mag_sd", 2.5, 0.05, 512.0, "uT", "field (root of R): small trusts it"),
        Param("field", 50.0, 10.0, FIELD_LIMIT, "uT", "strength of the field at the site"),
        Param("dip", 0.3, -0.5, 0.5, "ht", "of the field below the horizon"),
    )
    restarts = True
    status_bits = STATUS_BITS
    urgent = 7

    def __init__(self, **options: Any) -> None:
        chosen = {name: legal[0] for name, legal in _OPTIONS.items()} | options
        for name, value in chosen.items():
            legal = _OPTIONS.get(name, ())
            choices = f"one of {', '.join(map(str, legal or _OPTIONS))}"
            found = value if legal else name
            require(value in legal, f"mls_attitude, {name}", choices, found)
        self.fourth, self.free_norm = chosen["picard"] == 4, chosen["norm"] == "free"
        self.printed = {name for name, value in chosen.items() if value == "printed"}
        self.order = 4 if self.free_norm else 3
        self.states = (
            *parts.attitude_states(),
            *((State("norm", 0.0, NORM_LIMIT, "", 1.0),) if self.free_norm else ()),
            State("unaligned", -1.0, 0.0, "", -1.0),  # -1: not begun, 0: aligned
            *covariance.covariance_states(self.order, lambda i: parts.ALIGN_P),
        )
        self.outputs = (
            *(Output(name, "ht", 2.5e-5) for name in ("roll", "pitch", "heading")),
            *(Output(f"q{axis}", "", 4e-5, "body to north, west, up") for axis in "wxyz"),
            *((Output("norm", "", 1e-5, "|q| before it is set"),) if self.free_norm else ()),
            Output("status", "bits"),
        )

    def param_values(self, given: Mapping[str, float] | None = None) -> dict[str, float]:
        """As `Estimator.param_values`; also refuses what the filter would clamp at this ``scale``.

        `InputError`: unknown name, a value outside the legal range, or too large for ``scale``.
        """
        values = super().param_values(given)
        limits = {
            "p0_sd": P0_LIMIT / 0.5,
            "acc_sd": NOISE_LIMIT * GRAVITY / 0.5,
            "mag_sd": NOISE_LIMIT * FIELD_UNIT / 0.5,
        }
        parts.require_unclamped(values, limits)
        return values

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        progress = ops.where(u.dt < 0.0, -1.0, x.unaligned)
        aligning = progress < 0.0
        norm: Any = ops.where(aligning, 1.0, x.norm) if self.free_norm else 1.0
        dq = self._picard([ops.saturated(0.5 * w * u.dt, 1.0) for w in (u.gx, u.gy, u.gz)])
        before = (x.qw, x.qx, x.qy, x.qz)
        product = multiply(dq, before) if "process" in self.printed else multiply(before, dq)
        q = [ops.saturated(c, 1.0) for c in product]
        a = self._predicted(covariance.covariance_of(x, self.order), dq, u, p)
        c_nb = matrix(q)

        field = (u.mx, u.my, u.mz)
        no_field = dot(field, field) < NO_FIELD
        sine, cosine = ops.sincos_ht(p.dip)
        strength = (1.0 / FIELD_UNIT) * p.field
        site = (strength * cosine, 0.0, -(strength * sine))
        # Steps to the attitude, then their mean: the k-th counts 1/k.
        average = ops.maximum(MEAN_FROM + MEAN_SLOPE * progress, STEP_NOISE)
        average = ops.bounded(average, 0.0, MEAN_FROM, "while aligning")
        error: list[Any] = [0.0] * self.order  # correction so far
        for z, unit, v, longest, bad, sd in (
            ((u.ax, u.ay, u.az), 0.5 / GRAVITY, (0.0, 0.0, 1.0), 1.0, None, p.acc_sd),
            (field, 0.5 / FIELD_UNIT, site, FIELD_LIMIT / FIELD_UNIT, no_field, p.mag_sd),
        ):
            bound = (NORM_LIMIT if self.free_norm else 1.0) * longest
            r = [ops.bounded(norm * k, -bound, bound, "field") for k in conjugate_turn(c_nb, v)]
            predicted = [norm * k for k in turn(c_nb, v)] if "measurement" in self.printed else r
            noise = ops.saturated(unit * p.scale * sd, NOISE_LIMIT)
            variance = ops.where(aligning, average, noise * noise)
            # z - h over 2 |V|, h = n^2 C^T V; as printed z - H q = z - 2 h
            share = 1.0 if "innovation" in self.printed else 0.5
            nu = [unit * m - share * (norm * h) for m, h in zip(z, predicted, strict=True)]
            a, error = self._updated(a, error, r, bound * bound, variance, nu, bad)

        lead = ops.saturated(norm + error[0], NORM_LIMIT) if self.free_norm else 1.0
        correction = [lead, *(ops.saturated(c, MOVE_LIMIT) for c in error[-3:])]
        raw = [ops.saturated(c, 2.0) for c in multiply(q, correction)]
        bound = 8.0 if self.free_norm else 2.0  # of |correction|^2: above 1 or 4, and 3/4
        q_new, shrink = parts.normalised(raw, bound)
        half = ops.saturated(0.5 * shrink, 1.0)
        angles = roll_pitch_heading_ht(scaled_matrix(raw, bound), 4.0 * (half * half))
        p0 = ops.saturated(0.5 * p.p0_sd * p.scale, P0_LIMIT)
        count = ops.where(no_field, progress, progress + 1.0 / ALIGN_STEPS)
        count = ops.minimum(count, 0.0)
        first = ops.where(count < 0.0, parts.ALIGN_P, p0 * p0)
        length, after = self._turned(a, correction, aligning, first)
        extra = {"norm": ops.where(aligning, 1.0, length)} if self.free_norm else {}
        return (
            {
                **parts.restarted(q_new, u),
                **extra,
                "unaligned": count,
                **{name: after[i][j] for name, i, j in covariance.element_names(self.order)},
            },
            {
                **dict(zip(("roll", "pitch", "heading"), angles, strict=True)),
                **{f"q{axis}": c for axis, c in zip("wxyz", q_new, strict=True)},
                **extra,
                "status": parts.status_word({0: aligning, 1: no_field}),
            },
        )

    def _picard(self, half: list[Any]) -> list[Any]:
        """(19) or (21) of half the turn, y = D^2/4: 1 - y/2 [+ y^2/24], (1 - y/6) half."""
        y = ops.bounded(dot(half, half), 0.0, 3.0, "three squares")
        w = 1.0 - 0.5 * y + ((1.0 / 24.0) * (y * y) if self.fourth else 0.0)
        s = ops.bounded(1.0 - (1.0 / 6.0) * y, 0.0, 1.0, "sine over angle")
        s = -s if "process" in self.printed else s
        return [ops.bounded(v, -1.0, 1.0, "sine, cosine") for v in (w, *(s * h for h in half))]

    def _predicted(
        self, a: covariance.Symmetric, dq: list[Any], u: Any, p: Any
    ) -> covariance.Symmetric:
        """F P F^T + Q in the body's basis: turned by C(dq), as printed (18) not at all."""
        lead = self.order - 3
        white = ops.saturated(0.5 * p.gyro_sd * (u.dt * p.scale), parts.STEP_LIMIT)
        noise = ops.maximum(white * white, parts.FLOOR_NOISE)
        full = parts.sum_of(a[k][k] for k in range(lead, self.order)) >= parts.TRACE_LIMIT

        def element(i: int, j: int, value: Any) -> Any:
            return covariance.bounded_element(
                value + ops.where(full, 0.0, noise) if i == j else value, i, j
            )

        if "process" in self.printed:
            return covariance.symmetric(self.order, lambda i, j: element(i, j, a[i][j]))
        m = [[0.0] * lead + row for row in matrix(dq)]
        return covariance.congruence([[1.0, 0.0, 0.0, 0.0]] * lead + m, a, element)

    def _updated(
        self,
        a: covariance.Symmetric,
        error: list[Any],
        r: list[Any],
        square: float,
        variance: Any,
        nu: list[Any],
        bad: Any,
    ) -> tuple[covariance.Symmetric, list[Any]]:
        """P and correction after the components of n C^T V / |V|, none where ``bad`` holds.

        Row k of H / (2 |V|) is n r_k of the norm, if that is free, then n r x. So S = H P H^T + R
        follows from products that are ready long before P is.
        """
        squares = covariance.symmetric(
            3, lambda i, j: ops.bounded(r[i] * r[j], -square, square, "field")
        )
        lead, states = self.order - 3, range(self.order)
        for k, off in enumerate(nu):
            after, last = (k + 1) % 3, (k + 2) % 3
            row = [(0, 1.0, k)] * lead + [(lead + after, -1.0, last), (lead + last, 1.0, after)]
            column = [parts.sum_of(sign * (r[m] * a[i][j]) for j, sign, m in row) for i in states]
            s = variance
            for n, (i, sign, m) in enumerate(row):
                for j, sign_j, o in row[n:]:
                    s = s + (sign * sign_j * (1.0 + (i != j))) * (squares[m][o] * a[i][j])
            if bad is not None:
                column = [ops.where(bad, 0.0, c) for c in column]
            column = [ops.bounded(c, -8.0, 8.0, "P H") for c in column]
            gains: list[list[Any]] = []
            moves: list[Any] = []
            off = off - parts.sum_of(sign * (r[m] * error[j]) for j, sign, m in row)
            parts.update(gains, moves, column, s, off, NOISE_LIMIT * NOISE_LIMIT + square)
            a = covariance.reduced(a, gains[0])
            error = [
                ops.saturated(d + g * moves[0], 2.0) for d, g in zip(error, gains[0], strict=True)
            ]
        return a, error

    def _turned(
        self, a: covariance.Symmetric, correction: list[Any], fresh: Any, first: Any
    ) -> tuple[Any, covariance.Symmetric]:
        """(|correction|, P in the basis of the corrected quaternion); P0 where ``fresh``.

        L(c)^T P L(c) with c of length one; with the norm taken off, c is as much shorter than one
        as the correction is longer.
        """

        def element(i: int, j: int, value: Any) -> Any:
            value = ops.where(fresh, first if i == j else 0.0, value)
            value = covariance.bounded_element(value, i, j)
            # Of the norm, which has no noise, rounding would take the variance below 0.
            return ops.maximum(value, NORM_FLOOR) if self.free_norm and i == j == 0 else value

        square = dot(correction, correction)
        shrink = ops.rsqrt(square)
        if self.free_norm:
            unit = [ops.saturated(v * shrink, 1.0) for v in correction]
            length = ops.saturated(square * shrink, NORM_LIMIT)
            return length, covariance.congruence(left_matrix(unit), a, element)
        unit = [v * shrink for v in correction]
        c = [v * shrink for v in unit]
        return 1.0, covariance.congruence([row[1:] for row in left_matrix(c)[1:]], a, element)
