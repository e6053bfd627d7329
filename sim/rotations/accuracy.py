"""Attitude error in degrees, measured as the BROAD benchmark does.

The error ``e = q_est q_ref*``, taken in navigation axes, is split into a turn about the vertical
(heading error) and the remaining tilt (inclination error). The figure of a run is the root mean
square of each over the samples that move and have a reference.

D. Laidig, M. Caruso, A. Cereatti, T. Seel, "BROAD - A Benchmark for Robust Inertial Orientation
Estimation", Data 6(7):72, 2021, doi 10.3390/data6070072.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from boresight.model.arrays import FloatArray
from boresight.model.declarations import QUATERNION
from boresight.sim.rotations import rotation


def attitude_of(outputs: Mapping[str, FloatArray]) -> FloatArray:
    """Quaternions (..., 4) of an attitude filter's outputs by name."""
    return np.moveaxis(np.stack([outputs[name] for name in QUATERNION]), 0, -1)


class AttitudeError(NamedTuple):
    """Error of each sample [deg], arrays (...,) in 0..180; NaN where a quaternion is NaN."""

    total: FloatArray
    heading: FloatArray
    inclination: FloatArray


def attitude_error(q_est: npt.ArrayLike, q_ref: npt.ArrayLike) -> AttitudeError:
    """Split the error of each sample into heading and inclination.

    With ``e = (w, x, y, z)`` the angles are ``2 acos|w|``, ``2 atan|z/w|`` and
    ``2 acos sqrt(w^2 + z^2)``; they are computed as arc tangents, which keep their digits near
    zero. Attitudes (..., 4) are b to n (ENU), of either sign; `InputError` if one has norm zero.
    """
    reference = rotation.quaternion_conjugate(rotation.quaternion_normalise(q_ref))
    error = rotation.quaternion_multiply(rotation.quaternion_normalise(q_est), reference)
    w, x, y, z = np.moveaxis(np.abs(error), -1, 0)
    tilt, turn = x * x + y * y, z * z
    return AttitudeError(
        total=np.degrees(2.0 * np.arctan2(np.sqrt(tilt + turn), w)),
        heading=np.degrees(2.0 * np.arctan2(z, w)),
        inclination=np.degrees(2.0 * np.arctan2(np.sqrt(tilt), np.sqrt(w * w + turn))),
    )


def largest_turn_deg(q_a: FloatArray, q_b: FloatArray) -> float:
    """Largest angle [deg] between two runs' attitudes (n, 4); NaN if there is none.

    Samples in which either is the zero quaternion, no attitude yet, do not count.
    """
    both = q_a.any(axis=1) & q_b.any(axis=1)
    if not both.any():
        return float("nan")
    return float(attitude_error(q_a[both], q_b[both]).total.max())
