"""Float references: mag/acc alone, eq. (4)-(7), and the paper's filter to the letter.

These are not estimators of this project; they show what the shipped filter's changes to the paper
(`docs/systems/complementary.md`) do to the numbers.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.sim.rotations.rotation import wrap_rad

__all__ = ["filter_to_the_letter", "mag_acc_angles"]


def mag_acc_angles(acc: FloatArray, mag: FloatArray, field: Sequence[float]) -> FloatArray:
    """Pitch, roll, heading [rad] of each sample alone (..., 3), eq. (4)-(7).

    Parameters
    ----------
    acc, mag : (..., 3)
        Specific force and field, body axes.
    field : three floats
        Field in navigation axes, of which the horizontal part counts.
    """
    fx, fy, fz = np.moveaxis(acc / np.linalg.norm(acc, axis=-1, keepdims=True), -1, 0)
    theta, gamma = np.arcsin(np.clip(fy, -1.0, 1.0)), np.arctan2(-fx, fz)  # (4)
    st, ct, sg, cg = np.sin(theta), np.cos(theta), np.sin(gamma), np.cos(gamma)
    mx, my, mz = np.moveaxis(mag, -1, 0)
    hx = cg * mx + sg * mz  # (5)
    hy = st * sg * mx + ct * my - st * cg * mz
    psi = np.arctan2(hx * field[1] - hy * field[0], hx * field[0] + hy * field[1])  # (7)
    return np.stack([theta, gamma, psi], axis=-1)


def _rates(x: FloatArray, w: FloatArray, as_printed: bool) -> FloatArray:
    """Euler rates, eq. (3): of z-x'-y'', or as printed."""
    st, ct, sg, cg = np.sin(x[..., 0]), np.cos(x[..., 0]), np.sin(x[..., 1]), np.cos(x[..., 1])
    wx, wy, wz = np.moveaxis(w, -1, 0)
    if as_printed:
        cross_rate = st * wy + ct * wz
        return np.stack([wx + sg / cg * cross_rate, ct * wy - st * wz, cross_rate / cg], axis=-1)
    cross_rate = cg * wz - sg * wx
    return np.stack([cg * wx + sg * wz, wy - st / ct * cross_rate, cross_rate / ct], axis=-1)


def filter_to_the_letter(
    measured: FloatArray,
    gyr: FloatArray,
    dt: float,
    kp: Sequence[float],
    ki: Sequence[float],
    *,
    as_printed: bool = False,
) -> FloatArray:
    """Eq. (13) with gains per sample: angles [rad] (n, ..., 3).

    Midpoint rule, then correction with the residual of the same sample::

        x' = x + dt rate(x + dt/2 rate(x, w), w)
        e = wrap(x' - x_m),   I += Ki e,   x = x' - Kp e - I

    Parameters
    ----------
    measured : (n, ..., 3)
        `mag_acc_angles`; the first is the start (section 3.2).
    gyr : (n, ..., 3)
        [rad/s]
    """
    x, integral = measured[0].copy(), np.zeros_like(measured[0])
    out = np.empty_like(measured)
    out[0] = x
    p, i = np.asarray(kp), np.asarray(ki)
    for k in range(1, len(measured)):
        midpoint = x + 0.5 * dt * _rates(x, gyr[k], as_printed)
        x = x + dt * _rates(midpoint, gyr[k], as_printed)
        e = wrap_rad(x - measured[k])
        integral = integral + i * e
        x = wrap_rad(x - p * e - integral)
        out[k] = x
    return out
