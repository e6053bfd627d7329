"""Conversion of units.

`pint` defines the units, except a few with other names in the field: ``ht`` (half turns), ``gauss``
(1e-4 tesla, unlike pint's of the CGS), ``g0`` (standard gravity; plain ``g`` is a gram and is
refused by its dimension).
"""

from __future__ import annotations

import re
from functools import cache
from typing import Any

from boresight.model.declarations import GRAVITY

__all__ = ["UnitError", "linear"]

#: ``gauss`` or ``G``, optionally with a prefix.
_GAUSS = re.compile(r"(?<!\w)(milli|micro|kilo|[muk])?(?:gauss|G)(?!\w)")


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


@cache
def linear(unit: str, wanted: str) -> tuple[float, float]:
    """``(factor, offset)`` of ``value_in_wanted = factor * value_in_unit + offset``.

    Raises
    ------
    UnitError
        A unit is unknown, or the dimensions differ.
    """
    if unit == wanted:
        return 1.0, 0.0
    registry = _registry()
    quantity, target = registry.Quantity, _parsed(wanted)
    source = _parsed(unit)
    if _frequency(source) and _frequency(target) and _turns(source) != _turns(target):
        raise UnitError(f"{unit} is not {wanted}: one counts cycles or events, one an angle")
    try:
        zero = float(quantity(0.0, source).to(target).magnitude)
        slope = float(quantity(1.0, source).to(target).magnitude)
    except Exception:  # pint's errors share no base class
        raise UnitError(f"{unit} is not {wanted or 'a plain number'}") from None
    return slope - zero, zero


def _frequency(unit: Any) -> bool:
    return set(_registry().get_dimensionality(unit)) == {"[time]"}


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
