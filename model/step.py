"""What a ``step`` gets and must return, and what its mistakes mean."""

from __future__ import annotations

import inspect
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np

from boresight.model.declarations import Named, State
from boresight.model.errors import InputError, closest
from boresight.model.lowering.trace import Condition, Scalar
from boresight.model.places import author_line, place_of, place_of_function, placed

__all__ = ["Values", "check_constants", "checked"]

#: Cures of errors that Python and numpy raise, by their texts.
_CURES = (
    (
        r"does not support ufuncs|no callable \w+ method|ufunc '\w+' not supported",
        "numpy's functions take no traced value: use boresight.ops (sincos_ht, sqrt, exp, ...)",
    ),
    (r"not supported between|unsupported operand", "use + - * / ** and comparisons of numbers"),
    (
        r"shapes? .* (not aligned|mismatch)|could not be broadcast|mismatch in its core",
        "see the shapes of the arrays",
    ),
    (r"is not defined|has no attribute", "correct the name"),
    (r"is not callable", "write a * before the bracket"),
    (r"not subscriptable|not iterable|has no len", "it is one number, without elements"),
)


class _NotThere(InputError, AttributeError):
    """A name that is not declared; `getattr` and `hasattr` see an attribute that is not there."""


class Values(SimpleNamespace):
    """Values by name: of one kind, as a step gets them.

    Parameters
    ----------
    kind : str
        "input", "parameter" or "state", for messages.
    values : mapping
    """

    __slots__ = ("_names",)

    def __init__(self, kind: str, values: Mapping[str, Any]) -> None:
        # numpy's own, so that comparisons give its bools: ~ of Python's is a number.
        own = {n: np.float64(v) if type(v) in (float, int) else v for n, v in values.items()}
        super().__init__(**own)
        self._names = (kind, tuple(values))

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        kind, names = self._names
        near = ", ".join(closest(name, names))
        raise _NotThere.at(
            author_line(),
            wanted=f"one of the declared {kind}s: {near}" if near else f"a declared {kind}",
            found=repr(name),
            fix=f"correct the name, or declare the {kind}",
        )


def checked(
    name: str,
    step: Callable[..., Any],
    arguments: tuple[Any, ...],
    states: Sequence[Named],
    outputs: Sequence[Named],
    *,
    arrays: bool = False,
) -> tuple[dict[str, Any], dict[str, Any]]:
    """What ``step`` of the estimator ``name`` returns.

    Parameters
    ----------
    arrays : bool
        Whether each value may be an array, one element for each of several runs.

    Raises
    ------
    InputError
        It raises, or returns other than two dictionaries of numbers, one for each declared state
        and output.
    """
    begins = place_of_function(step)
    where = placed(begins, f"step of {name}")
    try:
        result = step(*arguments)
    except InputError as error:
        place = place_of(error)
        raise (
            error if not place or str(error).startswith(place) else InputError(f"{place}, {error}")
        ) from error
    except (Exception, SystemExit) as error:
        raise _explained(name, step, arguments, where, error) from error
    two = isinstance(result, tuple) and len(result) == 2
    if not two or not all(isinstance(part, Mapping) for part in result):
        kinds = " and ".join(type(part).__name__ for part in result) if two else ""
        raise InputError.at(
            where,
            wanted="two dictionaries: next states, outputs",
            found=kinds or type(result).__name__,
            fix="return {states by name}, {outputs by name}",
        )
    for kind, declared, given in zip(("state", "output"), (states, outputs), result, strict=True):
        _check_returned(f"{where}, {kind}", kind, [d.name for d in declared], given, arrays=arrays)
    states_and_outputs: tuple[dict[str, Any], dict[str, Any]] = result
    return states_and_outputs


def _explained(
    name: str,
    step: Callable[..., Any],
    arguments: tuple[Any, ...],
    where: str,
    error: BaseException,
) -> InputError:
    """What a step that raised did wrong."""
    place = place_of(error)
    try:
        inspect.signature(step).bind(*arguments)
    except TypeError:
        return InputError.at(
            where,
            wanted="step(self, x, u, p): states, inputs, parameters",
            found=f"step{inspect.signature(step)} of the object",
            fix="take these three, also where one is not needed",
        )
    text = f"{type(error).__name__}: {error}".splitlines()[0]
    cure = next((cure for known, cure in _CURES if re.search(known, text)), None)
    return InputError.at(
        place or where,
        wanted=f"a step of {name} that computes",
        found=text,
        fix=cure or "use + - * /, comparisons and boresight.ops",
    )


def check_constants(
    name: str,
    step: Callable[..., Any],
    states: Sequence[State],
    after: Mapping[str, Any],
    outputs: Mapping[str, Any],
) -> None:
    """Refuse constants among what a recorded step returns that no word of theirs can be."""
    ranges = {("state", s.name): (s.low, s.high) for s in states}
    given = [("state", *item) for item in after.items()]
    for kind, key, value in [*given, *(("output", *item) for item in outputs.items())]:
        number = value.data[0] if isinstance(value, Scalar) and value.kind == "const" else value
        low, high = ranges.get((kind, key), (-sys.float_info.max, sys.float_info.max))
        if isinstance(number, int | float) and not low <= number <= high:
            raise InputError.at(
                placed(place_of_function(step), f"step of {name}, {kind} {key}"),
                wanted=f"a constant in [{low:g}, {high:g}]"
                if kind == "state"
                else "a finite number",
                found=repr(number),
                fix="correct how it is computed, or the range",
            )


def _check_returned(
    where: str, kind: str, declared: Sequence[str], given: Mapping[str, Any], *, arrays: bool
) -> None:
    """Refuse what is missing, not declared, or no number."""
    for name in sorted({*declared} ^ {*given}, key=str):
        raise InputError.at(
            f"{where} {name}",
            wanted=f"each declared {kind} once: {', '.join(declared)}",
            found="none" if name in declared else "one that is not declared",
            fix=f"return it with the {kind}s, or change the declaration",
        )
    for name, value in given.items():
        if isinstance(value, np.ndarray) and value.ndim and not arrays:
            raise InputError.at(
                f"{where} {name}",
                wanted="a number",
                found=f"an array of shape {value.shape}",
                fix="return its elements, each by a name of its own",
            )
        if isinstance(value, Condition) or not hasattr(value, "__truediv__"):
            raise InputError.at(
                f"{where} {name}",
                wanted="a number",
                found=f"a {type(value).__name__.lower()}",
                fix="of a condition, return ops.where(condition, 1.0, 0.0)",
            )
