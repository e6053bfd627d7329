"""The magnetometer's part of VQF: heading, disturbed fields, new fields."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from boresight.model import ops
from boresight.model.algebra.angles import unit_angle_ht
from boresight.model.algebra.low_pass import filtered
from boresight.model.algebra.quaternion import Vector, dot, turn
from boresight.model.estimators.vqf.interface import Settings

__all__ = ["Heading", "heading_of"]

_SEEN_SQ = 0.01  #: uT^2, squared field from which on there is a sample.
_NORM_MOST = 444.0  #: uT


@dataclass(frozen=True)
class Heading:
    """What a magnetometer sample leaves: angle of the averaging frame, states, status."""

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
    flat = ops.bounded(flat_sq * flat_inverse, 0.0, _NORM_MOST, "magnitude")
    norm = ops.bounded(norm_sq * inverse, 0.0, _NORM_MOST, "magnitude")
    dip = ops.bounded(unit_angle_ht(-up, flat, inverse), -0.5, 0.5, "dip")
    return norm, dip, unit_angle_ht(east, north, flat_inverse)


def heading_of(
    x: Any, restart: Any, C: Any, field: Vector, turning: Any, p: Any, settings: Settings
) -> Heading:
    """Update with a sample of the field in body axes; C turns it to the averaging frame.

    ``turning``: the body turns fast enough to tell a new field from a magnet that it carries.
    """
    missing = ops.saturated(dot(field, field) - _SEEN_SQ, 1.0) < 0.0
    turned = [ops.bounded(c, -_NORM_MOST, _NORM_MOST, "field") for c in turn(C, field)]
    norm, dip, angle = _norm_and_dip(turned)

    # Norm and dip, low-passed.
    count = x.mag_count
    inverse = ops.bounded(1.0 / (count + 1.0), 0.0, 1.0, "1/n")
    low_pass = settings.field
    weights = low_pass.weights(count < low_pass.mean_samples - 0.5, inverse, missing)
    norms, norm_states = filtered(weights, low_pass, [(x.norm_z, x.norm_v)], [norm], _NORM_MOST)
    dips, dip_states = filtered(weights, low_pass, [(x.dip_z, x.dip_v)], [dip], 0.5)
    disturbed, after = _judged(x, norms[0], dips[0], turning, p, settings)

    # Gain: 1/n at first, none while a disturbance is rejected, half of it once that lasts too long.
    rejecting = x.rejected < settings.rejected_samples + 0.5
    usual = ops.where(disturbed, ops.where(rejecting, 0.0, 0.5 * p.mag_gain), p.mag_gain)
    first = ops.where(count < settings.first_samples - 0.5, inverse, 0.0)
    gain = ops.named("gain", ops.where(missing, 0.0, ops.maximum(usual, first)))
    delta = ops.wrap_ht(x.delta + gain * ops.wrap_ht(angle - x.delta))

    longer = ops.where(rejecting, x.rejected + 1.0, x.rejected)
    shorter = ops.maximum(x.rejected - 2.0, 0.0)
    after["rejected"] = ops.where(disturbed, longer, shorter)
    after["mag_count"] = ops.minimum(count + 1.0, float(settings.first_samples))
    states = {
        name: ops.where(restart, start, ops.where(missing, getattr(x, name), after[name]))
        for name, start in (
            ("ref_norm", 0.0),
            ("new_norm", -1.0),
            ("calm", 0.0),
            ("rejected", float(settings.rejected_samples)),
            ("mag_count", 0.0),
        )
    } | {
        name: ops.where(missing, getattr(x, name), after[name])
        for name in ("ref_dip", "new_dip", "new_turning")
    }
    states |= {"norm_z": norm_states[0][0], "norm_v": norm_states[0][1]}
    states |= {"dip_z": dip_states[0][0], "dip_v": dip_states[0][1], "delta": ops.where(restart, 0.0, delta)}
    return Heading(
        delta,
        states,
        unknown=states["mag_count"] < 0.5,
        missing=missing,
        disturbed=states["calm"] < settings.calm_samples - 0.5,
    )


def _judged(
    x: Any, norm: Any, dip: Any, turning: Any, p: Any, settings: Settings
) -> tuple[Any, dict[str, Any]]:
    """Whether the field is disturbed, and the next reference and candidate for a new one."""
    enough_first, enough = settings.candidate_samples

    def near(before: tuple[Any, Any]) -> Any:
        d_norm, d_dip = ops.absolute(norm - before[0]), ops.absolute(dip - before[1])
        return (d_norm < p.norm_share * before[0]) & (d_dip < p.dip_limit)

    def followed(before: tuple[Any, Any]) -> tuple[Any, Any]:
        return (
            before[0] + p.field_gain * (norm - before[0]),
            before[1] + p.field_gain * (dip - before[1]),
        )

    reference, candidate = (x.ref_norm, x.ref_dip), (x.new_norm, x.new_dip)
    at_reference, at_candidate = near(reference), near(candidate)
    full = float(settings.calm_samples)
    calm = ops.where(at_reference, ops.minimum(x.calm + 1.0, full), 0.0)
    quiet = calm > full - 0.5
    ref = [ops.where(quiet, c, b) for c, b in zip(followed(reference), reference, strict=True)]
    new = [
        ops.where(at_candidate, c, b) for c, b in zip(followed(candidate), (norm, dip), strict=True)
    ]
    longer = ops.minimum(x.new_turning + 1.0, float(enough))
    longer = ops.where(turning, longer, x.new_turning)
    for_long = ops.where(at_candidate, longer, 0.0)
    needed = ops.where(x.ref_norm > 0.0, enough - 0.5, enough_first - 0.5)
    accepted = ~quiet & (for_long > needed)
    after = {
        "ref_norm": ops.where(accepted, new[0], ref[0]),
        "ref_dip": ops.where(accepted, new[1], ref[1]),
        "new_norm": new[0],
        "new_dip": new[1],
        "new_turning": for_long,
        "calm": ops.where(accepted, full, calm),
    }
    return ~quiet & ~accepted, after
