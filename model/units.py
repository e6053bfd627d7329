"""Conversion of units.

`pint` defines the units, except a few with other names in the field: ``ht`` (half turns), ``gauss``
(1e-4 tesla, unlike pint's of the CGS), ``g0`` (standard gravity; plain ``g`` is a gram and is
refused by its dimension).
"""

from __future__ import annotations

import re
from functools import cache
from typing import Any

from boresight.model.errors import InputError, require

#: Standard gravity, m/s^2.
GRAVITY = 9.80665
#: ``gauss`` or ``G``, optionally with a prefix.
_GAUSS = re.compile(r"(?<!\w)(milli|micro|kilo|[muk])?(?:gauss|G)(?!\w)")
#: Names in units; those that need no look into the units library.
_NAME = re.compile(r"[^\W\d]+")
_COMMON = frozenset(
    (
        *("m", "km", "cm", "mm", "s", "ms", "min", "h", "Hz", "kHz", "MHz", "kg", "g0", "N", "J"),
        *("rad", "mrad", "deg", "ht", "turn", "G", "gauss", "T", "mT", "uT", "nT", "K", "degC"),
        *("V", "mV", "A", "mA", "W", "kW", "ohm", "F", "H", "C", "Pa", "hPa", "kPa", "bar"),
        *("g", "count", "counts", "lsb", "bits", "flags", "sqrt", "per", "percent"),
    )
)


class UnitError(ValueError):
    """An unknown unit, or one of another dimension; the message names it."""


@cache
def _registry() -> Any:
    import pint  # takes half a second, so only if a header has units

    registry: Any = pint.UnitRegistry()
    registry.define("half_turn = pi * radian = ht")
    registry.define(f"g0 = {GRAVITY} * meter / second ** 2")
    registry.define("tesla_gauss = 1e-4 * tesla")
    return registry


def check_unit(where: str, unit: object) -> None:
    """Raise InputError if a word of a unit is not known, such as "mtr" for "m"."""
    text = unit.replace("µ", "u").replace("Ω", "ohm") if isinstance(unit, str) else "\n"
    is_valid = not re.search(r"[\x00-\x1f]", text)
    try:
        for name in {*_NAME.findall(text)} - _COMMON:
            _parsed(name)
    except UnitError:
        is_valid = False
    require(is_valid, where, "a unit such as m/s^2 or uT", unit, "correct it, or leave it empty")


@cache
def linear(unit: str, wanted: str) -> tuple[float, float]:
    """``(factor, offset)`` of ``value_in_wanted = factor * value_in_unit + offset``.

    UnitError: a unit is unknown, or the dimensions differ.
    """
    if unit == wanted:
        return 1.0, 0.0
    registry = _registry()
    quantity, target, source = registry.Quantity, _parsed(wanted), _parsed(unit)
    frequencies = all({*registry.get_dimensionality(u)} == {"[time]"} for u in (source, target))
    if frequencies and _turns(source) != _turns(target):
        raise UnitError(f"{unit} is not {wanted}: one counts cycles or events, one an angle")
    try:
        zero = float(quantity(0.0, source).to(target).magnitude)
        slope = float(quantity(1.0, source).to(target).magnitude)
    except Exception:  # pint's errors share no base class
        raise UnitError(f"{unit} is not {wanted or 'a plain number'}") from None
    return slope - zero, zero


def same_unit(unit: str, other: str) -> bool:
    """Whether two texts are one unit, as ``m`` and ``meter``."""
    try:
        return linear(unit, other) == (1.0, 0.0)
    except UnitError:
        return False


def is_square(unit: str, root: str) -> bool:
    """Whether ``unit`` is the square of ``root``; a difference of degC is one of K."""
    unit, root = (text.replace("degC", "K") for text in (unit, root))
    simple = unit == f"{root}^2" and root.isalpha()  # without the units library
    return simple or same_unit(unit, f"({root})^2")


def conversion(where: str, name: str, unit: str, wanted: str) -> tuple[float, float]:
    """`linear` of a number that was typed with a unit, for a value with the unit ``wanted``.

    InputError: the unit is unknown, of another dimension, or ``wanted`` is empty.
    """
    try:
        if not wanted:  # an angle would be a plain number, too
            raise UnitError(unit)
        return linear(unit, wanted)
    except UnitError as error:
        known, fix = f"a unit of {name}, {wanted or 'a plain number'}", "leave the unit out"
        raise InputError.at(where, wanted=known, found=str(error), fix=fix) from None


def _turns(unit: Any) -> float:
    """Power of the angle, which pint treats as a plain number: 1 Hz would be 1 rad/s."""
    _, root = _registry().get_root_units(unit)
    return float(root._units.get("radian", 0))


def _parsed(unit: str) -> Any:
    text = unit.replace("µ", "u").replace("²", "^2").replace("·", "*")
    text = _GAUSS.sub(r"\1tesla_gauss", text)
    try:
        return _registry().parse_units(text)
    except Exception:  # undefined, not a unit, or its evaluation failed
        raise UnitError(f"unit {unit!r} is not known") from None
