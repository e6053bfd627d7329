"""CSV logs: one header, one line per sample; errors name line and column.

Comment lines (``#``) may precede the header. A header field is ``NAME`` or ``NAME[unit]``; an empty
field, or ``nan``, means that there is no new sample. Quotes may be around fields, within a line. A
column with other texts can be read, but not be used.
"""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections.abc import Iterable, Iterator
from functools import partial
from itertools import chain
from pathlib import Path
from shlex import quote
from typing import BinaryIO

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.errors import InputError
from boresight.model.units import check_unit
from boresight.sim.records.columnar import fast_rows, fast_table
from boresight.sim.records.record import Column, Record, name_of, split_header

__all__ = ["ROWS", "format_csv", "parse_csv", "pieces_of_csv", "write_csv"]


#: Values from which on pyarrow is worth its import, and rows that are written at once.
_FAST_FROM, ROWS = 100_000, 1 << 16
#: Texts of no sample, in any case.
_NONE = ("", "nan", "-nan")
#: Bytes that are read at once.
_BLOCK = 1 << 22
#: Other separators, their names, and the commands that write commas and decimal points.
_SEPARATORS = (
    (";", "semicolons", "tr ';,' ',.'"),
    ("\t", "tabs", "tr '\\t,' ',.'"),
    (" ", "blanks", "tr -s ' ' ','"),
)


def format_csv(record: Record) -> bytes:
    """Write each float64 with the shortest digits that read back exactly; NaN as an empty field."""
    buffer = io.BytesIO()
    write_csv(buffer, [record])
    return buffer.getvalue()


def write_csv(file: BinaryIO, blocks: Iterable[Record]) -> None:
    """Write blocks that follow each other; see `format_csv`."""
    for k, record in enumerate(blocks):
        if not k:
            file.write(_head(record))
        values = [c.values for c in record.columns.values()]
        for start in range(0, len(record), ROWS):
            part = [v[start : start + ROWS] for v in values]
            long = k or len(record) * len(values) > _FAST_FROM
            fast = fast_rows(part) if long else None
            file.write(_lines(part) if fast is None else fast)


def _head(record: Record) -> bytes:
    header = io.StringIO()
    csv.writer(header, lineterminator="\n").writerow(
        name if column.unit is None else f"{name}[{column.unit}]"
        for name, column in record.columns.items()
    )
    return header.getvalue().encode()


def _lines(values: list[FloatArray]) -> bytes:
    rows = np.column_stack(values).tolist()
    body = "\n".join(",".join(map(repr, row)) for row in rows)
    return f"{body}\n".replace("nan", "").encode()


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
    if (plain := _plain(path, content)) is not None:
        return plain
    lines = _lines_of(path, content)
    top = next((k for k, s in enumerate(lines) if not _is_remark(s)), None)
    if top is None:
        raise InputError.at(
            str(path),
            wanted="a header of column names",
            found="only blank lines and comments" if content.strip() else "an empty file",
            fix="write the header and one line per sample",
        )
    heads = _header(path, top + 1, lines[top])
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
    table, faults = _table(path, top + 2, [name for name, _ in heads], rows)
    return _record(path, top, heads, table, faults)


def _record(
    path: Path,
    top: int,
    heads: list[tuple[str, str | None]],
    table: FloatArray,
    faults: dict[str, InputError],
) -> Record:
    columns = {name: Column(table[:, k], unit) for k, (name, unit) in enumerate(heads)}
    location = partial(_location, path, top + 2)
    return Record(name_of(path), columns, location, str(path), faults=faults)


def _plain(path: Path, content: bytes) -> Record | None:
    """The record of a long file of plain numbers, by pyarrow; None for any other."""
    if len(content) < 10 * _FAST_FROM or content.startswith(codecs.BOM_UTF8):
        return None
    start, top = 0, 0
    while True:
        end = content.find(b"\n", start)
        line = content[start:end]
        if end < 0 or b"\r" in line[:-1] or b"\0" in line:
            return None
        if not _is_remark(line):
            break
        start, top = end + 1, top + 1
    try:
        heads = _header(path, top + 1, line.decode().rstrip("\r"))
    except UnicodeDecodeError:
        return None
    body = memoryview(content)[end + 1 : len(content.rstrip())]
    table = fast_table(body, [name for name, _ in heads]) if len(heads) > 1 else None
    return None if table is None else _record(path, top, heads, table, {})


