"""A Dask cluster that runs the draws."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from importlib import import_module

from boresight.model.errors import InputError, ToolMissing

__all__ = ["cluster"]


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
