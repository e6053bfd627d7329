"""Log files of records, for tests."""

from __future__ import annotations

from pathlib import Path

from boresight.sim.records.files import content_of
from boresight.sim.records.record import Record


def write_record(path: Path, record: Record) -> Path:
    """Write a log file in the format that its name says."""
    path.write_bytes(content_of(path, record))
    return path
