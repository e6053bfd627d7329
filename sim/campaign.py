"""Campaigns: many runs in batches over processes or a cluster, with a journal to continue from.

The result of a run does not depend on where it is computed: each has its own seed or case.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any, TypeVar

from boresight.model.errors import InputError
from boresight.sim.processes import dispatch, processes

__all__ = ["BATCH", "Journal", "complete"]

BATCH = 5  #: runs that are dispatched together.
_C = TypeVar("_C")


def complete(
    campaign: _C,
    work: Callable[[_C, Sequence[Any]], list[dict[str, Any]]],
    cases: dict[int, Any],
    journal: Journal,
    *,
    say: Callable[[str], None],
    jobs: int | None = 1,
    executor: Executor | None = None,
) -> list[dict[str, Any]]:
    """Run every case that the journal does not hold; the rows of all, in their order.

    Parameters
    ----------
    campaign : object
        First argument of ``work``.
    work : callable
        Maps some of the cases to their rows, plain data with the case's number as ``seed``.
    cases : dict of int to object
        By number.
    say : callable
        Called with a line after each batch.
    jobs, executor
        See `dispatch`.
    """
    left = [case for number, case in cases.items() if number not in journal.done]
    if len(left) < len(cases):
        say(f"{len(cases) - len(left)} of {len(cases)} runs are done already")
    size = BATCH if executor is not None or processes(jobs) > 1 else 1
    batches = [left[k : k + size] for k in range(0, len(left), size)]
    tasks = [(k, work, (campaign, batch)) for k, batch in enumerate(batches)]
    for _, rows in dispatch(jobs, tasks, executor):
        journal.add(rows)
        say(f"{sum(number in journal.done for number in cases)} of {len(cases)} runs")
    return [journal.done[number] for number in cases]


class Journal:
    """Rows of the runs that are done, in a file and in memory: one line each.

    The first line of the file says which campaign it belongs to; a file that begins otherwise is
    not touched.

    Parameters
    ----------
    path : path
    identity : mapping
        What the rows depend on.

    Attributes
    ----------
    done : dict of int to dict
        Rows by ``seed``.

    Raises
    ------
    InputError
        The file is that of another campaign, or no journal, or cannot be written.
    """

    def __init__(self, path: Path, identity: dict[str, Any]) -> None:
        self.path, self.done = path, dict[int, dict[str, Any]]()
        head = json.dumps({"boresight montecarlo": identity}, sort_keys=True)
        try:
            text = path.read_text(encoding="utf-8") if path.exists() else ""
            # A process that was killed leaves half a line.
            whole = text[: text.rfind("\n") + 1]
            lines = whole.splitlines()
            if text and (not lines or lines[0] != head):
                raise InputError.at(
                    str(path),
                    wanted="the journal of this campaign",
                    found="that of another one, or of sources that have changed, or another file",
                    fix="choose another folder with -o, or remove it",
                )
            for line in lines[1:]:
                row = json.loads(line)
                self.done[row["seed"]] = row
            self._head = "" if whole else head + "\n"  # written with the first row
            if whole != text:
                path.write_text(whole, encoding="utf-8")
        except (OSError, ValueError) as error:
            if isinstance(error, InputError):
                raise
            raise InputError.at(
                str(path),
                wanted="a journal that can be read and written",
                found=str(error).splitlines()[0],
                fix="choose another folder with -o, or remove it",
            ) from None

    def add(self, rows: Iterable[dict[str, Any]]) -> None:
        """Append rows; they are on disk when this returns."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with self.path.open("a", encoding="utf-8") as file:
            file.write(self._head)
            self._head = ""
            for row in rows:
                file.write(json.dumps(row, sort_keys=True) + "\n")
                self.done[row["seed"]] = row
