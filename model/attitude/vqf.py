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

import math
from collections.abc import Callable, Mapping
from typing import Any

from boresight.model import ops
from boresight.model.algebra.angles import pitch_roll_heading_ht, unit_angle_ht
from boresight.model.algebra.covariance import Symmetric, symmetric
from boresight.model.algebra.low_pass import LowPass, Weights, filtered, gain_of
from boresight.model.algebra.quaternion import (
    NOT_UNIT,
    Vector,
    cross,
    dot,
    increment,
    matrix,
    product,
    turn,
)
from boresight.model.algebra.quaternion_filter import status_word
from boresight.model.attitude.table import params_of
from boresight.model.declarations import Input, Param, State
from boresight.model.errors import require, require_choice
from boresight.model.estimator import Estimator
from boresight.model.nine_axis import INPUTS, OUTPUTS

# -- settings: rates, time constants, and the numbers that follow from them ----------------------

DEGREE = math.pi / 180.0
CLIP_RAD_S = 2.0 * DEGREE  #: largest bias, and unit of the states that hold it.
RATE_MOST = 40.0  #: rad/s, of an axis of the gyro.
ACC_MOST = 160.0  #: m/s^2, of an axis of the accelerometer.
ROOT_3 = 1.7321  #: of three components of at most one.
FORCE_MOST = 278.0  #: m/s^2, three components of the accelerometer.
FIELD_MOST = 444.0  #: uT, three components of 256.


def counter_limit(samples: float) -> float:
    """Where a counter that must reach ``samples`` stops: a power of two, which costs nothing."""
    mantissa, exponent = math.frexp(samples + 1.0)
    return math.ldexp(1.0, exponent - (mantissa == 0.5))


def counted(x: Any, samples: float) -> Any:
    """One more, as far as the counter goes."""
    return ops.saturated(x + 1.0, counter_limit(samples))


def _samples_until(limit_s: float, step_s: float) -> int:
    """Samples after which a float64 sum of steps is no longer below a limit.

    Counters hold whole samples, which fixed point keeps exactly.
    """
    total, n = 0.0, 0
    while total < limit_s:
        total, n = total + step_s, n + 1
    return n


class Settings:
    """Numbers of the paper's table 3, at the sample rates of accelerometer and magnetometer.

    Covariances of the bias are in units of the measurement variance at rest, so that one may be
    told from the other at any rate.
    """

    def __init__(
        self,
        rate_hz: float = 100.0,
        mag_rate_hz: float = 100.0,
        magnetic: bool = True,
        acc_tau_s: float = 3.0,
        mag_tau_s: float = 9.0,
    ) -> None:
        for name, value, low, high in (
            ("rate_hz", rate_hz, 10.0, 4000.0),
            ("mag_rate_hz", mag_rate_hz, 1.0, rate_hz),
            ("acc_tau_s", acc_tau_s, 0.5, 30.0),
            ("mag_tau_s", mag_tau_s, 0.5, 100.0),
        ):
            good = isinstance(value, int | float) and low <= value <= high
            fix = "choose a value inside the range"
            require(good, f"vqf, {name}", f"{low:g} to {high:g}", value, fix)
        self.rate_hz, self.mag_rate_hz, self.magnetic = rate_hz, mag_rate_hz, magnetic
        self.acc_tau_s, self.mag_tau_s = acc_tau_s, mag_tau_s
        #: Ts of gyro and accelerometer, and of the magnetometer.
        self.step_s, self.mag_step_s = step, mag_step = 1.0 / rate_hz, 1.0 / mag_rate_hz
        #: Low-passes: of the specific force, and of the values compared with it; of gyro and
        #: accelerometer for the detection of rest; of the field's norm and dip.
        self.vertical = LowPass(acc_tau_s, step)
        self.rest = LowPass(0.5, step)
        self.field = LowPass(0.05, mag_step)
        #: Samples: still ones that make rest, 1.5 s; near the reference that end a disturbance,
        #: 0.5 s; turning ones that accept a new field, the first one 5 s, another one 20 s.
        self.rest_samples = _samples_until(1.5, step)
        self.calm_samples = _samples_until(0.5, mag_step)
        self.candidate_samples = _samples_until(5.0, mag_step), _samples_until(20.0, mag_step)
        #: Disturbed samples after which the field is followed again: 60 s, the largest sum.
        self.rejected_samples = _samples_until(math.nextafter(60.0, 61.0), mag_step) - 1
        #: Samples that may yet be rejected when none was: a power of two, at which it stops; and
        #: what is left of them when the field is followed again, minus half a sample.
        self.patience = counter_limit(self.rejected_samples + 1.0)
        self.impatient = self.patience - self.rejected_samples - 0.5
        #: Magnetometer samples of gain 1/n or more, until tau/(n + 1) is below a step. 1/n is
        #: summed up as the filter's authors do, k <- k/(k + 1), whose last bit may decide.
        gain, self.first_samples = 0.5, 1
        while gain * mag_tau_s >= mag_step:
            gain, self.first_samples = gain / (gain + 1.0), self.first_samples + 1
        #: k_mag; gain at which reference and candidate of the field follow it, 20 s.
        self.mag_gain = gain_of(mag_tau_s, mag_step)
        self.field_gain = gain_of(20.0, mag_step)
        # Covariances [(0.01 deg/s)^2]: V, from 0 to (0.1 deg/s)^2 in 100 s; measurement variances
        # at which P settles, P^2/V + P, at rest (0.03 deg/s) and in motion (0.1 deg/s).
        v = 100.0 * step / 100.0
        at_rest, in_motion = (steady * steady / v + steady for steady in (9.0, 100.0))
        #: P0, of 0.5 deg/s, and V, in units of the variance at rest; that over that in motion.
        self.start_variance, self.growth = 2500.0 / at_rest, v / at_rest
        self.motion_weight = at_rest / in_motion


