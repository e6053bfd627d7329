"""A log that is read in blocks, as often as wanted."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

from boresight.sim.records.files import in_pieces, log_files, read_pieces, read_record
from boresight.sim.records.record import Record
from boresight.sim.records.stream import resized, timed

__all__ = ["Log", "logs_of"]

#: Bytes of a file that is read whole.
_WHOLE = 8 << 20


@dataclass(frozen=True, eq=False)
class Log:
    """A log.

    Attributes
    ----------
    name : str
        Name of its records.
    data : Record or Path
        The samples, or the file with them, of which no more than a block is held.
    steps : int, optional
        Leading samples; by default all.
    """

    name: str
    data: Record | Path
    steps: int | None = None

    @classmethod
    def of(cls, data: Any, steps: int | None = None, *, name: str = "record") -> Log:
        """The leading samples of a log file, or of data in memory (`Record.of`).

        Raises
        ------
        InputError
            Bad data; of a long file only the first rows are read.
        """
        if isinstance(data, Log):
            return data
        if isinstance(data, str | Path):
            path = Path(data)
            if in_pieces(path) and os.path.isfile(path) and os.path.getsize(path) > _WHOLE:
                return cls(next(read_pieces(path)).name, path, steps)
            data = read_record(path)
        record = Record.of(data, name=name).head(steps)
        return cls(record.name, record)

    def blocks(self, rows: int) -> Iterator[Record]:
        """The samples in blocks of so many rows, with their time steps; one as it is.

        Raises
        ------
        InputError
            As `sim.records.files.read_pieces`.
        """
        if isinstance(self.data, Record):
            whole = len(self.data) <= rows
            yield from [self.data] if whole else resized(timed([self.data]), rows)
            return
        done = 0
        for block in read_pieces(self.data, rows):
            yield block if self.steps is None else block.head(self.steps - done)
            done += len(block)
            if self.steps is not None and done >= self.steps:
                return


def logs_of(logs: Iterable[Any], steps: int | None = None) -> list[Log]:
    """Logs at paths or in folders, and data in memory: ``record``, ``record2``, ...

    Raises
    ------
    InputError
        A bad log, or a folder without logs.
    """
    paths = (log_files([x]) if isinstance(x, str | Path) else [x] for x in logs)
    out, unnamed = list[Log](), 0
    for log in chain.from_iterable(paths):
        unnamed += not isinstance(log, Record | Path)
        out.append(Log.of(log, steps, name=f"record{unnamed if unnamed > 1 else ''}"))
    return out
