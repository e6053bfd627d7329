"""What an estimator declares: inputs, parameters, states and outputs, each with range and unit.

Units are texts that people and the units library read (``m/s^2``, ``deg/s``, ``uT``); a few mean
more: ``ht`` is half turns (1 = pi rad, a binary angle that wraps), ``turn`` of an output is turns
from 0 to 1, the word read as an unsigned number; ``flags`` and ``bits`` are words whose bits are
compared exactly.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from numbers import Real
from typing import Any, Protocol

from boresight.model.errors import InputError
from boresight.model.places import author_line, placed
from boresight.model.words.fixed import Format

__all__ = [
    "EXACT_UNITS",
    "GRAVITY",
    "MICRO_G",
    "PERIODS",
    "QUATERNION",
    "Given",
    "Input",
    "Named",
    "Output",
    "Param",
    "State",
    "check_declared",
]

#: Outputs that together are an attitude.
QUATERNION = ("qw", "qx", "qy", "qz")
#: Units of words that are compared bit by bit, not as numbers.
EXACT_UNITS = ("flags", "bits")
#: Units of angles that wrap, and the period.
PERIODS = {"ht": 2.0, "turn": 1.0}
#: The line that declares it, "file.py, line 41"; says nothing of what it is.
_LINE: Any = field(default_factory=author_line, kw_only=True, repr=False, compare=False)
#: The unit g, standard gravity, m/s^2.
GRAVITY = 9.80665
#: A millionth of it, rounded once.
MICRO_G = float(f"{GRAVITY}e-6")


@dataclass(frozen=True)
class Given:
    """Words that come from somewhere with a format of its own: fraction bits, range."""

    frac: int
    low: float
    high: float


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
    source : str
        ``"PROGRAM.OUTPUT"``: in a core that holds that program it is read there, as the program's
        last complete update left it; before the first one it is 0, or where the output is the next
        value of a state, that state's initial value. In other cores it is an input like any other.
    given : Given, optional
        The words that it takes, where they are not of the finest format that holds the range:
        `model.linking` and the sensors of a board say that, no author has to.
    meaning : str
        What it is, for the texts about a core.

    Raises
    ------
    InputError
        The range is empty or not finite, ``missing`` lies outside it, or ``source`` has another
        form.
    """

    name: str
    low: float
    high: float
    unit: str = ""
    missing: float | str | None = None
    valid_of: str | tuple[str, ...] = ()
    clamp: bool = False
    source: str = ""
    given: Given | None = None
    meaning: str = ""
    line: str = _LINE

    def __post_init__(self) -> None:
        where = placed(self.line, f"input {self.name}")
        _check_range(where, self.low, self.high)
        program, dot, output = self.source.partition(".")
        if self.source and not (dot and program and output.isidentifier()):
            raise InputError.at(
                where,
                wanted='source="PROGRAM.OUTPUT"',
                found=repr(self.source),
                fix="name the program and its output, as mekf.qw",
            )
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

    @property
    def beyond(self) -> bool:
        """Whether the words that it takes can lie outside its range: the program clamps them."""
        g = self.given
        return g is not None and not (self.low <= g.low and g.high <= self.high)

    def taking(self, given: Given, word: int, *, of: str, unit: str, where: str) -> Input:
        """The same input, fed with words of somewhere else.

        Parameters
        ----------
        given : Given
            Their format and range.
        word : int
            W.
        of, unit : str
            Where they come from, for messages; what they are in.
        where : str
            Whose input it is, for messages.

        Raises
        ------
        InputError
            Another unit, or a range that it does not hold and may not be clamped to.
        """
        if unit != self.unit:
            raise InputError.at(
                placed(self.line, f"{where}, input {self.name}"),
                wanted=f"the unit of {of}, {unit or 'none'}",
                found=self.unit or "none",
                fix="declare the input in that unit, and convert in step",
            )
        taken = replace(self, given=given)
        if taken.beyond and not self.clamp:
            raise InputError.at(
                placed(self.line, f"{where}, input {self.name}"),
                wanted=f"a range that holds [{given.low:g}, {given.high:g}] {unit} of {of}".replace(
                    "  ", " "
                ),
                found=f"[{self.low:g}, {self.high:g}]",
                fix="widen it, or say clamp=True",
            )
        own = Format.declared(word, self.low, self.high, self.unit)
        return self if given.frac == own.frac and not taken.beyond else taken


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
    line: str = _LINE

    def __post_init__(self) -> None:
        where = placed(self.line, f"parameter {self.name}")
        _check_range(where, self.low, self.high)
        _check_inside(where, "default", self.default, self.low, self.high)


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
    line: str = _LINE

    def __post_init__(self) -> None:
        where = placed(self.line, f"state {self.name}")
        _check_range(where, self.low, self.high)
        _check_inside(where, "initial value", self.initial, self.low, self.high)


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
        Largest difference of fixed point and float64 that its author accepts, in ``unit``. Angles
        of `PERIODS` are compared modulo their period; words of `EXACT_UNITS` exactly, whatever
        stands here. Without it the difference is shown and not judged.
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
    line: str = _LINE

    def __post_init__(self) -> None:
        if self.tolerance is not None and not 0.0 <= self.tolerance < math.inf:
            raise InputError.at(
                placed(self.line, f"output {self.name}"),
                wanted="a tolerance of 0 or more",
                found=repr(self.tolerance),
                fix="give the largest difference of fixed point and float that you accept",
            )


class Named(Protocol):
    """What has a name."""

    @property
    def name(self) -> str:
        """Its name."""


#: What knows its line.
_DECLARED = (Input, Param, State, Output)


def check_declared(where: str, *groups: tuple[str, Iterable[Named]]) -> None:
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
            place = placed(one.line if isinstance(one, _DECLARED) else "", where)
            if not (isinstance(one.name, str) and one.name.isidentifier()):
                raise InputError.at(
                    place,
                    wanted=f"{kind} names of letters, digits and _",
                    found=repr(one.name),
                    fix="rename it",
                )
            if one.name in seen:
                raise InputError.at(
                    place, wanted=f"each {kind} once", found=f"{one.name} twice", fix="rename one"
                )
            seen.add(one.name)


def _check_range(where: str, low: float, high: float) -> None:
    for given in (low, high):
        if not isinstance(given, Real):
            raise InputError.at(
                where,
                wanted="a name, then numbers for its range",
                found=repr(given),
                fix='write it as Input("z", -1.0, 1.0, "m"), State likewise, '
                'Param("gain", 0.2, 0.0, 1.0)',
            )
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