# -- interface ----------------------------------------------------------------------------------

BELOW_ONE = 1.0 - 2.0**-31
START = (BELOW_ONE, 0.0, 0.0, 0.0)  #: attitude at the start; its norm is mended at once.

#: Bits of the output ``status``.
STATUS_BITS = {
    0: "no attitude yet: no specific force so far",
    1: "heading not aligned: no magnetometer sample so far, or a field along the vertical",
    2: "accelerometer not used: no specific force",
    3: "no magnetometer sample",
    4: "field disturbed: the heading follows the gyro",
    5: "at rest: the gyro's bias is measured",
}


def _channels(low_pass: LowPass, name: str, parts: str, largest: float, unit: str) -> list[State]:
    """States of a low-pass, by channel."""
    _, z, v = (c * largest for c in low_pass.largest)
    return [
        State(f"{name}_{kind}_{part}".rstrip("_"), -bound, bound, unit)
        for part in parts.split()
        for kind, bound in (("z", z), ("v", v))
    ]


def _low_passed(
    x: Any, weights: Weights, low_pass: LowPass, name: str, parts: Any, samples: Any, most: float
) -> tuple[list[Any], dict[str, Any]]:
    """Means of the channels ``name_part``, and their states."""
    before = [(getattr(x, f"{name}_z_{k}"), getattr(x, f"{name}_v_{k}")) for k in parts]
    means, after = filtered(weights, low_pass, before, samples, most)
    states = {f"{name}_z_{k}": s[0] for k, s in zip(parts, after, strict=True)}
    return means, states | {f"{name}_v_{k}": s[1] for k, s in zip(parts, after, strict=True)}


