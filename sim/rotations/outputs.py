"""An attitude filter's outputs as attitudes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.declarations import QUATERNION


def attitude_of(outputs: Mapping[str, FloatArray]) -> FloatArray:
    """Quaternions (..., 4) of output records by name."""
    return np.moveaxis(np.stack([outputs[name] for name in QUATERNION]), 0, -1)
