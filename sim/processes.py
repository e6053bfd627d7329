"""Tasks run by processes of this machine; results in the order of completion.

Each process has its own pipe and waits there for the next task. Only the main thread writes to the
pipes, one task at a time, and waits for results, so there is no queue that must be emptied before
the work can end.
"""

from __future__ import annotations

import math
import multiprocessing
import os
import pickle
import signal
import threading
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Executor, as_completed
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import chain, islice
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any, TypeVar

from boresight.model.resolve import profiles, profiles_now
from boresight.model.tolerances import tolerances, tolerances_now
from boresight.model.tools.failure import ToolFailed
from boresight.sim.records.selection import Selection, selected, selection

__all__ = ["dispatch", "duration", "processes"]

Label = TypeVar("Label")
Result = TypeVar("Result")


@dataclass(frozen=True, eq=False)
class _Worker:
    """A process and its pipe."""

    process: BaseProcess
    pipe: Connection

    @classmethod
    def start(cls) -> _Worker:
        """Start a process that waits for tasks."""
        context = multiprocessing.get_context("spawn")
        pipe, child_pipe = context.Pipe()
        process = context.Process(target=_serve, args=(child_pipe,), daemon=True)
        with child_pipe:
            process.start()
        return cls(process, pipe)

    def put(self, work: Callable[..., Any], arguments: tuple[object, ...]) -> None:
        """Send a task; errors of the process are raised by `get`."""
        task = pickle.dumps((work, arguments))
        with suppress(BrokenPipeError, ConnectionResetError):
            self.pipe.send_bytes(task)

    def get(self) -> Any:
        """Wait for the result of the task.

        Raises
        ------
        Exception
            The exception of the task.
        ToolFailed
            The process has ended.
        """
        try:
            reply = self.pipe.recv_bytes()
        except (EOFError, ConnectionResetError):
            self.process.join()
            raise ToolFailed(_end(self.process.exitcode or 0)) from None
        result, error = pickle.loads(reply)
        if error is not None:
            raise error
        return result

    def end(self) -> None:
        """Wait until the process has ended after its last task."""
        self.pipe.close()
        self.process.join()


@dataclass(frozen=True)
class _Settings:
    """Profiles, tolerances and rows of logs of the process that dispatches tasks."""

    profiles: Sequence[str] | None
    tolerances: Sequence[str]
    rows: Selection

    def run(self, work: Callable[..., Result], *arguments: object) -> Result:
        """Run a task with them."""
        with profiles(self.profiles), tolerances(self.tolerances), selected(self.rows):
            return work(*arguments)


def processes(jobs: int | None) -> int:
    """Number of processes: ``jobs``, or one for each processor."""
    return jobs or os.cpu_count() or 1


def duration(seconds: float) -> str:
    """Text of an approximate time."""
    return f"{math.ceil(seconds)} s" if seconds < 100.0 else f"{math.ceil(seconds / 60.0)} min"


def dispatch(
    jobs: int | None,
    tasks: Iterable[tuple[Label, Callable[..., Result], tuple[object, ...]]],
    executor: Executor | None = None,
) -> Iterator[tuple[Label, Result]]:
    """Run tasks (label, function, arguments) and yield results in the order of completion.

    ``jobs`` is the number of processes, by default one for each processor. One job or one task
    runs in this process, in order. A task is taken from ``tasks`` when a process is free for it.
    Other processes are spawned: a script that uses more than one job needs
    ``if __name__ == "__main__"``, and functions, arguments and results must be picklable. The
    processes end with the work. An executor, for example of a Dask cluster, replaces the
    processes; after an error it begins no more tasks.

    Raises
    ------
    ToolFailed
        A process ended before its task, for example because it was killed.
    """
    run = _Settings(profiles_now(), tolerances_now(), selection()).run
    tasks = ((label, run, (work, *parameters)) for label, work, parameters in tasks)
    if executor is not None:
        yield from _submit(executor, tasks)
        return
    remaining = iter(tasks)
    initial = list(islice(remaining, processes(jobs)))
    if len(initial) <= 1:
        for label, work, arguments in chain(initial, remaining):
            yield label, work(*arguments)
        return
    labels: dict[Connection, tuple[_Worker, Label]] = {}
    workers: list[_Worker] = []
    try:
        with _uninterrupted():
            for _ in initial:
                workers.append(_Worker.start())
        for worker, (label, work, arguments) in zip(workers, initial, strict=True):
            worker.put(work, arguments)
            labels[worker.pipe] = worker, label
        while labels:
            for pipe in wait(list(labels)):
                worker, label = labels.pop(pipe)  # type: ignore[call-overload]
                result = worker.get()
                for next_label, work, arguments in remaining:
                    worker.put(work, arguments)
                    labels[worker.pipe] = worker, next_label
                    break
                yield label, result
    except BaseException:
        for worker in workers:
            worker.process.kill()
        raise
    finally:
        for worker in workers:
            worker.end()


def _submit(
    executor: Executor, tasks: Iterable[tuple[Label, Callable[..., Result], tuple[object, ...]]]
) -> Iterator[tuple[Label, Result]]:
    """Yield results of an executor in the order of completion."""
    futures = {executor.submit(work, *arguments): label for label, work, arguments in tasks}
    try:
        for future in as_completed(futures):
            yield futures[future], future.result()
    except BaseException:
        for future in futures:
            future.cancel()
        raise


def _serve(pipe: Connection) -> None:
    """Run the tasks from a pipe, until it is closed."""
    with suppress(EOFError, OSError):
        while True:
            pipe.send_bytes(_reply(pipe.recv_bytes()))


def _reply(task: bytes) -> bytes:
    """Result of a task, or its exception with the traceback as a note."""
    try:
        work, arguments = pickle.loads(task)
        return pickle.dumps((work(*arguments), None))
    except Exception as error:
        error.add_note(traceback.format_exc())
        try:
            reply = pickle.dumps((None, error))
            pickle.loads(reply)
        except Exception:
            substitute = RuntimeError(f"{type(error).__name__}: {error}")
            substitute.__notes__ = error.__notes__
            reply = pickle.dumps((None, substitute))
        return reply


def _end(code: int) -> str:
    """Explain the exit code of a process that ended unexpectedly."""
    if code < 0:
        return (
            f"a worker process was killed by signal {-code}, as by the system where memory runs "
            "out: use fewer jobs"
        )
    return (
        f"a worker process ended with exit status {code}: a script that asks for more than one job "
        'needs `if __name__ == "__main__"`'
    )


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Let processes started in the block ignore Ctrl-C; their parent ends them."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    handler = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)
