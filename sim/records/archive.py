"""``.npz`` archives: one array for each column, or the nine-axis form ``t, gyr, acc, mag``.

The nine-axis form holds ``gyr``, ``acc``, ``mag`` (n, 3) and optionally ``q`` (n, 4): they become
the columns ``gx`` to ``mz`` and ``qw`` to ``qz``. With ``fs``, or ``restart``, there is a column
``dt``: 1/fs or the differences of ``t``, and `RESTART_S` where a filter restarts.
"""

from __future__ import annotations

import io
import zipfile
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.model.arrays import FloatArray
from boresight.model.declarations import QUATERNION
from boresight.model.errors import InputError
from boresight.sim.records.nine_axis import TRIADS
from boresight.sim.records.record import (
    RESTART_S,
    Record,
    columns_of,
    index_place,
    name_of,
    steps_of,
)

__all__ = ["format_npz", "heads_of", "parse_npz", "record_of_arrays"]

#: Arrays of the nine-axis form, and their columns.
_TRIPLES = {**{key: names for key, (names, _) in TRIADS.items()}, "q": QUATERNION}
#: Exceptions of numpy, zipfile and zlib for bytes that are not an archive, or a damaged one.
_UNREADABLE = (
    AttributeError,
    EOFError,
    KeyError,
    MemoryError,
    OSError,
    RuntimeError,
    ValueError,
    zipfile.BadZipFile,
    zlib.error,
)


#: Bytes of all arrays of an archive, at most.
_LARGEST = 4 << 30


def format_npz(record: Record) -> bytes:
    """Pack a record: one array for each column."""
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **heads_of(record))
    return buffer.getvalue()


def heads_of(record: Record) -> dict[str, FloatArray]:
    """Columns of a record by name, with their units in brackets."""
    return {
        name if column.unit is None else f"{name}[{column.unit}]": column.values
        for name, column in record.columns.items()
    }


def _arrays_of(path: Path, content: bytes) -> dict[str, npt.NDArray[Any]]:
    """Arrays of an archive; raises InputError unless it is one of plain arrays."""
    try:
        archive = np.load(io.BytesIO(content), allow_pickle=False)
        sizes = [info.file_size for info in archive.zip.infolist()]
        if sum(sizes) > _LARGEST:
            raise InputError.at(
                str(path),
                wanted=f"at most {_LARGEST >> 30} GiB of arrays",
                found=f"{sum(sizes) / 2**30:.3g} GiB, unpacked",
                fix="write it as Parquet, which is read in pieces",
            )
        arrays = {key: archive[key] for key in archive.files}
        if not all(isinstance(array, np.ndarray) for array in arrays.values()):
            raise ValueError("a member that is no array")
        return arrays
    except _UNREADABLE:
        raise InputError.at(
            str(path),
            wanted="an .npz archive of plain arrays",
            found="a file that cannot be read as one",
            fix="write it with numpy.savez; a CSV log must not be named .npz",
        ) from None


def parse_npz(path: Path, content: bytes) -> Record:
    """Unpack and check the content of an ``.npz`` log.

    Parameters
    ----------
    path : Path
        Path for the record's name and messages.
    content : bytes
        The file.

    Raises
    ------
    InputError
        The content is not such an archive; the message names array and index, from 0.
    """
    return record_of_arrays(path, list(_arrays_of(path, content).items()))


def record_of_arrays(path: Path, named: Sequence[tuple[str, npt.NDArray[Any]]]) -> Record:
    """The record of a file's arrays: one for each column, or the nine-axis form.

    Raises
    ------
    InputError
        None, two of one name, or one that is no column; the message names array and index, from 0.
    """
    arrays = dict(named)
    if not arrays:
        raise InputError.at(
            str(path), wanted="arrays", found="an empty archive", fix="store one array per column"
        )
    if len(arrays) < len(named):
        names = [name for name, _ in named]
        duplicate = next(name for name in names if names.count(name) > 1)
        raise InputError.at(
            str(path),
            wanted="every column once",
            found=f"{names.count(duplicate)} columns {duplicate}",
            fix="keep one of them",
        )
    columns, faults = columns_of(str(path), _flattened(str(path), arrays), copy=False)
    return Record(name_of(path), columns, index_place(str(path)), str(path), faults=faults)


def _flattened(where: str, arrays: dict[str, npt.NDArray[Any]]) -> dict[str, npt.NDArray[Any]]:
    """Split triples into columns, and make ``fs`` and ``restart`` a column ``dt``."""
    flat: dict[str, npt.NDArray[Any]] = {}
    rate, restart = arrays.pop("fs", None), arrays.pop("restart", None)
    for key, array in arrays.items():
        names = _TRIPLES.get(key)
        if names is None or array.ndim == 1:
            parts = {key: array}
        elif array.ndim == 2 and array.shape[1] == len(names):
            parts = {name: array[:, k] for k, name in enumerate(names)}
        else:
            raise InputError.at(
                f"{where}, array {key}",
                wanted=f"shape (n, {len(names)})",
                found=repr(array.shape),
                fix="store one row per sample",
            )
        duplicates = [name for name in parts if name in flat]
        if duplicates:
            raise InputError.at(
                where,
                wanted="every column once",
                found=f"{duplicates[0]} alone and in an array of several columns",
                fix="keep one of them",
            )
        flat |= parts
    if rate is None and restart is None:
        return flat
    if "t" not in flat or "dt" in flat:
        raise InputError.at(
            where,
            wanted="t, and no dt, beside fs or restart",
            found=", ".join(flat),
            fix="give the times, or the steps themselves in dt",
        )
    columns, faults = columns_of(where, {"t": flat["t"]})
    if faults:
        raise faults["t"]
    t = columns["t"].values
    dt = steps_of(where, t) if rate is None else _constant_steps(where, rate, len(t))
    if restart is not None:
        if restart.shape != dt.shape or restart.dtype.kind not in "biu":
            raise InputError.at(
                f"{where}, array restart",
                wanted=f"truth values, shape {dt.shape}",
                found=f"{restart.dtype}, shape {restart.shape}",
                fix="store one for each sample",
            )
        dt = np.where(restart != 0, RESTART_S, dt)
    return {**flat, "dt": dt}


def _constant_steps(where: str, rate: npt.NDArray[Any], count: int) -> FloatArray:
    is_number = rate.shape == () and rate.dtype.kind in "iuf"
    if not (is_number and np.isfinite(rate) and rate > 0):
        raise InputError.at(
            f"{where}, fs",
            wanted="one number above 0 (Hz)",
            found=repr(rate.tolist())[:40],
            fix="correct it, or leave it out to use the times",
        )
    return np.full(count, 1.0 / float(rate))