def interface_of(
    settings: Settings,
) -> tuple[tuple[Input, ...], tuple[Param, ...], tuple[State, ...]]:
    """Inputs, parameters that may be written while the filter runs, and states."""
    inputs = INPUTS if settings.magnetic else tuple(i for i in INPUTS if i.name[0] != "m")
    params = params_of(
        f"""
        rest_gyr {2.0 * DEGREE!r} 0 0.5 rad/s
            least deviation from the mean rate in motion
        rest_acc 0.5 0 0.9 m/s^2
            least deviation from the mean force in motion
        """
    )
    if settings.magnetic:
        params += params_of(
            f"""
            mag_gain {settings.mag_gain!r} 0 1 -
                share of the heading's error that a sample corrects
            field_gain {settings.field_gain!r} 0 1 -
                share of the field that reference and candidate take over at a sample
            norm_share 0.1 0 1 -
                least deviation of a disturbed field, of the reference's norm
            dip_limit {10.0 / 180.0!r} 0 1 ht
                least deviation of a disturbed field's dip
            """
        )
    p0 = settings.start_variance
    bound = p0 + settings.growth
    pairs = [(i, j) for i in range(3) for j in range(i, 3)]
    states = [
        *(State(f"q{a}", -1.0, BELOW_ONE, "", v) for a, v in zip("wxyz", START, strict=True)),
        *(State(f"bias_{a}", -1.0, BELOW_ONE, "") for a in "xyz"),
        *(
            State(f"p{i}{j}", 0.0 if i == j else -bound, bound, "", p0 if i == j else 0.0)
            for i, j in pairs
        ),
        *_channels(settings.rest, "gyr", "x y z", RATE_MOST, "rad/s"),
        *_channels(settings.rest, "acc", "x y z", ACC_MOST, "m/s^2"),
        *_channels(settings.vertical, "up", "e n u", FORCE_MOST, "m/s^2"),
        *_channels(settings.vertical, "c", "ex ey ez nx ny nz ux uy uz", 1.0, ""),
        *_channels(settings.vertical, "b", "e n", ROOT_3, ""),
        State("count", 0.0, counter_limit(settings.vertical.mean_samples), ""),
        State("still", 0.0, counter_limit(settings.rest_samples), ""),
    ]
    if settings.magnetic:
        norm, bound = 2.0 * FIELD_MOST, settings.patience
        states += [
            State("delta", -1.0, 1.0, "ht"),  # heading of the frame in which the force is averaged
            *_channels(settings.field, "norm", "_", FIELD_MOST, "uT"),
            *_channels(settings.field, "dip", "_", 0.5, "ht"),
            State("ref_norm", -1.0, norm, "uT"),
            State("ref_dip", -1.0, 1.0, "ht"),
            State("new_norm", -1.0, norm, "uT", -1.0),
            State("new_dip", -1.0, 1.0, "ht"),
            State("new_turning", 0.0, counter_limit(settings.candidate_samples[1]), ""),
            State("calm", 0.0, counter_limit(settings.calm_samples), ""),
            State("patience", 0.0, bound, "", bound - settings.rejected_samples),
            State("mag_count", 0.0, counter_limit(settings.first_samples), ""),
        ]
    return inputs, params, tuple(states)


# -- the bias: a Kalman filter of a random walk, measured in motion and at rest -----------------

_VERTICAL_WEIGHT = 1e-4  #: of the measurement about the vertical, over that of the others.
_GAIN_MOST = 2.0  #: bound of sqrt(P_jj r P r^T) w over S.


def grown(p: Symmetric, start: float, growth: float, high: float) -> Symmetric:
    """P + V on the variances below their start value."""
    return symmetric(
        3,
        lambda i, j: (
            ops.bounded(
                p[i][i] + ops.where(p[i][i] < start, growth, 0.0), 0.0, high, "start and one growth"
            )
            if i == j
            else p[i][j]
        ),
    )


