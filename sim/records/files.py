"""Log files: ``.npz`` by suffix, CSV otherwise."""

from __future__ import annotations

import os
from pathlib import Path

from boresight.sim.records.archive import parse_npz
from boresight.sim.records.reading import read_bytes
from boresight.sim.records.record import Record
from boresight.sim.records.text import parse_csv

__all__ = ["read_record"]


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
    return (parse_npz if path.suffix.lower() == ".npz" else parse_csv)(path, content)
