"""Demands on figures as text, the choice of a combination, and the nearest one."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from boresight.model.errors import InputError, listed
from boresight.model.units import conversion
from boresight.sim.explore.figures import FIGURES, Explored, Quantity

__all__ = ["Choice", "Demand", "Relaxed", "chosen", "demands_of", "with_tolerance"]

_DEMAND = re.compile(r"\s*([A-Za-z_][\w.]*)\s*(<=|>=|<|>)\s*([-+.\deE]+)\s*(.*?)\s*")


@dataclass(frozen=True)
class Demand:
    """A limit for a figure, in the figure's unit.

    Attributes
    ----------
    quantity : Quantity
    sign : str
        One of ``< <= > >=``.
    limit : float
    """

    quantity: Quantity
    sign: str
    limit: float

    def meets(self, value: float) -> bool:
        """Whether a figure is within the limit."""
        if "=" in self.sign and value == self.limit:
            return True
        return value < self.limit if "<" in self.sign else value > self.limit

    def excess(self, value: float) -> float:
        """Factor by which a figure misses the limit: 1 within it, else more."""
        if self.meets(value):
            return 1.0
        larger, smaller = (value, self.limit) if "<" in self.sign else (self.limit, value)
        return larger / smaller if smaller > 0.0 and math.isfinite(larger) else math.inf

    def clock(self, row: Explored) -> str:
        """Clock from which on a row's cycles meet a demand on a time; empty of other demands."""
        cycles = {"us": row.cycles, "own_us": row.cycles, "rate": row.interval}
        count = cycles.get(self.quantity.name)
        if not count or self.limit <= 0.0 or self.quantity.more is not (">" in self.sign):
            return ""
        mhz = count * self.limit / 1e6 if self.quantity.more else count / self.limit
        own = f" (its own: {row.clock:.4g} MHz, {row.clock_is})" if row.clock else ""
        return f"a clock of {math.ceil(10.0 * mhz) / 10.0:.1f} MHz{own}"

    def __str__(self) -> str:
        return f"{self.quantity.name}{self.sign}{self.limit:.4g}{_unit(self.quantity).strip()}"


@dataclass(frozen=True)
class Relaxed:
    """A demand that, relaxed alone, could be met.

    Attributes
    ----------
    demand : Demand
    limit : float
        The relaxed limit.
    row : Explored
        The combination that would then meet all demands.
    """

    demand: Demand
    limit: float
    row: Explored

    def __str__(self) -> str:
        unit = _unit(self.demand.quantity)
        clock = self.demand.clock(self.row)
        return (
            f"{self.demand} relaxed to {self.limit:.4g}{unit} alone would do"
            f"{f', or {clock}' if clock else ''}: {self.row.name}"
        )


@dataclass(frozen=True)
class Choice:
    """The chosen combination, or the nearest one.

    Attributes
    ----------
    row : Explored or None
        The least of the combinations that meet every demand.
    nearest : Explored or None
        If none does, the one that misses its worst limit by the smallest factor.
    missed : tuple of Demand
        The demands that the nearest one misses.
    relaxed : tuple of Relaxed
        Each demand that it would be enough to relax.
    """

    row: Explored | None = None
    nearest: Explored | None = None
    missed: tuple[Demand, ...] = ()
    relaxed: tuple[Relaxed, ...] = ()

    def lines(self, least: Quantity) -> list[str]:
        """Text for people."""
        if self.row is not None:
            figure = self.row.figures[least.name]
            return [f"choice, {least.name} {figure:.4g}{_unit(least)}: {self.row.name}"]
        if self.nearest is None:
            return ["nothing meets the demands: no combination has every figure"]
        parts = [
            f"{d.quantity.name} is {self.nearest.figures[d.quantity.name]:.4g}{_unit(d.quantity)}, "
            f"wanted {d.sign} {d.limit:.4g}" + (f", which takes {clock}" if clock else "")
            for d in self.missed
            for clock in [d.clock(self.nearest)]
        ]
        return [
            f"nothing meets the demands; nearest: {self.nearest.name}: {'; '.join(parts)}",
            *map(str, self.relaxed),
        ]


