"""The magnetometer's part of VQF: heading, disturbed fields, new fields."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from boresight.model import ops
from boresight.model.algebra.angles import unit_angle_ht
from boresight.model.algebra.low_pass import filtered
from boresight.model.algebra.quaternion import Vector, dot, turn
from boresight.model.attitude.vqf.settings import FIELD_MOST, Settings, counted, counter_limit

_SEEN_SQ = 0.01  #: uT^2, squared field from which on there is a sample.
_VERTICAL = 0.48  #: half turns, dip from which on a field tells no heading: 1/16 of it is level.
_REFERENCE_MOST = 2.0 * FIELD_MOST  #: uT, of a low-passed one


@dataclass(frozen=True)
class Heading:
    """Result of a magnetometer sample: angle of the averaging frame, states, status."""

    delta: Any
    states: dict[str, Any]
    unknown: Any
    missing: Any
    disturbed: Any


def _norm_and_dip(field: Vector) -> tuple[Any, Any, Any]:
    """|m| [uT], dip [half turns, positive downwards], angle from north to east [half turns]."""
    east, north, up = field
    flat_sq = ops.named("flat_sq", east * east + north * north)
    norm_sq = ops.named("norm_sq", flat_sq + up * up)
    flat_inverse, inverse = ops.rsqrt(flat_sq), ops.rsqrt(norm_sq)
    flat = ops.bounded(flat_sq * flat_inverse, 0.0, FIELD_MOST, "magnitude")
    norm = ops.bounded(norm_sq * inverse, 0.0, FIELD_MOST, "magnitude")
    dip = ops.bounded(
        unit_angle_ht(-up, flat, inverse), -0.5, 0.5, "dip", unless="the field is a few LSB"
    )
    return norm, dip, unit_angle_ht(east, north, flat_inverse)


def heading_of(
    x: Any, restart: Any, C: Any, field: Vector, turning: Any, p: Any, settings: Settings
) -> Heading:
    """Update with a sample of the field in body axes; C turns it to the averaging frame.

    ``turning``: the body turns fast enough to tell a new field from a magnet that it carries.
    """
    missing = ops.saturated(dot(field, field) - _SEEN_SQ, 1.0) < 0.0
    turned = [ops.bounded(c, -FIELD_MOST, FIELD_MOST, "field") for c in turn(C, field)]
    norm, dip, angle = _norm_and_dip(turned)

    # Norm and dip, low-passed.
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
    return Heading(delta, states, unknown=unknown, missing=missing, disturbed=disturbed)


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
