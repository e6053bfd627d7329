"""Ranges of linear filters of two states, by the largest sum of their samples.

A filter s' = A s + B x of the states s = (z, v) is linear. After n samples of at most X

    |e s| <= |e A^n s_0| + sum over k < n of |e A^k B| X

and so is the length of a vector whose components are filtered alike, from those of samples x of
length X: along any direction it is a filtered component of the samples.

A filter may begin as a mean: while a counter is below a limit, s' = (a, b) m' of
m' = (1 - g) m + g x, 0 <= g <= 1, where s = (a, b) m, and g = 1 while the counter is 0. The counter
may stay, return to 0, or be more by a constant, this only where there is a sample. So s is
(a, b) m, |m| <= X, whenever the counter is neither 0 nor at its limit, and s_0 is such a state.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from boresight.model.lowering.graph import Node
from boresight.model.words.program import Program
from boresight.sim.ranges.boxes import interval_at
from boresight.sim.ranges.polynomials import Polynomial, cleared, combined, monomial, polynomial_of
from boresight.sim.ranges.steps import live_nodes

__all__ = ["Forms", "LowPass", "low_passes_of", "near"]

FloatArray = npt.NDArray[np.float64]
#: Terms of a polynomial; conditions of a filter; steps from a next state back to states; samples
#: that are summed; share of a number that its rounding explains.
_TERMS, _CONDITIONS, _NEAR, _SAMPLES, _EXACT = 40, 3, 8, 100_000, 1e-12
#: Remainder of a state at which the sum ends; size of a state in a filter that diverges.
_REST, _DIVERGED = 1e-9, 1e6
Sides = dict[int, int]


class _Open(Exception):
    """A condition that needs a side first."""


@dataclass(frozen=True, eq=False)
class LowPass:
    """One filter.

    Attributes
    ----------
    z, v, sample : Node
    matrix, column : tuple of float
        A, row by row, and B.
    mean : tuple of float or None
        (a, b), of a filter that begins as a mean.
    counting : tuple of (int, float, int) or None
        Condition of the mean, its side, and the number of the counter.
    share : int or None
        Number of g.
    aliases : frozenset of int
        "bounded" nodes that count as their arguments.
    """

    z: Node
    v: Node
    sample: Node
    matrix: tuple[float, ...]
    column: tuple[float, ...]
    mean: tuple[float, ...] | None
    counting: tuple[int, int, int] | None
    share: int | None
    aliases: frozenset[int]

    def is_like(self, other: LowPass) -> bool:
        """Whether two filters are the same but for states and samples."""
        first, second = ((f.matrix, f.column, f.mean, f.counting, f.share) for f in (self, other))
        return first == second

    @cached_property
    def _gains(self) -> Callable[[FloatArray], float]:
        a, b = np.array(self.matrix).reshape(2, 2), np.array(self.column)
        start = np.array(self.mean or (0.0, 0.0))
        states, responses, power = [start], [b], np.eye(2)
        while abs(power := a @ power).sum() > _REST:
            if len(states) >= _SAMPLES or not abs(power).sum() < _DIVERGED:
                return lambda e: math.inf
            states.append(a @ states[-1])
            responses.append(a @ responses[-1])
        means, impulses = np.array(states), np.array(responses)

        def gain(e: FloatArray) -> float:
            terms = abs(impulses @ e)
            sums = np.concatenate([[0.0], np.cumsum(terms)[:-1]])
            tail = _REST / (1.0 - _REST) * (terms.sum() + abs(impulses).sum() + abs(means).sum())
            return float((abs(means @ e) + sums).max() + tail * (1.0 + abs(e).sum()))

        return gain

    def largest(self, form: Polynomial, sides: Mapping[int, int]) -> float:
        """Upper bound of a form of states and sample for samples up to one; else infinite.

        ``sides``: of the conditions under which it has that form.
        """
        z, v, x = ((n.number,) for n in (self.z, self.v, self.sample))
        if {*form} <= {z, v, x}:
            e = np.array([form.get(z, 0.0), form.get(v, 0.0)])
            return self._gains(e) + abs(form.get(x, 0.0))
        if self.mean is None or self.counting is None:
            return math.inf
        condition, side, _ = self.counting
        mean = _mean_of(form, z[0], x[0]) if sides.get(condition) == side else None
        if mean is None or mean[0] != self.share:
            return math.inf
        return max(abs(mean[1] * self.mean[0]), abs(mean[2]))

    def alike(self, form: Polynomial) -> dict[tuple[str, ...], float]:
        """A form by the roles of its nodes in the filter: the same for filters that are alike."""
        names = {self.z.number: "z", self.v.number: "v", self.sample.number: "x"}
        return {tuple(sorted(names.get(n, str(n)) for n in m)): c for m, c in form.items()}


def _mean_of(form: Polynomial, z: int, x: int) -> tuple[int, float, float] | None:
    """g, p and q of p (1 - g) z + q g x."""
    shares = {n for m in form for n in m} - {z, x}
    if len(shares) != 1:
        return None
    (g,) = shares
    p, q = form.get((z,), 0.0), form.get(monomial(g, x), 0.0)
    is_mean = abs(p + form.get(monomial(g, z), 0.0)) <= _EXACT * abs(p)
    return (g, p, q) if is_mean and {*form} <= {(z,), monomial(g, z), monomial(g, x)} else None


class Forms:
    """Nodes as polynomials of the states and samples of filters, side by side of conditions."""

    def __init__(self, nodes: Mapping[int, Node]) -> None:
        self.nodes = nodes
        self.leaves: dict[int, frozenset[int]] = {}
        for number, node in nodes.items():
            leaf = frozenset[int]() if node.kind == "const" or node.args else frozenset({number})
            self.leaves[number] = leaf.union(*(self.leaves[a.number] for a in node.args))

    def of(
        self, node: Node, variables: set[int], counter: int | None, aliases: set[int]
    ) -> Iterator[tuple[Sides, Polynomial | None]]:
        """Form of a node for all sides of the conditions that select it."""
        stack: list[Sides] = [{}]
        while stack:
            sides = stack.pop()
            try:
                yield sides, self._form(node, variables, counter, sides, aliases, {})
            except _Open as e:
                if len(sides) >= _CONDITIONS:
                    yield sides, None
                else:
                    stack += [{**sides, e.args[0]: side} for side in (1, 2)]

    def _is_weight(self, node: Node, counter: int | None) -> bool:
        """Whether a node depends only on a counter and on conditions."""
        if node.kind in ("select", "bounded"):
            return all(self._is_weight(arg, counter) for arg in node.args[-2:])
        return self.leaves[node.number] <= {counter}

    def _form(
        self,
        node: Node,
        variables: set[int],
        counter: int | None,
        sides: Sides,
        aliases: set[int],
        forms: dict[int, Polynomial | None],
    ) -> Polynomial | None:
        """The form on given sides; ``forms`` gets that of each node."""
        if node.kind == "const":
            return {(): node.value} if node.value else {}
        if node.number in forms:
            return forms[node.number]

        def form_of(other: Node) -> Polynomial | None:
            return self._form(other, variables, counter, sides, aliases, forms)

        is_expanded = self._is_weight(node, counter) or (
            node.kind == "mul" and any(self._is_weight(arg, counter) for arg in node.args)
        )
        out: Polynomial | None = {(node.number,): 1.0}
        if node.number in variables or not (is_expanded or self.leaves[node.number] & variables):
            pass
        elif node.kind == "bounded":
            aliases.add(node.number)
            out = form_of(node.args[0])
        elif node.kind == "select":
            condition = node.args[0].number
            if condition not in sides:
                raise _Open(condition)
            out = form_of(node.args[sides[condition]])
        elif node.kind in ("sum", "mul"):
            parts = [form_of(arg) for arg in node.args]
            valid = [part for part in parts if part is not None]
            out = cleared(combined(node, valid, _TERMS)) if len(valid) == len(parts) else None
        forms[node.number] = out
        return out


def low_passes_of(program: Program, nodes: Mapping[int, Node]) -> Iterator[LowPass]:
    """The filters of a compiled step, as `Estimator.compile_traced` gives it."""
    forms = Forms(live_nodes(program, nodes))
    pairs = [(s, a) for s, a in program.states if s in nodes and a in nodes]
    following = {nodes[s].number: nodes[a] for s, a in pairs}
    initial = {
        nodes[s].number: float(program.format(s).real(program.values[s].initial)) for s, _ in pairs
    }
    for z, node in following.items():
        for v in near(node, following.keys() - {z}):
            low_pass = _Filter(forms, following, initial, z, v).low_pass()
            if low_pass is not None:
                yield low_pass


def near(node: Node, wanted: set[int]) -> set[int]:
    """The wanted nodes that are at most some steps back."""
    level, visited = [node], set[int]()
    for _ in range(_NEAR):
        level = [arg for node in level for arg in node.args if arg.number not in visited]
        visited |= {node.number for node in level}
    return visited & wanted


class _Filter:
    """Search for the filter that two states are."""

    def __init__(
        self,
        forms: Forms,
        following: Mapping[int, Node],
        first: Mapping[int, float],
        z: int,
        v: int,
    ) -> None:
        self.nodes, self.forms, self.following, self.first = forms.nodes, forms, following, first
        self.z, self.v = z, v
        self.aliases: set[int] = set()

    def low_pass(self) -> LowPass | None:
        """The filter, if there is one."""
        if self.first[self.z] or self.first[self.v]:
            return None
        counters = {None, *near(self.following[self.z], {*self.following}) - {self.z, self.v}}
        for counter in sorted(counters, key=lambda n: n or 0):
            self.aliases = set()
            low_pass = self._with(counter)
            if low_pass is not None:
                return low_pass
        return None

    def _with(self, counter: int | None) -> LowPass | None:
        """The filter, if it begins as a mean while this counter is below a limit."""
        steady, means = list[tuple[Polynomial, Polynomial]](), list[tuple[Polynomial, Polynomial]]()
        counting, moves = None, list[tuple[Sides, bool]]()
        for sides, of_z, of_v in self._next_forms(counter):
            if of_z is None or of_v is None:
                return None
            is_held = of_z == {(self.z,): 1.0} and of_v == {(self.v,): 1.0}
            moves.append((sides, is_held))
            if is_held:
                continue
            is_mean = False
            if counter is not None:
                phases = [n for n in sides if self._limit(n, counter)]
                if len(phases) != 1 or (counting is not None and counting[0] != phases[0]):
                    return None
                counting = phases[0], self._limit(phases[0], counter), counter
                is_mean = sides[phases[0]] == counting[1]
            (means if is_mean else steady).append((of_z, of_v))
        if not steady or any(pair != steady[0] for pair in steady):
            return None
        if (counter is None) == bool(means) or any(pair != means[0] for pair in means):
            return None
        if counting is not None and counter is not None:
            form = self._condition(counting[0])
            limit = -form[()] / form[counter,]
            if self.first[counter] or not all(
                self._moves(counter, limit, sides, held=is_held) for sides, is_held in moves
            ):
                return None
        return self._filter(steady[0], means[0] if means else None, counting)

    def _next_forms(
        self, counter: int | None
    ) -> Iterator[tuple[Sides, Polynomial | None, Polynomial | None]]:
        """Next z and v, side by side."""
        pair = {self.z, self.v}
        for sides, of_z in self.forms.of(self.following[self.z], pair, counter, self.aliases):
            for v_sides, of_v in self.forms.of(self.following[self.v], pair, counter, self.aliases):
                if all(sides.get(n, side) == side for n, side in v_sides.items()):
                    yield {**sides, **v_sides}, of_z, of_v

    def _condition(self, condition: int) -> Polynomial:
        return polynomial_of(self.nodes[condition], _TERMS, _NEAR, (), self.aliases) or {}

    def _limit(self, condition: int, counter: int) -> int:
        """Side of a condition on which a counter is below a positive limit; 0: of another form."""
        form = self._condition(condition)
        slope, constant = form.get((counter,), 0.0), form.get((), 0.0)
        if {*form} != {(counter,), ()} or slope * constant >= 0.0:
            return 0
        return 1 if slope > 0.0 else 2

    def _moves(self, counter: int, limit: float, sides: Sides, *, held: bool) -> bool:
        """Whether a counter stays, returns to 0, or, unless held, increases by a constant.

        Its saturation is not below the ``limit`` of the mean.
        """
        stack = [self.following[counter]]
        while stack:
            node = stack.pop()
            if node.kind == "select":
                side = sides.get(node.args[0].number)
                stack += [node.args[side]] if side else node.args[1:]
            elif node.kind == "bounded":
                self.aliases.add(node.number)
                stack.append(node.args[0])
            elif node.kind == "saturated" and node.value >= limit:
                stack.append(node.args[0])
            else:
                for form_sides, form in self.forms.of(node, {counter}, counter, self.aliases):
                    if any(sides.get(n, side) != side for n, side in form_sides.items()):
                        continue
                    step = None if form is None else form.pop((), 0.0)
                    if form == {} and step == 0.0:
                        continue
                    if form != {(counter,): 1.0} or step is None or step < 0.0 or (held and step):
                        return False
        return True

    def _filter(
        self,
        steady: tuple[Polynomial, Polynomial],
        means: tuple[Polynomial, Polynomial] | None,
        counting: tuple[int, int, int] | None,
    ) -> LowPass | None:
        samples = {n for form in steady for m in form for n in m} - {self.z, self.v}
        if len(samples) != 1 or any(len(m) != 1 for form in steady for m in form):
            return None
        (x,) = samples
        mean, g = None, None
        if means is not None and counting is not None:
            triples = [_mean_of(form, self.z, x) for form in means]
            if any(f is None for f in triples):
                return None
            (g, p, a), (other_g, q, b) = (f for f in triples if f is not None)
            share = self.nodes[g]
            if g != other_g or a <= 0.0 or not 0.0 <= share.low <= share.high <= 1.0:
                return None
            # The mean that z holds moves by p = 1, and v follows z.
            if abs(p - 1.0) > _EXACT or abs(q * a - b * p) > _EXACT * abs(b):
                return None
            if not self._is_one_at(share, counting[2]):
                return None
            mean = a, b
        return LowPass(
            self.nodes[self.z],
            self.nodes[self.v],
            self.nodes[x],
            tuple(form.get((n,), 0.0) for form in steady for n in (self.z, self.v)),
            tuple(form.get((x,), 0.0) for form in steady),
            mean,
            counting,
            g,
            frozenset(self.aliases | {self.following[n].number for n in (self.z, self.v)}),
        )

    def _is_one_at(self, share: Node, counter: int) -> bool:
        """Whether g is 1 where the counter is 0."""
        cut = [self.nodes[counter]]
        if self.forms.leaves[share.number] != {counter}:
            return False
        lower, upper = interval_at(share, cut, 0.0)
        return abs(lower - 1.0) <= _EXACT and abs(upper - 1.0) <= _EXACT