def measured(
    p: Symmetric,
    rows: list[list[Any]],
    errors: list[Any],
    weights: list[Any],
    high: float,
    anew: tuple[Any, float],
) -> tuple[list[Any], Symmetric]:
    """Change of the bias, and P after the measurement: K e, P - K R P.

    Errors of the three components are independent, so they are taken one after the other, without
    inverting a matrix; e_i is that before any of them::

        c = P r_i    S = 1 + w_i r_i c    k = (w_i/S) c
        d <- d + k (e_i - r_i d)    P <- P - k c^T

    ``p`` is P in units of a measurement variance, variances of at most ``high``; ``rows`` of R are
    of about unit length at most; ``errors`` e = y - R b; ``weights`` that variance over those of
    the components, 0 to 1. Where the condition of ``anew`` holds, P is diagonal with its variance.
    """
    change: list[Any] = [0.0] * 3
    for k, (row, error, weight) in enumerate(zip(rows, errors, weights, strict=True)):
        column = [
            ops.bounded(dot(row, p[j]), -2.0 * high, 2.0 * high, "sqrt(P_jj r P r^T)")
            for j in range(3)
        ]
        along = ops.bounded(dot(row, column), 0.0, 4.0 * high, "variance along r")
        total = ops.bounded(1.0 + weight * along, 1.0, 1.0 + 4.0 * high, "S")
        share = ops.bounded(weight / total, 0.0, 1.0, "w/S")
        gain = [ops.bounded(c * share, -_GAIN_MOST, _GAIN_MOST, "gain") for c in column]
        move = ops.saturated(error - dot(row, change), 4.0)
        change = [ops.saturated(d + g * move, 4.0) for d, g in zip(change, gain, strict=True)]
        p = _reduced(p, gain, column, high, anew if k == 2 else None)
    return change, p


def _reduced(
    p: Symmetric, gain: list[Any], column: list[Any], bound: float, anew: tuple[Any, float] | None
) -> Symmetric:
    """P - k c^T, or a diagonal start."""

    def element(i: int, j: int) -> Any:
        value = p[i][j] - gain[i] * column[j]
        if anew is not None:
            value = ops.where(anew[0], anew[1] if i == j else 0.0, value)
        return ops.bounded(value, 0.0 if i == j else -bound, bound, "covariance")

    return symmetric(3, element)


def bias_of(
    x: Any,
    restart: Any,
    weights: Weights,
    C: Any,
    bias: list[Any],
    vertical: tuple[Any, Any],
    mean_rate: list[Any],
    resting: Any,
    settings: Settings,
) -> tuple[list[Any], Symmetric, dict[str, Any]]:
    """Bias and P after a sample, and the states of the low-passes of C and of C b.

    At rest the low-passed gyro is the bias. In motion the correction of the inclination in a step
    is the mean of C times the remaining bias; a weak measurement of zero about the vertical, where
    the bias is not observable, lets it forget::

        e_e = -n/Ts + mean(C b)_e - mean(C)_e b     e_n = e/Ts + mean(C b)_n - mean(C)_n b
        e_u = -mean(C)_u b

    ``weights`` are of the low-pass of the specific force, which C and C b share; ``bias`` is that
    before it, in units of `CLIP_RAD_S`, at which errors and bias are clipped; ``vertical`` (e, n)
    of the low-passed force before the correction, a unit vector.
    """
    across = [ops.bounded(dot(row, bias), -ROOT_3, ROOT_3, "bias of unit size") for row in C[:2]]
    names, elements = [f"{a}{b}" for a in "enu" for b in "xyz"], [c for row in C for c in row]
    means, states = _low_passed(x, weights, settings.vertical, "c", names, elements, 1.0)
    R = [means[:3], means[3:6], means[6:]]
    mean, more = _low_passed(x, weights, settings.vertical, "b", "en", across, ROOT_3)
    states |= more
    east, north = vertical
    rate = settings.rate_hz / CLIP_RAD_S
    in_motion = [
        -rate * north + mean[0] - dot(R[0], bias),
        rate * east + mean[1] - dot(R[1], bias),
        -dot(R[2], bias),
    ]
    rows, errors = [], []
    for i in range(3):
        at_rest = (1.0 / CLIP_RAD_S) * mean_rate[i] - bias[i]
        errors.append(ops.saturated(ops.where(resting, at_rest, in_motion[i]), 1.0))
        rows.append([ops.where(resting, float(i == j), R[i][j]) for j in range(3)])
    motion = settings.motion_weight
    level = ops.named("weight", ops.where(resting, 1.0, motion))
    up_weight = ops.named("weight_up", ops.where(resting, 1.0, _VERTICAL_WEIGHT * motion))
    start, bound = settings.start_variance, settings.start_variance + settings.growth
    P = grown(symmetric(3, lambda i, j: getattr(x, f"p{i}{j}")), start, settings.growth, bound)
    change, P = measured(P, rows, errors, [level, level, up_weight], bound, (restart, start))
    learnt = [
        ops.saturated(ops.where(restart, 0.0, b + d), 1.0)
        for b, d in zip(bias, change, strict=True)
    ]
    return learnt, P, states


