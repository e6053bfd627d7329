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
    if node.kind == "const":
        return {(): node.value}
    if node.kind == "bounded" and left and node.number not in ends:
        if passed is not None:
            passed.add(node.number)
        return polynomial_of(node.args[0], terms, left, ends, passed)
    if node.kind in ("sum", "mul") and left and node.number not in ends:
        parts = [polynomial_of(arg, terms, left - 1, ends, passed) for arg in node.args]
        known = [part for part in parts if part is not None]
        if len(known) < len(parts):
            return None
        if node.kind == "mul":
            return times(known[0], known[1], terms)
        out: Polynomial = {}
        for part, sign in zip(known, node.signs, strict=True):
            out = plus(out, scaled(part, sign))
        return out if len(out) <= terms else None
    return {(node.number,): 1.0}


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
