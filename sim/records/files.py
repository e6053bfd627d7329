"""Log files by suffix: `FORMATS`; CSV otherwise."""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from boresight.model.errors import InputError
from boresight.sim.records.archive import format_npz, parse_npz
from boresight.sim.records.assembly import Reader, record_from
from boresight.sim.records.bags import is_bag, read_bag
from boresight.sim.records.columnar import (
    format_feather,
    format_mat,
    packer_gzip,
    packer_zstd,
    parse_feather,
    parse_mat,
    parse_parquet,
    pieces_of_parquet,
    unpack_gzip,
    unpack_zstd,
    write_parquet,
)
from boresight.sim.records.maps import read_map, ready_map
from boresight.sim.records.reading import opened, read_bytes
from boresight.sim.records.record import Record, joined
from boresight.sim.records.selection import selection
from boresight.sim.records.stream import resized, timed
from boresight.sim.records.text import ROWS, parse_csv, pieces_of_csv, write_csv
from boresight.sim.records.ulog import read_ulog

__all__ = [
    "FORMATS",
    "RECORDINGS",
    "blocks_of",
    "check_written",
    "content_of",
    "in_pieces",
    "log_files",
    "read_logs",
    "read_pieces",
    "read_record",
    "record_of",
    "recording_of",
    "write_pieces",
]


class Format(NamedTuple):
    """Reader and writer of the content of a log file.

    ``write`` takes blocks of a log that follow each other; without ``pieces`` a file is read whole.
    """

    parse: Callable[[Path, bytes], Record]
    write: Callable[[BinaryIO, Iterable[Record]], None]
    pieces: Callable[[Path, BinaryIO], Iterator[Record]] | None = None


def _from_record(pack: Callable[[Record], bytes]) -> Callable[[BinaryIO, Iterable[Record]], None]:
    """A writer of blocks by a function that packs a record."""

    def write(file: BinaryIO, blocks: Iterable[Record]) -> None:
        file.write(pack(joined(list(blocks))))

    return write


def _packed(packer: Callable[[BinaryIO], Any]) -> Callable[[BinaryIO, Iterable[Record]], None]:
    """A writer of CSV through a packer."""

    def write(file: BinaryIO, blocks: Iterable[Record]) -> None:
        with packer(file) as packed:
            write_csv(packed, blocks)

    return write


_CSV = Format(parse_csv, write_csv, pieces_of_csv)
#: Formats by the end of the file's name.
FORMATS = {
    ".csv": _CSV,
    ".csv.gz": Format(
        lambda path, content: parse_csv(path, unpack_gzip(path, content)), _packed(packer_gzip)
    ),
    ".csv.zst": Format(
        lambda path, content: parse_csv(path, unpack_zstd(path, content)), _packed(packer_zstd)
    ),
    ".npz": Format(parse_npz, _from_record(format_npz)),
    ".parquet": Format(parse_parquet, write_parquet, pieces_of_parquet),
    ".feather": Format(parse_feather, _from_record(format_feather)),
    ".mat": Format(parse_mat, _from_record(format_mat)),
}
#: Suffixes of other kinds of files, under which no log is written.
_FOREIGN = {".xls", ".xlsx", ".ods", ".h5", ".hdf5", ".json", ".npy", ".pkl", ".tsv", ".py"}
#: Expected of a path in messages about files that cannot be opened.
_READABLE = "a log file that can be read"
#: Suffixes of CSV under other names.
_OF_TEXT = ("", ".txt", ".dat", ".log", ".tsv")
#: Recordings of topics, which are read alone, by the end of the file's name: reader and ready map.
RECORDINGS: dict[str, tuple[Reader, str]] = {
    ".ulg": (read_ulog, "px4"),
    ".bag": (read_bag, "ros"),
    ".db3": (read_bag, "ros"),
    ".mcap": (read_bag, "ros"),
}


def read_record(path: str | os.PathLike[str]) -> Record:
    """Read a log file.

    Raises
    ------
    InputError
        It cannot be read or holds no log; the one-line message names the file, the line and the
        column (for ``.npz`` the array and the index, counted from 0).
    """
    path = Path(path)
    if selection().is_identity:
        return joined([*_blocks(path, whole=True)])
    return joined([*_selected(path)])


def log_files(paths: Iterable[str | Path]) -> list[Path]:
    """Return the logs at some paths; a folder stands for every file of `FORMATS` below it.

    Raises
    ------
    InputError
        A folder without logs.
    """
    out: list[Path] = []
    for path in paths:
        logs = _logs_below(Path(path))
        if not logs:
            raise InputError.at(
                str(path),
                wanted=f"a log, or a folder with logs ({', '.join(FORMATS)})",
                found="a folder without any",
                fix="name a log file",
            )
        out += logs
    return out