def _location(path: Path, first_line: int, row: int, column: str) -> str:
    return f"{path}, line {row + first_line}, column {column}"


def pieces_of_csv(path: Path, file: BinaryIO) -> Iterator[Record]:
    """Parse a CSV log in pieces, which together are the result of `parse_csv`.

    Raises
    ------
    InputError
        As `parse_csv`; rows before have been given then.
    """
    block = file.read(_BLOCK)
    is_short, block = len(block) < _BLOCK, block.removeprefix(codecs.BOM_UTF8)
    top, end = 0, 0
    while True:
        start, end = end, block.find(b"\n", end) + 1
        line = block[start:end]
        if not end or not _is_remark(line):
            break
        top += 1
    if not end or is_short or block.count(b"\r") != block.count(b"\r\n"):
        yield parse_csv(path, block + file.read())
        return
    (text, *_) = _lines_of(path, line)
    heads = _header(path, top + 1, text)
    rest, first = block[end:], top + 2
    while block:
        block = file.read(_BLOCK)
        # Blank lines are left out at the end of the file alone; a row may end in the next block.
        line_end = rest.rfind(b"\n") + 1
        lines = rest[: _end_of_rows(rest[:line_end], len(heads))] if block else rest
        rest = rest[len(lines) :] + block
        if not block and len(heads) > 1:
            lines = lines.rstrip()
        if not lines:
            continue
        table = fast_table(lines, [n for n, _ in heads]) if len(heads) > 1 else None
        faults: dict[str, InputError] = {}
        if table is None:
            rows = _lines_of(path, lines)
            if not rows[-1]:
                rows.pop()
            table, faults = _table(path, first, [n for n, _ in heads], rows)
        yield _record(path, first - 2, heads, table, faults)
        first += len(table)


def _is_remark(line: str | bytes) -> bool:
    """Whether a line above the header is blank, a comment, or Excel's ``sep=,``."""
    text = line.decode("latin-1") if isinstance(line, bytes) else line
    return not text.strip() or text.startswith("#") or text.strip().strip('"') == "sep=,"


def _end_of_rows(lines: bytes, width: int) -> int:
    """Where the last row ends, but for blank lines behind it."""
    end = len(lines.rstrip()) if width > 1 else len(lines)
    return lines.find(b"\n", end) + 1 if 0 < end < len(lines) else end


