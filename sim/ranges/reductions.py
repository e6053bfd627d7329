"""Vectors less their parts along others, which makes none longer.

A step that computes t_1 = v . p_1, t_2 = (v - t_1 p_1) . p_2, ... and v' = v - t_1 p_1 - t_2 p_2
takes one part after the other. |v - (v . p) p|^2 = |v|^2 - (v . p)^2 (2 - |p|^2), so v' is no
longer than v if no |p|^2 is more than 2, and |t_k| <= |v| |p_k|. A limited t takes less, and v' is
still no longer.

Rows of a square root of a covariance are such v in an update, and those of the matrix that
Gram-Schmidt makes orthonormal.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

from boresight.model.lowering.graph import Node
from boresight.sim.ranges.polynomials import Polynomial, plus, polynomial_of, times

__all__ = ["Reduction", "reductions_of"]

#: Parts that are taken of one vector; terms, and steps back of a polynomial.
_PARTS, _TERMS, _DEPTH = 4, 60, 12
#: A component: that of v, if there is one, and by the number of each t that of its p.
Component = tuple[int | None, dict[int, int]]


@dataclass(frozen=True, eq=False)
class Reduction:
    """v' of v.

    Attributes
    ----------
    rest : frozenset of int
        Numbers of the components of v' that are not those of v.
    base : tuple of Node
        What those are of v, without what is 0.
    along : dict of int to tuple of Node
        Of each t, by its number and in the order of computation, the components of p.
    passed : dict of int to frozenset of int
        Of each t, the "bounded" nodes that count as their arguments.
    """

    rest: frozenset[int]
    base: tuple[Node, ...]
    along: dict[int, tuple[Node, ...]]
    passed: dict[int, frozenset[int]]


def reductions_of(nodes: Mapping[int, Node]) -> Iterator[Reduction]:
    """Those of a step; |p|^2 <= 2 is left to the caller."""
    said = {n.number for n in nodes.values() if n.kind == "bounded"}
    groups: dict[tuple[int, ...], dict[int, Component]] = {}
    for node in nodes.values():
        for parts, component in _components(node, said):
            groups.setdefault(parts, {})[node.number] = component
    for parts, found in groups.items():
        members = _chosen(nodes, parts, found)
        passed: dict[int, set[int]] = {t: set() for t in parts}
        if _are_vectors(members.values()) and all(
            nodes[t].low <= 0.0 <= nodes[t].high
            and _is_part(nodes, parts[: k + 1], [*members.values()], passed[t])
            for k, t in enumerate(parts)
        ):
            yield Reduction(
                frozenset(members),
                tuple(nodes[c] for c, _ in members.values() if c is not None),
                {t: tuple(nodes[p[t]] for _, p in members.values()) for t in parts},
                {t: frozenset(each) for t, each in passed.items()},
            )


def _components(node: Node, said: set[int]) -> Iterator[tuple[tuple[int, ...], Component]]:
    """Ways to read a sum as c - t_1 p_1 - t_2 p_2 ..., by the t in the order of computation."""
    form = polynomial_of(node, _TERMS, _DEPTH, said) if node.kind == "sum" else None
    taken = [m for m in form or {} if len(m) == 2]
    alone = [m for m in form or {} if len(m) != 2]
    if form is None or not 1 <= len(taken) <= _PARTS or any(form[m] != -1.0 for m in taken):
        return
    if len(alone) > 1 or any(len(m) != 1 or form[m] != 1.0 for m in alone):
        return
    for chosen in product(*([(m[0], m[1]), (m[1], m[0])] for m in taken)):
        parts = dict(chosen)
        if len(parts) == len(taken):
            yield (
                tuple(sorted(parts)),
                (alone[0][0] if alone else None, dict(sorted(parts.items()))),
            )


def _are_vectors(members: Collection[Component]) -> bool:
    """Whether there are several components, and none of a vector is there twice."""
    base = [c for c, _ in members if c is not None]
    along = zip(*(p.values() for _, p in members), strict=True)
    return len(members) > 1 and all(len({*v}) == len(v) for v in (base, *map(list, along)))


def _argument(node: Node) -> Node:
    return node.args[0] if node.kind in ("bounded", "saturated") else node


def _chosen(
    nodes: Mapping[int, Node], parts: Sequence[int], found: Mapping[int, Component]
) -> dict[int, Component]:
    """The components whose products the first t is the sum of, and those of which v has none."""
    first = parts[0]
    ends = {n for c, p in found.values() for n in (c, p[first]) if n is not None}
    form = polynomial_of(_argument(nodes[first]), _TERMS, _DEPTH, ends) or {}
    return {
        number: (c, p)
        for number, (c, p) in found.items()
        if c is None or tuple(sorted((c, p[first]))) in form
    }


def _is_part(
    nodes: Mapping[int, Node], parts: Sequence[int], members: Sequence[Component], passed: set[int]
) -> bool:
    """Whether the last t is the inner product of its p and what those before leave of v."""
    *before, last = parts
    ends = {*before, *(n for c, p in members for n in (c, *p.values()) if n is not None)}
    form = polynomial_of(_argument(nodes[last]), _TERMS, _DEPTH, ends, passed)
    if form is None:
        return False
    for c, p in members:
        left: Polynomial = {} if c is None else {(c,): 1.0}
        for t in before:
            left = plus(left, {tuple(sorted((t, p[t]))): -1.0})
        by = times(left, {(p[last],): -1.0}, _TERMS)
        if by is None:
            return False
        form = plus(form, by)
    return not any(form.values())
