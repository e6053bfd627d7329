"""Declarations of an estimator: inputs, parameters, states and outputs, with range and unit.

Units are texts of the units library (``m/s^2``, ``deg/s``, ``uT``) and four special ones: ``ht`` is
half turns (1 = pi rad, a binary angle that wraps); ``turn`` of an output is turns from 0 to 1, the
word read as an unsigned number; ``flags`` and ``bits`` are words whose bits are compared exactly.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from numbers import Integral, Real
from types import NoneType
from typing import Any

import numpy as np

from boresight.model.errors import author_line, placed, require
from boresight.model.units import GRAVITY as GRAVITY
from boresight.model.units import check_unit

#: Outputs that together are an attitude.
QUATERNION = ("qw", "qx", "qy", "qz")
#: Name of the difference between two attitudes.
ATTITUDE = "attitude"
#: Tolerance of an attitude, in degrees, over that of each of its components: an angle a differs by
#: a/2 in the quaternion, whose length is at most twice a component's.
ATTITUDE_DEG = 4.0 * (180.0 / math.pi)
#: Units of words that are compared bit by bit, not as numbers.
EXACT_UNITS = ("flags", "bits")
#: Units of angles that wrap, and the period.
PERIODS = {"ht": 2.0, "turn": 1.0}
#: Shares of a word from which on a range takes all of it, and of the largest of the shortest words.
_ALL, _BELOW = 0.999, 1.0 - 2.0**-17
#: Source location of a declaration, "file.py, line 41"; no part of its identity.
_LINE: Any = field(default_factory=author_line, kw_only=True, repr=False, compare=False)
#: Kinds of values by their annotations, and what messages call them.
_KINDS: dict[str, tuple[type | tuple[type, ...], str]] = {
    "str": (str, "a text"),
    "bool": ((bool, np.bool_), "True or False"),
    "int": (Integral, "a whole number"),
    "float": (Real, "a number"),
    "None": (NoneType, "None"),
    "tuple": ((tuple, list), "a tuple"),
    "Mapping": (Mapping, "a dictionary"),
}
#: Largest magnitude of a range.
_LARGEST = 2.0**400
#: A millionth of `GRAVITY`, rounded once.
MICRO_G = float(f"{GRAVITY}e-6")


@dataclass(frozen=True)
class SourceFormat:
    """Fraction bits and range of the words of an input's source."""

    frac: int
    low: float
    high: float


@dataclass(frozen=True)
class Input:
    """One word of every input record.

    InputError: the unit is not known, the range is empty or not finite, or ``missing`` lies outside
    it.

    Parameters
    ----------
    name : str
        Column of a log that feeds it.
    low, high : float
        Full scale, in ``unit``.
    unit : str
        Unit of the values; a log's column may have another one of the same dimension.
    missing : float or "hold", optional
        Value that is read if a log has no new sample, or "hold" for the last one. By default a
        missing sample is refused.
    valid_of : str or tuple of str
        Inputs whose validity this one flags: 1 if they have a new sample, else 0; no column.
    clamp : bool
        Whether values beyond the full scale are clamped, by the program itself in every form; by
        default a log with such a value is refused.
    source_format : SourceFormat, optional
        Format of the words read, if it is not the finest that holds the range. Boards set it for
        their sensors.
    meaning : str
        Description, for the texts about a core.
    """

    name: str
    low: float
    high: float
    unit: str = ""
    missing: float | str | None = None
    valid_of: str | tuple[str, ...] = ()
    clamp: bool = False
    source_format: SourceFormat | None = None
    meaning: str = ""
    line: str = _LINE

    def __post_init__(self) -> None:
        where = _checked(self, "input")
        _check_range(where, self.low, self.high)
        if not isinstance(self.missing, str | None):
            _check_inside(where, "missing", self.missing, self.low, self.high)
        elif self.missing != "hold":
            wanted, fix = 'missing=NUMBER or missing="hold"', "choose one for missing samples"
            require(self.missing is None, where, wanted, self.missing, fix)

    @property
    def flags(self) -> tuple[str, ...]:
        """Inputs whose validity this one flags."""
        return (self.valid_of,) if isinstance(self.valid_of, str) else tuple(self.valid_of)

    @property
    def span(self) -> tuple[float, float]:
        """Range of its words: the declared range, or the whole word of a clamped input."""
        if self.source_format is not None:
            return self.source_format.low, self.source_format.high
        share, exponent = math.frexp(max(-self.low, self.high))
        full = math.ldexp(1.0, exponent - (share == 0.5))
        if not self.clamp or (self.low <= -_ALL * full and self.high >= _ALL * full):
            return self.low, self.high
        return -full, _BELOW * full

    @property
    def explained(self) -> str:
        """The meaning, and to what words beyond the range are clamped."""
        limits = f"clamped to {self.low:g} to {self.high:g}" if self.clamp and self.beyond else ""
        return "; ".join(filter(None, (self.meaning, limits)))

    @property
    def beyond(self) -> bool:
        """Whether words can lie outside the range; the program clamps them."""
        return self.span[0] < self.low or self.high < self.span[1]


