"""CSV logs: one header, one line per sample; errors name line and column.

Comment lines (``#``) may precede the header. A header field is ``NAME`` or ``NAME[unit]``; an empty
field means that there is no new sample.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt

from boresight.model.errors import InputError
from boresight.sim.records.record import Column, Record, name_of, split_header

__all__ = ["format_csv", "parse_csv"]

FloatArray = npt.NDArray[np.float64]


def format_csv(record: Record) -> str:
    """Write each float64 with the shortest digits that read back exactly; NaN as an empty field."""
    header = ",".join(
        name if column.unit is None else f"{name}[{column.unit}]"
        for name, column in record.columns.items()
    )
    rows = np.column_stack([c.values for c in record.columns.values()]).tolist()
    body = "\n".join(",".join(map(repr, row)) for row in rows)
    return f"{header}\n" + f"{body}\n".replace("nan", "")


def parse_csv(path: Path, content: bytes) -> Record:
    """Parse and check the content of a CSV log.

    Parameters
    ----------
    path : Path
        Path for the record's name and messages.
    content : bytes
        The file.

    Raises
    ------
    InputError
        The content is not such a table; the message names line and column.
    """
    lines = _lines_of(path, content)
    top = next((k for k, s in enumerate(lines) if s.strip() and not s.startswith("#")), None)
    if top is None:
        raise InputError.at(
            str(path),
            wanted="a header of column names",
            found="only blank lines and comments" if content.strip() else "an empty file",
            fix="write the header and one line per sample",
        )
    heads = _header(f"{path}, line {top + 1}", lines[top])
    rows = lines[top + 1 :]
    if rows and not rows[-1]:  # after the last line break
        rows.pop()
    while (
        len(heads) > 1 and rows and not rows[-1].strip()
    ):  # in a single column an empty line is a missing sample
        rows.pop()
    if not rows:
        raise InputError.at(
            f"{path}, line {top + 1}",
            wanted="rows of samples below the header",
            found="none",
            fix="write one line per sample",
        )
    table = _table(path, top + 2, [name for name, _ in heads], rows)
    columns = {name: Column(table[:, k], unit) for k, (name, unit) in enumerate(heads)}
    location = partial(_location, path, top + 2)
    return Record(name_of(path), columns, location, str(path))


def _location(path: Path, first_line: int, row: int, column: str) -> str:
    return f"{path}, line {row + first_line}, column {column}"


def _lines_of(path: Path, content: bytes) -> list[str]:
    """Lines of a text file with any line ends; raises InputError for a binary file."""
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = "\0"
    if "\0" in text:
        raise InputError.at(
            str(path),
            wanted="a CSV log in UTF-8 text",
            found="binary data",
            fix="export it as text; an archive of arrays must be named .npz",
        )
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def _header(where: str, line: str) -> list[tuple[str, str | None]]:
    heads = [split_header(where, field) for field in line.split(",")]
    names = [name for name, _ in heads]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError.at(
            where,
            wanted="every column once",
            found=f"{names.count(twice)} columns {twice}",
            fix="keep one of them",
        )
    if all(_number(name) is not None for name in names):
        raise InputError.at(
            where,
            wanted="a header of column names",
            found="numbers only",
            fix="write the names of the columns above the first sample",
        )
    return heads


def _table(path: Path, first_line: int, names: list[str], rows: list[str]) -> FloatArray:
    """Values (rows, columns), NaN for an empty field; raises InputError for other texts."""
    width = len(names)
    counts = np.array([row.count(",") for row in rows]) + 1
    if (counts != width).any():
        row = int(np.argmax(counts != width))
        raise InputError.at(
            f"{path}, line {row + first_line}",
            wanted=f"{width} fields, as in the header",
            found=str(counts[row]) if rows[row].strip() else "an empty line",
            fix="complete or remove the line",
        )
    body = ",".join(rows)
    fields = body.split(",")
    table = _numbers(body, fields).reshape(-1, width)
    bad = np.isinf(table)
    if bad.any():
        row, column = divmod(int(np.argmax(bad)), width)
        field = fields[row * width + column].strip()
        raise InputError.at(
            _location(path, first_line, row, names[column]),
            wanted="a finite number, or nothing",
            found=repr(field if len(field) <= 40 else f"{field[:37]}..."),
            fix="correct or remove the line",
        )
    return table


def _numbers(body: str, fields: list[str]) -> FloatArray:
    """Value of each field: NaN if it is empty, infinity if it is not a finite number."""
    # The fast path takes plain numbers only: float() also accepts "nan" (which would pass for an
    # empty field), "1_000", and digits of other scripts.
    plain = not body.encode().translate(None, delete=b"0123456789+-.eE, \t")
    if plain:
        try:
            return np.array([float(field or "nan") for field in fields])
        except ValueError:
            pass  # examine each field, as the caller must name the faulty one
    values = (_number(field.strip()) if field.strip() else np.nan for field in fields)
    return np.array([np.inf if value is None else value for value in values])


def _number(field: str) -> float | None:
    """Return a finite number, or None for other texts."""
    try:
        value = float(field) if field.isascii() and "_" not in field else np.inf
    except ValueError:
        return None
    return value if np.isfinite(value) else None