def _logs_below(path: Path) -> list[Path]:
    """Return the path itself, or every log in a folder."""
    if not os.path.isdir(path) or is_bag(path):  # `Path.is_dir` raises on some Pythons
        return [path]
    bags = {p.parent for p in path.rglob("metadata.yaml")}
    files = (p for p in path.rglob("*") if p.name.endswith((*FORMATS, *RECORDINGS)))
    logs = bags | {p for p in files if p.parent not in bags}
    # In hidden folders are files that are being written, or were when a process was killed.
    return sorted(p for p in logs if not any(x[0] == "." for x in p.relative_to(path).parts[:-1]))


def read_logs(logs: Iterable[Any]) -> list[tuple[Record, Path | None]]:
    """Return records with their paths; None for data in memory (`Record.of`).

    Data in memory without a name are called ``record``, ``record2``, ...

    Raises
    ------
    InputError
        A bad log, or a folder without logs.
    """
    out: list[tuple[Record, Path | None]] = []
    unnamed = 0
    for log in logs:
        if isinstance(log, str | Path):
            out += [(read_record(path), path) for path in log_files([log])]
            continue
        unnamed += not isinstance(log, Record)
        out.append((Record.of(log, name=f"record{unnamed if unnamed > 1 else ''}"), None))
    return out


def record_of(data: Any, *, name: str = "record") -> Record:
    """Return the record of a log file, if ``data`` is a path, or of data (`Record.of`)."""
    return read_record(data) if isinstance(data, str | Path) else Record.of(data, name=name)


def content_of(path: str | os.PathLike[str], record: Record) -> bytes:
    """Contents of a log file for a record, which `read_record` reads back exactly."""
    buffer = io.BytesIO()
    write_pieces(path, buffer, [record])
    return buffer.getvalue()


def check_written(path: str | os.PathLike[str]) -> None:
    """Refuse the name of a log to be written whose suffix says another kind of file."""
    suffix = Path(path).suffix.lower()
    if suffix in _FOREIGN:
        raise InputError.at(
            str(path),
            wanted=f"a suffix of a log, {', '.join(FORMATS)}",
            found=suffix,
            fix="choose one; without a known suffix CSV is written",
        )


def write_pieces(path: str | os.PathLike[str], file: BinaryIO, pieces: Iterable[Record]) -> None:
    """Write a log file in pieces of any length: the same bytes as of all of it."""
    _format(Path(path)).write(file, resized(map(Record.of_numbers, pieces)))


def read_pieces(path: str | os.PathLike[str], rows: int = ROWS) -> Iterator[Record]:
    """Read a log file in pieces of so many rows, each with its time steps.

    Raises
    ------
    InputError
        As `read_record`; rows before a fault have been given then.
    """
    yield from resized(_selected(Path(path)), rows)


def blocks_of(path: str | os.PathLike[str]) -> Iterator[Record]:
    """A log file in blocks as it is written, or the rows of it that are selected.

    Raises
    ------
    InputError
        As `read_pieces`.
    """
    path = Path(path)
    return _blocks(path) if selection().is_identity else _selected(path)


def in_pieces(path: Path) -> bool:
    """Whether `read_pieces` holds no more than a block of such a file."""
    return recording_of(path) is None and _format(path).pieces is not None


def recording_of(path: Path) -> tuple[Reader, str] | None:
    """Reader of a recording's topics and name of its ready map; None for a table."""
    if is_bag(path):
        return read_bag, "ros"
    name = path.name.lower()
    return next((pair for suffix, pair in RECORDINGS.items() if name.endswith(suffix)), None)


def _selected(path: Path) -> Iterator[Record]:
    """The blocks of a file with their time steps, as far as they are selected."""
    blocks, rows = timed(_blocks(path)), selection()
    return blocks if rows.is_identity else rows.pieces(blocks)


def _blocks(path: Path, *, whole: bool = False) -> Iterator[Record]:
    """A file as it is, in blocks or as one."""
    if (recording := recording_of(path)) is not None:
        read, name = recording
        toml = selection().map
        yield record_from(path, read, ready_map(name) if toml is None else read_map(toml))
        return
    if selection().map is not None:
        raise InputError.at(
            str(path),
            wanted=f"a recording of topics, for --map: {', '.join(RECORDINGS)}",
            found="a table, whose columns are inputs",
            fix="leave --map out",
        )
    form = _format(path)
    try:
        if whole or form.pieces is None:
            yield form.parse(path, read_bytes(path, _READABLE))
            return
        with opened(path, _READABLE) as file:
            yield from form.pieces(path, file)
    except InputError as error:
        suffix = path.suffix.lower()
        is_known = suffix in _OF_TEXT or path.name.lower().endswith((*FORMATS,))
        if is_known or not error.parts or error.parts["wanted"] == _READABLE:
            raise
        raise InputError.at(
            error.parts["where"],
            wanted=error.parts["wanted"],
            found=error.parts["found"],
            fix=f"files *{suffix} are read as CSV; logs are {', '.join((*FORMATS, *RECORDINGS))}",
        ) from None


def _format(path: Path) -> Format:
    name = path.name.lower()
    return next((form for suffix, form in FORMATS.items() if name.endswith(suffix)), _CSV)
