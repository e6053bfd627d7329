"""Nodes as polynomials of the nodes that they are computed from."""

from __future__ import annotations

from boresight.model.lowering.graph import Node

__all__ = ["Polynomial", "is_sum_of_squares", "plus", "polynomial_of", "scaled", "times"]

#: Most terms of a polynomial, most steps back to the nodes that it is made of, and most products
#: of two terms.
TERMS = 60
STEPS_BACK = 6
PRODUCTS = 3600
#: A coefficient that rounding explains.
TINY = 1e-12
#: A polynomial: the coefficient of each product of nodes, by their sorted numbers.
Polynomial = dict[tuple[int, ...], float]


def polynomial_of(node: Node, depth: int = STEPS_BACK) -> Polynomial | None:
    """Expand a node, at most ``depth`` steps back; return None if it has too many terms."""
    if node.kind == "const":
        return {(): node.value}
    if not depth or node.kind not in ("bounded", "sum", "mul"):
        return {(node.number,): 1.0}
    if node.kind == "bounded":
        return polynomial_of(node.args[0], depth)
    parts = []
    for arg in node.args:
        part = polynomial_of(arg, depth - 1)
        if part is None:
            return None
        parts.append(part)
    if node.kind == "mul":
        return times(parts[0], parts[1])
    total: Polynomial = {}
    for part, sign in zip(parts, node.signs, strict=True):
        total = plus(total, scaled(part, sign))
    return total if len(total) <= TERMS else None


def times(a: Polynomial, b: Polynomial) -> Polynomial | None:
    """Return the product, or None if it has too many terms."""
    if len(a) * len(b) > PRODUCTS:
        return None
    product: Polynomial = {}
    for m, x in a.items():
        for n, y in b.items():
            key = tuple(sorted((*m, *n)))
            product[key] = product.get(key, 0.0) + x * y
    return product


def plus(a: Polynomial, b: Polynomial) -> Polynomial:
    """Return the sum."""
    total = dict(a)
    for m, value in b.items():
        total[m] = total.get(m, 0.0) + value
    return total


def scaled(a: Polynomial, factor: float) -> Polynomial:
    """Return the product with a number."""
    return {m: factor * value for m, value in a.items()}


def is_sum_of_squares(a: Polynomial) -> bool:
    """Whether each term is a nonnegative multiple of a square, or zero but for rounding."""
    return all(
        value >= -TINY and (value <= TINY or all(m.count(n) % 2 == 0 for n in m))
        for m, value in a.items()
    )
