"""Log files by suffix: `FORMATS`; CSV otherwise."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

from boresight.model.errors import InputError
from boresight.sim.records.archive import format_npz, parse_npz
from boresight.sim.records.columnar import (
    format_feather,
    format_mat,
    format_parquet,
    pack_gzip,
    pack_zstd,
    parse_feather,
    parse_mat,
    parse_parquet,
    unpack_gzip,
    unpack_zstd,
)
from boresight.sim.records.reading import read_bytes
from boresight.sim.records.record import Record
from boresight.sim.records.text import format_csv, parse_csv

__all__ = ["FORMATS", "content_of", "log_files", "read_logs", "read_record", "record_of"]


class Format(NamedTuple):
    """What reads and writes the content of a log file."""

    parse: Callable[[Path, bytes], Record]
    write: Callable[[Record], bytes]


_CSV = Format(parse_csv, format_csv)
#: Formats by the end of the file's name.
FORMATS = {
    ".csv": _CSV,
    ".csv.gz": Format(
        lambda path, content: parse_csv(path, unpack_gzip(path, content)),
        lambda record: pack_gzip(format_csv(record)),
    ),
    ".csv.zst": Format(
        lambda path, content: parse_csv(path, unpack_zstd(path, content)),
        lambda record: pack_zstd(format_csv(record)),
    ),
    ".npz": Format(parse_npz, format_npz),
    ".parquet": Format(parse_parquet, format_parquet),
    ".feather": Format(parse_feather, format_feather),
    ".mat": Format(parse_mat, format_mat),
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
    return _format(path).parse(path, read_bytes(path, "a log file that can be read"))


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
    if not os.path.isdir(path):  # `Path.is_dir` raises on some Pythons
        return [path]
    return sorted(p for p in path.rglob("*") if p.name.endswith(tuple(FORMATS)))


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
    return _format(Path(path)).write(record)


def _format(path: Path) -> Format:
    name = path.name.lower()
    return next((made for suffix, made in FORMATS.items() if name.endswith(suffix)), _CSV)
