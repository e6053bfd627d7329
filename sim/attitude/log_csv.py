"""Text form of a log: parse it with every fault named by line and column, and write it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt

from boresight.model.errors import InputError
from boresight.sim.attitude.log_checks import COLUMNS, check_samples, quote, wanted_value
from boresight.sim.records.text import fields_of, lines_of

__all__ = ["format_csv", "parse_csv"]

FloatArray = npt.NDArray[np.float64]

_REQUIRED = tuple(name for array in ("t", "gyr", "acc", "mag") for name in COLUMNS[array])
_KNOWN = (*_REQUIRED, *COLUMNS["q"])
#: Arrays in which an empty field is legal: it becomes NaN.
_MAY_BE_EMPTY = ("mag", "q")
#: Unknown columns that a message lists.
_SHOWN = 4


def format_csv(arrays: Mapping[str, FloatArray]) -> str:
    """Write the shortest digits that give each float64 back; NaN becomes an empty field.

    Parameters
    ----------
    arrays : mapping
        ``t`` (n,), ``gyr``, ``acc``, ``mag`` (n, 3) and perhaps ``q`` (n, 4).
    """
    present = [array for array in COLUMNS if array in arrays]
    header = ",".join(name for array in present for name in COLUMNS[array])
    rows = np.column_stack([arrays[array] for array in present]).tolist()
    body = "\n".join(",".join(map(repr, row)) for row in rows)
    return f"{header}\n{body}\n".replace("nan", "")


def parse_csv(path: Path, content: bytes) -> dict[str, FloatArray]:
    """Parse and check the content of a CSV log.

    Parameters
    ----------
    path : Path
        For messages only.
    content : bytes
        The file.

    Returns
    -------
    dict of arrays
        ``t`` (n,), ``gyr``, ``acc``, ``mag`` (n, 3), ``q`` (n, 4) if its columns are there.

    Raises
    ------
    InputError
        If the content is not a log; the message names the line and the column.
    """
    lines = lines_of(path, content)
    top = next((k for k, s in enumerate(lines) if s.strip() and not s.startswith("#")), None)
    if top is None:
        raise InputError.at(
            str(path),
            wanted=f"a header {','.join(_REQUIRED)}",
            found="only blank lines and comments" if content.strip() else "an empty file",
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
    return _parse_rows(path, top + 2, names, rows)


def _check_header(where: str, names: list[str]) -> None:
    unknown = [name for name in names if name not in _KNOWN]
    if unknown:
        raise InputError.at(
            where,
            wanted=f"only the columns {','.join(_KNOWN)}",
            found=", ".join(map(quote, unknown[:_SHOWN]))
            + (f" and {len(unknown) - _SHOWN} more" if len(unknown) > _SHOWN else ""),
            fix="rename or remove what is unknown, and separate columns by commas",
        )
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError.at(
            where,
            wanted="every column once",
            found=f"{names.count(twice)} columns {twice}",
            fix="keep one of them",
        )
    wanted = _KNOWN if any(name in names for name in COLUMNS["q"]) else _REQUIRED
    missing = [name for name in wanted if name not in names]
    if missing:
        raise InputError.at(
            where,
            wanted=f"the columns {','.join(wanted)}",
            found=f"none named {' or '.join(missing)}",
            fix="add what is missing",
        )


def _parse_rows(
    path: Path, first_line: int, names: list[str], rows: list[str]
) -> dict[str, FloatArray]:
    def place(row: int, array: str, component: int) -> str:
        return f"{path}, line {row + first_line}, column {COLUMNS[array][component]}"

    width = len(names)
    fields, table = fields_of(path, first_line, width, rows)
    empty = np.isnan(table)
    order = {
        array: [names.index(name) for name in columns]
        for array, columns in COLUMNS.items()
        if columns[0] in names
    }
    bad = np.isinf(table)
    for array, columns in order.items():
        if array not in _MAY_BE_EMPTY:
            bad[:, columns] |= empty[:, columns]
    if bad.any():
        row, column = divmod(int(np.argmax(bad)), width)
        array = next(array for array, columns in order.items() if column in columns)
        field = fields[row * width + column].strip()
        raise InputError.at(
            place(row, array, order[array].index(column)),
            wanted=wanted_value(array),
            found=quote(field) if field else "an empty field",
            fix="correct or remove the line",
        )
    arrays = {array: table[:, columns] for array, columns in order.items()}
    arrays["t"] = arrays["t"][:, 0]
    check_samples(arrays, place)
    return arrays
