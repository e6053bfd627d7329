"""Sensor logs: the record that every run is fed with, and its two file formats.

A log file is either CSV with the header ``t,gx,gy,gz,ax,ay,az,mx,my,mz`` and optionally
``qw,qx,qy,qz`` (columns in any order, comment lines starting with ``#`` above the header), or
``.npz`` with the arrays ``t, gyr, acc, mag`` and optionally ``q, mov, fs``. Units and frames are
those of `Log`. A magnetometer triple that is empty (CSV) or NaN (npz) says that the sensor had
nothing new in that row; an empty or NaN quaternion says that the reference has a gap there.
"""

from __future__ import annotations

import io
import os
import zipfile
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from model.errors import InputError

__all__ = ["Log", "read_log", "write_log"]

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
#: Names a value for a message: (row, array, component) -> "file, line 7, column gx".
Place = Callable[[int, str, int], str]

#: CSV columns of each array, in file order.
_COLUMNS = {
    "t": ("t",),
    "gyr": ("gx", "gy", "gz"),
    "acc": ("ax", "ay", "az"),
    "mag": ("mx", "my", "mz"),
    "q": ("qw", "qx", "qy", "qz"),
}
_REQUIRED = tuple(name for array in ("t", "gyr", "acc", "mag") for name in _COLUMNS[array])
_UNITS = {"t": "s", "gyr": "rad/s", "acc": "m/s^2", "mag": "uT"}
#: A reference quaternion may be off norm one by this much (it was rounded to be written down).
_NORM_TOLERANCE = 0.01


@dataclass(frozen=True, eq=False)
class Log:
    """What the sensors said, sample by sample, and perhaps what the attitude was.

    Arrays are copied as float64 (bool for the flags) and checked; n is the number of samples.

    Parameters
    ----------
    name : str
        Short name for reports; `read_log` takes the file name without suffix.
    t : (n,) array
        Time [s], strictly increasing.
    gyr : (n, 3) array
        Body rate [rad/s] in b. Sample k is the mean rate of the step that ends at ``t[k]``.
    acc : (n, 3) array
        Specific force [m/s^2] in b: +g on the axis that points up at rest.
    mag : (n, 3) array
        Magnetic flux density [uT] in b. Rows that are not new become NaN.
    mag_new : (n,) array of bool
        Whether the magnetometer delivered a new sample in that row.
    q : (n, 4) array, optional
        Reference attitude, Hamilton, scalar first, b to n (ENU). NaN rows: reference missing.
    mov : (n,) array of bool, optional
        Samples that count when errors are averaged.
    fs : float, optional
        Sampling rate [Hz] of a log with a uniform step; without it, `t` gives the steps.

    Raises
    ------
    InputError
        If a shape is wrong, a value is not finite, the time does not increase, a magnetometer or
        quaternion row is NaN in part, or a quaternion is not of norm one.
    """

    name: str
    t: FloatArray
    gyr: FloatArray
    acc: FloatArray
    mag: FloatArray
    mag_new: BoolArray
    q: FloatArray | None = None
    mov: BoolArray | None = None
    fs: float | None = None

    def __post_init__(self) -> None:
        arrays = {"t": self.t, "gyr": self.gyr, "acc": self.acc, "mag": self.mag}
        if self.q is not None:
            arrays["q"] = self.q
        where = f"log {self.name!r}"
        clean = _clean_arrays(where, {**arrays, "mag_new": self.mag_new, "mov": self.mov})
        clean["mag"] = np.where(clean["mag_new"][:, None], clean["mag"], np.nan)
        _check_samples(clean, _index_place(where))
        lost = clean["mag_new"] & np.isnan(clean["mag"][:, 0])
        if lost.any():
            raise InputError.at(
                _index_place(where)(int(np.argmax(lost)), "mag", 0),
                wanted="a number, as mag_new is true",
                found="nan",
                fix="clear mag_new there",
            )
        for key, value in clean.items():
            object.__setattr__(self, key, value)
        if self.fs is not None:
            object.__setattr__(self, "fs", _clean_rate(where, self.fs))

    def __len__(self) -> int:
        """Count the samples."""
        return len(self.t)

    @property
    def dt(self) -> FloatArray:
        """Time step that ends at each sample, [s], (n,).

        All are 1/fs if `fs` is given; else the differences of `t`, and the first, which nothing
        precedes, is the median of the others.

        Raises
        ------
        InputError
            If there is a single sample and no `fs`.
        """
        if self.fs is not None:
            return np.full(len(self), 1.0 / self.fs)
        if len(self) == 1:
            raise InputError.at(
                f"log {self.name!r}",
                wanted="two rows or more, to know the time step",
                found="one",
                fix="use a longer log, or give fs in an .npz file",
            )
        steps = np.diff(self.t)
        return np.concatenate([[np.median(steps)], steps])


