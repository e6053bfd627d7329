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

#: Letters of the axes of FLU and ENU, and of the opposite ones.
_BODY, _NAVIGATION = ("FLU", "BRD"), ("ENU", "WSD")


def _matrix(where: str, name: str, *letters: tuple[str, str]) -> FloatArray:
    """Columns: the axes of ``name`` in FLU or ENU."""
    for axes, opposite in letters:
        if len(name) == 3 and set(name) <= {*axes, *opposite}:
            columns = [
                np.eye(3)[axes.find(x)] if x in axes else -np.eye(3)[opposite.find(x)] for x in name
            ]
            matrix = np.stack(columns, axis=1)
            if np.linalg.det(matrix) > 0.5:
                return matrix
    allowed = "".join(dict.fromkeys("".join(chain.from_iterable(letters))))
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