@dataclass(frozen=True)
class Param:
    """A register that may be written while the estimator runs.

    ``low``/``high`` are the legal range; ``meaning`` is the effect of small and large values.

    InputError: the unit is not known, the range is empty or not finite, or the default lies outside
    it.
    """

    name: str
    default: float
    low: float
    high: float
    unit: str = ""
    meaning: str = ""
    line: str = _LINE

    def __post_init__(self) -> None:
        where = _checked(self, "parameter")
        _check_range(where, self.low, self.high)
        _check_inside(where, "default", self.default, self.low, self.high)


@dataclass(frozen=True)
class State:
    """A value carried from sample to sample, with its range and start value.

    InputError: the unit is not known, the range is empty or not finite, or the start value lies
    outside it.
    """

    name: str
    low: float
    high: float
    unit: str = ""
    initial: float = 0.0
    line: str = _LINE

    def __post_init__(self) -> None:
        where = _checked(self, "state")
        _check_range(where, self.low, self.high)
        _check_inside(where, "initial value", self.initial, self.low, self.high)


@dataclass(frozen=True)
class Output:
    """One word of every output record.

    InputError: the unit is not known, the tolerance, ``truth`` or ``longest`` is negative or not a
    number, or ``share`` is not from 0 to 1.

    Parameters
    ----------
    name : str
        The true values in a log are the column ``NAME_true``.
    unit : str
        Unit of the values.
    tolerance : float, optional
        Largest accepted difference of fixed point and float64, in ``unit``. Angles
        of `PERIODS` are compared modulo their period; words of `EXACT_UNITS` bit by bit,
        and take none. By default the difference is shown and not judged.
    meaning : str
        Description, for register maps and pages.
    share, longest : float, int
        For words of `EXACT_UNITS`, which are decisions: largest accepted share of updates that
        differ from float64, and most such updates in a row.
    truth : float, optional
        Largest accepted root mean square error against a log's true values, in ``unit``: `check`
        fails beyond it. By default the error is shown and not judged.
    """

    name: str
    unit: str = ""
    tolerance: float | None = None
    meaning: str = ""
    share: float = 1e-5
    longest: int = 10
    truth: float | None = None
    line: str = _LINE

    def __post_init__(self) -> None:
        where = _checked(self, "output")
        exact = self.unit in EXACT_UNITS and bool(self.tolerance)
        wanted = f"no tolerance of {self.unit}, which are compared bit by bit"
        fix = "leave it out, or give share and longest, how many may differ"
        require(not exact, where, wanted, self.tolerance, fix)
        fix = "give what you accept"
        require(0.0 <= self.share <= 1.0, where, "a share from 0 to 1", self.share, fix)
        require(self.longest >= 0, where, "a longest of 0 or more", self.longest, fix)
        truth = self.truth is None or 0.0 < self.truth < math.inf
        require(truth, where, "a limit above 0 for the error against truth", self.truth, fix)
        tolerance = self.tolerance is None or 0.0 <= self.tolerance < math.inf
        require(tolerance, where, "a tolerance of 0 or more", self.tolerance, fix)


def _checked(declaration: Any, kind: str) -> str:
    """Check the unit, and return the place for messages.

    Numpy's numbers become Python's, and whole numbers of real quantities floats.
    """
    where = placed(declaration.line, f"{kind} {declaration.name}")
    for part in fields(declaration):
        value = getattr(declaration, part.name)
        if isinstance(value, np.generic):
            value = value.item()
        if type(value) is int and "float" in str(part.type):
            value = float(value) if abs(value) < _LARGEST else math.inf if value > 0 else -math.inf
        object.__setattr__(declaration, part.name, value)
        if part.name not in ("name", "low", "high"):  # see `_check_range`
            check_kind(where, part.name, value, str(part.type))
    check_unit(where, declaration.unit)
    return where


def check_kind(where: str, subject: str, value: object, annotation: str) -> None:
    """Refuse a value of another kind than its annotation; those not in `_KINDS` allow any."""
    kinds = [_KINDS.get(part.partition("[")[0], (object, "")) for part in annotation.split(" | ")]
    wanted, fix = f"{subject}: {' or '.join(words for _, words in kinds)}", "correct it"
    if isinstance(value, str) and wanted.endswith("a number"):
        fix = "write it without quotes"
    elif wanted.endswith("a tuple"):
        fix = f"write {subject} = (...,)"
    require(any(isinstance(value, kind) for kind, _ in kinds), where, wanted, value, fix)


def _check_range(where: str, low: float, high: float) -> None:
    forms = 'write it as Input("z", -1.0, 1.0, "m"), State likewise, Param("gain", 0.2, 0.0, 1.0)'
    for limit in (low, high):
        require(isinstance(limit, Real), where, "a name, then numbers for its range", limit, forms)
    finite = -_LARGEST < low < high < _LARGEST
    require(finite, where, "a finite range with low < high", (low, high))


def _check_inside(where: str, subject: str, value: float, low: float, high: float) -> None:
    fix = f"correct the {subject} or the range"
    require(low <= value <= high, where, f"{subject} in [{low:g}, {high:g}]", value, fix)
