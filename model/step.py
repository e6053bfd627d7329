"""Calls of methods that a user wrote: arguments and results checked, errors in one line."""

from __future__ import annotations

import inspect
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from types import SimpleNamespace
from typing import Any, TypeVar

import numpy as np

from boresight.model import errors
from boresight.model.errors import InputError, place_of_function, placed, require
from boresight.model.lowering.trace import Condition, Scalar

T = TypeVar("T")
#: Remedies for errors of Python and numpy, by patterns of their texts.
_REMEDIES = (
    (
        r"does not support ufuncs|no callable \w+ method|ufunc '\w+' not supported",
        "numpy's functions take no traced value: use boresight.ops (sincos_ht, sqrt, exp, ...)",
    ),
    (
        r"Cannot cast ufunc '\w+' output",
        "an array of float64 holds no traced value: write a = a + b instead of a += b",
    ),
    (
        r"casting rule",
        "numpy.linalg takes no traced value: write ops.inverse(S, least) or ops.solve(S, B, least) "
        "of boresight for a covariance S, with the smallest variance in R as least",
    ),
    (r"not supported between|unsupported operand", "use + - * / ** and comparisons of numbers"),
    (
        r"shapes? .* (not aligned|mismatch)|could not be broadcast|mismatch in its core",
        "see the shapes of the arrays",
    ),
    (r"is not defined|has no attribute", "correct the name"),
    (r"is not callable", "write a * before the bracket"),
    (
        r"missing \d+ required|unexpected keyword argument|positional arguments? but",
        "correct the arguments of the call",
    ),
    (r"RecursionError", "no recursion: the result before is a state"),
    (r"'Values' object is not", "write x.NAME, u.NAME, p.NAME"),
    (r"not subscriptable|not iterable|has no len", "it is one number, without elements"),
)

#: Names of numpy's functions in errors of numpy that say it in many words.
_NUMPY_ERRORS = (
    (r"no callable (\w+) method", "numpy's {} of a traced value"),
    (r"Cannot cast ufunc '(\w+)' output", "numpy's {} into an array of float64"),
    (r"Cannot cast ufunc '(\w+)' input", "numpy.linalg's {} of traced values"),
)


class _Undeclared(InputError, AttributeError):
    """A name that is not declared; for `getattr` and `hasattr` a missing attribute."""


class Values(SimpleNamespace):
    """Values of one ``kind`` by name ("input", "parameter", "state"), the arguments of a step."""

    __slots__ = ("_names",)

    def __init__(self, kind: str, values: Mapping[str, Any]) -> None:
        # numpy scalars, whose comparisons give numpy's bools: ~ of a Python bool is a number.
        numbers = {n: np.float64(v) if type(v) in (float, int) else v for n, v in values.items()}
        super().__init__(**numbers)
        self._names = (kind, tuple(values))

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        kind, names = self._names
        near = errors.listed(name, names)
        raise _Undeclared.at(
            errors.author_line(),
            wanted=f"one of the declared {kind}s: {near}" if near else f"a declared {kind}",
            found=repr(name),
            fix=f"correct the name, or declare the {kind}",
        )


