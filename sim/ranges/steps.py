"""A compiled step as proofs see it: its nodes, and the elements of its covariance."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.lowering.graph import Node
from boresight.model.words.program import Program
from boresight.sim.accuracy.covariance import covariance_of
from boresight.sim.ranges.claims import live

__all__ = ["covariance_elements", "live_nodes"]

#: Share of an eigenvalue that rounding explains.
_ROUNDING = 1e-9


def live_nodes(program: Program, nodes: Mapping[int, Node]) -> dict[int, Node]:
    """Nodes that outputs and next states need, by number, each after its arguments."""
    results = (*program.outputs, *(after for _, after in program.states))
    return {n.number: n for n in live([nodes[n] for n in results if n in nodes])}


def covariance_elements(
    estimator: Estimator, program: Program, nodes: Mapping[int, Node]
) -> dict[tuple[int, int], tuple[Node, Node]]:
    """State and next value of each element (i, j), i <= j, of a covariance among the states.

    Empty without one, where an element is missing, and where the first matrix is none.
    """
    try:
        covariance = covariance_of(estimator)
    except InputError:
        return {}
    size = len(covariance.axes)
    elements: dict[tuple[int, int], tuple[Node, Node]] = {}
    first = np.zeros((size, size))
    for i, j, k in covariance.elements:
        state, following = program.states[k]
        if state not in nodes or following not in nodes:
            return {}
        elements[min(i, j), max(i, j)] = nodes[state], nodes[following]
        word = program.format(state).real(program.values[state].initial)
        first[i, j] = first[j, i] = word
    whole = len(elements) == size * (size + 1) // 2
    return elements if whole and np.linalg.eigvalsh(first)[0] >= -_ROUNDING else {}
