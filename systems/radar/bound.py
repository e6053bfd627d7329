"""The Cramer-Rao bound of two radars' biases from one target."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pymap3d

from boresight.model.arrays import FloatArray


def jacobian(site: Sequence[float], seen: FloatArray) -> FloatArray:
    """dX/d(rho, e, n) (n, 3, 3), earth-fixed, at ranges, elevations, azimuths (n, 3)."""
    longitude, latitude, _ = site
    r, e, n = seen.T
    ce, se, cn, sn, zero = np.cos(e), np.sin(e), np.cos(n), np.sin(n), np.zeros_like(r)
    along = [ce * sn, ce * cn, se]
    up = [-r * se * sn, -r * se * cn, r * ce]
    local = np.array([along, up, [r * ce * cn, -r * ce * sn, zero]]).transpose(2, 1, 0)
    axes = np.stack([pymap3d.enu2uvw(*unit, latitude, longitude) for unit in np.eye(3)], axis=1)
    return np.asarray(axes @ local)


def information(jacobians: Sequence[FloatArray], noise: FloatArray) -> FloatArray:
    """Information of the records up to each about the six biases, (n, 6, 6): sum of H^T R^-1 H.

    With H = [J_1, -J_2] and R = H diag(noise)^2 H^T, the target being unknown.
    """
    h = np.concatenate([jacobians[0], -jacobians[1]], axis=2)
    r = h @ np.diag(noise**2) @ h.transpose(0, 2, 1)
    each = h.transpose(0, 2, 1) @ np.linalg.solve(r, h)
    return np.asarray(np.cumsum(each, axis=0))


def covariances(
    jacobians: Sequence[FloatArray], noise: FloatArray, prior: FloatArray
) -> FloatArray:
    """Least covariance (n, 6, 6) after each record of biases known before to ``prior`` (6,).

    Infinite ``prior``: nothing is known. Where the biases are not determined, infinite.
    """
    # In units of the noise, where the matrices are near one.
    total = information(jacobians, noise) * np.outer(noise, noise) + np.diag((noise / prior) ** 2)
    values, vectors = np.linalg.eigh(total)
    determined = values[:, :1] > 1e-13 * values[:, -1:]
    inverse = np.where(determined, 1.0 / np.where(determined, values, 1.0), np.inf)
    with np.errstate(invalid="ignore"):
        scaled = np.einsum("nij,nj,nkj->nik", vectors, inverse, vectors) * np.outer(noise, noise)
    return np.asarray(np.where(determined[:, :, None], scaled, np.inf))


def deviations(p: FloatArray) -> FloatArray:
    """Standard deviations (n, k) of covariances (n, k, k)."""
    return np.asarray(np.sqrt(np.einsum("nii->ni", p)))
