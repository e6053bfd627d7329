"""Values of the nodes of a step at random points.

Results of limits, functions and conditions are drawn: no identity depends on them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Set

import numpy as np
import numpy.typing as npt

from boresight.model.lowering.graph import Node
from boresight.sim.ranges.claims import Premises, live
from boresight.sim.ranges.coefficients import Coefficient
from boresight.sim.ranges.inner_products import POINTS, FloatArray
from boresight.sim.ranges.polynomials import polynomial_of
from boresight.sim.ranges.steps import compared

__all__ = ["Points"]

BoolArray = npt.NDArray[np.bool_]
#: Terms and steps back of a polynomial.
_LOOSE = 8
#: Kinds of conditions that combine others.
_CHOICES = ("select", "complement")


class Points:
    """The values, of each node after its arguments.

    Parameters
    ----------
    nodes : mapping of int to Node
        Of the step, by number.
    cone : set of int
        Numbers of the nodes that depend on the covariance.
    rng
        Source of random values.

    Attributes
    ----------
    values, sizes : dict of int to (points,) array
        Value of each node, and the size of the terms whose sum it is.
    bounded, aliases : set of int
        "bounded" nodes, and those of them that count as their arguments.
    premises : Premises
        The other premises of the aliases.
    """

    def __init__(self, nodes: Mapping[int, Node], cone: Set[int], rng: np.random.Generator) -> None:
        self.nodes, self.cone, self.rng = nodes, cone, rng
        self.values: dict[int, FloatArray] = {}
        self.sizes: dict[int, FloatArray] = {}
        self.bounded = {n.number for n in nodes.values() if n.kind == "bounded"}
        self.aliases: set[int] = set()
        self.premises = Premises()
        self._signs: dict[int, BoolArray] = {}
        self._levels = _levels_of(nodes.values(), rng)

    def let(self, node: Node, value: FloatArray, size: FloatArray | None = None) -> None:
        """Set the value of a node."""
        self.values[node.number] = value
        self.sizes[node.number] = abs(value) if size is None else size

    def at(self, c: Coefficient) -> FloatArray:
        """Value of a coefficient."""
        value = np.full(POINTS, c.number)
        for node in c.nodes:
            value = value * self.values[node.number]
        for number, side in c.sides:
            value = np.where(self._sign(self.nodes[number]) == (side == 1), value, 0.0)
        return value

    def total(self, coefficients: Iterable[Coefficient]) -> FloatArray:
        """Value of a sum of coefficients."""
        return sum((self.at(c) for c in coefficients), np.zeros(POINTS))

    def evaluate(self, node: Node, *, unlimited: bool = False) -> None:
        """Compute the value of a node; ``unlimited``: its argument is within its limit."""
        if node.number in self.values:
            return
        args = [self.values[a.number] for a in node.args]
        sizes = [self.sizes[a.number] for a in node.args]
        size: FloatArray | None = None
        if node.kind == "const":
            value = np.full(POINTS, node.value)
        elif node.kind in ("input", "param", "state") and math.isfinite(node.high - node.low):
            value = self.rng.uniform(node.low, node.high, POINTS)
        elif node.kind == "bounded" or unlimited:
            value, size = args[0], sizes[0]
            if node.kind == "bounded" and node.number in self.cone:
                self.aliases.add(node.number)
        elif node.kind == "saturated" and self._is_zero(node.args[0]):
            value = np.zeros(POINTS)
        elif node.kind == "saturated":
            low, high = max(-node.value, node.low), min(node.value, node.high)
            limited = self.rng.uniform(low, high, POINTS)
            is_within = (self.rng.random(POINTS) < 0.5) & (abs(args[0]) <= node.value)
            value = np.where(is_within, args[0], limited)
        elif node.kind == "sum":
            value = sum((s * a for s, a in zip(node.signs, args, strict=True)), np.zeros(POINTS))
            size = sum(sizes, np.zeros(POINTS))
        elif node.kind == "mul":
            value, size = args[0] * args[1], sizes[0] * sizes[1]
        elif node.kind in ("select", "flip"):
            sign = self._sign(node.args[0])
            yes, no = (-args[1], args[1]) if node.kind == "flip" else args[1:]
            value, size = np.where(sign, yes, no), np.where(sign, sizes[1], sizes[-1])
            if node.number not in self.cone:
                value = self._in_interval(node, value)
        elif node.kind == "rsqrt":
            value = 1.0 / np.sqrt(np.maximum(abs(args[0]), 1e-300))
        elif node.kind == "reciprocal":
            value = 1.0 / np.where(args[0] == 0.0, 1e-300, args[0])
        else:
            value = self.rng.normal(size=POINTS)
        self.let(node, value, size)

    def _in_interval(self, node: Node, value: FloatArray) -> FloatArray:
        """Values of a selection; others where they take a side that its condition excludes."""
        inside = (node.low <= value) & (value <= node.high)
        if inside.all() or not math.isfinite(node.high - node.low):
            return value
        return np.where(inside, value, self.rng.uniform(node.low, node.high, POINTS))

    def _is_zero(self, node: Node) -> bool:
        """Whether a node is 0, as x - (x + c - c) is, but for rounding."""
        aliases: set[int] = set()
        form = polynomial_of(node, _LOOSE, _LOOSE, (), aliases)
        is_zero = form is not None and not any(form.values())
        self.aliases |= aliases if is_zero else set()
        return is_zero

    def _sign(self, condition: Node) -> BoolArray:
        """Whether a condition is negative: drawn, unless it combines others."""
        number = condition.number
        if number not in self._signs:
            signs = [self._sign(a) for a in condition.args] if condition.kind in _CHOICES else []
            if condition.kind == "select":
                self._signs[number] = np.where(*signs)
            elif condition.kind == "complement":
                self._signs[number] = signs[0] ^ signs[1]
            elif condition.kind == "const":
                self._signs[number] = np.full(POINTS, condition.value < 0.0)
            elif (test := compared(condition)) is not None and test.value in self._levels:
                levels, positions = self._levels[test.value]
                self._signs[number] = (positions <= levels.index(test.level)) == test.below
            elif condition.kind == "input" and condition.low < 0.0 < condition.high:
                self._signs[number] = self.values[number] < 0.0
            else:
                share = self.rng.choice([0.2, 0.5, 0.8], POINTS)
                self._signs[number] = self.rng.random(POINTS) < share
        return self._signs[number]


def _levels_of(
    nodes: Iterable[Node], rng: np.random.Generator
) -> dict[object, tuple[list[float], npt.NDArray[np.int64]]]:
    """Levels of each value that is compared with several: they exclude combinations of sides.

    With them, for each point, the index of the lowest level above the value.
    """
    conditions = live(
        [node.args[0] for node in nodes if node.kind in ("select", "flip")],
        lambda node: node.args if node.kind in _CHOICES else (),
    )
    levels: dict[object, set[float]] = {}
    for condition in conditions:
        if (test := compared(condition)) is not None:
            levels.setdefault(test.value, set()).add(test.level)
    return {
        value: (sorted(thresholds), rng.integers(0, len(thresholds) + 1, POINTS))
        for value, thresholds in sorted(levels.items(), key=repr)
        if len(thresholds) > 1
    }
