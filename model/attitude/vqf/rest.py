"""Whether the body rests: gyro and accelerometer stay near their means, the former near zero."""

from __future__ import annotations

from typing import Any

from boresight.model import ops
from boresight.model.algebra.low_pass import filtered
from boresight.model.algebra.quaternion import dot
from boresight.model.attitude.vqf.settings import ACC_MOST, CLIP_RAD_S, RATE_MOST, Settings, counted


def rest_of(
    x: Any, u: Any, p: Any, inverse: Any, settings: Settings
) -> tuple[Any, list[Any], dict[str, Any]]:
    """Still samples so far, the low-passed rate, and the states of both low-passes."""
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
