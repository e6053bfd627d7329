"""CSV logs: one header, one line per sample; errors name line and column.

Comment lines (``#``, ``%``, ``//``) may precede the header. A header field is ``NAME``,
``NAME[unit]`` or ``NAME (unit)``; an empty field, or ``nan``, means that there is no new sample.
Quotes may be around fields, within a line. A column with other texts can be read, but not be used.
"""

from __future__ import annotations

import codecs
import csv
import io
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from shlex import quote
from typing import BinaryIO

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.errors import InputError, require
from boresight.sim.records import record

#: Values from which on pyarrow is worth its import.
_FAST_FROM = 100_000
#: Texts that others write for a missing value.
_MISSING = ("na", "n/a", "none", "null", "-", "--", "?")
#: In a comment above the header: the log's attitude is another device's estimate.
_COMPARISON = "a comparison, not truth"
#: Bytes that are read at once.
_BLOCK = 1 << 22
#: Other separators, their names, and the commands that write commas and decimal points.
_SEPARATORS = (
    (";", "semicolons", "tr ';,' ',.'"),
    ("\t", "tabs", "tr '\\t,' ',.'"),
    ("|", "bars", "tr '|,' ',.'"),
    (" ", "blanks", "tr -s ' ' ','"),
)


def write_csv(file: BinaryIO, blocks: Iterable[record.Record]) -> None:
    """Write blocks of a log: the shortest digits that read back exactly, NaN as an empty field."""
    for k, block in enumerate(blocks):
        if not k:
            header = io.StringIO()
            heads = (column.head(name) for name, column in block.columns.items())
            csv.writer(header, lineterminator="\n").writerow(heads)
            file.write(header.getvalue().encode())
        rows = np.column_stack([c.values for c in block.columns.values()]).tolist()
        body = "\n".join(",".join(map(repr, row)) for row in rows)
        file.write(f"{body}\n".replace("nan", "").encode())


def read_csv(path: Path, file: BinaryIO) -> Iterator[record.Record]:
    """Read a CSV log in blocks; ``path`` is for its name and messages."""
    top, offset, text, comparison = 0, 0, "#", False
    while text.strip().strip('"') in ("", "sep=,") or text.startswith(("#", "%", "//")):
        line, fix = file.readline(), "write the header and one line per sample"
        if b"\r" in line.rstrip(b"\r\n"):  # line ends of old: all of the file is one line
            file = io.BytesIO(line.replace(b"\r", b"\n") + file.read().replace(b"\r", b"\n"))
            line = file.readline()
        found = "only blank lines and comments" if offset else "an empty file"
        require(bool(line), str(path), "a header of column names", found, fix)
        text = _text(path, top + 1, offset, line).rstrip("\n")
        top, offset = top + 1, offset + len(line)
        comparison |= text.startswith("#") and _COMPARISON in text
    heads = _header(path, top, text)
    names, first, pending = [name for name, _ in heads], top + 1, b""
    while block := file.read(_BLOCK):
        # Blank lines are left out at the end of the file alone.
        block = pending + block + file.readline()
        end = len(block) if len(heads) == 1 else len(block.rstrip())
        end = block.find(b"\n", end) + 1 or len(block) if 0 < end < len(block) else end
        lines, pending = block[:end], block[end:]
        if not lines:
            continue
        is_long, faults = len(lines) >= 10 * _FAST_FROM and len(names) > 1, dict[str, InputError]()
        table = _fast_table(lines, names) if is_long else None
        if table is None:
            rows = _text(path, first, offset, lines).removesuffix("\n").split("\n")
            table, faults = _table(path, first, names, rows)
        columns = {name: record.Column(table[:, k], unit) for k, (name, unit) in enumerate(heads)}
        place = record.Place(str(path), first)
        yield record.Record(record.name_of(path), columns, place, str(path), (), comparison, faults)
        first, offset = first + len(table), offset + len(lines)
    wanted, fix = "rows of samples below the header", "write one line per sample"
    require(first > top + 1, f"{path}, line {top}", wanted, None, fix)


def _text(path: Path, first: int, offset: int, content: bytes) -> str:
    """Text of some lines, with plain line ends; raises InputError for what is no UTF-8 text."""
    fix = "export it as UTF-8; other formats need their suffix, as .npz or .parquet"
    if b"\0" in content:
        used, found = content.rstrip(b"\0"), "binary data"
        start = offset + len(used)
        if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
            found = "UTF-16 text"
        elif b"\0" not in used and start > 0:
            found = f"zeros from byte {start} to the end"
            fix = f"keep its beginning: head -c {start} {quote(str(path))} > {_beside(path, 'cut')}"
        raise InputError.at(str(path), wanted="a CSV log in UTF-8 text", found=found, fix=fix)
    try:
        text = content.decode("utf-8-sig" if offset == 0 else "utf-8")
    except UnicodeDecodeError as error:
        line = first + content.count(b"\n", 0, error.start)
        found = f"the byte {content[error.start]:#04x}, as of text in Latin-1"
        fix = f"iconv -f latin1 -t utf-8 {quote(str(path))} > {_beside(path, 'utf8')}"
        wanted = "a CSV log in UTF-8 text"
        raise InputError.at(f"{path}, line {line}", wanted=wanted, found=found, fix=fix) from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _header(path: Path, number: int, line: str) -> list[tuple[str, str | None]]:
    where, file, first = f"{path}, line {number}", quote(str(path)), 1
    is_pointer = line.startswith("version https://git-lfs")
    require(not is_pointer, where, "a log", "a pointer of Git LFS", "git lfs pull")
    if said := re.fullmatch(r"\W*sep=(.)\W*", line):
        line, first = f"a{said[1]}b", number + 1  # of the line below, which has the names
    for separator, name, command in _SEPARATORS:
        if "," not in line and separator in line.strip():
            fix = f", or: tail -n +{first} {file} | {command} > {_beside(path, 'commas')}"
            fix = "export it so" + fix * (path.suffix.lower() != ".gz")
            wanted = "commas between the columns, and decimal points"
            raise InputError.at(where, wanted=wanted, found=name, fix=fix)
    fields = _fields(where, line) if '"' in line else line.split(",")
    names = [bool(field.strip()) for field in fields]
    fix = f"sed 's/, *\\r*$//' {file} > {_beside(path, 'columns')}"
    is_ended = not names[-1] and all(names[:-1])
    require(not is_ended, where, "a name between all commas", "a comma at the end", fix)
    found, fix = "none for the first one (an index of pandas?)", "name it, or write the file"
    is_named = names[0] or len(names) == 1
    require(is_named, where, "a name for every column", found, f"{fix} without it (index=False)")
    is_header = not all(math.isfinite(_number(field)) for field in fields)
    fix = "write the names of the columns above the first sample"
    require(is_header, where, "a header of column names", "numbers only", fix)
    return record.split_headers(where, fields)


