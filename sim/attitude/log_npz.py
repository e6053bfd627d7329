"""Archive form of a log: numpy's ``.npz`` with one array per sensor."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.model.errors import InputError
from boresight.sim.attitude.log_checks import check_samples, clean_arrays, clean_rate, index_place
from boresight.sim.records.archive import arrays_of

__all__ = ["format_npz", "parse_npz"]

_REQUIRED = ("t", "gyr", "acc", "mag")
_OPTIONAL = ("q", "mov", "restart", "fs")


def format_npz(arrays: Mapping[str, npt.ArrayLike]) -> bytes:
    """Pack arrays into the bytes of an ``.npz`` file.

    Parameters
    ----------
    arrays : mapping
        ``t, gyr, acc, mag`` and perhaps ``q, mov, restart, fs``.
    """
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **{k: np.asarray(v) for k, v in arrays.items()})
    return buffer.getvalue()


def parse_npz(path: Path, content: bytes) -> dict[str, Any]:
    """Unpack and check the content of an ``.npz`` log; other arrays in it are left alone.

    Parameters
    ----------
    path : Path
        For messages only.
    content : bytes
        The file.

    Returns
    -------
    dict
        Float64 arrays ``t`` (n,), ``gyr``, ``acc``, ``mag`` (n, 3); if they are there ``q``
        (n, 4), ``mov`` and ``restart`` (n,) of bool, and ``fs``, a float.

    Raises
    ------
    InputError
        If the content is not a log; the message names the array and the index, from 0.
    """
    held: dict[str, Any] = dict(arrays_of(path, content, (*_REQUIRED, *_OPTIONAL)))
    missing = [key for key in _REQUIRED if key not in held]
    if missing:
        raise InputError.at(
            str(path),
            wanted=f"the arrays {', '.join(_REQUIRED)}",
            found=f"none named {' or '.join(missing)}",
            fix="add what is missing",
        )
    rate = held.pop("fs", None)
    arrays = clean_arrays(str(path), held)
    check_samples(arrays, index_place(str(path)))
    if rate is not None:
        arrays["fs"] = clean_rate(str(path), rate)
    return arrays
