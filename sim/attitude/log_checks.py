"""What makes sensor samples usable, and the one-line messages when they are not."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.model.errors import InputError

__all__ = [
    "COLUMNS",
    "Place",
    "check_samples",
    "clean_arrays",
    "clean_rate",
    "index_place",
    "quote",
    "wanted_value",
]

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
#: Names a value for a message: (row, array, component) -> "a.csv, line 7, column gx".
Place = Callable[[int, str, int], str]

#: CSV columns of each array, in file order.
COLUMNS = {
    "t": ("t",),
    "gyr": ("gx", "gy", "gz"),
    "acc": ("ax", "ay", "az"),
    "mag": ("mx", "my", "mz"),
    "q": ("qw", "qx", "qy", "qz"),
}
#: Units that a message names.
_UNITS = {"t": "s", "gyr": "rad/s", "acc": "m/s^2", "mag": "uT"}
#: A reference quaternion may be off norm one by this much: it was rounded to be written down.
_NORM_TOLERANCE = 0.01
#: Longest quotation in a message, in characters.
_QUOTE = 40


def index_place(where: str) -> Place:
    """Make a `Place` that names values by array and index from 0: ``<where>, gyr[12, 1]``."""

    def place(row: int, array: str, component: int) -> str:
        index = f"{row}" if array == "t" else f"{row}, {component}"
        return f"{where}, {array}[{index}]"

    return place


def clean_arrays(where: str, arrays: Mapping[str, npt.ArrayLike | None]) -> dict[str, Any]:
    """Copy arrays as float64 (flags as bool) and check their shapes and types.

    Parameters
    ----------
    where : str
        File or log, for messages.
    arrays : mapping
        By name: those of `COLUMNS` are numbers, any other is one flag per sample; None is left
        out. ``t`` must be there and fixes the number of samples.

    Returns
    -------
    dict of arrays

    Raises
    ------
    InputError
        If a shape or a type is wrong.
    """
    times = np.asarray(arrays["t"])
    if times.ndim != 1 or times.size == 0:
        raise InputError.at(
            f"{where}, array t",
            wanted="shape (n,) with n of 1 or more",
            found=repr(times.shape),
            fix="store one time per sample",
        )
    clean = {}
    for key, value in arrays.items():
        if value is None:
            continue
        array = np.asarray(value)
        flags = key not in COLUMNS
        shape = times.shape if flags or key == "t" else (len(times), len(COLUMNS[key]))
        if array.shape != shape:
            raise InputError.at(
                f"{where}, array {key}",
                wanted=f"shape {shape!r}, one row for each time",
                found=repr(array.shape),
                fix="store one row per sample",
            )
        if array.dtype.kind not in ("biu" if flags else "iuf"):
            raise InputError.at(
                f"{where}, array {key}",
                wanted="truth values" if flags else "real numbers",
                found=f"the type {array.dtype}",
                fix="convert the array",
            )
        if flags and not np.isin(array, (0, 1)).all():
            raise InputError.at(
                f"{where}, array {key}",
                wanted="truth values",
                found="integers other than 0 and 1",
                fix="convert the array",
            )
        clean[key] = array.astype(np.bool_ if flags else np.float64)
    return clean


def clean_rate(where: str, rate: npt.ArrayLike) -> float:
    """Convert a sampling rate [Hz] to float, or raise `InputError` if it is not one above 0."""
    array = np.asarray(rate)
    number = array.shape == () and array.dtype.kind in "iuf"
    if not (number and np.isfinite(array) and array > 0):
        raise InputError.at(
            f"{where}, fs",
            wanted="one number above 0 (Hz)",
            found=quote(array.tolist()),
            fix="correct it, or leave it out to use the times",
        )
    return float(array)


def check_samples(arrays: Mapping[str, FloatArray], place: Place) -> None:
    """Refuse what no estimator can use, naming the first such value.

    Parameters
    ----------
    arrays : mapping
        ``t`` (n,), ``gyr``, ``acc``, ``mag`` (n, 3) and perhaps ``q`` (n, 4), float64.
    place : Place
        Names a value for the message.

    Raises
    ------
    InputError
        If t, gyr or acc is not finite; a row of mag or q is NaN in part, or infinite; a
        quaternion is not of norm one; t does not increase strictly.
    """
    for name in ("t", "gyr", "acc"):
        _refuse(arrays, name, ~np.isfinite(arrays[name]), place, wanted_value(name))
    for name in ("mag", "q"):
        if name in arrays:
            gap = np.isnan(arrays[name])
            partly = gap & ~gap.all(axis=1, keepdims=True)
            _refuse(arrays, name, partly | np.isinf(arrays[name]), place, wanted_value(name))
    if "q" in arrays:
        with np.errstate(over="ignore"):
            norm = np.linalg.norm(arrays["q"], axis=1)
        off = np.abs(norm - 1.0) > _NORM_TOLERANCE
        if off.any():
            row = int(np.argmax(off))
            raise InputError.at(
                place(row, "q", 0),
                wanted="a quaternion of norm 1",
                found=f"norm {norm[row]:.6g}",
                fix="correct it, or leave the whole quaternion out",
            )
    late = np.diff(arrays["t"]) <= 0
    if late.any():
        row = int(np.argmax(late)) + 1
        before, found = arrays["t"][row - 1 : row + 1].tolist()
        raise InputError.at(
            place(row, "t", 0),
            wanted=f"a time above {before!r}, that of the row before",
            found=repr(found),
            fix="sort the rows and remove repeated ones",
        )


def wanted_value(array: str) -> str:
    """Say what may stand in an array, for a message."""
    unit = f" ({_UNITS[array]})" if array in _UNITS else ""
    gap = ", or no value in all of the row" if array in ("mag", "q") else ""
    return f"a finite number{unit}{gap}"


def quote(value: object) -> str:
    """Write a value as Python does, cut short if it is long."""
    text = repr(value)
    return text if len(text) <= _QUOTE else f"{text[: _QUOTE - 3]}..."


def _refuse(
    arrays: Mapping[str, FloatArray], name: str, bad: BoolArray, place: Place, wanted: str
) -> None:
    if bad.any():
        flat = int(np.argmax(bad))
        row, component = divmod(flat, bad.size // len(bad))
        value = arrays[name].ravel().tolist()[flat]
        raise InputError.at(
            place(row, name, component),
            wanted=wanted,
            found="no value" if np.isnan(value) else repr(value),
            fix="correct or remove the row",
        )
