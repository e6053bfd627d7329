"""From one unit to another.

`pint` knows the units; here are the few that the field writes otherwise: ``ht`` (half turns),
``gauss`` (1e-4 tesla, not pint's of the CGS), ``g0`` (standard gravity; plain ``g`` is a gram and
is refused by its dimension).
"""

from __future__ import annotations

import re
from functools import cache
from typing import Any

from boresight.model.declarations import GRAVITY

__all__ = ["UnitError", "linear"]

#: ``gauss`` or ``G``, perhaps with a prefix.
_GAUSS = re.compile(r"(?<!\w)(milli|micro|kilo|[muk])?(?:gauss|G)(?!\w)")


class UnitError(ValueError):
    """A unit that is not known, or one of another dimension; the message says which."""


@cache
def _registry() -> Any:
    import pint  # half a second: only where a header asks for it

    registry: Any = pint.UnitRegistry()
    registry.define("half_turn = pi * radian = ht")
    registry.define(f"g0 = {GRAVITY} * meter / second ** 2")
    registry.define("tesla_gauss = 1e-4 * tesla")
    return registry


@cache
def linear(given: str, wanted: str) -> tuple[float, float]:
    """``(factor, offset)`` of ``value_in_wanted = factor * value_in_given + offset``.

    Raises
    ------
    UnitError
        Unknown, or of another dimension.
    """
    if given == wanted:
        return 1.0, 0.0
    registry = _registry()
    quantity, target = registry.Quantity, _parsed(wanted)
    source = _parsed(given)
    if _frequency(source) and _frequency(target) and _turns(source) != _turns(target):
        raise UnitError(f"{given} is no {wanted}: one counts cycles or events, one an angle")
    try:
        zero = float(quantity(0.0, source).to(target).magnitude)
        one = float(quantity(1.0, source).to(target).magnitude)
    except Exception:  # pint's errors share no base class
        raise UnitError(f"{given} is no {wanted or 'plain number'}") from None
    return one - zero, zero


def _frequency(unit: Any) -> bool:
    return set(_registry().get_dimensionality(unit)) == {"[time]"}


def _turns(unit: Any) -> float:
    """Power of the angle, which pint takes for a plain number: 1 Hz would be 1 rad/s."""
    _, root = _registry().get_root_units(unit)
    return float(root._units.get("radian", 0))


def _parsed(unit: str) -> Any:
    text = unit.replace("µ", "u").replace("²", "^2").replace("·", "*")
    text = _GAUSS.sub(r"\1tesla_gauss", text)
    try:
        return _registry().parse_units(text)
    except Exception:  # undefined, not a text of units, or its evaluation failed
        raise UnitError(f"unit {unit!r} is not known") from None
