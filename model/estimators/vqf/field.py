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
    start = {
        "ref_norm": 0.0,
        "ref_dip": 0.0,
        "new_norm": -1.0,
        "new_dip": 0.0,
        "new_turning": 0.0,
        "calm": 0.0,
        "rejected": float(settings.rejected_samples),
        "mag_count": 0.0,
    }
    old = {name: ops.where(restart, c, getattr(x, name)) for name, c in start.items()}
    missing = ops.saturated(dot(field, field) - _SEEN_SQ, 1.0) < 0.0
    turned = [ops.bounded(c, -_NORM_MOST, _NORM_MOST, "field") for c in turn(C, field)]
    norm, dip, angle = _norm_and_dip(turned)

    # Norm and dip, low-passed.
    count = old["mag_count"]
    inverse = ops.bounded(1.0 / (count + 1.0), 0.0, 1.0, "1/n")
    low_pass = settings.field
    weights = low_pass.weights(count < low_pass.mean_samples - 0.5, inverse, missing)
    norms, norm_states = filtered(weights, low_pass, [(x.norm_z, x.norm_v)], [norm], _NORM_MOST)
    dips, dip_states = filtered(weights, low_pass, [(x.dip_z, x.dip_v)], [dip], 0.5)
    disturbed, after = _judged(old, norms[0], dips[0], turning, p, settings)

    # Gain: 1/n at first, none while a disturbance is rejected, half of it once that lasts too long.
    rejecting = old["rejected"] < settings.rejected_samples + 0.5
    usual = ops.where(disturbed, ops.where(rejecting, 0.0, 0.5 * p.mag_gain), p.mag_gain)
    first = ops.where(count < settings.first_samples - 0.5, inverse, 0.0)
    gain = ops.named("gain", ops.where(missing, 0.0, ops.maximum(usual, first)))
    before = ops.where(restart, 0.0, x.delta)
    delta = ops.wrap_ht(before + gain * ops.wrap_ht(angle - before))

    rejected = old["rejected"]
    after["rejected"] = ops.where(
        disturbed,
        ops.where(rejecting, rejected + 1.0, rejected),
        ops.maximum(rejected - 2.0, 0.0),
    )
    after["mag_count"] = ops.minimum(count + 1.0, float(settings.first_samples))
    states = {name: ops.where(missing, old[name], value) for name, value in after.items()}
    states |= {"norm_z": norm_states[0][0], "norm_v": norm_states[0][1]}
    states |= {"dip_z": dip_states[0][0], "dip_v": dip_states[0][1], "delta": delta}
    return Heading(
        delta,
        states,
        unknown=states["mag_count"] < 0.5,
        missing=missing,
        disturbed=states["calm"] < settings.calm_samples - 0.5,
    )


def _judged(
    old: dict[str, Any], norm: Any, dip: Any, turning: Any, p: Any, settings: Settings
) -> tuple[Any, dict[str, Any]]:
    """Whether the field is disturbed, and the next reference and candidate for a new one."""
    follow = settings.reference_gain
    enough_first, enough = settings.candidate_samples

    def near(kind: str) -> Any:
        d_norm = ops.absolute(norm - old[f"{kind}_norm"])
        d_dip = ops.absolute(dip - old[f"{kind}_dip"])
        return (d_norm < p.norm_share * old[f"{kind}_norm"]) & (d_dip < p.dip_limit)

    def followed(kind: str) -> tuple[Any, Any]:
        before = old[f"{kind}_norm"], old[f"{kind}_dip"]
        return (
            before[0] + follow * (norm - before[0]),
            before[1] + follow * (dip - before[1]),
        )

    at_reference, at_candidate = near("ref"), near("new")
    full = float(settings.calm_samples)
    calm = ops.where(at_reference, ops.minimum(old["calm"] + 1.0, full), 0.0)
    quiet = ~(calm < full - 0.5)
    ref = [
        ops.where(quiet, c, old[f"ref_{n}"])
        for n, c in zip(("norm", "dip"), followed("ref"), strict=True)
    ]
    new = [
        ops.where(at_candidate, c, now)
        for c, now in zip(followed("new"), (norm, dip), strict=True)
    ]
    longer = ops.where(turning, ops.minimum(old["new_turning"] + 1.0, float(enough)), old["new_turning"])
    for_long = ops.where(at_candidate, longer, 0.0)
    needed = ops.where(old["ref_norm"] > 0.0, enough - 0.5, enough_first - 0.5)
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
