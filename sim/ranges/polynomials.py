"""Nodes as polynomials of the nodes that they are computed from."""

from __future__ import annotations

from collections.abc import Container, Sequence

from boresight.model.lowering.graph import Node

__all__ = [
    "Expansions",
    "Polynomial",
    "cleared",
    "combined",
    "ends_of_product",
    "is_sum_of_squares",
    "is_zero",
    "monomial",
    "plus",
    "polynomial_of",
    "quotient",
    "scaled",
    "substituted",
    "times",
]

#: Products of two terms that are tried.
_PRODUCTS = 3600
#: A polynomial: the coefficient of each product of nodes, by their sorted numbers.
Polynomial = dict[tuple[int, ...], float]


class Expansions:
    """Polynomials of the nodes of a step, each computed once.

    Parameters
    ----------
    terms : int
        Most terms of each.
    ends
        Numbers of nodes that stay as they are.
    """

    def __init__(self, terms: int, ends: Container[int] = ()) -> None:
        self.terms, self.ends = terms, ends
        self._forms: dict[tuple[Node, int], tuple[Polynomial | None, frozenset[int]]] = {}

    def of(self, node: Node, depth: int, aliases: set[int] | None = None) -> Polynomial | None:
        """A node as a polynomial of others, at most ``depth`` steps back; None: of too many terms.

        ``aliases`` gets the numbers of those "bounded" ones that count as their arguments.
        """
        if not depth or node.kind not in ("bounded", "sum", "mul") or node.number in self.ends:
            return {(): node.value} if node.kind == "const" else {(node.number,): 1.0}
        key = node, depth
        if key not in self._forms:
            bounded = set[int]()
            self._forms[key] = self._expand(node, depth, bounded), frozenset(bounded)
        form, bounded_nodes = self._forms[key]
        if aliases is not None:
            aliases |= bounded_nodes
        return form

    def _expand(self, node: Node, depth: int, aliases: set[int]) -> Polynomial | None:
        if node.kind == "bounded":
            aliases.add(node.number)
            return self.of(node.args[0], depth, aliases)
        parts: list[Polynomial] = []
        for arg in node.args:
            part = self.of(arg, depth - 1, aliases)
            if part is None:
                return None
            parts.append(part)
        return combined(node, parts, self.terms)


def polynomial_of(
    node: Node, terms: int, depth: int, ends: Container[int] = (), aliases: set[int] | None = None
) -> Polynomial | None:
    """A single expansion; see `Expansions.of`."""
    return Expansions(terms, ends).of(node, depth, aliases)


def combined(node: Node, parts: Sequence[Polynomial], terms: int) -> Polynomial | None:
    """The sum or product of a node's arguments; None: of too many terms."""
    if node.kind == "mul":
        return times(parts[0], parts[1], terms)
    out: Polynomial = {}
    for part, sign in zip(parts, node.signs, strict=True):
        for m, value in part.items():
            out[m] = out.get(m, 0.0) + sign * value
    return out if len(out) <= terms else None


def cleared(form: Polynomial | None) -> Polynomial | None:
    """A polynomial without terms that are 0."""
    return None if form is None else {m: c for m, c in form.items() if c}


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


def ends_of_product(
    ends: tuple[float, float], by: tuple[float, float], power: int = 1
) -> tuple[float, float]:
    """Ends of a product with a power of another factor."""
    powers = [end**power for end in by]
    if power % 2 == 0 and by[0] < 0.0 < by[1]:
        powers.append(0.0)
    corners = [x * y if x and y else 0.0 for x in ends for y in powers]
    return min(corners), max(corners)


def quotient(form: Polynomial, number: int, power: int = 1) -> Polynomial:
    """The terms with a power of a node, divided by it."""
    out: Polynomial = {}
    for m, c in form.items():
        if m.count(number) >= power:
            index = m.index(number)
            out[m[:index] + m[index + power :]] = c
    return out


def monomial(*numbers: int) -> tuple[int, ...]:
    """A product of nodes."""
    return tuple(sorted(numbers))


def is_zero(form: Polynomial, tiny: float = 1e-12) -> bool:
    """Whether a polynomial is 0, but for the last bits of its coefficients."""
    return all(abs(c) <= tiny for c in form.values())


def substituted(form: Polynomial, number: int, by: Polynomial, terms: int) -> Polynomial | None:
    """A polynomial with another one in place of a node; None: of too many terms."""
    out: Polynomial = {}
    for m, c in form.items():
        part: Polynomial | None = {tuple(n for n in m if n != number): c}
        for _ in range(m.count(number)):
            part = None if part is None else times(part, by, terms)
        if part is None:
            return None
        out = plus(out, part)
    return {m: c for m, c in out.items() if c}


def is_sum_of_squares(a: Polynomial) -> bool:
    """Whether each term is a square, or 0 but for the last bits of its coefficient."""
    return all(
        v >= -1e-12 and (v <= 1e-12 or all(m.count(n) % 2 == 0 for n in m)) for m, v in a.items()
    )
