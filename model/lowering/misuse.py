"""What a recorded value cannot do, and what to write instead.

A step runs once on values that have no numbers yet. An operation that needs a number, or would lose
the record, is refused with its line.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from boresight.model.errors import InputError
from boresight.model.places import author_line

#: The operation of these methods, and what to write instead.
Refused = Mapping[str, tuple[str, str]]

_TRUTH = (
    "if, and, or, not, max, min of a traced value",
    "use ops.where(condition, yes, no), & | ~, ops.maximum, ops.minimum",
)
_KEY = ("a traced value in a set, as a key, or in a cache", "use its name, or its place in a list")
NO_NUMBER: Refused = {
    "bool": _TRUTH,
    "hash": _KEY,
    "float complex": (
        "float() or a function of math, of a traced value",
        "use the functions of boresight.ops; numbers stay as they are; an array of "
        "traced values is made by np.array([...]) or with dtype=object",
    ),
    "int index round trunc floor ceil": (
        "a traced value as a whole number",
        "choose with ops.where and comparisons",
    ),
    "rmod floordiv rfloordiv divmod rdivmod": (
        "// or divmod of a traced value, or % by one",
        "x - x % c is a multiple of a number c",
    ),
    "rpow": ("a traced value as a power", "write ops.exp(x * log_a) for a**x, log_a a number"),
    "and rand or ror invert xor rxor": (
        "& | ^ ~ of a traced value",
        "compare it: these combine conditions, as (x < 1.0) & (y > 0.0)",
    ),
}
_ARITHMETIC = "add sub mul truediv pow mod floordiv divmod matmul lshift rshift"
_AS_NUMBER = "neg pos abs float complex int index round trunc floor ceil lt gt le ge"
NO_CONDITION: Refused = {
    "bool": _TRUTH,
    "hash": _KEY,
    f"{_ARITHMETIC} r{_ARITHMETIC.replace(' ', ' r')} {_AS_NUMBER}": (
        "a condition as a number",
        "write ops.where(condition, 1.0, 0.0)",
    ),
}


def repeatable(same: bool, line: str = "") -> None:
    """Refuse a step that computes something else when it runs again, unless it is the same.

    ``line``: source location, by default the author's line that runs.

    Raises
    ------
    InputError
        See above.
    """
    if not same:
        raise InputError.at(
            line or author_line(),
            wanted="a step that computes the same whenever it runs",
            found="another expression the second time",
            fix="no random numbers, no time, nothing kept in self: use states and inputs",
        )


def _refusing(operation: str, fix: str) -> Callable[..., Any]:
    def refuse(self: Any, *_: Any) -> Any:
        raise InputError.at(
            author_line(), wanted="operations that can be recorded", found=operation, fix=fix
        )

    return refuse


class Refuses:
    """A class whose objects refuse some methods, each with the author's line and a cure."""

    def __init_subclass__(cls, refused: Refused = {}, **options: Any) -> None:  # noqa: B006
        super().__init_subclass__(**options)
        for methods, (operation, fix) in refused.items():
            for method in methods.split():
                setattr(cls, f"__{method}__", _refusing(operation, fix))
