"""What recorded expressions become before they are lowered."""

from __future__ import annotations

from boresight.model.lowering.graph import Node, expand
from boresight.model.lowering.trace import Scalar


def node_of(x: Scalar) -> Node:
    """The node of a recorded number; equal expressions of one call each have one node."""
    return nodes_of(x)[0]


def nodes_of(*x: Scalar) -> list[Node]:
    """As `node_of`, all of one graph."""
    made = expand(x[0].tracer)[1]
    return [made[e.number] for e in x]