def _lines_of(path: Path, content: bytes) -> list[str]:
    """Lines of a text file with any line ends; raises InputError for a binary file."""
    if b"\0" in content:
        is_utf16 = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
        start = len(content.rstrip(b"\0"))
        is_cut = b"\0" not in content[:start] and start > 0
        raise InputError.at(
            str(path),
            wanted="a CSV log in UTF-8 text",
            found="UTF-16 text"
            if is_utf16
            else f"zeros from byte {start} to the end"
            if is_cut
            else "binary data",
            fix=f"keep its beginning: head -c {start} {quote(str(path))} > {_beside(path, 'cut')}"
            if is_cut
            else "export it as UTF-8; other formats need their suffix, as .npz or .parquet",
        )
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise InputError.at(
            f"{path}, line {line}",
            wanted="a CSV log in UTF-8 text",
            found=f"the byte {content[error.start]:#04x}, as of text in Latin-1",
            fix=f"iconv -f latin1 -t utf-8 {quote(str(path))} > {_beside(path, 'utf8')}",
        ) from None
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def _header(path: Path, number: int, line: str) -> list[tuple[str, str | None]]:
    where = f"{path}, line {number}"
    first = 1
    if said := re.fullmatch(r"\W*sep=(.)\W*", line):
        line, first = f"a{said[1]}b", number + 1  # of the line below, which has the names
    for separator, name, command in _SEPARATORS:
        if "," not in line and separator in line.strip():
            command = f"tail -n +{first} {quote(str(path))} | {command} > {_beside(path, 'commas')}"
            packed = path.suffix.lower() in (".gz", ".zst")
            raise InputError.at(
                where,
                wanted="commas between the columns, and decimal points",
                found=name,
                fix="export it so" if packed else f"export it so, or: {command}",
            )
    fields = _fields(where, line)
    if not fields[-1].strip() and all(map(str.strip, fields[:-1])):
        raise InputError.at(
            where,
            wanted="a name between all commas",
            found="a comma at the end",
            fix=f"sed 's/, *\\r*$//' {quote(str(path))} > {_beside(path, 'columns')}",
        )
    if not fields[0].strip() and len(fields) > 1:
        raise InputError.at(
            where,
            wanted="a name for every column",
            found="none for the first one (an index of pandas?)",
            fix="name it, or write the file without it (index=False)",
        )
    heads = [split_header(where, field) for field in fields]
    names = [name for name, _ in heads]
    duplicate = next((name for name in names if names.count(name) > 1), None)
    if duplicate is not None:
        raise InputError.at(
            where,
            wanted="every column once",
            found=f"{names.count(duplicate)} columns {duplicate}",
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


def _beside(path: Path, what: str) -> str:
    """Name of a file for a corrected copy, for a shell."""
    return quote(str(path.with_name(f"{path.stem}-{what}.csv")))


def _fields(where: str, line: str) -> list[str]:
    """Fields of a line; raises InputError for a quote that does not end in it."""
    if '"' not in line:
        return line.split(",")
    try:
        (fields,) = csv.reader([line], strict=True, skipinitialspace=True)
    except csv.Error:
        raise InputError.at(
            where,
            wanted="quotes around whole fields, each within the line",
            found="another one",
            fix="correct the line",
        ) from None
    return fields


def _table(
    path: Path, first_line: int, names: list[str], rows: list[str]
) -> tuple[FloatArray, dict[str, InputError]]:
    """Values (rows, columns), NaN for no number, and by column its first text that is none.

    Raises
    ------
    InputError
        A line of too few or too many fields.
    """
    width = len(names)
    quoted = {
        k: _fields(f"{path}, line {k + first_line}", row)
        for k, row in enumerate(rows)
        if '"' in row
    }
    counts = np.array([row.count(",") for row in rows]) + 1
    for k, parts in quoted.items():
        counts[k] = len(parts)
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
    if quoted:
        split = (quoted.get(k) or row.split(",") for k, row in enumerate(rows))
        fields = list(chain.from_iterable(split))
    table = _numbers(body, fields).reshape(-1, width)
    invalid = np.isinf(table)
    faults = {}
    for column in np.flatnonzero(invalid.any(axis=0)).tolist():
        row = int(np.argmax(invalid[:, column]))
        field = fields[row * width + column].strip()
        line = [f.strip().partition("[")[0] for f in fields[row * width : (row + 1) * width]]
        if line == names:
            faults[names[column]] = InputError.at(
                f"{path}, line {row + first_line}",
                wanted="a sample",
                found="the header again",
                fix="remove the line; where a logger began anew, make two files of it",
            )
            continue
        faults[names[column]] = InputError.at(
            _location(path, first_line, row, names[column]),
            wanted="a finite number",
            found=repr(field if len(field) <= 40 else f"{field[:37]}..."),
            fix=(not np.isfinite(table[row]).any() and _units_fix(names[column], field))
            or _time_fix(field)
            or "correct or remove the line",
        )
    table[invalid] = np.nan
    return table, faults


def _time_fix(text: str) -> str:
    """The remedy for a time of day or a date; else empty."""
    if not re.search(r"\d:\d\d|\d{4}-\d\d-\d\d", text):
        return ""
    return (
        "write seconds in place of times as text, by pandas: "
        "t = pandas.to_datetime(t); t = (t - t[0]).dt.total_seconds()"
    )


def _units_fix(name: str, text: str) -> str:
    """The remedy for a text that is a unit, in a row without numbers; else empty."""
    unit = text.strip("[]() ")
    try:
        check_unit("", unit if unit[:1].isalpha() else None)
    except InputError:
        return ""
    return f"a line of units? write them in the header, {name}[{unit}], and remove the line"


def _numbers(body: str, fields: list[str]) -> FloatArray:
    """Value of each field: NaN if it is empty or "nan", infinity if it is no finite number."""
    # The fast path takes plain numbers only: float() also accepts "inf", "1_000", and digits of
    # other scripts.
    plain = not body.encode().translate(None, delete=b"0123456789+-.eE, \t")
    if plain:
        try:
            return np.array([float(field or "nan") for field in fields])
        except ValueError:
            pass  # examine each field, as the caller must name the faulty one
    texts = (field.strip() for field in fields)
    values = (np.nan if text.lower() in _NONE else _number(text) for text in texts)
    return np.array([np.inf if value is None else value for value in values])


def _number(field: str) -> float | None:
    """Return a finite number, or None for other texts."""
    try:
        value = float(field) if field.isascii() and "_" not in field else np.inf
    except ValueError:
        return None
    return value if np.isfinite(value) else None
