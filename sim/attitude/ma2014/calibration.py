"""How a sensor sits on its platform: mean triad matrix and its polar orthogonalisation.

Ma Long et al. (2014), section 2.2: the platform turns about each of its axes; the sensors see the
axes as vectors s. With S = [s_x s_y s_z] and B = [b_x b_y b_z] the same axes in platform
coordinates,

    T = mean over the repetitions of S B^-1,        T_0 = T (T^T T)^(-1/2).

T_0 is the orthogonal matrix nearest to T. With the singular values of T = U D V^T it is U V^T.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from boresight.model.arrays import FloatArray
from boresight.model.errors import InputError

__all__ = ["nearest_rotation", "orthogonality_error", "triad_matrix"]


def triad_matrix(s: npt.ArrayLike, b: npt.ArrayLike) -> FloatArray:
    """Mean of ``S B^-1``, from platform to sensor axes: (3, 3).

    ``s`` (repetitions, 3, 3) are axes as the sensor saw them, ``b`` (3, 3) the same in platform
    coordinates, one column each. `InputError` if a shape is wrong, a value is not finite, or the
    axes b lie in a plane.
    """
    s, b = np.asarray(s, dtype=np.float64), np.asarray(b, dtype=np.float64)
    if s.ndim != 3 or s.shape[1:] != (3, 3) or not len(s) or b.shape != (3, 3):
        raise InputError(
            f"s and b must have the shapes (n, 3, 3) and (3, 3), not {s.shape} and {b.shape}"
        )
    if not (np.isfinite(s).all() and np.isfinite(b).all()):
        raise InputError("s and b must be finite")
    if abs(np.linalg.det(b)) < 1e-6 * float(np.prod(np.linalg.norm(b, axis=0))):
        raise InputError("the axes in b must not lie in one plane")
    return np.asarray((s @ np.linalg.inv(b)).mean(axis=0))  # T = mean S B^-1


def nearest_rotation(t: npt.ArrayLike) -> FloatArray:
    """The rotation nearest to a matrix: ``T (T^T T)^(-1/2)`` (3, 3).

    `InputError` if T is singular or a reflection, which have no solution.
    """
    t = np.asarray(t, dtype=np.float64)
    if t.shape != (3, 3) or not np.isfinite(t).all():
        raise InputError(f"T must be a finite matrix of shape (3, 3), not {t.shape}")
    u, d, vt = np.linalg.svd(t)
    if d[-1] <= 1e-9 * d[0] or np.linalg.det(t) < 0.0:
        raise InputError(
            "T must have a determinant above 0: check the order and the signs of "
            f"the axes (determinant {np.linalg.det(t):.3g})"
        )
    return np.asarray(u @ vt)  # T = U D V^T, T^T T = V D^2 V^T


def orthogonality_error(t: npt.ArrayLike) -> float:
    """Largest element of ``|T^T T - I|``: 0 for an orthogonal matrix."""
    t = np.asarray(t, dtype=np.float64)
    return float(np.abs(t.T @ t - np.eye(3)).max())
