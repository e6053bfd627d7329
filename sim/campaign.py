"""Campaigns: independent tasks on processes or on a Dask cluster, and the journal of their results.

`dispatch` runs tasks and yields their results. `complete` does the same for tasks whose results are
plain data, and writes these to a journal (JSON lines), so that a later campaign continues an
interrupted one. The key of a row is a digest of everything that determines its result (`digest`).
"""

from __future__ import annotations

import hashlib
import json
import math
import multiprocessing
import os
import signal
import sys
import sysconfig
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any, TypeVar

from boresight.model.errors import InputError
from boresight.model.settings import CURRENT, Settings, using
from boresight.model.tools.external import ToolFailed, optional
from boresight.model.tools.files import package_digest

BATCH = 5  #: Tasks that one process runs before it returns their results.
_SECONDS = 5.0  #: Time from one line of progress to the next.
_LONGEST = 1 << 24  #: Longest line of a journal, bytes.

Label = TypeVar("Label")
Result = TypeVar("Result")
Row = dict[str, Any]


def processes(jobs: int | None) -> int:
    """Number of processes: ``jobs``, or one for each processor."""
    return jobs or os.cpu_count() or 1


def duration(seconds: float) -> str:
    """Text of an approximate time."""
    return f"{math.ceil(seconds)} s" if seconds < 100.0 else f"{math.ceil(seconds / 60.0)} min"


def digest(*parts: Any) -> str:
    """SHA-256 of plain data; other objects count by their `repr`."""
    return hashlib.sha256(json.dumps(parts, default=repr).encode()).hexdigest()


def sources(*objects: object) -> str:
    """Digest of Boresight's Python files, and of the loaded ones beside those of some objects.

    It covers a user's file and the modules that it imports from the same folder or below it.
    """
    files = {
        name: Path(path).resolve()
        for name, module in [*sys.modules.items()]
        if (path := getattr(module, "__file__", None)) and path.endswith(".py")
    }
    names = {getattr(o, "__module__", None) or type(o).__module__ for o in objects}
    own = [files[name].parent for name in names if name in files]
    installed = [Path(sysconfig.get_path(name)) for name in ("purelib", "platlib", "stdlib")]
    texts = {
        hashlib.sha256(file.read_bytes()).hexdigest()
        for file in {*files.values()}
        if any(map(file.is_relative_to, own)) and not any(map(file.is_relative_to, installed))
    }
    return digest(package_digest(), sorted(texts))


def _run(settings: Settings, work: Callable[..., Result], *arguments: object) -> Result:
    """Run a task with the settings of the process that dispatches it."""
    with using(**vars(settings)):
        return work(*arguments)


def dispatch(
    jobs: int | None,
    tasks: Sequence[tuple[Label, Callable[..., Result], tuple[object, ...]]],
    executor: Executor | None = None,
) -> Iterator[tuple[Label, Result]]:
    """Run tasks (label, function, arguments) and yield results in the order of completion.

    They run on ``jobs`` processes (by default one for each processor), or on an ``executor``, for
    example a Dask cluster (`cluster`). One job or one task runs in this process, in order. Other
    processes are spawned: a script that uses more than one job needs
    ``if __name__ == "__main__"``; functions, arguments and results must be picklable. An error
    cancels the tasks that remain. Raises ToolFailed if a process ended before its task, for example
    because it was killed.
    """
    count = min(processes(jobs), len(tasks))
    if executor is None and count <= 1:
        for label, work, arguments in tasks:
            yield label, work(*arguments)
        return
    futures = dict[Future[Result], Label]()
    with _pool(count) if executor is None else nullcontext(executor) as pool:
        try:
            for label, work, arguments in tasks:
                futures[pool.submit(_run, CURRENT.get(), work, *arguments)] = label
            for future in as_completed(futures):
                yield futures.pop(future), future.result()
        except BrokenProcessPool:
            raise ToolFailed(
                "a worker process ended before its task: if memory ran out, use fewer jobs; a "
                'script that uses more than one job needs `if __name__ == "__main__"`'
            ) from None
        finally:
            for future in futures:
                future.cancel()


@contextmanager
def _pool(count: int) -> Iterator[Executor]:
    """Spawned processes; an error or Ctrl-C ends them."""
    context = multiprocessing.get_context("spawn")
    others = multiprocessing.active_children()
    quiet: Any = {"initializer": signal.signal, "initargs": (signal.SIGINT, signal.SIG_DFL)}
    pool = ProcessPoolExecutor(count, context, **quiet)  # Ctrl-C ends it without a traceback
    try:
        yield pool
    except BaseException:
        for process in multiprocessing.active_children():
            if process not in others:
                process.kill()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


