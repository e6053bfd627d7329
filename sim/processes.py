"""Work dealt out to processes, results as they come."""

from __future__ import annotations

import multiprocessing
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from typing import TypeVar

__all__ = ["dealt"]

Label = TypeVar("Label")
Found = TypeVar("Found")


def dealt(
    jobs: int, tasks: Sequence[tuple[Label, Callable[..., Found], tuple[object, ...]]]
) -> Iterator[tuple[Label, Found]]:
    """Results of the tasks (label, function, arguments), as they come.

    With one job they run here, in order. Processes begin anew (`spawn`): a script that asks for
    more than one needs ``if __name__ == "__main__"``, and functions and arguments are such as can
    be pickled.
    """
    if jobs == 1:
        for label, work, arguments in tasks:
            yield label, work(*arguments)
        return
    context = multiprocessing.get_context("spawn")
    others = set(multiprocessing.active_children())
    with ProcessPoolExecutor(min(jobs, len(tasks)), mp_context=context) as pool:
        with _uninterrupted():
            labels: dict[Future[Found], Label] = {
                pool.submit(work, *arguments): label for label, work, arguments in tasks
            }
        try:
            for future in as_completed(labels):
                yield labels[future], future.result()
        except BaseException:
            for process in set(multiprocessing.active_children()) - others:
                process.terminate()
            # Waits for the pool's own thread: at the interpreter's end it would race with it.
            pool.shutdown(wait=True, cancel_futures=True)
            raise


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Processes that begin meanwhile do not hear Ctrl-C: who began them ends them."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    usual = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, usual)
