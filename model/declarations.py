"""What an estimator declares: inputs, parameters, states and outputs, each with range and unit.

Units are texts that people and the units library read (``m/s^2``, ``deg/s``, ``uT``); a few mean
more: ``ht`` is half turns (1 = pi rad, a binary angle that wraps), ``flags`` and ``bits`` are words
whose bits are compared exactly.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

from boresight.model.errors import InputError

__all__ = ["EXACT_UNITS", "QUATERNION", "Input", "Output", "Param", "State", "check_declared"]

#: Outputs that together are an attitude.
QUATERNION = ("qw", "qx", "qy", "qz")
#: Units of words that are compared bit by bit, not as numbers.
EXACT_UNITS = ("flags", "bits")


@dataclass(frozen=True)
class Input:
    """One word of every input record.

    Parameters
    ----------
    name : str
        Column of a log that feeds it.
    low, high : float
        Full scale, in ``unit``.
    unit : str
        Unit of the values; a log's column may have another one of the same dimension.
    missing : float or "hold", optional
        What it reads where a log has no new sample: this value, or the last one. Without it, a
        missing sample is refused.
    valid_of : str or tuple of str
        Makes it a flag, 1 where these inputs have a new sample and 0 elsewhere; it has no column.
    clamp : bool
        Values beyond the full scale are clamped on purpose; else they are refused.

    Raises
    ------
    InputError
        The range is empty or not finite, or ``missing`` lies outside it.
    """

    name: str
    low: float
    high: float
    unit: str = ""
    missing: float | str | None = None
    valid_of: str | tuple[str, ...] = ()
    clamp: bool = False

    def __post_init__(self) -> None:
        where = f"input {self.name}"
        _check_range(where, self.low, self.high)
        if isinstance(self.missing, str):
            if self.missing != "hold":
                raise InputError.at(
                    where,
                    wanted='missing=NUMBER or missing="hold"',
                    found=repr(self.missing),
                    fix="choose what it reads where a log has no new sample",
                )
        elif self.missing is not None:
            _check_inside(where, "missing", self.missing, self.low, self.high)

    @property
    def flags(self) -> tuple[str, ...]:
        """Inputs whose validity it tells."""
        return (self.valid_of,) if isinstance(self.valid_of, str) else tuple(self.valid_of)


@dataclass(frozen=True)
class Param:
    """A register that may be written while the estimator runs.

    ``low``/``high`` are its legal range; ``meaning`` says what small and large values do.

    Raises
    ------
    InputError
        The range is empty or not finite, or the default lies outside it.
    """

    name: str
    default: float
    low: float
    high: float
    unit: str = ""
    meaning: str = ""

    def __post_init__(self) -> None:
        _check_range(f"parameter {self.name}", self.low, self.high)
        _check_inside(f"parameter {self.name}", "default", self.default, self.low, self.high)


@dataclass(frozen=True)
class State:
    """A value carried from sample to sample, with its range and start value.

    Raises
    ------
    InputError
        The range is empty or not finite, or the start value lies outside it.
    """

    name: str
    low: float
    high: float
    unit: str = ""
    initial: float = 0.0

    def __post_init__(self) -> None:
        _check_range(f"state {self.name}", self.low, self.high)
        _check_inside(f"state {self.name}", "initial value", self.initial, self.low, self.high)


@dataclass(frozen=True)
class Output:
    """One word of every output record.

    Parameters
    ----------
    name : str
        Its truth, where a log has it, is the column ``NAME_true``.
    unit : str
        Unit of the values.
    tolerance : float, optional
        Largest difference of fixed point and float64 that its author accepts, in ``unit``. Half
        turns are compared modulo 2; words of `EXACT_UNITS` exactly, whatever stands here. Without
        it the difference is shown and not judged.
    meaning : str
        What it is, for register maps and pages.

    Raises
    ------
    InputError
        The tolerance is negative or not a number.
    """

    name: str
    unit: str = ""
    tolerance: float | None = None
    meaning: str = ""

    def __post_init__(self) -> None:
        if self.tolerance is not None and not 0.0 <= self.tolerance < math.inf:
            raise InputError.at(
                f"output {self.name}",
                wanted="a tolerance of 0 or more",
                found=repr(self.tolerance),
                fix="give the largest difference of fixed point and float that you accept",
            )


class _Declared(Protocol):
    @property
    def name(self) -> str: ...


def check_declared(where: str, *groups: tuple[str, Iterable[_Declared]]) -> None:
    """Refuse names that are no identifiers or that one group holds twice.

    Parameters
    ----------
    where : str
        Estimator, for the message.
    groups : (kind, declarations)
        Of one kind each: "input", "parameter", ...

    Raises
    ------
    InputError
        See above.
    """
    for kind, declared in groups:
        seen = set()
        for one in declared:
            if not one.name.isidentifier():
                raise InputError.at(
                    where,
                    wanted=f"{kind} names of letters, digits and _",
                    found=repr(one.name),
                    fix="rename it",
                )
            if one.name in seen:
                raise InputError.at(
                    where, wanted=f"each {kind} once", found=f"{one.name} twice", fix="rename one"
                )
            seen.add(one.name)


def _check_range(where: str, low: float, high: float) -> None:
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise InputError.at(
            where,
            wanted="a finite range with low < high",
            found=f"[{low:g}, {high:g}]",
            fix="correct the declaration",
        )


def _check_inside(where: str, what: str, value: float, low: float, high: float) -> None:
    if not low <= value <= high:
        raise InputError.at(
            where,
            wanted=f"{what} in [{low:g}, {high:g}]",
            found=f"{value:g}",
            fix=f"correct the {what} or the range",
        )
