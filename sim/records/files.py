"""Log files: ``.npz`` by suffix, CSV otherwise."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from boresight.sim.records.archive import format_npz, parse_npz
from boresight.sim.records.reading import read_bytes
from boresight.sim.records.record import Record
from boresight.sim.records.text import format_csv, parse_csv

__all__ = ["content_of", "read_record", "record_of"]


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


def record_of(data: Any, *, name: str = "record") -> Record:
    """A record of a log file, if ``data`` is a path, or of data in memory (`Record.of`)."""
    return read_record(data) if isinstance(data, str | Path) else Record.of(data, name=name)


def content_of(path: str | os.PathLike[str], record: Record) -> bytes:
    """A record as the bytes of a log file of that name, which `read_record` reads back exactly."""
    return format_npz(record) if _is_npz(Path(path)) else format_csv(record).encode()


def _is_npz(path: Path) -> bool:
    return path.suffix.lower() == ".npz"
