"""Proof that a matrix of states stays a covariance, and of ranges that follow from that.

|P_ij| <= sqrt(P_ii P_jj) is no property of one state, and no interval holds it. Here the elements
of the next matrix are expanded to polynomials of those of the one before, P, for each side of
their selections, and brought to the form

    P' = sum of F (P - w P T P) F^T + Q      w = 1 / S      S = T : P + v

with a rank-one T >= 0, v >= 0 and a diagonal Q >= 0, in which all else that the step computes may
have any value. P - w P T P is what a measurement leaves of P, so P' is a covariance if P is one;
the first one is, and by induction all are. Of a covariance:

* an element is within the roots of its two largest variances, a variance is not negative, nor is
  r P r^T, and a sum of variances that a selection compares limits each;
* a gain r P / S is within sqrt(P_ii s / 4 v), T = s r^T r, and r P / sqrt(S) within sqrt(P_ii s).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence, Set

from boresight.model.estimator import Estimator
from boresight.model.lowering.graph import LEAVES, Node
from boresight.model.words.program import Program
from boresight.sim.ranges.claims import Claim, Proof
from boresight.sim.ranges.elements import TERMS, Family, Forms, Linear, Sides
from boresight.sim.ranges.intervals import interval_of
from boresight.sim.ranges.polynomials import (
    Polynomial,
    cleared,
    ends_of_product,
    is_zero,
    plus,
    polynomial_of,
    scaled,
    substituted,
    times,
)
from boresight.sim.ranges.steps import covariance_elements, live_nodes

__all__ = ["Matrices"]

#: Sums F (...) F^T; coefficients that rounding explains.
_CONGRUENCES, _TINY = 3, 1e-9


class Matrices:
    """The covariances of a compiled step; none where the next one is not proven to be one.

    Parameters
    ----------
    estimator, program, nodes
        The last two as `Estimator.compile_traced` gives them.
    """

    def __init__(self, estimator: Estimator, program: Program, nodes: Mapping[int, Node]) -> None:
        self.nodes = live_nodes(program, nodes)
        self.families: list[Family] = []
        self.used: set[int] = set()
        self.forms = Forms(self.nodes)
        elements = covariance_elements(estimator, program, nodes)
        if not elements:
            return
        size = 1 + max(j for _, j in elements)
        before, after = (
            [[elements[min(i, j), max(i, j)][k] for j in range(size)] for i in range(size)]
            for k in (0, 1)
        )
        self._add(before)
        self.ends = self._intervals()
        if not self._follows(after):
            self.families = []

    def _intervals(self) -> dict[int, tuple[float, float]]:
        """Of each node, where no variance among the states is negative."""
        family = self.families[0]
        ends = {n: (node.low, node.high) for n, node in self.nodes.items()}
        for k, row in enumerate(family.numbers):
            ends[row[k]] = max(0.0, ends[row[k]][0]), ends[row[k]][1]
        for number, node in self.nodes.items():
            if number in family.cone and node.args:
                ends[number] = interval_of(node, [ends[arg.number] for arg in node.args])
        return ends

    def proof_of(self, claim: Claim) -> Proof | None:
        """Prove a claim, if it follows from a covariance."""
        low, high = claim.ends
        for k, family in enumerate(self.families[1:]):
            for number, (i, j) in family.at.items():
                node = self.nodes[number]
                if node.kind == "bounded" and node.args[0] is claim.node:
                    sizes = [self.nodes[family.numbers[n][n]].high for n in (i, j)]
                    least, most = -math.sqrt(math.prod(sizes)), math.sqrt(math.prod(sizes))
                    if i != j and low <= least and most <= high:
                        return self._proof({family.numbers[n][n] for n in (i, j)})
                    if i == j and low <= 0.0:
                        return self._bounded(claim, self.families[k], (-math.inf, high))
        for family in reversed(self.families):
            if claim.node.number in family.cone and claim.node.number not in family.at:
                return self._bounded(claim, family, (low, high))
        return None

    def _bounded(self, claim: Claim, family: Family, wanted: tuple[float, float]) -> Proof | None:
        """Prove that a value, of the elements of a family, is in a range."""
        low, high = wanted
        for split in (False, True):
            self.used = set()
            if all(
                (low == -math.inf or low <= self._least(form, sides, family, low))
                and self._most(form, sides, family, high) <= high
                for (form,), sides in self.forms.cases([claim.node], family, split=split)
            ):
                variances = {family.numbers[k][k] for k in range(len(family.numbers))}
                return self._proof((self.used - family.at.keys()) | variances)
        return None

    def _proof(self, base: Set[int]) -> Proof:
        passed = (self.nodes[n] for n in sorted(self.forms.passed))
        return Proof("covariance", tuple(self.nodes[n] for n in sorted(base)), tuple(passed))

    # -- which matrices are covariances -----------------------------------------------------------

    def _add(self, matrix: Sequence[Sequence[Node]]) -> Family:
        family = Family([[node.number for node in row] for row in matrix])
        for node in self.nodes.values():
            if node.number in family.at or any(a.number in family.cone for a in node.args):
                family.cone.add(node.number)
        self.families.append(family)
        return family

    def _follows(self, matrix: Sequence[Sequence[Node]]) -> bool:
        """Whether a matrix is a covariance if that of the states is; keeps those between."""
        if [[n.number for n in row] for row in matrix] == self.families[0].numbers:
            return True
        between = [node for row in matrix for node in map(_origin, row) if node is not None]
        size = len(matrix)
        family: Family | None = self.families[0]
        if len(between) == size * size:
            rows = [between[k : k + size] for k in range(0, size * size, size)]
            if rows == matrix or not self._follows(rows):
                return False
            numbers = [[node.number for node in row] for row in rows]
            family = next((f for f in self.families if f.numbers == numbers), None)
        if family is None or not self._certified(matrix, family):
            return False
        self._add(matrix)
        return True

    def _certified(self, matrix: Sequence[Sequence[Node]], family: Family) -> bool:
        """Whether a matrix is a covariance if a family is one."""
        size = range(len(matrix))
        where = [(i, j) for i in size for j in size if i <= j]
        for forms, sides in self.forms.cases([matrix[i][j] for i, j in where], family):
            if any(f is None for f in forms):
                return False
            known = {ij: f for ij, f in zip(where, forms, strict=True) if f is not None}
            if not self._is_covariance(known, family, sides):
                return False
        return True

    def _is_covariance(
        self, forms: Mapping[tuple[int, int], Polynomial], family: Family, sides: Sides
    ) -> bool:
        linear: dict[tuple[int, int], Linear] = {}
        taken: dict[int, dict[tuple[int, int], Polynomial]] = {}
        noise: Linear = {}
        for ij, form in forms.items():
            sorted_form = self.forms.sorted_terms(form, family)
            if sorted_form is None:
                return False
            linear[ij], parts, noise[ij] = sorted_form
            for weight, part in parts.items():
                taken.setdefault(weight, {})[ij] = part
        maps = self._congruences(linear, len(family.numbers))
        if maps is None or not self._is_noise(noise, max(i for i, _ in forms) + 1):
            return False
        return all(self._are_taken(t, w, maps, [*forms], family, sides) for w, t in taken.items())

    def _are_taken(
        self,
        taken: Mapping[tuple[int, int], Polynomial],
        weight: int,
        maps: Sequence[Sequence[Mapping[int, Polynomial]]],
        where: Sequence[tuple[int, int]],
        family: Family,
        sides: Sides,
    ) -> bool:
        """Whether what an inverse multiplies is what a measurement takes of F P F^T."""
        gauge = self._gauge(self.nodes[weight].args[0], family, sides)
        return gauge is not None and all(
            is_zero(plus(taken.get(ij, {}), self._measured(maps, gauge[0], ij, family)), _TINY)
            for ij in where
        )

    def _congruences(
        self, linear: Mapping[tuple[int, int], Linear], columns: int
    ) -> list[list[dict[int, Polynomial]]] | None:
        """Matrices F whose sum of F P F^T the linear forms are; None: not found."""
        left = {ij: dict(form) for ij, form in linear.items()}
        size = max(i for i, _ in left) + 1
        out: list[list[dict[int, Polynomial]]] = []
        for _ in range(_CONGRUENCES):
            if all(is_zero(p, _TINY) for form in left.values() for p in form.values()):
                return out
            rows = [_root_row(left[i, i], i, columns) for i in range(size)]
            if any(row is None for row in rows):
                return None
            known = [row for row in rows if row is not None]
            out.append(known)
            for (i, j), form in left.items():
                for k, a in known[i].items():
                    for m, b in known[j].items():
                        key = (min(k, m), max(k, m))
                        product = times(a, b, TERMS)
                        if product is None:
                            return None
                        form[key] = plus(form.get(key, {}), scaled(product, -1.0))
        done = all(is_zero(p, _TINY) for form in left.values() for p in form.values())
        return out if done else None

    def _is_noise(self, forms: Linear, size: int) -> bool:
        """Whether a matrix is a sum of s f f^T, no s negative: one for each term of a variance."""
        left = {ij: cleared(form) or {} for ij, form in forms.items()}
        done = set[tuple[int, tuple[int, ...]]]()
        while True:
            terms = [
                (len(m), i, m)
                for i in range(size)
                for m, c in left.get((i, i), {}).items()
                if c > _TINY and (i, m) not in done
            ]
            if not terms:
                break
            _, i, m = min(terms)
            done.add((i, m))
            root, rest = _root(m)
            if not self._positive(rest, 1.0):
                return False
            own = left[i, i][m]
            row: dict[int, Polynomial] = {i: {root: own}}
            for j in range(size):
                key = (min(i, j), max(i, j))
                parts = {n: c for n, c in left.get(key, {}).items() if j != i}
                over = [(_divided({n: c}, tuple(sorted((*root, *rest))))) for n, c in parts.items()]
                for part in over:
                    row[j] = plus(row.get(j, {}), part or {})
            for j, a in row.items():
                for k, b in row.items():
                    if j <= k:
                        product = times(times(a, b, TERMS) or {}, {rest: -1.0 / own}, TERMS) or {}
                        left[j, k] = cleared(plus(left.get((j, k), {}), product)) or {}
        return all(is_zero(form, _TINY) for form in left.values())

    def _measured(
        self,
        maps: Sequence[Sequence[Mapping[int, Polynomial]]],
        gauge: Linear,
        ij: tuple[int, int],
        family: Family,
    ) -> Polynomial:
        """Element of the sum of F P T P F^T."""
        out: Polynomial = {}
        i, j = ij
        for rows in maps:
            for k, a in rows[i].items():
                for m, b in rows[j].items():
                    outer = times(a, b, TERMS) or {}
                    for (r, s), t in gauge.items():
                        part = times(outer, t, TERMS) or {}
                        for x, y in {(r, s), (s, r)}:
                            pair = (family.numbers[k][x], family.numbers[y][m])
                            share = 1.0 if r == s else 0.5
                            out = plus(
                                out,
                                {tuple(sorted((*pair, *n))): share * c for n, c in part.items()},
                            )
        return out

    def _gauge(self, node: Node, family: Family, sides: Sides) -> tuple[Linear, float] | None:
        """T and the least v of T : P + v, if T is of rank one and neither is negative."""
        form, _ = self.forms.of(node, family, sides, whole=True)
        if form is None:
            return None
        found = self._outer(form, family)
        return found if found is not None and found[1] >= 0.0 else None

    def _outer(self, form: Polynomial, family: Family) -> tuple[Linear, float] | None:
        """T of rank one, not negative, and the least v of T : P + v; None: of another form."""
        found = self.forms.sorted_terms(form, family)
        if found is None or found[1] or not self._is_outer(found[0]):
            return None
        linear, _, rest = found
        return linear, sum(self._range(m, c, {})[0] for m, c in rest.items())

    def _is_outer(self, linear: Linear) -> bool:
        """Whether a linear form of a covariance is s r P r^T, s not negative."""
        for (k, j), form in linear.items():
            if k == j:
                if not all(self._positive(m, c) for m, c in form.items()):
                    return False
                continue
            square = times(form, form, TERMS)
            other = times(linear.get((k, k), {}), linear.get((j, j), {}), TERMS)
            if (
                square is None
                or other is None
                or not is_zero(plus(square, scaled(other, -4.0)), _TINY)
            ):
                return False
        return True

    # -- what follows ---------------------------------------------------------------------------

    def _least(self, form: Polynomial | None, sides: Sides, family: Family, wanted: float) -> float:
        """A lower bound of a form of a covariance."""
        if form is None:
            return -math.inf
        square = self._outer(form, family)  # r P r^T and what else there is
        if square is not None:
            return square[1]
        return -self._most(scaled(form, -1.0), sides, family, -wanted)

    def _most(self, form: Polynomial | None, sides: Sides, family: Family, wanted: float) -> float:
        """An upper bound of a form of a covariance."""
        if form is None:
            return math.inf
        caps = self._caps(sides, family)
        best = self._gain(form, family, sides, caps)
        if best <= wanted:
            return best
        left = {m: c for m, c in form.items() if not self.forms.parts_of(m, family)[1]}
        if len(left) < len(form) and not self._is_taken(form, family, sides):
            return best
        total = self._by_signs(left, caps)
        return min(best, total if total <= wanted else self._by_parts(left, family, caps))

    def _by_signs(self, form: Polynomial, caps: Mapping[int, float]) -> float:
        return sum(self._range(m, c, caps)[1] for m, c in form.items())

    def _by_parts(self, form: Polynomial, family: Family, caps: Mapping[int, float]) -> float:
        """Upper bound with variances at their largest, and without what is not positive at all."""
        for n in {n for m in form for n in m if self.nodes[n].kind == "sum"}:
            by = polynomial_of(self.nodes[n], TERMS, 1)
            other = None if by is None else substituted(form, n, by, TERMS)
            form = form if other is None else other
        for n in {row[k] for k, row in enumerate(family.numbers)}:
            slope = _over(form, n)
            if all(n not in m for m in slope) and self._by_signs(scaled(slope, -1.0), caps) <= 0.0:
                other = substituted(form, n, {(): self._variance(n, caps)}, TERMS)
                form = form if other is None else other
        for n in sorted({n for m in form for n in m}):
            if self.ends[n][0] >= 0.0 and self._by_signs(_over(form, n), caps) <= 0.0:
                form = {m: c for m, c in form.items() if n not in m}
        return self._by_signs(form, caps)

    def _is_taken(self, form: Polynomial, family: Family, sides: Sides) -> bool:
        """Whether what weights multiply is what measurements take of a variance."""
        found = self.forms.sorted_terms(form, family)
        if found is None:
            return False
        linear, taken, _ = found
        maps = self._congruences({(0, 0): linear}, len(family.numbers))
        return maps is not None and all(
            self._are_taken({(0, 0): part}, weight, maps, [(0, 0)], family, sides)
            for weight, part in taken.items()
        )

    def _gain(
        self, form: Polynomial, family: Family, sides: Sides, caps: Mapping[int, float]
    ) -> float:
        """Bound of a gain: a row r P times the inverse of S or of its root."""
        rows: dict[int, Polynomial] = {}
        all_weights = set()
        columns = None
        for m, c in form.items():
            elements, weights, rest = self.forms.parts_of(m, family)
            if len(elements) != 1 or len(weights) != 1:
                return math.inf
            all_weights.add(weights[0])
            pair = family.at[elements[0]]
            columns = {*pair} if columns is None else columns & {*pair}
            rows.setdefault(elements[0], {})[rest] = c
        if len(all_weights) != 1 or not columns:
            return math.inf
        weight = self.nodes[all_weights.pop()]
        gauge = self._gauge(weight.args[0], family, sides)
        if gauge is None:
            return math.inf
        for j in columns:
            row: dict[int, Polynomial] = {}
            for number, part in rows.items():
                a, b = family.at[number]
                row[b if a == j else a] = part
            ratio = self._ratio(row, gauge[0])
            if ratio is None:
                continue
            (factor,) = ratio
            most = max(0.0, self._range(factor, ratio[factor], {})[1])
            variance = self._variance(family.numbers[j][j], caps)
            if weight.kind == "rsqrt":
                return math.sqrt(variance * most)
            if gauge[1] > 0.0:
                return math.sqrt(variance * most / (4.0 * gauge[1]))
        return math.inf

    def _ratio(self, row: Mapping[int, Polynomial], gauge: Linear) -> Polynomial | None:
        """s, of one term, of row_k row_l = s T_kl; None: there is none."""
        ratio: Polynomial | None = None
        for k, a in row.items():
            for m, b in row.items():
                if k > m:
                    continue
                product = times(a, b, TERMS)
                own = gauge.get((k, m), {})
                if product is None or not own:
                    return None
                own = scaled(own, 1.0 if k == m else 0.5)
                if ratio is None:
                    first = min(own)
                    candidates = [_divided({n: c / own[first]}, first) for n, c in product.items()]
                    ratio = next((r for r in candidates if r is not None), None)
                if ratio is None:
                    return None
                whole = times(ratio, own, TERMS)
                if whole is None or not is_zero(plus(product, scaled(whole, -1.0)), _TINY):
                    return None
        return ratio

    def _caps(self, sides: Sides, family: Family) -> dict[int, float]:
        """Limits of variances by what was compared; by number of the element."""
        caps: dict[int, float] = {}
        for number, side in sides.items():
            form, _ = self.forms.of(self.nodes[number], family, sides)
            if form is None:
                continue
            form = scaled(form, -1.0) if side == 1 else form  # not negative
            variances = {m[0]: c for m, c in form.items() if len(m) == 1 and m[0] in family.at}
            diagonal = all(a == b for a, b in (family.at[n] for n in variances))
            alone = len(variances) == len(form) - (() in form)
            if diagonal and alone and all(c < 0.0 for c in variances.values()):
                for n, c in variances.items():
                    caps[n] = min(caps.get(n, math.inf), form.get((), 0.0) / -c)
        return caps

    def _variance(self, number: int, caps: Mapping[int, float]) -> float:
        return max(0.0, min(self.nodes[number].high, caps.get(number, math.inf)))

    def _positive(self, monomial: tuple[int, ...], factor: float) -> bool:
        """Whether a term cannot be negative."""
        odd = _root(monomial)[1]
        self.used.update(odd)
        return factor > 0.0 and all(self.ends[n][0] >= 0.0 for n in odd)

    def _range(
        self, monomial: tuple[int, ...], factor: float, caps: Mapping[int, float]
    ) -> tuple[float, float]:
        """Ends of a term; elements of a covariance by its variances."""
        ends = factor, factor
        for number in sorted(set(monomial)):
            family = next((f for f in self.families if number in f.at), None)
            if family is None:
                self.used.add(number)
                a, b = self.ends[number]
            else:
                k, m = family.at[number]
                variances = (self._variance(family.numbers[n][n], caps) for n in (k, m))
                b = math.sqrt(math.prod(variances))
                a = 0.0 if k == m else -b
            ends = ends_of_product(ends, (a, b), monomial.count(number))
        return ends


def _origin(node: Node) -> Node | None:
    """The element that another one has changed: the first term of its sum."""
    at = node
    while at.kind in ("bounded", "select", "sum"):
        at = at.args[0] if at.kind != "select" else at.args[2 if at.args[1].kind == "const" else 1]
        if at.kind in ("bounded", *LEAVES):
            return at if at.kind in ("bounded", "state") else None
    return node if node.kind == "state" else None


def _root_row(form: Linear, own: int, size: int) -> dict[int, Polynomial] | None:
    """Row r of r P r^T in a linear form, as far as one of its elements has one term."""
    pivots = []
    for k in range(size):
        square = {m: c for m, c in form.get((k, k), {}).items() if abs(c) >= _TINY}
        if len(square) == 1:
            ((m, c),) = square.items()
            if c > 0.0 and all(m.count(n) % 2 == 0 for n in m):
                pivots.append((len(m), k != own, k, {m[::2]: math.sqrt(c)}))
    if not pivots:
        return {} if all(is_zero(p, _TINY) for p in form.values()) else None
    _, _, at, root = min(pivots, key=lambda p: p[:3])
    row = {at: root}
    ((m, c),) = root.items()
    for k in range(size):
        if k != at and not is_zero(form.get((min(k, at), max(k, at)), {}), _TINY):
            part = _divided(form[min(k, at), max(k, at)], m)
            if part is None:
                return None
            row[k] = scaled(part, 0.5 / c)
    return row


def _over(form: Polynomial, number: int) -> Polynomial:
    """The terms that have a node, each over it."""
    out: Polynomial = {}
    for m, c in form.items():
        if number in m:
            at = m.index(number)
            out[m[:at] + m[at + 1 :]] = c
    return out


def _root(monomial: tuple[int, ...]) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """r and s of a product of nodes r^2 s."""
    numbers = sorted(set(monomial))
    root = [n for n in numbers for _ in range(monomial.count(n) // 2)]
    return tuple(root), tuple(n for n in numbers if monomial.count(n) % 2)


def _divided(form: Polynomial, by: tuple[int, ...]) -> Polynomial | None:
    """A polynomial over a product of nodes; None: it does not divide it."""
    out: Polynomial = {}
    for m, c in form.items():
        left = list(m)
        for n in by:
            if n not in left:
                return None
            left.remove(n)
        out[tuple(left)] = c
    return out
