"""Reusable parts of filters, written with the ordinary operations (`docs/operations.md`)."""

from boresight.model.blocks.biquad import Cascade
from boresight.model.blocks.moving import MovingSum
from boresight.model.blocks.table import interpolated

__all__ = ["Cascade", "MovingSum", "interpolated"]
