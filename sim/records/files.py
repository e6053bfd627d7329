"""Log files: ``.npz`` by suffix, CSV otherwise."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from boresight.model.errors import InputError
from boresight.sim.records.archive import format_npz, parse_npz
from boresight.sim.records.reading import read_bytes
from boresight.sim.records.record import Record
from boresight.sim.records.text import format_csv, parse_csv

__all__ = ["content_of", "log_files", "read_logs", "read_record", "record_of"]


def read_record(path: str | os.PathLike[str]) -> Record:
    """Read a log file.

    Raises
    ------
    InputError
        It cannot be read or holds no log; the one-line message names the file, the line and the
        column (for ``.npz`` the array and the index, counted from 0).
    """
    path = Path(path)
    content = read_bytes(path, "a log file that can be read")
    return (parse_npz if _is_npz(path) else parse_csv)(path, content)


def log_files(paths: Iterable[str | Path]) -> list[Path]:
    """Return the logs at some paths; a folder stands for every .csv and .npz below it.

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
                wanted="a log, or a folder with .csv or .npz logs",
                found="a folder without any",
                fix="name a log file",
            )
        out += logs
    return out


def _logs_below(path: Path) -> list[Path]:
    """Return the path itself, or every log in a folder."""
    if not os.path.isdir(path):  # `Path.is_dir` raises on some Pythons
        return [path]
    return sorted(p for p in path.rglob("*") if p.suffix in (".csv", ".npz"))


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
    return format_npz(record) if _is_npz(Path(path)) else format_csv(record).encode()


def _is_npz(path: Path) -> bool:
    return path.suffix.lower() == ".npz"
