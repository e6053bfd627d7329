"""Axes by their letters: FLU, FRD and others of a body, ENU, NED and others of the earth.

A name says where the first, second and third axis point: F forward, B back, L left, R right, U up,
D down; E east, W west, N north, S south. Records have FLU and ENU.
"""

from __future__ import annotations

from itertools import chain

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.errors import InputError
from boresight.sim.rotations.rotation import matrix_to_quaternion, quaternion_multiply

#: Axis and sign of each letter, in FLU and in ENU.
_BODY = {"F": (0, 1), "B": (0, -1), "L": (1, 1), "R": (1, -1), "U": (2, 1), "D": (2, -1)}
_NAVIGATION = {"E": (0, 1), "W": (0, -1), "N": (1, 1), "S": (1, -1), "U": (2, 1), "D": (2, -1)}


def _matrix(where: str, name: str, *letters: dict[str, tuple[int, int]]) -> FloatArray:
    """Columns: the axes of ``name`` in FLU or ENU."""
    for axes in letters:
        if len(name) == 3 and set(name) <= set(axes):
            matrix = np.zeros((3, 3))
            for k, letter in enumerate(name):
                matrix[axes[letter][0], k] = axes[letter][1]
            if np.linalg.det(matrix) > 0.5:
                return matrix
    allowed = "".join(dict.fromkeys(chain.from_iterable(letters)))
    raise InputError.at(
        where,
        wanted=f"three letters of {allowed} for right-handed axes, as FRD or NED",
        found=repr(name),
        fix="name the frame of the file",
    )


def vector_from(where: str, frame: str, vectors: FloatArray) -> FloatArray:
    """Vectors (n, 3) of a body frame in FLU, or of a navigation frame in ENU.

    Raises
    ------
    InputError
        No frame of such a name.
    """
    matrix = _matrix(where, frame, _BODY, _NAVIGATION)
    axis = np.abs(matrix).argmax(axis=1)  # no sum of products: a missing component stays alone
    return np.asarray(vectors[:, axis] * matrix.sum(axis=1))


def attitude_from(where: str, frames: str, q: FloatArray) -> FloatArray:
    """Quaternions (n, 4), for example "FRD to NED", as FLU to ENU.

    Raises
    ------
    InputError
        No two frames of such names.
    """
    body, _, navigation = frames.partition(" to ")
    # v_enu = N v_n, v_b = B^T v_flu: q_enu_flu = q_N q q_B*.
    left = matrix_to_quaternion(_matrix(where, navigation, _NAVIGATION))
    right = matrix_to_quaternion(_matrix(where, body, _BODY).T)
    return quaternion_multiply(quaternion_multiply(left, q), right)