def checked(
    estimator: Any, *arguments: Any, arrays: bool = False
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Call the ``step`` of an estimator; with ``arrays`` values may be those of several runs.

    InputError: ``step`` raises, or returns anything but two dictionaries with a number for each
    declared state and output.
    """
    where = placed(place_of_function(estimator.step), f"step of {estimator.name}")
    try:
        result: Any = estimator.step(*arguments)
    except InputError as error:
        line = "" if re.match(r"[^:]*, line \d", str(error)) else errors.place_of(error)
        raise (InputError(f"{line}, {error}") if line else error) from error
    except (Exception, SystemExit) as error:
        raise _explained(estimator, where, error) from error
    parts = result if isinstance(result, tuple) else (result,)
    good = len(parts) == 2 and all(isinstance(part, Mapping) for part in parts)
    found = " and ".join(f"a {type(part).__name__}" for part in parts)
    fix = "return {states by name}, {outputs by name}"
    require(good, where, "two dictionaries: next states, outputs", found, fix)
    declarations = (("state", estimator.states), ("output", estimator.outputs))
    for (kind, declared), returned in zip(declarations, parts, strict=True):
        names = [d.name for d in declared]
        _check_returned(f"{where}, {kind}", kind, names, returned, arrays=arrays)
    return parts[0], parts[1]


def _explained(estimator: Any, where: str, error: BaseException) -> InputError:
    try:
        check_arguments(where, "step", estimator.step)
    except InputError as wrong:
        return wrong
    text = f"{type(error).__name__}: {error}".splitlines()[0]
    remedies = (remedy for pattern, remedy in _REMEDIES if re.search(pattern, text))
    matches = ((re.search(pattern, text), template) for pattern, template in _NUMPY_ERRORS)
    return InputError.at(
        errors.place_of(error) or where,
        wanted=f"a step of {estimator.name} without an error",
        found=next((template.format(match[1]) for match, template in matches if match), text),
        fix=next(remedies, "use + - * /, comparisons and boresight.ops"),
    )


def check_arguments(where: str, name: str, method: Callable[..., Any]) -> None:
    """Refuse a method that does not take states, inputs, parameters."""
    signature = inspect.signature(method)
    try:
        signature.bind(None, None, None)
    except TypeError:
        wanted, found = f"{name}(self, x, u, p): states, inputs, parameters", f"{name}{signature}"
        fix = "declare all three, even if one is not used"
        raise InputError.at(where, wanted=wanted, found=f"{found} of the object", fix=fix) from None


def check_constants(estimator: Any, after: Mapping[str, Any], outputs: Mapping[str, Any]) -> None:
    """Refuse constants returned by a recorded step that lie outside the declared range."""
    largest, step = sys.float_info.max, place_of_function(estimator.step)
    where = placed(step, f"step of {estimator.name}")
    returned = [(f"state {s.name}", after[s.name], s.low, s.high) for s in estimator.states]
    returned += [(f"output {o}", value, -largest, largest) for o, value in outputs.items()]
    for place, value, low, high in returned:
        wanted = f"a constant in [{low:g}, {high:g}]" if high < largest else "a finite number"
        number = value.data[0] if isinstance(value, Scalar) and value.kind == "const" else value
        inside = not isinstance(number, int | float) or low <= number <= high
        fix = "correct how it is computed, or the range"
        require(inside, f"{where}, {place}", wanted, number, fix)


def _check_returned(
    where: str, kind: str, declared: Sequence[str], returned: Mapping[str, Any], *, arrays: bool
) -> None:
    missing = [name for name in declared if name not in returned]
    unknown = sorted(str(name) for name in returned.keys() - {*declared})
    if missing or unknown:
        where, found = f"{where} {', '.join(missing or unknown)}", ", ".join(unknown) or "none"
        wanted = f"each declared {kind} once: {', '.join(declared)}"
        fix = f"return it with the {kind}s, or change the declaration"
        raise InputError.at(where, wanted=wanted, found=found, fix=fix)
    for name, value in returned.items():
        check_number(f"{where} {name}", value, arrays=arrays)


def check_number(where: str, value: Any, *, arrays: bool = False) -> None:
    """Refuse what a method gives instead of a number or traced value."""
    if isinstance(value, np.ndarray) and value.ndim:
        if arrays:
            return
        found, fix = f"an array of shape {value.shape}", "give its elements one by one"
    elif isinstance(value, Condition):
        found, fix = "a condition", "write ops.where(condition, 1.0, 0.0)"
    elif isinstance(value, tuple | list):
        found, fix = f"a {type(value).__name__}", "give its elements one by one"
    elif hasattr(value, "__truediv__"):
        return
    else:
        found = "None" if value is None else f"a {type(value).__name__}, {value!r}"
        fix = "compute it from states, inputs, parameters and numbers"
    raise InputError.at(where, wanted="a number", found=found, fix=fix)


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
        line = errors.place_of(error, users=True)
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
    try:
        inspect.signature(call).bind(*args, **options)
    except (TypeError, ValueError) as error:
        return isinstance(error, ValueError)  # of a function written in C
    return True


def _base_signature(call: Callable[..., Any]) -> str:
    """Name and arguments of a method as our base class has it, without types."""
    name = getattr(call, "__name__", "it")
    kinds = type(getattr(call, "__self__", None)).__mro__
    ours = [vars(k) for k in kinds if k.__module__.startswith("boresight.")]
    bases = [attributes[name] for attributes in ours if name in attributes]
    if not bases:
        return f"{name} with the arguments that it gets"
    signature = inspect.signature(bases[-1])
    parameters = [p.replace(annotation=p.empty) for p in signature.parameters.values()]
    return f"{name}{signature.replace(parameters=parameters, return_annotation=signature.empty)}"
