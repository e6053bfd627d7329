"""A compiled step as proofs see it: its nodes, and the elements of its covariance."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.lowering.graph import Node
from boresight.model.words.program import Program
from boresight.sim.accuracy.covariance import covariance_of
from boresight.sim.ranges.claims import live
from boresight.sim.ranges.polynomials import polynomial_of

__all__ = [
    "Comparison",
    "compared",
    "covariance_elements",
    "implied",
    "is_possible",
    "live_nodes",
    "may_fuse",
    "side_of",
]

#: Share of an eigenvalue that rounding explains; terms and steps back of a compared value.
_ROUNDING, _TERMS, _BACK = 1e-9, 8, 3


def live_nodes(program: Program, nodes: Mapping[int, Node]) -> dict[int, Node]:
    """Nodes that outputs and next states need, by number, each after its arguments."""
    results = (*program.outputs, *(next_state for _, next_state in program.states))
    return {n.number: n for n in live([nodes[n] for n in results if n in nodes])}


def may_fuse(node: Node) -> bool:
    """Whether readers of a node may compute it themselves instead of reading its word."""
    return node.kind == "mul" or (node.kind == "sum" and len(node.args) == 1)


def covariance_elements(
    estimator: Estimator, program: Program, nodes: Mapping[int, Node]
) -> dict[tuple[int, int], tuple[Node, Node]]:
    """State and next value of each element (i, j), i <= j, of a covariance among the states.

    Empty without a covariance, with a missing element, or if the initial matrix is no covariance.
    """
    try:
        covariance = covariance_of(estimator)
    except InputError:
        return {}
    size = len(covariance.axes)
    elements: dict[tuple[int, int], tuple[Node, Node]] = {}
    initial = np.zeros((size, size))
    for i, j, k in covariance.elements:
        state, next_state = program.states[k]
        if state not in nodes or next_state not in nodes:
            return {}
        elements[min(i, j), max(i, j)] = nodes[state], nodes[next_state]
        value = program.format(state).real(program.values[state].initial)
        initial[i, j] = initial[j, i] = value
    is_complete = len(elements) == size * (size + 1) // 2
    return elements if is_complete and np.linalg.eigvalsh(initial)[0] >= -_ROUNDING else {}


def implied(nodes: Mapping[int, Node], sides: Mapping[int, int]) -> Iterator[tuple[int, int]]:
    """Sides of conditions, by number, and those of the conditions that they combine.

    1: negative, 2: not. A side of a selection of conditions implies sides of two or of none.
    """
    stack = [*sides.items()]
    while stack:
        number, side = stack.pop()
        yield number, side
        node = nodes[number]
        if node.kind != "select":
            continue
        for k, other_side in ((1, 2), (2, 1)):
            branch = node.args[k]
            if branch.kind == "const" and (branch.value < 0.0) != (side == 1):
                stack += [(node.args[0].number, other_side), (node.args[other_side].number, side)]


@dataclass(frozen=True)
class Comparison:
    """A comparison of a value with a level.

    Attributes
    ----------
    value : tuple of (monomial, float)
        A polynomial without its constant, up to a factor.
    level : float
    below : bool
        Whether the condition is negative below the level; else above it.
    """

    value: tuple[tuple[tuple[int, ...], float], ...]
    level: float
    below: bool


def compared(condition: Node) -> Comparison | None:
    """The comparison of a value with a constant that a condition is; None: of another form."""
    form = polynomial_of(condition, _TERMS, _BACK) if condition.kind == "sum" else None
    constant, factor = 0.0, 0.0
    if form is not None:
        constant, factor = form.pop((), 0.0), next(iter(form.values()), 0.0)
    if form is None or factor == 0.0:
        return None
    value = tuple(sorted((m, c / factor) for m, c in form.items()))
    return Comparison(value, -constant / factor, factor > 0.0)


def is_possible(nodes: Mapping[int, Node], sides: Mapping[int, int]) -> bool:
    """Whether the sides imply no condition on both of its sides."""
    implied_sides = {*implied(nodes, sides)}
    return len({number for number, _ in implied_sides}) == len(implied_sides)


def side_of(condition: Node, sides: Mapping[int, int]) -> int:
    """The side of a condition that the given sides imply; 0: either."""
    if condition.number in sides:
        return sides[condition.number]
    if condition.kind == "const":
        return 1 if condition.value < 0.0 else 2
    if condition.kind != "select":
        return 0
    side = side_of(condition.args[0], sides)
    each = {side_of(arg, sides) for arg in ([condition.args[side]] if side else condition.args[1:])}
    return each.pop() if len(each) == 1 else 0