@contextmanager
def cluster(address: str | None) -> Iterator[Executor | None]:
    """The executor that runs a campaign: the Dask cluster of a scheduler.

    Yields None, which stands for the processes of this machine, without an address (for example
    ``tcp://host:8786``). Raises ToolMissing without dask.distributed, InputError if none answers.
    """
    if address is None:
        yield None
        return
    distributed = optional("distributed")
    try:
        client = distributed.Client(address, timeout=10)
    except (OSError, TimeoutError, ValueError) as error:
        wanted, found = "the address of a Dask scheduler", f"{address}: {type(error).__name__}"
        fix = "start one with `dask scheduler` and give its address"
        raise InputError.at("scheduler", wanted=wanted, found=found, fix=fix) from None
    with client:
        yield client.get_executor()


class Journal:
    """``rows`` of completed tasks by key, in memory and as lines of a JSON file.

    Several processes may add rows to one file. A line that was cut off, because its process was
    killed, is ignored; with ``again`` all of the file are. InputError: the file is not a journal,
    or cannot be read.
    """

    def __init__(self, path: Path, *, again: bool = False) -> None:
        self.path, self.rows = path, dict[str, Row]()
        if not path.exists():
            return
        found, line = dict[str, Row](), b"{"
        try:
            if not path.is_dir() and not path.is_file():
                raise OSError("a pipe or a device")
            with path.open("rb") as file:
                left = os.fstat(file.fileno()).st_size  # without what is added meanwhile
                while left > 0 and line[:1] == b"{" and (line := file.readline(_LONGEST)):
                    left -= len(line)
                    if line.endswith(b"}\n"):
                        row = json.loads(line)
                        found[row.pop("key")] = row
        except (OSError, ValueError, KeyError, AttributeError, TypeError) as error:
            raise self._unusable(error) from None
        if line[:1] not in (b"", b"{"):
            raise self._unusable("lines that are no rows")
        self.rows = {} if again else found

    def add(self, rows: Mapping[str, Row]) -> None:
        """Append rows by key; they are in the file when this returns, or it raises InputError."""
        text = "".join(json.dumps({"key": key, **row}) + "\n" for key, row in rows.items())
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with self.path.open("ab+") as file:
                size = file.tell()
                file.seek(max(size - 1, 0))
                cut_off = size > 0 and file.read(1) != b"\n"
                file.write(b"\n" * cut_off + text.encode())
        except OSError as error:  # of a full disk it has no name of a file
            raise self._unusable(error) from None
        self.rows |= rows

    def _unusable(self, found: object) -> InputError:
        wanted = "a journal that can be read and written"
        fix = "choose another folder with -o, or remove it"
        return InputError.at(str(self.path), wanted=wanted, found=str(found), fix=fix)


def complete(
    context: Any,
    work: Callable[[Any, Sequence[Any]], Sequence[Row]],
    tasks: Mapping[str, Any],
    journal: Journal,
    *,
    say: Callable[[str], None],
    jobs: int | None = 1,
    scheduler: str | None = None,
    shared: bool = True,
    batch: int = BATCH,
) -> list[Row]:
    """Run the tasks whose rows the journal does not hold; return the rows of all, in order.

    ``work`` maps ``context`` and some tasks to a row for each: plain data, with ``refused`` in it
    if the task could not be done. A process returns the rows of ``batch`` tasks together. For
    ``jobs`` and ``scheduler`` see `dispatch` and `cluster`. A context that is not ``shared`` has
    objects of Python, which other processes cannot make: the tasks run in this process, and a
    scheduler is refused.
    """
    if scheduler is not None and not shared:
        wanted, fix = "names or files, which its workers read", "leave the scheduler out"
        raise InputError.at("scheduler", wanted=wanted, found="objects", fix=fix)
    remaining = [key for key in tasks if key not in journal.rows]
    known = len(tasks) - len(remaining)
    if known:
        say(f"{known} of {len(tasks)} runs are in {journal.path} already")
    own = jobs if shared else 1
    start, done, told = time.monotonic(), known, 0.0
    with cluster(scheduler) as workers:
        size = batch if workers is not None or processes(own) > 1 else 1
        batches = [remaining[k : k + size] for k in range(0, len(remaining), size)]
        calls = [(keys, work, (context, [tasks[key] for key in keys])) for keys in batches]
        for keys, rows in dispatch(own, calls, workers):
            journal.add(dict(zip(keys, rows, strict=True)))
            done += len(keys)
            if done < len(tasks) and time.monotonic() < told + _SECONDS:
                continue
            told = time.monotonic()
            refused = sum(bool(journal.rows.get(key, {}).get("refused")) for key in tasks)
            seconds = (time.monotonic() - start) * (len(tasks) - done) / (done - known)
            line = f"{done} of {len(tasks)} runs" + (f", {refused} refused" if refused else "")
            say(line + (f", about {duration(seconds)} left" if done < len(tasks) else ""))
    return [journal.rows[key] for key in tasks]