# -- the magnetometer: heading, disturbed fields, new fields ------------------------------------

_SEEN_SQ = 0.01  #: uT^2, squared field from which on there is a sample.
_VERTICAL = 0.48  #: half turns, dip from which on a field tells no heading: 1/16 of it is level.
_REFERENCE_MOST = 2.0 * FIELD_MOST  #: uT, of a low-passed one


def heading_of(
    x: Any, restart: Any, C: Any, field: Vector, turning: Any, p: Any, settings: Settings
) -> tuple[Any, dict[str, Any], dict[int, Any]]:
    """Angle of the averaging frame, states and flags of the status after a sample of the field.

    The field is in body axes; C turns it to the averaging frame. ``turning``: the body turns fast
    enough to tell a new field from a magnet that it carries.
    """
    missing = ops.saturated(dot(field, field) - _SEEN_SQ, 1.0) < 0.0
    turned = [ops.bounded(c, -FIELD_MOST, FIELD_MOST, "field") for c in turn(C, field)]

    # Norm |m| [uT] and dip [half turns, positive downwards], low-passed; angle from north to east.
    east, north, up = turned
    flat_sq = ops.named("flat_sq", east * east + north * north)
    norm_sq = ops.named("norm_sq", flat_sq + up * up)
    flat_inverse, norm_inverse = ops.rsqrt(flat_sq), ops.rsqrt(norm_sq)
    flat = ops.bounded(flat_sq * flat_inverse, 0.0, FIELD_MOST, "magnitude")
    norm = ops.bounded(norm_sq * norm_inverse, 0.0, FIELD_MOST, "magnitude")
    dip = ops.bounded(
        unit_angle_ht(-up, flat, norm_inverse), -0.5, 0.5, "dip", unless="the field is a few LSB"
    )
    angle = unit_angle_ht(east, north, flat_inverse)
    count = x.mag_count
    inverse = ops.bounded(1.0 / (count + 1.0), 0.0, 1.0, "1/n")
    low_pass = settings.field
    weights = low_pass.weights(count < low_pass.mean_samples - 0.5, inverse)
    norms, norm_states = filtered(
        weights, low_pass, [(x.norm_z, x.norm_v)], [norm], FIELD_MOST, missing
    )
    dips, dip_states = filtered(weights, low_pass, [(x.dip_z, x.dip_v)], [dip], 0.5, missing)
    disturbed, after = _judged(x, norms[0], dips[0], missing, turning, p, settings)

    # Gain: 1/n at first, none while a disturbance is rejected, half of it once that lasts too long.
    rejecting = x.patience > settings.impatient
    steady_gain = ops.where(disturbed, ops.where(rejecting, 0.0, 0.5 * p.mag_gain), p.mag_gain)
    gain = ops.where(count < settings.first_samples - 0.5, inverse, steady_gain)
    gain = ops.named("gain", ops.where(missing, 0.0, gain))
    delta = ops.wrap_ht(x.delta + gain * ops.wrap_ht(angle - x.delta))

    spent = ops.where(disturbed, ops.where(rejecting, -1.0, 0.0), 2.0)
    spent = ops.named("spent", ops.where(missing, 0.0, spent))
    after["patience"] = ops.saturated(x.patience + spent, settings.patience)
    sample = ops.where(missing, 0.0, 1.0)
    after["mag_count"] = ops.saturated(count + sample, counter_limit(settings.first_samples))
    start = {
        "ref_norm": 0.0,
        "new_norm": -1.0,
        "calm": 0.0,
        "patience": settings.patience - settings.rejected_samples,
        "mag_count": 0.0,
    }
    states = after | {n: ops.where(restart, c, after[n]) for n, c in start.items()}
    states |= {"norm_z": norm_states[0][0], "norm_v": norm_states[0][1]}
    states |= {
        "dip_z": dip_states[0][0],
        "dip_v": dip_states[0][1],
        "delta": ops.where(restart, 0.0, delta),
    }
    unknown = (after["mag_count"] < 0.5) | (ops.absolute(dips[0]) > _VERTICAL)
    return delta, states, {1: unknown, 3: missing, 4: disturbed}


