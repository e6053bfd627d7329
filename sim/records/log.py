"""A log that is read in blocks, as often as wanted."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import Any

from boresight.sim.records.bundled import is_comparison
from boresight.sim.records.files import in_pieces, log_files, read_pieces, read_record
from boresight.sim.records.record import Record
from boresight.sim.records.stream import resized, timed

__all__ = ["Log", "logs_of"]

#: Largest file that is held in memory, bytes.
_MEMORY_LIMIT = 8 << 20


def _identity(record: Record) -> Record:
    return record


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
    path : Path, optional
        The file that it is from.
    derived : callable
        Each block goes through it.
    """

    name: str
    data: Record | Path
    steps: int | None = None
    path: Path | None = None
    derived: Callable[[Record], Record] = _identity

    @classmethod
    def of(
        cls, data: Any, steps: int | None = None, *, name: str = "record", load: bool = False
    ) -> Log:
        """The leading samples of a log file, or of data in memory (`Record.of`).

        A file of more than 8 MB is read again each time, but for ``load``.

        Raises
        ------
        InputError
            Bad data; of a long file only the first rows are read.
        """
        if isinstance(data, Log):
            return data
        if isinstance(data, str | Path):
            path = Path(data)
            long = not load and in_pieces(path) and os.path.isfile(path)
            if long and os.path.getsize(path) > _MEMORY_LIMIT:
                return cls(next(read_pieces(path)).name, path, steps, path)
            return cls.in_memory(read_record(path).head(steps), path)
        return cls.in_memory(Record.of(data, name=name).head(steps))

    @classmethod
    def in_memory(cls, record: Record, path: Path | None = None) -> Log:
        """A log in memory."""
        return cls(record.name, record, path=path)

    def through(self, work: Callable[[Record], Record]) -> Log:
        """The log whose samples are converted by a function, block by block."""
        if isinstance(self.data, Record):
            return replace(self, data=work(self.data))
        return replace(self, derived=lambda block: work(self.derived(block)))

    @property
    def comparison(self) -> bool:
        """Its reference is another device's estimate, not truth."""
        return self.first.comparison or (self.path is not None and is_comparison(self.path))

    @property
    def first(self) -> Record:
        """All of a log in memory, of a file the first 65,536 rows."""
        return self.data if isinstance(self.data, Record) else next(self.blocks(1 << 16))

    def __len__(self) -> int:
        """Count the samples; a file is read for it."""
        if isinstance(self.data, Record):
            return len(self.data)
        return sum(map(len, self.blocks(1 << 16)))

    def blocks(self, rows: int) -> Iterator[Record]:
        """The samples in blocks of so many rows, with their time steps; one as it is.

        Raises
        ------
        InputError
            As `sim.records.files.read_pieces`.
        """
        if isinstance(self.data, Record):
            fits = len(self.data) <= rows
            yield from [self.data] if fits else resized(timed([self.data]), rows)
            return
        count = 0
        for block in read_pieces(self.data, rows):
            yield self.derived(block if self.steps is None else block.head(self.steps - count))
            count += len(block)
            if self.steps is not None and count >= self.steps:
                return


def logs_of(logs: Iterable[Any], steps: int | None = None, *, load: bool = False) -> list[Log]:
    """Logs at paths or in folders, and data in memory: ``record``, ``record2``, ...

    ``load``: see `Log.of`.

    Raises
    ------
    InputError
        A bad log, or a folder without logs.
    """
    paths = (log_files([x]) if isinstance(x, str | Path) else [x] for x in logs)
    out, unnamed = list[Log](), 0
    for log in chain.from_iterable(paths):
        unnamed += not isinstance(log, Record | Path)
        name = f"record{unnamed if unnamed > 1 else ''}"
        out.append(Log.of(log, steps, name=name, load=load))
    return out
