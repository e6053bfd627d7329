"""What a ``step`` must return, and where its mistakes happened."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from boresight.model.declarations import Named
from boresight.model.errors import InputError

__all__ = ["checked", "place_of"]

#: Folders whose lines nobody wrote an estimator in.
_OWN = [Path(__file__).parent / room for room in ("", "lowering", "algebra")]


def checked(
    name: str,
    step: Callable[..., Any],
    arguments: tuple[Any, ...],
    states: Sequence[Named],
    outputs: Sequence[Named],
) -> tuple[dict[str, Any], dict[str, Any]]:
    """What ``step`` of the estimator ``name`` returns.

    Raises
    ------
    InputError
        It raises, or returns other than two dictionaries of numbers, one for each declared state
        and output.
    """
    try:
        result = step(*arguments)
    except InputError:
        raise
    except Exception as error:
        raise InputError.at(
            place_of(error),
            wanted=f"a step of {name} that computes",
            found=f"{type(error).__name__}: {error}".splitlines()[0],
            fix="use + - * /, comparisons and boresight.ops",
        ) from error
    two = isinstance(result, tuple) and len(result) == 2
    if not two or not all(isinstance(part, Mapping) for part in result):
        kinds = " and ".join(type(part).__name__ for part in result) if two else ""
        raise InputError.at(
            f"step of {name}",
            wanted="two dictionaries: next states, outputs",
            found=kinds or type(result).__name__,
            fix="return {states by name}, {outputs by name}",
        )
    for kind, declared, given in zip(("state", "output"), (states, outputs), result, strict=True):
        _check_returned(f"step of {name}, {kind}", kind, [d.name for d in declared], given)
    states_and_outputs: tuple[dict[str, Any], dict[str, Any]] = result
    return states_and_outputs


def _check_returned(
    where: str, kind: str, declared: Sequence[str], given: Mapping[str, Any]
) -> None:
    """Refuse what is missing, not declared, or no number."""
    for name in sorted({*declared} ^ {*given}):
        raise InputError.at(
            f"{where} {name}",
            wanted=f"each declared {kind} once: {', '.join(declared)}",
            found="none" if name in declared else "one that is not declared",
            fix=f"return it with the {kind}s, or change the declaration",
        )
    for name, value in given.items():
        if not hasattr(value, "__truediv__"):
            raise InputError.at(
                f"{where} {name}",
                wanted="a number",
                found=f"a {type(value).__name__.lower()}",
                fix="of a condition, return ops.where(condition, 1.0, 0.0)",
            )


def place_of(error: BaseException) -> str:
    """File and line where an error happened, outside the recorder's own files."""
    frames = traceback.extract_tb(error.__traceback__)
    theirs = [f for f in frames if Path(f.filename).parent not in _OWN] or frames
    return f"{Path(theirs[-1].filename).name}, line {theirs[-1].lineno}"