def _beside(path: Path, what: str) -> str:
    """Name of a file for a corrected copy, for a shell."""
    return quote(str(path.with_name(f"{path.stem}-{what}.csv")))


def _fields(where: str, line: str) -> list[str]:
    """Fields of a line; raises InputError for a quote that does not end in it."""
    try:
        (fields,) = csv.reader([line], strict=True, skipinitialspace=True)
    except csv.Error:
        wanted = "quotes around whole fields, each within the line"
        found = "one that does not end, or text beside one"
        fix = 'remove it, or write "" for a quote within a field'
        raise InputError.at(where, wanted=wanted, found=found, fix=fix) from None
    return fields


def _table(
    path: Path, first_line: int, names: list[str], rows: list[str]
) -> tuple[FloatArray, dict[str, InputError]]:
    """Values (rows, columns), NaN for no number, and by column its first text that is none."""
    width = len(names)
    split = [
        _fields(f"{path}, line {k + first_line}", row) if '"' in row else row.split(",")
        for k, row in enumerate(rows)
    ]
    wrong = next((k for k, parts in enumerate(split) if len(parts) != width), None)
    if wrong is not None:
        where, wanted = f"{path}, line {wrong + first_line}", f"{width} fields, as in the header"
        found = str(len(split[wrong])) if rows[wrong].strip() else "an empty line"
        raise InputError.at(where, wanted=wanted, found=found, fix="complete or remove the line")
    table = np.array([_number(field) for row in split for field in row]).reshape(-1, width)
    invalid = np.isinf(table)
    faults = {}
    for column in np.flatnonzero(invalid.any(axis=0)).tolist():
        row, name = int(np.argmax(invalid[:, column])), names[column]
        field, where = split[row][column].strip(), f"{path}, line {row + first_line}"
        wanted, fix = "a finite number", "correct or remove the line"
        found = repr(field if len(field) <= 40 else f"{field[:37]}...")
        unit = field.strip("[]() ")
        if _is_header(split[row], names):
            wanted, found = "a sample", "the header again"
            fix = "remove the line; if a logger started again there, make two files"
        elif not np.isfinite(table[row]).any() and unit[:1].isalpha() and record.is_unit(unit):
            fix = f"a line of units? write them in the header, {name}[{unit}], and remove the line"
        elif re.search(r"\d:\d\d|\d{4}-\d\d-\d\d", field):
            fix = record.SECONDS
        elif field.lower() in _MISSING:
            fix = "leave a missing value empty"
        where += f", column {name}" * (wanted != "a sample")
        faults[name] = InputError.at(where, wanted=wanted, found=found, fix=fix)
    table[invalid] = np.nan
    return table, faults


def _is_header(fields: Sequence[str], names: Sequence[str]) -> bool:
    """Whether the fields of a line are the header of columns with these names."""
    with suppress(InputError):
        return [name for name, _ in record.split_headers("", fields)] == names
    return False


def _number(field: str) -> float:
    """A finite number; NaN for no sample, infinity for other texts."""
    text = field.strip()
    if text.lower() in ("", "nan", "-nan"):
        return math.nan
    try:
        value = float(text) if text.isascii() and "_" not in text else math.inf
    except ValueError:
        return math.inf
    return value if math.isfinite(value) else math.inf


def _fast_table(body: bytes | memoryview, names: list[str]) -> FloatArray | None:
    """Values as by `_table`; None without pyarrow, or where lines hold more than plain numbers."""
    try:
        csv, arrow = import_module("pyarrow.csv"), import_module("pyarrow")
    except ImportError:
        return None
    try:
        table = csv.read_csv(
            arrow.BufferReader(body),
            csv.ReadOptions(column_names=names),
            csv.ParseOptions(quote_char=False, ignore_empty_lines=False),
            csv.ConvertOptions(
                column_types=dict.fromkeys(names, arrow.float64()),
                null_values=["", "nan", "NaN"],
                check_utf8=False,
            ),
        )
    except arrow.ArrowInvalid:
        return None
    values = np.empty((table.num_rows, len(names)), order="F")
    for k, column in enumerate(table.columns):
        values[:, k] = column.to_numpy()
        missing = np.count_nonzero(np.isnan(values[:, k]))
        if missing != column.null_count or np.isinf(values[:, k]).any():
            return None
    # A row without any number may be an empty line, which arrow takes for one.
    blank = np.isnan(values[:, 0])
    return None if blank.any() and np.isnan(values[blank]).all(axis=1).any() else values
