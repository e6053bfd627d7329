"""Attitude maths in float64: quaternions, rotation matrices, Euler angles, rotation vectors.

Conventions of every function here:

- A quaternion is Hamilton, scalar first ``(w, x, y, z)``, and turns body axes (b) into navigation
  axes (n = East, North, Up): ``v_n = q v_b q*``. Its matrix is ``c_nb``: ``v_n = c_nb v_b``.
- Euler angles are ``(theta, gamma, psi)`` = (pitch about x, roll about y, heading about z), in
  radians, of the intrinsic sequence z-x'-y'': ``c_nb = Rz(psi) Rx(theta) Ry(gamma)``. The heading
  is positive counter-clockwise seen from above.
- The last axis (two last axes for a matrix) holds the components, all axes before it are free and
  broadcast: ``(..., 4)``, ``(..., 3, 3)``, ``(..., 3)``.
- NaN goes in, NaN comes out. A quaternion of norm zero is an `InputError`, for it has no attitude.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.model.arrays import FloatArray
from boresight.model.errors import InputError

#: Half angle [rad] below which sin(x)/x is written as its series: the first term left out,
#: x^4/120, is then below 2^-53.
_SERIES_BELOW = 3e-4


def _components(value: npt.ArrayLike, shape: tuple[int, ...], what: str) -> FloatArray:
    array = np.asarray(value, dtype=np.float64)
    if array.shape[-len(shape) :] != shape:
        wanted = ", ".join(["...", *map(str, shape)])
        raise InputError(f"{what} must have the shape ({wanted}), not {array.shape!r}")
    return array


def _stack(*parts: npt.NDArray[Any]) -> FloatArray:
    """Components (...,) as (..., n), each in one piece of memory, where arithmetic is fast."""
    whole = np.empty((len(parts), *np.broadcast_shapes(*(part.shape for part in parts))))
    for k, part in enumerate(parts):
        whole[k] = part
    return np.moveaxis(whole, 0, -1)


def quaternion_multiply(p: npt.ArrayLike, q: npt.ArrayLike) -> FloatArray:
    """Hamilton product ``p q`` (..., 4): the attitude that turns by q first, then by p."""
    pw, px, py, pz = np.moveaxis(_components(p, (4,), "p"), -1, 0)
    qw, qx, qy, qz = np.moveaxis(_components(q, (4,), "q"), -1, 0)
    return _stack(
        pw * qw - px * qx - py * qy - pz * qz,
        pw * qx + px * qw + py * qz - pz * qy,
        pw * qy - px * qz + py * qw + pz * qx,
        pw * qz + px * qy - py * qx + pz * qw,
    )


def quaternion_running_product(start: npt.ArrayLike, turns: npt.ArrayLike) -> FloatArray:
    """``start t_0 t_1 ... t_k`` for every k, of turns (n, 4) in body axes: (n, 4).

    In numbers of Python's own: of one quaternion at a time numpy spends its time in calls.
    """
    w, x, y, z = _components(start, (4,), "start").tolist()
    out = []
    for a, b, c, d in _components(turns, (4,), "turns").tolist():
        w, x, y, z = (
            w * a - x * b - y * c - z * d,
            w * b + x * a + y * d - z * c,
            w * c - x * d + y * a + z * b,
            w * d + x * c - y * b + z * a,
        )
        out.append((w, x, y, z))
    return np.array(out).reshape(-1, 4)


def quaternion_conjugate(q: npt.ArrayLike) -> FloatArray:
    """Conjugate ``q*`` (..., 4); the inverse attitude if q has norm one."""
    return np.asarray(_components(q, (4,), "q") * np.array([1.0, -1.0, -1.0, -1.0]))


def quaternion_normalise(q: npt.ArrayLike) -> FloatArray:
    """Scale quaternions (..., 4) to norm one; the sign stays."""
    q = _components(q, (4,), "q")
    norm = np.linalg.norm(q, axis=-1, keepdims=True)
    if np.any(norm == 0.0):
        raise InputError("q must have a norm above zero, not 0.0: it holds no attitude")
    return np.asarray(q / norm, dtype=np.float64)


def quaternion_to_matrix(q: npt.ArrayLike) -> FloatArray:
    """Rotation matrix ``c_nb`` (..., 3, 3) of a quaternion of any norm above zero."""
    w, x, y, z = np.moveaxis(quaternion_normalise(q), -1, 0)
    return np.stack(
        [
            _stack(1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
            _stack(2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
            _stack(2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
        ],
        axis=-2,
    )


def matrix_to_quaternion(c_nb: npt.ArrayLike) -> FloatArray:
    """Quaternion (..., 4) of norm one of a rotation matrix, which is not checked; ``w >= 0``.

    Four times the product of each component with every other one is a sum of matrix elements.
    Of the four rows of products the one with the largest diagonal is taken, so that no
    digits are lost at any attitude (Shepperd 1978).
    """
    c = _components(c_nb, (3, 3), "c_nb")
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = np.moveaxis(c, (-2, -1), (0, 1))
    wx, wy, wz = zy - yz, xz - zx, yx - xy
    xy, xz, yz = xy + yx, xz + zx, yz + zy
    products = np.stack(
        [
            _stack(1 + xx + yy + zz, wx, wy, wz),
            _stack(wx, 1 + xx - yy - zz, xy, xz),
            _stack(wy, xy, 1 - xx + yy - zz, yz),
            _stack(wz, xz, yz, 1 - xx - yy + zz),
        ],
        axis=-2,
    )
    best = np.argmax(np.diagonal(products, axis1=-2, axis2=-1), axis=-1)
    row = np.take_along_axis(products, best[..., None, None], axis=-2)[..., 0, :]
    q = quaternion_normalise(row)
    return np.where(q[..., :1] < 0.0, -q, q)


def rotate(q: npt.ArrayLike, v_b: npt.ArrayLike) -> FloatArray:
    """Turn vectors (..., 3): ``v_n = q v_b q*``. With the conjugate of q it goes from n to b."""
    w, x, y, z = np.moveaxis(quaternion_normalise(q), -1, 0)
    a, b, c = np.moveaxis(_components(v_b, (3,), "v_b"), -1, 0)
    # t = 2 r x v,  v' = v + w t + r x t   with q = (w, r) of norm one
    t, u, v = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return _stack(
        a + w * t + (y * v - z * u), b + w * u + (z * t - x * v), c + w * v + (x * u - y * t)
    )


def euler_to_matrix(euler: npt.ArrayLike) -> FloatArray:
    """Rotation matrix ``c_nb = Rz(psi) Rx(theta) Ry(gamma)`` (..., 3, 3) of any angles."""
    return quaternion_to_matrix(euler_to_quaternion(euler))


def matrix_to_euler(c_nb: npt.ArrayLike) -> FloatArray:
    """Euler angles (..., 3) of a rotation matrix: theta in [-pi/2, pi/2], others in [-pi, pi].

    The roll is read off the bottom row; the heading is then what is left after that roll is
    undone. So the three angles together always give the matrix back to rounding, even where pitch
    is +-90 degrees and only ``psi +- gamma`` has a meaning.
    """
    c = _components(c_nb, (3, 3), "c_nb")
    # bottom row: (-cos(theta) sin(gamma), sin(theta), cos(theta) cos(gamma))
    theta = np.arctan2(c[..., 2, 1], np.hypot(c[..., 2, 0], c[..., 2, 2]))
    gamma = np.arctan2(-c[..., 2, 0], c[..., 2, 2])
    # first column of c_nb Ry(gamma)^T = Rz(psi) Rx(theta): (cos(psi), sin(psi), 0)
    sg, cg = np.sin(gamma), np.cos(gamma)
    psi = np.arctan2(c[..., 1, 0] * cg + c[..., 1, 2] * sg, c[..., 0, 0] * cg + c[..., 0, 2] * sg)
    return _stack(theta, gamma, psi)


def euler_to_quaternion(euler: npt.ArrayLike) -> FloatArray:
    """Quaternion (..., 4) of any Euler angles: ``qz(psi) qx(theta) qy(gamma)``.

    It is a smooth function of the angles: the sign is not forced, and a heading that grows by a
    full turn ends at ``-q``.
    """
    return about_axes(_components(euler, (3,), "euler"), (3, 1, 2))


def about_axes(angles: FloatArray, axes: tuple[int, int, int]) -> FloatArray:
    """Product (..., 4) of turns by ``angles`` (..., 3) [rad] about x, y, z, as ordered."""
    q = np.array([1.0, 0.0, 0.0, 0.0])
    for axis in axes:
        part = np.zeros((*angles.shape[:-1], 4))
        half = 0.5 * angles[..., axis - 1]
        part[..., 0], part[..., axis] = np.cos(half), np.sin(half)
        q = quaternion_multiply(q, part)
    return q


def quaternion_to_euler(q: npt.ArrayLike) -> FloatArray:
    """Euler angles (..., 3) of a quaternion of any norm above zero; see `matrix_to_euler`."""
    return matrix_to_euler(quaternion_to_matrix(q))


def rotation_vector_to_quaternion(phi: npt.ArrayLike) -> FloatArray:
    """Quaternion (..., 4) of norm one of the turn by ``|phi|`` about ``phi`` [rad].

    A constant body rate w over a time dt takes q to ``q rotation_vector_to_quaternion(w dt)``.
    """
    phi = _components(phi, (3,), "phi")
    half = 0.5 * np.linalg.norm(phi, axis=-1, keepdims=True)
    small = half < _SERIES_BELOW
    safe = np.where(small, 1.0, half)
    # sin(h)/h = 1 - h^2/6 + h^4/120 - ...
    sinc = np.where(small, 1.0 - half * half / 6.0, np.sin(safe) / safe)
    return np.concatenate([np.cos(half), 0.5 * sinc * phi], axis=-1)


def quaternion_to_rotation_vector(q: npt.ArrayLike) -> FloatArray:
    """Rotation vector (..., 3) [rad] of the shortest turn that q, or -q, stands for."""
    q = quaternion_normalise(q)
    q = np.where(q[..., :1] < 0.0, -q, q)
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    half = np.arctan2(sine, q[..., :1])
    small = half < _SERIES_BELOW
    safe = np.where(small, 1.0, sine)
    # h/sin(h) = 1 + h^2/6 + 7 h^4/360 + ...
    factor = np.where(small, 1.0 + half * half / 6.0, half / safe)
    return np.asarray(2.0 * factor * q[..., 1:], dtype=np.float64)


def turns_between(p: npt.ArrayLike, q: npt.ArrayLike) -> FloatArray:
    """Rotation vectors (..., 3) [rad], in body axes, that take attitudes p to attitudes q."""
    return quaternion_to_rotation_vector(quaternion_multiply(quaternion_conjugate(p), q))


def angle_between(p: npt.ArrayLike, q: npt.ArrayLike) -> FloatArray:
    """Angles (...,) [rad], 0 to pi, of the turns that take attitudes p to attitudes q (..., 4)."""
    p, q = np.asarray(p), np.asarray(q)
    chord = np.minimum(np.linalg.norm(p - q, axis=-1), np.linalg.norm(p + q, axis=-1))
    return np.asarray(4.0 * np.arcsin(0.5 * chord))  # |p - q| = 2 sin(angle / 4)
