"""Who runs the draws: this process, other processes of this machine, a Dask cluster.

Which draw runs where changes nothing of it: each has a seed of its own.
"""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from boresight.model.errors import InputError, ToolMissing
from boresight.sim.montecarlo.campaign import Campaign, draws
from boresight.sim.montecarlo.journal import Journal

__all__ = ["cluster", "complete", "processes"]

HAND = 5  #: draws that are dealt out together.


@contextmanager
def processes(jobs: int) -> Iterator[Executor | None]:
    """So many processes of this machine; None for one: this process itself."""
    if jobs == 1:
        yield None
        return
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(jobs, mp_context=context) as pool:
        yield pool


@contextmanager
def cluster(address: str) -> Iterator[Executor]:
    """The Dask cluster whose scheduler is at ``address``, as ``tcp://host:8786``.

    Raises
    ------
    ToolMissing
        dask.distributed is not installed.
    InputError
        No scheduler answers.
    """
    try:
        distributed = import_module("distributed")
    except ImportError:
        raise ToolMissing(
            "dask.distributed was not found: pip install 'boresight[cluster]', here and on the "
            "workers."
        ) from None
    try:
        client = distributed.Client(address, timeout=10)
    except (OSError, TimeoutError, ValueError) as error:
        raise InputError.at(
            "scheduler",
            wanted="the address of a Dask scheduler",
            found=f"{address}: {type(error).__name__}",
            fix="start one with `dask scheduler` and give its address",
        ) from None
    with client:
        yield client.get_executor()


def complete(
    campaign: Campaign,
    seeds: Sequence[int],
    journal: Journal,
    executor: Executor | None,
    say: Callable[[str], None],
) -> list[dict[str, Any]]:
    """All draws in the order of their seeds; those of the journal are not run again."""
    left = [seed for seed in seeds if seed not in journal.done]
    if len(left) < len(seeds):
        say(f"{len(seeds) - len(left)} of {len(seeds)} draws are done already")
    hands = [left[k : k + HAND] for k in range(0, len(left), HAND)]

    def told() -> None:
        done = sum(seed in journal.done for seed in seeds)
        say(f"{done} of {len(seeds)} draws")

    if executor is None:
        for hand in hands:
            for seed in hand:
                journal.add(draws(campaign, [seed]))
            told()
    else:
        futures = [executor.submit(draws, campaign, hand) for hand in hands]
        try:
            for future in as_completed(futures):
                journal.add(future.result())
                told()
        except BaseException:
            for future in futures:
                future.cancel()
            raise
    return [journal.done[seed] for seed in seeds]
