"""Root mean square errors of attitudes, computed apart from `sim.accuracy.figures`."""

from __future__ import annotations

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.sim.rotations.accuracy import AttitudeError, attitude_error


def attitude_rmse(q: FloatArray, reference: FloatArray) -> AttitudeError:
    """Of all samples that have a reference (n, 4)."""
    known = np.isfinite(reference).all(axis=1)
    errors = attitude_error(q[known], reference[known])
    return AttitudeError(*(np.sqrt(np.mean(np.square(e))) for e in errors))
