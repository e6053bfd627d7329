"""Effect of measurements on vectors: they subtract parts along unit vectors.

h P h + v is |m|^2, m = sum_k h_k p_k + sqrt(v) e, and a measurement subtracts from each vector its
part along the unit vector u = m / |m|: a gain L_i = P_i: h / |m| is p_i . u, and P - L L^T is the
matrix of the vectors p_i - (p_i . u) u, shorter than p_i.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from boresight.model.lowering.graph import Node
from boresight.sim.ranges.coefficients import ONE, Coefficient, nodes_behind
from boresight.sim.ranges.inner_products import Pair, Vector, is_scaled, of_unit
from boresight.sim.ranges.noise import minimum_of
from boresight.sim.ranges.pairs import Pairs, Weight
from boresight.sim.ranges.terms import Term, Terms

__all__ = ["directions", "find_gain", "find_measured", "find_unit", "gain"]


def find_measured(pairs: Pairs, node: Node) -> list[Vector]:
    """m, with and without noise, of a node that is 1 / |m|^2 or 1 / |m|; empty of another node.

    No element has that noise.
    """
    total = next(iter(pairs.roots_of(node.args[0])), None)
    if total is None:
        return []
    alike = [total, pairs.space.without_noise(total)]
    while total is not alike[1]:
        total.of_measurement = True
        if total.noise:
            break
        total = total.parts[0][1]
    return alike


def find_unit(pairs: Pairs, node: Node) -> None:
    """Find the unit vector along m of a node 1 / |m|."""
    alike = find_measured(pairs, node)
    if alike:
        total = alike[0]
        at = total.at / np.where(total.length > 0.0, total.length, 1.0)[:, None]
        pairs.units[node.number] = alike, pairs.space.add(at, measured=total)


def find_gain(pairs: Pairs, node: Node) -> bool:
    """Find the vectors of a gain P_i: h / |m|; False: the node is no gain."""
    k = next((k for k, a in enumerate(node.args) if a.number in pairs.units), None)
    if k is None:
        return False
    pair = gain(pairs, node, node.args[1 - k], *pairs.units[node.args[k].number])
    pairs.by_node.setdefault(node.number, []).extend([pair] if pair else [])
    return True


def gain(
    pairs: Pairs, node: Node, column: Node, alike: Sequence[Vector], unit: Vector
) -> Pair | None:
    """A vector and the unit vector whose inner product a gain is; None: it is no gain of m."""
    for x, y in pairs.of(column):
        for vector, other in ((x, y), (y, x)):
            direction = None
            if other in alike:
                direction = unit
            elif is_scaled(other):
                (choice, measured), *_ = other.parts
                if measured in alike and choice.is_choice:
                    direction = pairs.sum_of(((choice, unit),))
            if direction is not None and pairs.is_product(node, (vector, direction)):
                return vector, direction
    return None


def directions(terms: Terms, products: Sequence[Term]) -> list[tuple[Coefficient, Vector]] | None:
    """The unit vectors along which products are subtracted, in order, each with its condition.

    None: a product is of another form.
    """
    out: dict[int, tuple[Coefficient, Vector]] = {}
    for term in products:
        a, b = ([v for pair in terms.pairs.of(f) for v in pair if of_unit(v)] for f in term.factors)
        unit = next((v for v in a if v in b), None) or _share_of(terms, term)
        if unit is None:
            return None
        out[unit.number] = Coefficient(sides=term.coefficient.sides), unit
    return [out[n] for n in sorted(out)]


def _share_of(terms: Terms, term: Term) -> Vector | None:
    """The root of k, times m, of a product k (x . m)(m . y); None: of another form."""
    plain = terms.pairs.space.without_noise
    first, second = ([v for p in terms.pairs.of(f) for v in p] for f in term.factors)
    coefficient = Coefficient(nodes=term.coefficient.nodes)
    candidates = [(coefficient, plain(m)) for m in first if m in second and coefficient.nodes]
    for some, others in ((first, second), (second, first)):
        scaled = ((c, plain(m)) for v in some if is_scaled(v) for c, m in v.parts)
        candidates += [(c, m) for c, m in scaled if m in map(plain, others)]
    candidates += [(c, m.parts[0][1]) for c, m in candidates if is_scaled(m)]
    for c, m in candidates:
        weight = _weight_of(terms, c, m)
        if weight is not None:
            root = np.sqrt(np.maximum(terms.points.at(c), 0.0))
            share = terms.pairs.space.add(root[:, None] * m.at, measured=m, share=True)
            terms.pairs.weights[c, m] = weight
            return share
    return None


def _weight_of(terms: Terms, c: Coefficient, m: Vector) -> Weight | None:
    """w and v of a coefficient w / (w |m|^2 + v), neither negative; None: of another form."""
    if c.number != 1.0 or c.sides or len(c.nodes) != 1:
        return None
    *claims, node = _bounded_chain(c.nodes[0])
    factors = node.args if node.kind == "mul" else (node,)
    reciprocals = [f for f in factors if f.kind == "reciprocal"]
    w = Coefficient(nodes=tuple(f for f in factors if f.kind != "reciprocal"))
    if len(reciprocals) != 1 or w.ends({})[0] < 0.0:
        return None
    *inner_claims, total = _bounded_chain(reciprocals[0].args[0])
    squares, noise = terms.pairs.sums.get(total.number, ((), ()))
    scaled = [m] if w == ONE else [v for v in terms.pairs.space.vectors if v.parts == ((w, m),)]
    if not any({x, y} == {v, m} for v in scaled for x, y in squares) or minimum_of(noise) < 0.0:
        return None
    terms.points.aliases |= {n.number for n in (*claims, *inner_claims)}
    terms.points.premises.base |= nodes_behind((*noise, w))
    return Weight(w, noise)


def _bounded_chain(node: Node) -> Iterator[Node]:
    """A node, and the arguments of its claims, one after the other."""
    yield node
    while node.kind == "bounded":
        node = node.args[0]
        yield node