def read_log(path: str | os.PathLike[str]) -> Log:
    """Read a log file: ``.npz`` by its suffix, CSV otherwise.

    Parameters
    ----------
    path : path-like

    Returns
    -------
    Log
        Named after the file.

    Raises
    ------
    InputError
        If the file cannot be read or does not hold a log; the one-line message names the file,
        the line and the column (for ``.npz`` the array and the index, counted from 0).
    """
    path = Path(path)
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError.at(
            str(path),
            wanted="a readable log file",
            found=(error.strerror or type(error).__name__).lower(),
            fix="check the path",
        ) from None
    if path.suffix.lower() == ".npz":
        return _read_npz(path, content)
    return _read_csv(path, content)


def write_log(path: str | os.PathLike[str], log: Log) -> None:
    """Write a log file that `read_log` reads back bit for bit.

    Parameters
    ----------
    path : path-like
        With suffix ``.npz`` for that format; anything else is written as CSV.
    log : Log
        CSV has no place for `mov` and `fs`: a log that has one of them must go to ``.npz``.

    Raises
    ------
    InputError
        If the format cannot hold the log, or the file cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() == ".npz":
        held = {key: getattr(log, key) for key in ("t", "gyr", "acc", "mag", "q", "mov", "fs")}
        buffer = io.BytesIO()
        np.savez_compressed(buffer, **{k: v for k, v in held.items() if v is not None})
        content = buffer.getvalue()
    else:
        extra = [key for key in ("mov", "fs") if getattr(log, key) is not None]
        if extra:
            raise InputError.at(
                str(path),
                wanted="a log without mov and fs, for which CSV has no column",
                found=" and ".join(extra),
                fix="write an .npz file, or leave them out with dataclasses.replace",
            )
        content = _csv_text(log).encode()
    try:
        path.write_bytes(content)
    except OSError as error:
        raise InputError.at(
            str(path),
            wanted="a file that can be written",
            found=(error.strerror or type(error).__name__).lower(),
            fix="choose another path",
        ) from None


def _csv_text(log: Log) -> str:
    arrays = [log.t[:, None], log.gyr, log.acc, log.mag]
    names = list(_REQUIRED)
    if log.q is not None:
        arrays.append(log.q)
        names.extend(_COLUMNS["q"])
    rows = np.concatenate(arrays, axis=1).tolist()
    # only NaN differs from itself: it becomes the empty field
    lines = [",".join([repr(x) if x == x else "" for x in row]) for row in rows]  # noqa: PLR0124
    return "\n".join([",".join(names), *lines, ""])


# ---- CSV --------------------------------------------------------------------------------------


def _read_csv(path: Path, content: bytes) -> Log:
    lines = _text_lines(path, content)
    top = next((k for k, s in enumerate(lines) if s.strip() and not s.startswith("#")), None)
    if top is None:
        raise InputError.at(
            str(path),
            wanted=f"a header {','.join(_REQUIRED)}",
            found="no line but blanks and comments" if content.strip() else "an empty file",
            fix="write the header and one line per sample",
        )
    names = [name.strip() for name in lines[top].split(",")]
    _check_header(f"{path}, line {top + 1}", names)
    rows = lines[top + 1 :]
    while rows and not rows[-1].strip():
        rows.pop()
    if not rows:
        raise InputError.at(
            f"{path}, line {top + 1}",
            wanted="rows of samples below the header",
            found="none",
            fix="write one line per sample",
        )

    def place(row: int, array: str, component: int) -> str:
        return f"{path}, line {row + top + 2}, column {_COLUMNS[array][component]}"

    arrays = _parse_rows(path, top + 2, names, rows, place)
    _check_samples(arrays, place)
    return Log(
        path.stem,
        arrays["t"],
        arrays["gyr"],
        arrays["acc"],
        arrays["mag"],
        ~np.isnan(arrays["mag"][:, 0]),
        arrays.get("q"),
    )


def _text_lines(path: Path, content: bytes) -> list[str]:
    try:
        if b"\0" in content:
            raise UnicodeError
        text = content.decode("utf-8-sig")
    except UnicodeError:
        raise InputError.at(
            str(path),
            wanted="a CSV log in UTF-8 text",
            found="binary data",
            fix="export it as text; an archive of arrays must be named .npz",
        ) from None
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def _check_header(where: str, names: list[str]) -> None:
    known = [name for columns in _COLUMNS.values() for name in columns]
    unknown = [name for name in names if name not in known]
    if unknown:
        raise InputError.at(
            where,
            wanted=f"only the columns {','.join(known)}",
            found=", ".join(_quote(name) for name in unknown),
            fix="rename or remove what is unknown, and separate columns by commas",
        )
    for name in names:
        if names.count(name) > 1:
            raise InputError.at(
                where,
                wanted="every column once",
                found=f"{names.count(name)} columns {name}",
                fix="keep one of them",
            )
    wanted = known if any(name in names for name in _COLUMNS["q"]) else list(_REQUIRED)
    missing = [name for name in wanted if name not in names]
    if missing:
        raise InputError.at(
            where,
            wanted=f"the columns {','.join(wanted)}",
            found=f"none named {' or '.join(missing)}",
            fix="add what is missing",
        )


def _parse_rows(
    path: Path, first_line: int, names: list[str], rows: list[str], place: Place
) -> dict[str, FloatArray]:
    width = len(names)
    counts = np.array([row.count(",") for row in rows]) + 1
    if (counts != width).any():
        row = int(np.argmax(counts != width))
        raise InputError.at(
            f"{path}, line {row + first_line}",
            wanted=f"{width} fields, as in the header",
            found="an empty line" if not rows[row].strip() else str(counts[row]),
            fix="complete or remove the line",
        )
    body = ",".join(rows)
    fields = [field.strip() for field in body.split(",")]
    # float() would also take 1_000 and digits of other scripts
    plain = body.isascii() and "_" not in body
    try:
        if not plain:
            raise ValueError
        values = np.array([float(field) if field else np.nan for field in fields])
    except ValueError:
        values = np.array([_number(field) for field in fields])
    table = values.reshape(-1, width)
    empty = np.array([not field for field in fields]).reshape(-1, width)
    order = {
        array: [names.index(name) for name in columns]
        for array, columns in _COLUMNS.items()
        if columns[0] in names
    }
    # an empty field is legal in mag and q; everything else must be a finite number
    bad = ~np.isfinite(table) & ~empty
    bad[:, order["t"] + order["gyr"] + order["acc"]] |= empty[
        :, order["t"] + order["gyr"] + order["acc"]
    ]
    if bad.any():
        row, column = np.unravel_index(int(np.argmax(bad)), bad.shape)
        array = next(array for array, columns in order.items() if column in columns)
        field = fields[int(row) * width + int(column)]
        raise InputError.at(
            place(int(row), array, order[array].index(int(column))),
            wanted=_wanted(array) + (", or all of them empty" if array in ("mag", "q") else ""),
            found=_quote(field) if field else "an empty field",
            fix="correct or remove the line",
        )
    arrays = {array: table[:, columns] for array, columns in order.items()}
    arrays["t"] = arrays["t"][:, 0]
    return arrays


def _number(field: str) -> float:
    """Value of a field; NaN if it is empty, infinity if it is no number."""
    if not field:
        return np.nan
    try:
        return float(field) if field.isascii() and "_" not in field else np.inf
    except ValueError:
        return np.inf


# ---- npz --------------------------------------------------------------------------------------


def _read_npz(path: Path, content: bytes) -> Log:
    try:
        loaded = np.load(io.BytesIO(content), allow_pickle=False)
        held = {key: loaded[key] for key in (*_COLUMNS, "mov", "fs") if key in loaded.files}
    except (
        # what numpy, zipfile and zlib raise on bytes that are no archive, or a damaged one
        AttributeError,
        EOFError,
        KeyError,
        MemoryError,
        OSError,
        RuntimeError,
        ValueError,
        zipfile.BadZipFile,
        zlib.error,
    ):
        raise InputError.at(
            str(path),
            wanted="an .npz archive of plain arrays",
            found="something that cannot be read as one",
            fix="write it with numpy.savez; a CSV log must not be named .npz",
        ) from None
    missing = [key for key in ("t", "gyr", "acc", "mag") if key not in held]
    if missing:
        raise InputError.at(
            str(path),
            wanted="the arrays t, gyr, acc and mag",
            found=f"none named {' or '.join(missing)}",
            fix="add what is missing",
        )
    rate = held.pop("fs", None)
    arrays = _clean_arrays(str(path), held)
    _check_samples(arrays, _index_place(str(path)))
    return Log(
        path.stem,
        arrays["t"],
        arrays["gyr"],
        arrays["acc"],
        arrays["mag"],
        ~np.isnan(arrays["mag"][:, 0]),
        arrays.get("q"),
        arrays.get("mov"),
        None if rate is None else _clean_rate(str(path), rate),
    )


def _index_place(where: str) -> Place:
    def place(row: int, array: str, component: int) -> str:
        return f"{where}, {array}[{row}]" if array == "t" else f"{where}, {array}[{row}, {component}]"

    return place


# ---- checks that both formats and `Log` share -------------------------------------------------


def _clean_arrays(where: str, arrays: Mapping[str, npt.ArrayLike | None]) -> dict[str, Any]:
    """Copy to float64 or bool and check the shapes against the length of t; leave out None."""
    rows = np.shape(arrays["t"])[0] if np.ndim(arrays["t"]) == 1 else None
    if not rows:
        raise InputError.at(
            f"{where}, array t",
            wanted="shape (n,) with n of 1 or more",
            found=repr(np.shape(arrays["t"])),
            fix="store one time per sample",
        )
    clean = {}
    for key, value in arrays.items():
        if value is None:
            continue
        array = np.asarray(value)
        shape = (rows, len(_COLUMNS[key])) if len(_COLUMNS.get(key, "1")) > 1 else (rows,)
        if array.shape != shape:
            raise InputError.at(
                f"{where}, array {key}",
                wanted=f"shape {shape!r}, one row for each time",
                found=repr(array.shape),
                fix="store one row per sample",
            )
        flags = key not in _COLUMNS
        legal = array.dtype.kind in ("biu" if flags else "iuf")
        if not legal or (flags and not np.isin(array, (0, 1)).all()):
            raise InputError.at(
                f"{where}, array {key}",
                wanted="truth values" if flags else "real numbers",
                found=f"the type {array.dtype}" if not legal else "values other than 0 and 1",
                fix="convert the array",
            )
        clean[key] = array.astype(np.bool_ if flags else np.float64)
    return clean


def _clean_rate(where: str, rate: npt.ArrayLike) -> float:
    array = np.asarray(rate)
    legal = array.shape == () and array.dtype.kind in "iuf"
    if not legal or not (np.isfinite(array) and array > 0):
        raise InputError.at(
            f"{where}, fs",
            wanted="one number above 0 (Hz)",
            found=_quote(array.tolist()),
            fix="correct it, or leave it out to use the times",
        )
    return float(array)


def _check_samples(arrays: dict[str, FloatArray], place: Place) -> None:
    """Refuse what no estimator can use, naming the first value in each array."""
    for name in ("t", "gyr", "acc"):
        _refuse(arrays, name, ~np.isfinite(arrays[name]), place, _wanted(name))
    for name in ("mag", "q"):
        if name not in arrays:
            continue
        gap = np.isnan(arrays[name])
        partly = gap & ~gap.all(axis=1, keepdims=True)
        whole = f"{_wanted(name)}, or no value in the whole row"
        _refuse(arrays, name, partly | np.isinf(arrays[name]), place, whole)
    if "q" in arrays:
        norm = np.linalg.norm(arrays["q"], axis=1)
        off = np.abs(norm - 1.0) > _NORM_TOLERANCE
        if off.any():
            row = int(np.argmax(off))
            raise InputError.at(
                place(row, "q", 0),
                wanted="a quaternion of norm 1",
                found=f"norm {norm[row]:.6g}",
                fix="correct the row, or leave its quaternion out",
            )
    late = np.diff(arrays["t"]) <= 0
    if late.any():
        row = int(np.argmax(late)) + 1
        raise InputError.at(
            place(row, "t", 0),
            wanted=f"a time above {arrays['t'][row - 1].item()!r}, that of the row before",
            found=repr(arrays["t"][row].item()),
            fix="sort the rows and remove repeated ones",
        )


def _refuse(
    arrays: dict[str, FloatArray], name: str, bad: BoolArray, place: Place, wanted: str
) -> None:
    if bad.any():
        flat = int(np.argmax(bad))
        row, component = divmod(flat, bad.size // len(bad))
        value = arrays[name].flat[flat]
        raise InputError.at(
            place(row, name, component),
            wanted=wanted,
            found="no value" if np.isnan(value) else repr(value.item()),
            fix="correct or remove the row",
        )


def _wanted(array: str) -> str:
    unit = _UNITS.get(array)
    return f"a finite number ({unit})" if unit else "a finite number"


def _quote(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 40 else f"{text[:36]}..."
