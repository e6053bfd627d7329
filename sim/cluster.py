"""A Dask cluster that runs a campaign."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import AbstractContextManager, contextmanager, nullcontext
from importlib import import_module
from typing import Any

from boresight.model.errors import InputError, ToolMissing

__all__ = ["cluster", "executor_for"]


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


def executor_for(
    address: str | None, executor: Executor | None, *, texts: bool, wanted: str
) -> AbstractContextManager[Any]:
    """The executor that runs a campaign; None for the processes of this machine.

    Parameters
    ----------
    address : str or None
        Of a scheduler, if there is no executor.
    texts : bool
        Whether the campaign can be made by another process.
    wanted : str
        Arguments that have to be texts, for the message.

    Raises
    ------
    InputError
        A scheduler, for objects that its workers cannot make.
    """
    if executor is not None or address is None:
        return nullcontext(executor)
    if not texts:
        raise InputError.at(
            "scheduler",
            wanted=f"{wanted} by name or file, which its workers can read",
            found="objects",
            fix="give texts, or leave the scheduler out",
        )
    return cluster(address)
