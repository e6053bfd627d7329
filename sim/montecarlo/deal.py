"""Who runs the draws: this process, other processes of this machine, a Dask cluster.

Which draw runs where changes nothing of it: each has a seed of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, as_completed
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from boresight.model.errors import InputError, ToolMissing
from boresight.sim.montecarlo.campaign import Campaign, draws
from boresight.sim.montecarlo.journal import Journal
from boresight.sim.processes import dispatch

__all__ = ["cluster", "complete"]

HAND = 5  #: draws that are dealt out together.


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
    *,
    say: Callable[[str], None],
    jobs: int = 1,
    executor: Executor | None = None,
) -> list[dict[str, Any]]:
    """All draws in the order of their seeds; those of the journal are not run again.

    So many processes of this machine run them, or ``executor``.
    """
    left = [seed for seed in seeds if seed not in journal.done]
    if len(left) < len(seeds):
        say(f"{len(seeds) - len(left)} of {len(seeds)} draws are done already")
    size = HAND if executor is not None or jobs > 1 else 1
    hands = [left[k : k + size] for k in range(0, len(left), size)]
    if executor is not None:
        found = _submitted(executor, campaign, hands)
    else:
        dealt_out = dispatch(jobs, [(k, draws, (campaign, hand)) for k, hand in enumerate(hands)])
        found = (made for _, made in dealt_out)
    for made in found:
        journal.add(made)
        say(f"{sum(seed in journal.done for seed in seeds)} of {len(seeds)} draws")
    return [journal.done[seed] for seed in seeds]


def _submitted(
    executor: Executor, campaign: Campaign, hands: Sequence[Sequence[int]]
) -> Iterator[list[dict[str, Any]]]:
    """Draws of an executor, as they come; after an error those that have not begun never do."""
    futures = [executor.submit(draws, campaign, hand) for hand in hands]
    try:
        for future in as_completed(futures):
            yield future.result()
    except BaseException:
        for future in futures:
            future.cancel()
        raise
