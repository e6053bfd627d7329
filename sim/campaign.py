"""Campaigns: many runs in batches over processes or a cluster, with a journal to continue from.

The result of a run does not depend on where it is computed: each has its own seed or case.
"""

from __future__ import annotations

import json
import sqlite3
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any, TypeVar

from boresight.model.errors import InputError
from boresight.sim.processes import dispatch, duration, processes

__all__ = ["BATCH", "Journal", "complete"]

BATCH = 5  #: runs that are dispatched together.
#: Seconds that a process waits for another one that writes into the same journal.
_PATIENCE_S = 60.0
_C = TypeVar("_C")


def complete(
    campaign: _C,
    work: Callable[[_C, Sequence[Any]], list[dict[str, Any]]],
    cases: Mapping[Any, Any],
    journal: Journal,
    *,
    say: Callable[[str], None],
    jobs: int | None = 1,
    executor: Executor | None = None,
    batch: int = BATCH,
    after_batch: Callable[[], None] | None = None,
) -> list[dict[str, Any]]:
    """Run every case that the journal does not hold; the rows of all, in their order.

    Parameters
    ----------
    campaign : object
        First argument of ``work``.
    work : callable
        Maps some of the cases to their rows, plain data with the case's key under `Journal.key`.
    cases : mapping
        By key, in the order in which they are dispatched.
    say : callable
        Called with a line after each batch: done, refused (rows with ``refused``), time left.
    jobs, executor
        See `dispatch`.
    batch : int
        Runs that are dispatched together.
    after_batch : callable, optional
        Called after each batch, when its rows are in the journal.
    """
    remaining = [case for number, case in cases.items() if number not in journal.rows]
    if len(remaining) < len(cases):
        say(f"{len(cases) - len(remaining)} of {len(cases)} runs are done already")
    size = batch if executor is not None or processes(jobs) > 1 else 1
    batches = [remaining[k : k + size] for k in range(0, len(remaining), size)]
    tasks = [(k, work, (campaign, part)) for k, part in enumerate(batches)]
    start, resumed = time.monotonic(), len(cases) - len(remaining)
    for _, rows in dispatch(jobs, tasks, executor):
        journal.add(rows)
        done = [journal.rows[number] for number in cases if number in journal.rows]
        refused = sum(bool(row.get("refused")) for row in done)
        seconds = (time.monotonic() - start) * (len(cases) - len(done)) / (len(done) - resumed)
        say(
            f"{len(done)} of {len(cases)} runs"
            + (f", {refused} refused" if refused else "")
            + (f", about {duration(seconds)} left" if len(done) < len(cases) else "")
        )
        if after_batch is not None:
            after_batch()
    return [journal.rows[number] for number in cases]


class Journal:
    """Rows of the completed runs, in memory and in an SQLite file of its own.

    Each row is written completely or not at all, whenever a process is killed, and several
    processes may add rows at once. A file of another campaign is not changed.

    Parameters
    ----------
    path : path
    identity : mapping
        Data that all rows depend on.
    key : str
        Name of a row's key in the row.

    Attributes
    ----------
    rows : dict
        Rows by key.

    Raises
    ------
    InputError
        The file belongs to another campaign, is no journal, or cannot be read.
    """

    def __init__(self, path: Path, identity: dict[str, Any], *, key: str = "seed") -> None:
        self.path, self.key, self.rows = path, key, dict[Any, dict[str, Any]]()
        self._identity = json.dumps(identity, sort_keys=True)
        if path.exists():
            with self._connection() as connection:
                names = {name for (name,) in connection.execute("SELECT name FROM sqlite_master")}
                if not names:  # its process was killed before its first row
                    return
                if not {"campaign", "runs"} <= names or [
                    *connection.execute("SELECT identity FROM campaign")
                ] != [(self._identity,)]:
                    raise self._foreign()
                for number, row in connection.execute("SELECT key, row FROM runs"):
                    self.rows[number] = json.loads(row)

    def add(self, rows: Iterable[dict[str, Any]]) -> None:
        """Add rows; they are on disk when this returns.

        Raises
        ------
        InputError
            The file cannot be written, as on a full disk, or another campaign has made it since.
        """
        self.path.parent.mkdir(parents=True, exist_ok=True)
        new_rows = list(rows)
        with self._connection() as connection:
            connection.execute("BEGIN IMMEDIATE")
            connection.execute("CREATE TABLE IF NOT EXISTS campaign (identity TEXT UNIQUE)")
            connection.execute("CREATE TABLE IF NOT EXISTS runs (key PRIMARY KEY, row TEXT)")
            connection.execute("INSERT OR IGNORE INTO campaign VALUES (?)", (self._identity,))
            if connection.execute("SELECT count(*) FROM campaign").fetchone() != (1,):
                raise self._foreign()
            connection.executemany(
                "INSERT OR REPLACE INTO runs VALUES (?, ?)",
                [(row[self.key], json.dumps(row, sort_keys=True)) for row in new_rows],
            )
            connection.execute("COMMIT")
        self.rows |= {row[self.key]: row for row in new_rows}

    @contextmanager
    def _connection(self) -> Iterator[sqlite3.Connection]:
        """The file, open for the block; uncommitted changes are rolled back."""
        try:
            with closing(
                sqlite3.connect(self.path, timeout=_PATIENCE_S, isolation_level=None)
            ) as connection:
                yield connection
        except (sqlite3.Error, OSError, ValueError) as error:
            if isinstance(error, InputError):
                raise
            if getattr(error, "sqlite_errorname", "") == "SQLITE_NOTADB":
                raise self._foreign() from None
            raise InputError.at(
                str(self.path),
                wanted="a journal that can be read and written",
                found=str(error).splitlines()[0],
                fix="choose another folder with -o, or remove it",
            ) from None

    def _foreign(self) -> InputError:
        return InputError.at(
            str(self.path),
            wanted="the journal of this campaign",
            found="that of another one, or of sources that have changed, or another file",
            fix="choose another folder with -o, or remove it",
        )