def _judged(
    x: Any, norm: Any, dip: Any, missing: Any, turning: Any, p: Any, settings: Settings
) -> tuple[Any, dict[str, Any]]:
    """Whether the field is disturbed, and the next reference and candidate for a new one."""
    first_samples, samples = settings.candidate_samples

    def near(d_norm: Any, d_dip: Any, norm: Any) -> Any:
        return (ops.absolute(d_norm) < p.norm_share * norm) & (ops.absolute(d_dip) < p.dip_limit)

    d_ref, d_new = (norm - x.ref_norm, dip - x.ref_dip), (norm - x.new_norm, dip - x.new_dip)
    at_reference, at_candidate = near(*d_ref, x.ref_norm), near(*d_new, x.new_norm)
    calm = ops.where(at_reference, counted(x.calm, settings.calm_samples), 0.0)
    calm = ops.named("calm_for", ops.where(missing, x.calm, calm))
    quiet = calm > settings.calm_samples - 0.5
    follow = ops.named("follow", ops.where(missing, 0.0, ops.where(quiet, p.field_gain, 0.0)))
    search = ops.where(missing, 0.0, ops.where(at_candidate, p.field_gain, 1.0))
    search = ops.named("search", search)
    new_norm = ops.bounded(
        x.new_norm + search * d_new[0],
        *(-1.0, _REFERENCE_MOST, "a mean"),
        unless="the low-pass overshoots, where a strong field ends",
    )
    new_dip = ops.bounded(x.new_dip + search * d_new[1], -1.0, 1.0, "a mean")
    longer = ops.where(turning, counted(x.new_turning, samples), x.new_turning)
    turned = ops.where(at_candidate, longer, 0.0)
    turned = ops.named("turned_for", ops.where(missing, x.new_turning, turned))
    threshold = ops.where(x.ref_norm > 0.0, samples - 0.5, first_samples - 0.5)
    accepted = ~quiet & (turned > threshold)
    after = {
        "ref_norm": ops.where(accepted, new_norm, x.ref_norm + follow * d_ref[0]),
        "ref_dip": ops.where(accepted, new_dip, x.ref_dip + follow * d_ref[1]),
        "new_norm": new_norm,
        "new_dip": new_dip,
        "new_turning": turned,
        "calm": ops.where(accepted, float(settings.calm_samples), calm),
    }
    return ~quiet & ~accepted, after


# -- the filter ---------------------------------------------------------------------------------

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
    start_deg = {18: 3.0, 22: 0.5, 23: 0.3, 24: 0.15, 25: 0.08, 26: 0.04, 27: 0.02}
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

        ``rate_hz`` is that of gyro and accelerometer, ``mag_rate_hz`` of the magnetometer, by
        default the same. With ``mag`` "none" the heading is that of the gyro, and the name is
        ``vqf_six_axis``. ``acc_tau_s``, ``mag_tau_s`` [s]: small trusts the force, the field.

        `InputError`: a number outside its range, or another ``mag``.
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
            field = (u.mx, u.my, u.mz)
            delta, more, of_field = heading_of(x, restart, C, field, turning, p, settings)
            states, flags = states | more, flags | of_field
            heading = ops.wrap_ht(heading + delta)
            s, c = ops.sincos_ht(0.5 * delta)
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
        means[kind], more = _low_passed(x, weights, low_pass, kind, "xyz", samples, bound)
        deviation = [ops.saturated(s - m, 1.0) for s, m in zip(samples, means[kind], strict=True)]
        moving[kind] = ~(ops.saturated(dot(deviation, deviation) - limit * limit, 1.0) < 0.0)
        states |= more
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
