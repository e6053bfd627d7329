"""VQF: orientation from inertial sensors, with or without a magnetometer.

D. Laidig, T. Seel, "VQF: Highly accurate IMU orientation estimation with bias estimation and
magnetic disturbance rejection", Information Fusion 91:187, 2023, doi 10.1016/j.inffus.2022.10.014;
the filter for real time, with the paper's numbers.

One sample, in the paper's order: the gyro turns the attitude; the specific force, turned by it and
low-passed, is made vertical by the shortest turn; that turn tells the bias in motion, the gyro's
mean at rest; the field turns the heading by a share of what is missing, unless it is disturbed.

The paper averages the force in the frame that the gyro alone turns and keeps the inclination's
correction as a second quaternion. Here there is one, q, and every correction turns the low-pass
with it: its states are linear in their samples, so the outputs are the same.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from boresight.model import ops
from boresight.model.algebra.angles import unit_angle_ht
from boresight.model.algebra.covariance import symmetric
from boresight.model.algebra.low_pass import filtered
from boresight.model.algebra.quaternion import cross, dot, increment, matrix, product
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.estimators.nine_axis import OUTPUTS
from boresight.model.estimators.vqf.bias import grown, measured
from boresight.model.estimators.vqf.field import heading_of
from boresight.model.estimators.vqf.interface import (
    CLIP_RAD_S,
    DEGREE,
    START,
    Settings,
    counted,
    interface_of,
)

__all__ = ["Vqf", "VqfSixAxis"]

_FORCE_SEEN_SQ = 1e-6  #: (m/s^2)^2, squared specific force from which on there is a sample.
_TURNING_SQ = (20.0 * DEGREE) ** 2  #: (rad/s)^2, squared rate at which a new field is believed.
_GAP_STEPS = 1.5  #: steps that a sample's time may last before it counts as a gap.
_UPSIDE_DOWN = 2.0**-20  #: 1 + cosine of a correction that has no axis.


def _rates(settings: Settings) -> dict[str, float]:
    return {"dt": settings.rate_hz, "mx": settings.mag_rate_hz}


class Vqf(Estimator):
    """VQF of Laidig and Seel: low-passed vertical, bias in motion and at rest, disturbed fields."""

    name = "vqf"
    outputs = OUTPUTS
    urgent = 7
    settings = Settings()
    inputs, params, states = interface_of(settings)
    rates_hz = _rates(settings)

    def __init__(
        self,
        rate_hz: float = 100.0,
        mag_rate_hz: float | None = None,
        mag: str = "full",
        acc_tau_s: float = 3.0,
        mag_tau_s: float = 9.0,
    ) -> None:
        """Fix the sample rates, on which all gains depend.

        Parameters
        ----------
        rate_hz : float
            Of gyro and accelerometer.
        mag_rate_hz : float, optional
            Of the magnetometer; by default the same.
        mag : {"full", "none"}
            Without a magnetometer the heading is that of the gyro.
        acc_tau_s, mag_tau_s : float
            Time constants: small trusts the accelerometer, the magnetometer.

        Raises
        ------
        InputError
            A number outside its range, or another ``mag``.
        """
        if mag not in ("full", "none"):
            raise InputError.at(
                "vqf, mag", wanted='"full" or "none"', found=repr(mag), fix="choose one of these"
            )
        if mag_rate_hz is None:
            mag_rate_hz = rate_hz
        self.settings = Settings(rate_hz, mag_rate_hz, mag == "full", acc_tau_s, mag_tau_s)
        self.inputs, self.params, self.states = interface_of(self.settings)
        self.rates_hz = _rates(self.settings)

    def for_rates(self, rates_hz: Mapping[str, float]) -> Vqf:
        """With its time constants, for these rates; itself where they differ by a thousandth."""
        now = self.settings
        # Six digits, so that logs of one sensor share what is made of it.
        rate, field = (float(f"{rates_hz.get(n, rates_hz['dt']):.6g}") for n in ("dt", "mx"))
        field = min(field, rate) if now.magnetic else rate
        if abs(rate / now.rate_hz - 1.0) < 1e-3 and abs(field / now.mag_rate_hz - 1.0) < 1e-3:
            return self
        mag = "full" if now.magnetic else "none"
        made = Vqf(rate, field, mag, now.acc_tau_s, now.mag_tau_s)
        made.name = self.name
        return made

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """One sample; with ``dt`` below zero nothing but a new start, at the sample after it."""
        settings = self.settings
        restart = u.dt < 0.0
        gyro, force = (u.gx, u.gy, u.gz), (u.ax, u.ay, u.az)
        no_force = ops.saturated(dot(force, force) - _FORCE_SEEN_SQ, 1.0) < 0.0
        bias = [getattr(x, f"bias_{a}") for a in "xyz"]
        inverse = ops.bounded(1.0 / (x.count + 1.0), 0.0, 1.0, "1/n")

        # Rest: gyro and accelerometer stay near their low-passed values, and the former near zero.
        still, mean_rate, states = self._rest(x, u, p, inverse)
        resting = still > settings.rest_samples - 0.5
        mean_rate_sq = dot(mean_rate, mean_rate)

        # Strapdown: q <- q (cos, sin) of the angle that the rate turns in a step, or in a gap.
        step = ops.where(u.dt > _GAP_STEPS * settings.step_s, u.dt, settings.step_s)
        bias_step = CLIP_RAD_S * step
        half = [
            ops.saturated(0.5 * (w * step) - 0.5 * (b * bias_step), 1.0)
            for w, b in zip(gyro, bias, strict=True)
        ]
        q = [getattr(x, f"q{a}") for a in "wxyz"]
        q = [ops.saturated(c, 1.0) for c in product(q, increment(half))]

        # Vertical: the force in navigation axes, low-passed.
        turned = _rotated(q, force)
        weights = settings.vertical.weights(x.count < settings.vertical.mean_samples - 0.5, inverse)
        before = [(getattr(x, f"up_z_{a}"), getattr(x, f"up_v_{a}")) for a in "enu"]
        mean_force, ups = filtered(weights, settings.vertical, before, turned, 278.0)
        length = ops.rsqrt(dot(mean_force, mean_force))
        east, north, up = (ops.saturated(c * length, 1.0) for c in mean_force)
        q, levelled = _made_vertical(q, east, north, up)
        C = matrix(q)
        ups = list(zip(*(levelled(part) for part in zip(*ups, strict=True)), strict=True))

        # Bias.
        learnt, P, filtered_states = self._bias(
            x, restart, weights, C, bias, (east, north), mean_rate, resting
        )
        states |= filtered_states
        count = ops.named(
            "samples",
            ops.where(no_force, x.count, counted(x.count, settings.vertical.mean_samples)),
        )
        states |= {
            **{f"q{a}": ops.where(restart, c, v) for a, c, v in zip("wxyz", START, q, strict=True)},
            **{f"bias_{a}": b for a, b in zip("xyz", learnt, strict=True)},
            **{f"p{i}{j}": P[i][j] for i in range(3) for j in range(i, 3)},
            **{f"up_z_{a}": s[0] for a, s in zip("enu", ups, strict=True)},
            **{f"up_v_{a}": s[1] for a, s in zip("enu", ups, strict=True)},
            "count": ops.where(restart, 0.0, count),
            "still": ops.where(restart, 0.0, still),
        }
        flags = {0: restart | (count < 0.5), 2: no_force, 5: resting}
        pitch, roll, heading = _euler_ht(C)
        if settings.magnetic:
            turning = mean_rate_sq > _TURNING_SQ
            found = heading_of(x, restart, C, (u.mx, u.my, u.mz), turning, p, settings)
            states |= found.states
            flags |= {1: found.unknown, 3: found.missing, 4: found.disturbed}
            heading = ops.wrap_ht(heading + found.delta)
            s, c = ops.sincos_ht(0.5 * found.delta)
            # Of the turn by delta about the vertical, (c, 0, 0, s), and q.
            q = [
                ops.saturated(v, 1.0)
                for v in (
                    c * q[0] - s * q[3],
                    c * q[1] - s * q[2],
                    c * q[2] + s * q[1],
                    c * q[3] + s * q[0],
                )
            ]
        status: Any = 0.0
        for bit, flag in sorted(flags.items()):
            status = status + ops.where(flag, float(1 << bit), 0.0)
        out = {"pitch": pitch, "roll": roll, "heading": heading, "status": status}
        return states, out | {f"q{a}": v for a, v in zip("wxyz", q, strict=True)}

    def _rest(self, x: Any, u: Any, p: Any, inverse: Any) -> tuple[Any, list[Any], dict[str, Any]]:
        """Still samples so far, the low-passed rate, and the states of both low-passes."""
        low_pass = self.settings.rest
        states: dict[str, Any] = {}
        means: dict[str, list[Any]] = {}
        moving: dict[str, Any] = {}
        beginning = x.count < low_pass.mean_samples - 0.5
        weights = low_pass.weights(beginning, inverse)
        for kind, most, limit in (("gyr", 40.0, p.rest_gyr), ("acc", 160.0, p.rest_acc)):
            samples = [getattr(u, f"{kind[0]}{a}") for a in "xyz"]
            before = [(getattr(x, f"{kind}_z_{a}"), getattr(x, f"{kind}_v_{a}")) for a in "xyz"]
            means[kind], after = filtered(weights, low_pass, before, samples, most)
            deviation = [
                ops.saturated(s - m, 1.0) for s, m in zip(samples, means[kind], strict=True)
            ]
            moving[kind] = ~(ops.saturated(dot(deviation, deviation) - limit * limit, 1.0) < 0.0)
            states |= {f"{kind}_z_{a}": s[0] for a, s in zip("xyz", after, strict=True)}
            states |= {f"{kind}_v_{a}": s[1] for a, s in zip("xyz", after, strict=True)}
        broken = moving["gyr"]
        for rate in means["gyr"]:
            broken = broken | (ops.saturated(rate * rate - CLIP_RAD_S**2, 1.0) > 0.0)
        still = ops.named("still_before", ops.where(broken, 0.0, x.still))
        still = ops.where(moving["acc"], 0.0, counted(still, self.settings.rest_samples))
        return ops.named("still_after", still), means["gyr"], states

    def _bias(
        self,
        x: Any,
        restart: Any,
        weights: Any,
        C: Any,
        bias: list[Any],
        vertical: tuple[Any, Any],
        mean_rate: list[Any],
        resting: Any,
    ) -> tuple[list[Any], Any, dict[str, Any]]:
        """Bias and P after this sample, and the states of the low-passes of C and of C b."""
        settings = self.settings
        low_pass = settings.vertical
        names = [f"{a}{b}" for a in "enu" for b in "xyz"]
        flat, matrices = filtered(
            weights,
            low_pass,
            [(getattr(x, f"c_z_{n}"), getattr(x, f"c_v_{n}")) for n in names],
            [c for row in C for c in row],
            1.0,
        )
        R = [flat[:3], flat[3:6], flat[6:]]
        means, biases = filtered(
            weights,
            low_pass,
            [(getattr(x, f"b_z_{a}"), getattr(x, f"b_v_{a}")) for a in "en"],
            [ops.bounded(dot(row, bias), -1.7321, 1.7321, "bias of unit size") for row in C[:2]],
            3.0**0.5,
        )
        # In motion: what corrects the inclination is the mean of C times the bias that is left.
        east, north = vertical
        rate = settings.rate_hz / CLIP_RAD_S
        errors = [
            -rate * north + means[0] - dot(R[0], bias),
            rate * east + means[1] - dot(R[1], bias),
            -dot(R[2], bias),
        ]
        rows, limited = [], []
        for i in range(3):
            error = ops.where(resting, (1.0 / CLIP_RAD_S) * mean_rate[i] - bias[i], errors[i])
            limited.append(ops.saturated(error, 1.0))
            rows.append([ops.where(resting, float(i == j), R[i][j]) for j in range(3)])
        motion = settings.motion_weight
        seldom = ops.named("weight", ops.where(resting, 1.0, motion))
        never = ops.named("weight_up", ops.where(resting, 1.0, 1e-4 * motion))
        start, most = settings.start_variance, settings.start_variance + settings.growth
        P = symmetric(3, lambda i, j: getattr(x, f"p{i}{j}"))
        change, P = measured(
            grown(P, start, settings.growth, most),
            rows,
            limited,
            [seldom, seldom, never],
            most,
            (restart, start),
        )
        learnt = [
            ops.saturated(ops.where(restart, 0.0, b + d), 1.0)
            for b, d in zip(bias, change, strict=True)
        ]
        states = {f"c_z_{n}": s[0] for n, s in zip(names, matrices, strict=True)}
        states |= {f"c_v_{n}": s[1] for n, s in zip(names, matrices, strict=True)}
        states |= {f"b_z_{a}": s[0] for a, s in zip("en", biases, strict=True)}
        states |= {f"b_v_{a}": s[1] for a, s in zip("en", biases, strict=True)}
        return learnt, P, states


class VqfSixAxis(Vqf):
    """VQF without a magnetometer: the heading is that of the gyro, less its bias."""

    name = "vqf_six_axis"
    settings = Settings(magnetic=False)
    inputs, params, states = interface_of(settings)
    rates_hz = _rates(settings)

    def __init__(self, rate_hz: float = 100.0, acc_tau_s: float = 3.0) -> None:
        """Fix the sample rate; see `Vqf`."""
        super().__init__(rate_hz, mag="none", acc_tau_s=acc_tau_s)


def _rotated(q: list[Any], v: Any) -> list[Any]:
    """C v of a unit quaternion (w, r): v + 2 (w t + r x t) with t = r x v. 21 slots."""
    _, x, y, z = q
    t = [ops.bounded(c, -280.0, 280.0, "a vector") for c in cross((x, y, z), v)]
    around = (y * t[2] - z * t[1], z * t[0] - x * t[2], x * t[1] - y * t[0])
    return [
        ops.bounded(a + 2.0 * (q[0] * b + c), -278.0, 278.0, "a turned vector")
        for a, b, c in zip(v, t, around, strict=True)
    ]


def _made_vertical(
    q: list[Any], e: Any, n: Any, u: Any
) -> tuple[list[Any], Callable[[Any], tuple[Any, Any, Any]]]:
    """Attitude after the shortest turn of a unit vector (e, n, u) to the vertical, and that turn.

    The turn is the quaternion (1 + u, n, -e, 0)/2 over its length, the root of (1 + u)/2; half a
    turn about x where there is no shortest one. Of unit q the product has that length too. Its
    matrix, which turns vectors::

        M = [[1 - e^2/(1 + u), -e n/(1 + u), -e], [..., 1 - n^2/(1 + u), -n], [e, n, u]]
    """
    s = ops.named("one_and_up", 1.0 + u)
    a = ops.where(s < _UPSIDE_DOWN, 1.0, n)
    turned = [
        0.5 * (s * q[0]) - 0.5 * (a * q[1]) + 0.5 * (e * q[2]),
        0.5 * (s * q[1]) + 0.5 * (a * q[0]) - 0.5 * (e * q[3]),
        0.5 * (s * q[2]) - 0.5 * (a * q[3]) - 0.5 * (e * q[0]),
        0.5 * (s * q[3]) + 0.5 * (a * q[2]) + 0.5 * (e * q[1]),
    ]
    turned = [ops.saturated(c, 1.0) for c in turned]
    inverse = ops.rsqrt(ops.bounded(dot(turned, turned), 0.0, 1.0, "norms of at most one"))
    a, b = (ops.bounded(c * inverse, -2.01, 2.01, "twice the sine of half a turn") for c in (a, e))
    across = ops.bounded(-0.5 * (a * b), -1.0, 1.0, "of a matrix")
    first, second = (ops.bounded(1.0 - 0.5 * (c * c), -1.0, 1.0, "of a matrix") for c in (b, a))

    def turn(v: Any) -> tuple[Any, Any, Any]:
        return (
            first * v[0] + across * v[1] - e * v[2],
            across * v[0] + second * v[1] - n * v[2],
            e * v[0] + n * v[1] + u * v[2],
        )

    return [ops.saturated(c * inverse, 1.0) for c in turned], turn


def _euler_ht(C: Any) -> tuple[Any, Any, Any]:
    """Pitch, roll, heading [half turns] of C = Rz(heading) Rx(pitch) Ry(roll)."""
    cosine_sq = C[2][2] * C[2][2] + C[2][0] * C[2][0]
    secant = ops.rsqrt(cosine_sq)
    cosine = ops.bounded(cosine_sq * secant, 0.0, 1.0, "cosine of the pitch")
    return (
        unit_angle_ht(C[2][1], cosine),
        ops.wrap_ht(-unit_angle_ht(C[2][0], C[2][2], secant)),
        ops.wrap_ht(-unit_angle_ht(C[0][1], C[1][1], secant)),
    )
