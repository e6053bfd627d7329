"""Calls of methods that a user wrote: what they raise is the user's mistake, in one line."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any, TypeVar

from boresight.model.errors import InputError
from boresight.model.places import place_of

T = TypeVar("T")


def called(
    call: Callable[..., T],
    *args: Any,
    where: str,
    wanted: str,
    fix: str = "correct it",
    kind: Any = object,
    answer: str = "correct what it returns",
    **options: Any,
) -> T:
    """Call a method of a user's class that returns a ``kind``; ``answer`` is the remedy if not.

    The line of the error is added to ``where``. InputError: the method raises, does not take these
    arguments, or returns something else. Our own kinds of exceptions, lack of memory, and errors
    without a line of a user pass unchanged.
    """
    try:
        result = call(*args, **options)
    except (Exception, SystemExit) as error:
        from_boresight = type(error).__module__.startswith("boresight.")
        if from_boresight or isinstance(error, MemoryError | BrokenPipeError):
            raise
        line = place_of(error, users=True)
        if not line:
            if _accepts(call, *args, **options):
                raise
            fix = f"write {_base_signature(call)}"
        text = (f"{type(error).__name__}: {error}".splitlines() or [""])[0]
        place = f"{where}, {line}" if line else where
        raise InputError.at(place, wanted=wanted, found=text[:200], fix=fix) from error
    if not isinstance(result, kind):
        raise InputError.at(where, wanted=wanted, found=type(result).__name__, fix=answer)
    return result


def _accepts(call: Callable[..., Any], *args: Any, **options: Any) -> bool:
    """Whether a function takes these arguments."""
    try:
        signature = inspect.signature(call)
    except (TypeError, ValueError):  # of a function written in C
        return True
    try:
        signature.bind(*args, **options)
    except TypeError:
        return False
    return True


def _base_signature(call: Callable[..., Any]) -> str:
    """Name and arguments of a method as our base class has it, without types."""
    name = getattr(call, "__name__", "it")
    kinds = type(getattr(call, "__self__", None)).__mro__
    bases = [
        vars(k)[name] for k in kinds if k.__module__.startswith("boresight.") and name in vars(k)
    ]
    if not bases:
        return f"{name} with the arguments that it gets"
    signature = inspect.signature(bases[-1])
    parameters = [p.replace(annotation=p.empty) for p in signature.parameters.values()]
    return f"{name}{signature.replace(parameters=parameters, return_annotation=signature.empty)}"
