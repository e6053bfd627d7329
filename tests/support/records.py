"""Log files of records, for tests."""

from __future__ import annotations

import io
from pathlib import Path

from boresight.sim.records.files import FORMATS, content_of
from boresight.sim.records.record import Record, joined


def write_record(path: Path, record: Record) -> Path:
    """Write a log file in the format that its name says."""
    path.write_bytes(content_of(path, record))
    return path


def parsed(name: str, content: bytes) -> Record:
    """The record of the content of a log file."""
    read = FORMATS[Path(name).suffix].read
    return joined([*read(Path(name), io.BytesIO(content))])