def _unit(quantity: Quantity) -> str:
    return f" {quantity.unit}" if quantity.unit not in ("", quantity.name) else ""


def quantity_of(name: str, quantities: Sequence[Quantity], where: str) -> Quantity:
    """A figure by name.

    Raises
    ------
    InputError
        There is no figure of this name.
    """
    for quantity in quantities:
        if quantity.name == name:
            return quantity
    raise InputError.at(
        where,
        wanted=f"one of {listed(name, [q.name for q in quantities])}",
        found=repr(name),
        fix="choose one; docs/learn/explore.md has them all",
    )


def demands_of(text: str, quantities: Sequence[Quantity]) -> list[Demand]:
    """Demands from a text as ``attitude<0.01deg, dsp<=1, us<5``.

    Parameters
    ----------
    text : str
        With commas; a unit may be left out, and is converted to that of the figure.
    quantities : sequence of Quantity
        The available figures.

    Raises
    ------
    InputError
        Not a demand, or a figure or unit that does not exist.
    """
    demands = []
    for part in filter(None, map(str.strip, text.split(","))):
        match = _DEMAND.fullmatch(part)
        try:
            limit = float(match[3]) if match else math.nan
        except ValueError:
            limit = math.nan
        if match is None or not math.isfinite(limit):
            raise InputError.at(
                "want",
                wanted=f"demands as {quantities[0].name}<0.01{quantities[0].unit}, dsp<=1",
                found=repr(part),
                fix="write NAME, one of < <= > >=, and a number",
            )
        quantity = quantity_of(match[1], quantities, "want")
        if match[4]:
            where = f"want, {part}"
            factor, offset = conversion(where, quantity.name, match[4], quantity.unit)
            limit = factor * limit + offset
        demands.append(Demand(quantity, match[2], limit))
    return demands


def with_tolerance(demands: Sequence[Demand], quantities: Sequence[Quantity]) -> list[Demand]:
    """Add the demand that errors are within the declared tolerances, unless one limits an error.

    ``quantities`` are the figures that some row has: outputs without tolerances are not judged.
    """
    costs = {quantity.name for quantity in FIGURES} - {"tolerance"}
    ratio = next((quantity for quantity in quantities if quantity.name == "tolerance"), None)
    if ratio is None or any(demand.quantity.name not in costs for demand in demands):
        return [*demands]
    return [Demand(ratio, "<=", 1.0), *demands]


def chosen(rows: Iterable[Explored], demands: Sequence[Demand], least: Quantity) -> Choice:
    """Choose among the rows that are not refused and have every figure.

    Parameters
    ----------
    rows : iterable of Explored
    demands : sequence of Demand
    least : Quantity
        The figure that decides among combinations that meet all demands: the least of it, or the
        most of a figure of which more is better.
    """
    names = {least.name, *(d.quantity.name for d in demands)}
    complete = [row for row in rows if not row.refused and names <= row.figures.keys()]

    def cost(row: Explored) -> tuple[float, ...]:
        value = row.figures[least.name]
        return (-value if least.more else value, row.figures.get("cycles", 0.0), row.word)

    def missed(row: Explored) -> list[Demand]:
        return [d for d in demands if not d.meets(row.figures[d.quantity.name])]

    passing = [row for row in complete if not missed(row) and row.fits is not False]
    if passing:
        return Choice(row=min(passing, key=cost))
    if not complete:
        return Choice()

    def rank(row: Explored) -> tuple[float, ...]:
        factors = [d.excess(row.figures[d.quantity.name]) for d in demands]
        return (row.fits is False, max(factors, default=1.0), *cost(row))

    nearest = min(complete, key=rank)
    relaxed = []
    for demand in demands:
        candidates = [row for row in complete if missed(row) == [demand] and row.fits is not False]
        if candidates:
            row = min(candidates, key=lambda row: demand.excess(row.figures[demand.quantity.name]))
            relaxed.append(Relaxed(demand, row.figures[demand.quantity.name], row))
    return Choice(None, nearest, tuple(missed(nearest)), tuple(relaxed))
