"""Vectors less their parts along others, which are no longer than before.

A step that computes t_1 = v . p_1, t_2 = (v - t_1 p_1) . p_2, ... and v' = v - t_1 p_1 - t_2 p_2
subtracts one part after the other. |v - (v . p) p|^2 = |v|^2 - (v . p)^2 (2 - |p|^2), so v' is no
longer than v if no |p|^2 is more than 2, and |t_k| <= |v| |p_k|. A limited t subtracts less, and v'
is still no longer.

Such v are the rows of a square root of a covariance in an update, and those of a matrix that
Gram-Schmidt makes orthonormal.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

from boresight.model.lowering.graph import Node
from boresight.sim.ranges.polynomials import Polynomial, plus, polynomial_of, times

__all__ = ["Reduction", "reductions_of"]

#: Most parts that are subtracted from a vector; terms, and steps back of a polynomial.
_PARTS, _TERMS, _DEPTH = 4, 60, 12
#: Numbers of a component of v, or None, and of that component of each p, by its t.
Component = tuple[int | None, dict[int, int]]


@dataclass(frozen=True, eq=False)
class Reduction:
    """The vector v' and its parts.

    Attributes
    ----------
    rest : frozenset of int
        Numbers of the components of v' that differ from those of v.
    base : tuple of Node
        These components of v, without those that are 0.
    components : dict of int to tuple of Node
        Components of p, by the number of t, in the order of computation.
    aliases : dict of int to frozenset of int
        "bounded" nodes that count as their arguments, by the number of t.
    """

    rest: frozenset[int]
    base: tuple[Node, ...]
    components: dict[int, tuple[Node, ...]]
    aliases: dict[int, frozenset[int]]


def reductions_of(nodes: Mapping[int, Node]) -> Iterator[Reduction]:
    """The reductions of a step; the caller checks |p|^2 <= 2."""
    bounded = {n.number for n in nodes.values() if n.kind == "bounded"}
    groups: dict[tuple[int, ...], dict[int, Component]] = {}
    for node in nodes.values():
        for parts, component in _components(node, bounded):
            groups.setdefault(parts, {})[node.number] = component
    for parts, components in groups.items():
        members = _members(nodes, parts, components)
        aliases: dict[int, set[int]] = {t: set() for t in parts}
        if _are_vectors(members.values()) and all(
            nodes[t].low <= 0.0 <= nodes[t].high
            and _is_part(nodes, parts[: k + 1], [*members.values()], aliases[t])
            for k, t in enumerate(parts)
        ):
            yield Reduction(
                frozenset(members),
                tuple(nodes[c] for c, _ in members.values() if c is not None),
                {t: tuple(nodes[p[t]] for _, p in members.values()) for t in parts},
                {t: frozenset(numbers) for t, numbers in aliases.items()},
            )


def _components(node: Node, bounded: set[int]) -> Iterator[tuple[tuple[int, ...], Component]]:
    """Ways to read a sum as c - t_1 p_1 - t_2 p_2 ..., by the t in the order of computation."""
    form = polynomial_of(node, _TERMS, _DEPTH, bounded) if node.kind == "sum" else None
    products = [m for m in form or {} if len(m) == 2]
    others = [m for m in form or {} if len(m) != 2]
    if form is None or not 1 <= len(products) <= _PARTS or any(form[m] != -1.0 for m in products):
        return
    if len(others) > 1 or any(len(m) != 1 or form[m] != 1.0 for m in others):
        return
    for pairs in product(*([(m[0], m[1]), (m[1], m[0])] for m in products)):
        parts = dict(pairs)
        if len(parts) == len(products):
            yield (
                tuple(sorted(parts)),
                (others[0][0] if others else None, dict(sorted(parts.items()))),
            )


def _are_vectors(members: Collection[Component]) -> bool:
    """Whether there are several components, and no vector has one of them twice."""
    base = [c for c, _ in members if c is not None]
    components = zip(*(p.values() for _, p in members), strict=True)
    return len(members) > 1 and all(len({*v}) == len(v) for v in (base, *map(list, components)))


def _argument(node: Node) -> Node:
    return node.args[0] if node.kind in ("bounded", "saturated") else node


def _members(
    nodes: Mapping[int, Node], parts: Sequence[int], components: Mapping[int, Component]
) -> dict[int, Component]:
    """The components in the sum of products that the first t is, and those where v is 0."""
    first = parts[0]
    ends = {n for c, p in components.values() for n in (c, p[first]) if n is not None}
    form = polynomial_of(_argument(nodes[first]), _TERMS, _DEPTH, ends) or {}
    return {
        number: (c, p)
        for number, (c, p) in components.items()
        if c is None or tuple(sorted((c, p[first]))) in form
    }


def _is_part(
    nodes: Mapping[int, Node], parts: Sequence[int], members: Sequence[Component], aliases: set[int]
) -> bool:
    """Whether the last t is the inner product of its p and v less the previous parts."""
    *previous, last = parts
    ends = {*previous, *(n for c, p in members for n in (c, *p.values()) if n is not None)}
    form = polynomial_of(_argument(nodes[last]), _TERMS, _DEPTH, ends, aliases)
    if form is None:
        return False
    for c, p in members:
        remainder: Polynomial = {} if c is None else {(c,): 1.0}
        for t in previous:
            remainder = plus(remainder, {tuple(sorted((t, p[t]))): -1.0})
        subtrahend = times(remainder, {(p[last],): -1.0}, _TERMS)
        if subtrahend is None:
            return False
        form = plus(form, subtrahend)
    return not any(form.values())
