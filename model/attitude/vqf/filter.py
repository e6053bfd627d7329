"""VQF: orientation from inertial sensors, with or without a magnetometer.

D. Laidig, T. Seel, "VQF: Highly accurate IMU orientation estimation with bias estimation and
magnetic disturbance rejection", Information Fusion 91:187, 2023, doi 10.1016/j.inffus.2022.10.014;
the filter for real time, with the paper's numbers.

One sample, in the paper's order: the gyro turns the attitude; the specific force, turned by it and
low-passed, is made vertical by the shortest turn; the bias follows from that turn in motion, from
the gyro's mean at rest; the field corrects a share of the heading's error, unless it is disturbed.

The paper averages the force in the frame that the gyro alone turns and keeps the inclination's
correction as a second quaternion. Here there is one, q, and every correction turns the low-pass
with it: its states are linear in their samples, so the outputs are the same.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from boresight.model import ops
from boresight.model.algebra.angles import pitch_roll_heading_ht
from boresight.model.algebra.low_pass import filtered
from boresight.model.algebra.quaternion import NOT_UNIT, cross, dot, increment, matrix, product
from boresight.model.algebra.quaternion_filter import status_word
from boresight.model.attitude.vqf.bias import bias_of
from boresight.model.attitude.vqf.field import heading_of
from boresight.model.attitude.vqf.interface import START, STATUS_BITS, interface_of
from boresight.model.attitude.vqf.settings import (
    ACC_MOST,
    CLIP_RAD_S,
    DEGREE,
    FORCE_MOST,
    RATE_MOST,
    Settings,
    counted,
)
from boresight.model.errors import require_choice
from boresight.model.estimator import Estimator
from boresight.model.nine_axis import OUTPUTS

_FORCE_SEEN_SQ = 4.0  #: (m/s^2)^2, squared specific force from which on it counts as a sample.
_TURNING_SQ = 400.0 * DEGREE * DEGREE  #: (rad/s)^2, squared rate at which a new field is believed.
_GAP_STEPS = 1.5  #: steps that a sample's time may last before it counts as a gap.
_UPSIDE_DOWN = 0.5  #: 1 + cosine of a turn from which on half a turn comes first.


def _rates(settings: Settings) -> dict[str, float]:
    return {"dt": settings.rate_hz} | ({"mx": settings.mag_rate_hz} if settings.magnetic else {})


class Vqf(Estimator):
    """VQF of Laidig and Seel: low-passed vertical, bias in motion and at rest, disturbed fields."""

    name = "vqf"
    outputs = OUTPUTS
    restarts = True
    start_deg = {18: 2.5, 22: 0.4, 23: 0.2, 24: 0.1, 25: 0.04, 26: 0.02}
    status_bits = STATUS_BITS
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

        Without a magnetometer its name is ``vqf_six_axis``.

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
        require_choice("vqf, mag", mag, ("full", "none"))
        if mag_rate_hz is None:
            mag_rate_hz = rate_hz
        self.name = "vqf" if mag == "full" else "vqf_six_axis"
        self.settings = Settings(rate_hz, mag_rate_hz, mag == "full", acc_tau_s, mag_tau_s)
        self.inputs, self.params, self.states = interface_of(self.settings)
        self.rates_hz = _rates(self.settings)

    def for_rates(self, rates_hz: Mapping[str, float]) -> Vqf:
        """Filter with the same time constants for these rates; itself if they differ by 0.1 %."""
        now = self.settings
        # Six digits, so that logs of one sensor share one compiled program.
        rate, field = (float(f"{rates_hz.get(n, rates_hz['dt']):.6g}") for n in ("dt", "mx"))
        field = min(field, rate) if now.magnetic else rate
        if abs(rate / now.rate_hz - 1.0) < 1e-3 and abs(field / now.mag_rate_hz - 1.0) < 1e-3:
            return self
        mag = "full" if now.magnetic else "none"
        return Vqf(rate, field, mag, now.acc_tau_s, now.mag_tau_s)

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """One sample; with ``dt`` below zero nothing but a new start, at the sample after it."""
        settings = self.settings
        restart = u.dt < 0.0
        gyro, force = (u.gx, u.gy, u.gz), (u.ax, u.ay, u.az)
        no_force = ops.saturated(dot(force, force) - _FORCE_SEEN_SQ, 1.0) < 0.0
        bias = [getattr(x, f"bias_{a}") for a in "xyz"]
        inverse = ops.bounded(1.0 / (x.count + 1.0), 0.0, 1.0, "1/n")

        # Rest: gyro and accelerometer stay near their low-passed values, and the former near zero.
        still, mean_rate, states = rest_of(x, u, p, inverse, settings)
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
        turned = rotated(q, force)
        weights = settings.vertical.weights(x.count < settings.vertical.mean_samples - 0.5, inverse)
        before = [(getattr(x, f"up_z_{a}"), getattr(x, f"up_v_{a}")) for a in "enu"]
        mean_force, ups = filtered(weights, settings.vertical, before, turned, FORCE_MOST)
        length = ops.rsqrt(dot(mean_force, mean_force))
        east, north, up = (ops.saturated(c * length, 1.0) for c in mean_force)
        q, levelled = made_vertical(q, east, north, up)
        C = matrix(q)
        ups = list(zip(*(levelled(part) for part in zip(*ups, strict=True)), strict=True))

        # Bias.
        learnt, P, filtered_states = bias_of(
            x, restart, weights, C, bias, (east, north), mean_rate, resting, settings
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
        pitch, roll, heading = pitch_roll_heading_ht(C)
        if settings.magnetic:
            turning = mean_rate_sq > _TURNING_SQ
            update = heading_of(x, restart, C, (u.mx, u.my, u.mz), turning, p, settings)
            states |= update.states
            flags |= {1: update.unknown, 3: update.missing, 4: update.disturbed}
            heading = ops.wrap_ht(heading + update.delta)
            s, c = ops.sincos_ht(0.5 * update.delta)
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
        status = status_word(dict(sorted(flags.items())))
        out = {"pitch": pitch, "roll": roll, "heading": heading, "status": status}
        return states, out | {f"q{a}": v for a, v in zip("wxyz", q, strict=True)}


def rest_of(
    x: Any, u: Any, p: Any, inverse: Any, settings: Settings
) -> tuple[Any, list[Any], dict[str, Any]]:
    """Still samples so far, the low-passed rate, and the states of both low-passes.

    At rest gyro and accelerometer stay near their means, the former near zero.
    """
    low_pass = settings.rest
    states: dict[str, Any] = {}
    means: dict[str, list[Any]] = {}
    moving: dict[str, Any] = {}
    beginning = x.count < low_pass.mean_samples - 0.5
    weights = low_pass.weights(beginning, inverse)
    for kind, bound, limit in (("gyr", RATE_MOST, p.rest_gyr), ("acc", ACC_MOST, p.rest_acc)):
        samples = [getattr(u, f"{kind[0]}{a}") for a in "xyz"]
        before = [(getattr(x, f"{kind}_z_{a}"), getattr(x, f"{kind}_v_{a}")) for a in "xyz"]
        means[kind], after = filtered(weights, low_pass, before, samples, bound)
        deviation = [ops.saturated(s - m, 1.0) for s, m in zip(samples, means[kind], strict=True)]
        moving[kind] = ~(ops.saturated(dot(deviation, deviation) - limit * limit, 1.0) < 0.0)
        states |= {f"{kind}_z_{a}": s[0] for a, s in zip("xyz", after, strict=True)}
        states |= {f"{kind}_v_{a}": s[1] for a, s in zip("xyz", after, strict=True)}
    broken = moving["gyr"]
    for rate in means["gyr"]:
        broken = broken | (ops.saturated(rate * rate - CLIP_RAD_S * CLIP_RAD_S, 1.0) > 0.0)
    still = ops.named("still_before", ops.where(broken, 0.0, x.still))
    still = ops.where(moving["acc"], 0.0, counted(still, settings.rest_samples))
    return ops.named("still_after", still), means["gyr"], states


def rotated(q: list[Any], v: Any) -> list[Any]:
    """C v of a unit quaternion (w, r): v + 2 (w t + r x t) with t = r x v. 21 slots."""
    _, x, y, z = q
    t = [ops.bounded(c, -FORCE_MOST, FORCE_MOST, "a vector") for c in cross((x, y, z), v)]
    around = (y * t[2] - z * t[1], z * t[0] - x * t[2], x * t[1] - y * t[0])
    return [
        ops.bounded(
            a + 2.0 * (q[0] * b + c), -FORCE_MOST, FORCE_MOST, "a turned vector", unless=NOT_UNIT
        )
        for a, b, c in zip(v, t, around, strict=True)
    ]


def made_vertical(
    q: list[Any], e: Any, n: Any, u: Any
) -> tuple[list[Any], Callable[[Any], tuple[Any, Any, Any]]]:
    """Attitude after the shortest turn of a unit vector (e, n, u) to the vertical, and that turn.

    The turn is the quaternion (1 + u, n, -e, 0)/2 over its length, the root of (1 + u)/2. Near half
    a turn that length is lost in rounding, so half a turn about x comes first, and then the
    shortest turn of (e, -n, -u). Of unit q the product has the length of the quaternion too. Its
    matrix, which turns vectors::

        M = [[1 - e^2/(1 + u), -e n/(1 + u), -e], [..., 1 - n^2/(1 + u), -n], [e, n, u]]
    """
    inverted = 1.0 + u < _UPSIDE_DOWN
    w, x, y, z = q
    w, x = ops.where(inverted, -x, w), ops.where(inverted, w, x)
    y, z = ops.where(inverted, -z, y), ops.where(inverted, y, z)
    n, u = ops.flip(inverted, n), ops.flip(inverted, u)
    s = ops.named("one_and_up", 1.0 + u)
    turned = [
        0.5 * (s * w) - 0.5 * (n * x) + 0.5 * (e * y),
        0.5 * (s * x) + 0.5 * (n * w) - 0.5 * (e * z),
        0.5 * (s * y) - 0.5 * (n * z) - 0.5 * (e * w),
        0.5 * (s * z) + 0.5 * (n * y) + 0.5 * (e * x),
    ]
    turned = [ops.saturated(c, 1.0) for c in turned]
    norm_sq = ops.bounded(
        dot(turned, turned), 0.0, 1.0, "norms of at most one", unless="rounding made them longer"
    )
    inverse = ops.rsqrt(norm_sq)
    a, b = (ops.bounded(c * inverse, -2.01, 2.01, "twice the sine of half a turn") for c in (n, e))
    across = ops.bounded(-0.5 * (a * b), -1.0, 1.0, "of a matrix", unless=NOT_UNIT)
    first, second = (
        ops.bounded(1.0 - 0.5 * (c * c), -1.0, 1.0, "of a matrix", unless=NOT_UNIT) for c in (b, a)
    )

    def turn(v: Any) -> tuple[Any, Any, Any]:
        v = (v[0], ops.flip(inverted, v[1]), ops.flip(inverted, v[2]))
        return (
            first * v[0] + across * v[1] - e * v[2],
            across * v[0] + second * v[1] - n * v[2],
            e * v[0] + n * v[1] + u * v[2],
        )

    return [ops.saturated(c * inverse, 1.0) for c in turned], turn
