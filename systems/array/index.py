"""Measurement by an index of the azimuth, in both readings; scaled as the filter's states are."""

from __future__ import annotations

import math
from typing import Any

from boresight import ops
from boresight.model.algebra.quaternion import dot
from boresight.model.algebra.scalar_update import Measured, Update
from boresight.model.algebra.strapdown import Angles, Sample
from boresight.systems.array.error_filter import PHI, SCALE
from boresight.systems.array.interface import UNITS


def heading_row(seen: Angles) -> dict[int, Any]:
    """d(heading)/d(phi) times cos(pitch): (C_12 sin, C_22 sin, -cos^2)/cos, of unit length."""
    share = UNITS["tilt"] / UNITS["heading"]
    level = [ops.saturated(y * seen.secant, 1.0) for y in seen.y[:2]]
    tilt = [share * (y * seen.y[2]) for y in level]
    return dict(zip(PHI, [*tilt, -seen.cosine], strict=True))


def offset(u: Any, sample: Sample, seen: Angles) -> Any:
    """Heading at the index less the azimuth there [half turns].

    heading' = (w_z C_33 + w_x C_31)/cos^2(pitch)
    """
    along = (sample.turn[2] * seen.up[1] + sample.turn[0] * seen.up[0]) * seen.secant
    along = ops.saturated(ops.saturated(along, 2.0**-5) * seen.secant, 2.0**-4)
    passed = (1.0 / math.pi) * (along - along * u.index_time)
    return ops.wrap_ht(seen.outputs["heading"] - passed - u.azimuth)


def fix(p: Any, seen: Angles, off: Any) -> Measured:
    """The heading: z cos(pitch) = row . phi."""
    root = (1.0 / UNITS["heading"]) * p.index_sd * seen.cosine
    z = ops.saturated((math.pi / UNITS["heading"]) * off, 8.0) * seen.cosine
    return Measured(heading_row(seen), z, root * root)


def change(x: Any, p: Any, off: Any, turned: Any) -> Measured:
    """The scale factor, (change - 360 deg)/360 deg over one turn; after more or less, nothing."""
    full_turn = (turned < 3.0) & (turned > -3.0)
    difference = ops.flip(turned < 0.0, ops.wrap_ht(off - x.last_off))
    z = ops.saturated((0.5 / UNITS["scale"]) * ops.where(full_turn, difference, 0.0), 8.0)
    root = ops.saturated((math.sqrt(0.5) / math.pi / UNITS["scale"]) * p.index_sd, 1.0)
    return Measured({SCALE: ops.where(full_turn, 1.0, 0.0)}, z, root * root)


def corrected(off: Any, seen: Angles, update: Update) -> Any:
    """The offset after a correction, which is no change that the gyro saw: less row . phi/cos."""
    row = heading_row(seen)
    along = ops.saturated(dot(list(row.values()), [update.gain[k] for k in row]), 1.0)
    angle = ops.saturated(along * (UNITS["heading"] * update.move), 0.25)
    angle = ops.saturated(angle * seen.secant, 0.5)
    return ops.wrap_ht(off - (1.0 / math.pi) * angle)
