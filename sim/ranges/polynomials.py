"""Nodes as polynomials of what they are computed from."""

from __future__ import annotations

from collections.abc import Container

from boresight.model.lowering.graph import Node

__all__ = ["Polynomial", "is_sum_of_squares", "plus", "polynomial_of", "scaled", "times"]

#: Products of two terms that are tried.
_PRODUCTS = 3600
#: A polynomial: the coefficient of each product of nodes, by their sorted numbers.
Polynomial = dict[tuple[int, ...], float]


def polynomial_of(
    node: Node, terms: int, left: int, ends: Container[int] = (), passed: set[int] | None = None
) -> Polynomial | None:
    """A node as a polynomial of others, at most ``left`` steps back; None: of too many terms.

    The nodes whose numbers are ``ends`` stay as they are. ``passed`` gets the numbers of those
    "bounded" ones that count as their arguments.
    """
    return _polynomial(node, terms, left, ends, set() if passed is None else passed, {})


def _polynomial(
    node: Node,
    terms: int,
    left: int,
    ends: Container[int],
    passed: set[int],
    known: dict[tuple[int, int], Polynomial | None],
) -> Polynomial | None:
    """The same; ``known`` by node and steps that are left."""
    if node.kind == "const":
        return {(): node.value}
    if node.kind not in ("bounded", "sum", "mul") or not left or node.number in ends:
        return {(node.number,): 1.0}
    key = node.number, left
    if key in known:
        return known[key]
    known[key] = None
    if node.kind == "bounded":
        passed.add(node.number)
        known[key] = _polynomial(node.args[0], terms, left, ends, passed, known)
        return known[key]
    parts = list[Polynomial]()
    for arg in node.args:
        part = _polynomial(arg, terms, left - 1, ends, passed, known)
        if part is None:
            return None
        parts.append(part)
    if node.kind == "mul":
        known[key] = times(parts[0], parts[1], terms)
        return known[key]
    out: Polynomial = {}
    for part, sign in zip(parts, node.signs, strict=True):
        out = plus(out, scaled(part, sign))
    known[key] = out if len(out) <= terms else None
    return known[key]


def times(a: Polynomial, b: Polynomial, terms: int) -> Polynomial | None:
    """Product; None: of too many terms."""
    if len(a) * len(b) > max(_PRODUCTS, 5 * terms):
        return None
    out: Polynomial = {}
    for m, x in a.items():
        for n, y in b.items():
            key = tuple(sorted((*m, *n)))
            out[key] = out.get(key, 0.0) + x * y
    return out


def plus(a: Polynomial, b: Polynomial) -> Polynomial:
    """Sum."""
    out = dict(a)
    for m, value in b.items():
        out[m] = out.get(m, 0.0) + value
    return out


def scaled(a: Polynomial, factor: float) -> Polynomial:
    """Product with a number."""
    return {m: factor * value for m, value in a.items()}


def is_sum_of_squares(a: Polynomial) -> bool:
    """Whether each term is a square, or 0 but for the last bits of its coefficient."""
    return all(
        v >= -1e-12 and (v <= 1e-12 or all(m.count(n) % 2 == 0 for n in m)) for m, v in a.items()
    )
