"""Which values' rounding makes the error of an output: the adjoint of a program over a record.

Each word is rounded by itself, in every update. What a last bit of it does to an output, then and
in all later updates, is the derivative of that output: one backward pass through the nodes of an
update, and from update to update through the states. Squares of the effects add up, as those of
independent errors do.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.lowering.graph import LEAVES, Node
from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Program
from boresight.sim.compare.twin import Twin, function_arguments, rounding_errors, twins

__all__ = ["UPDATES", "Influence", "influences"]


#: Updates, at the end of a record, over which errors are followed.
UPDATES = 1500
#: Node values that are held at a time; of larger programs fewer updates count.
_MOST = 4_000_000
#: Random signs with which the errors of an output are summed, and their seed.
_SIGNS, _SEED = 4, 1


@dataclass(frozen=True)
class Influence:
    """What the rounding of one value does to one output.

    Attributes
    ----------
    value : str
        Name in the program.
    line : str
        Where its author wrote it.
    rms : float
        Root mean square of the error that it makes, in the output's unit.
    share : float
        Of the mean square of all.
    one_more_bit : float
        Root mean square of the whole error if this word had one more bit.
    """

    value: str
    line: str
    rms: float
    share: float
    one_more_bit: float


def influences(
    program: Program,
    nodes: Mapping[int, Node],
    inputs: IntArray,
    states: IntArray,
    before: IntArray | None = None,
) -> dict[str, list[Influence]]:
    """Influences on each output, the largest first; of a program with linked words none.

    These are copies in the format of another program (`model.linking`), which the graph lacks.

    Parameters
    ----------
    program, nodes
        As `Estimator.compile_traced` gives them.
    inputs : int64 (n, n_inputs)
        Input words, of which the last `UPDATES` count.
    states : int64 (n, n_states)
        State words after each update.
    before : int64 (n_states,), optional
        Those before the first one; by default the initial words.
    """
    node_of = dict(nodes)
    results = {*program.outputs, *(value for pair in program.states for value in pair)}
    if results - node_of.keys():
        return {}
    adjoint = _Adjoint(program, node_of, inputs, states, before)
    errors = rounding_errors(
        program, node_of, inputs[adjoint.some], states[adjoint.some], adjoint.before
    )
    out: dict[str, list[Influence]] = {}
    for k, name in enumerate(program.output_names):
        with np.errstate(all="ignore"):
            effects = adjoint.effects(k)
        rms = {n: effects.get(n, 0.0) * e.rms for n, e in errors.items()}
        # What grows without end over the updates is no number.
        some = {n: x for n, x in rms.items() if math.isfinite(x) and x > 0.0}
        out[name] = _sorted(program, node_of, some)
    return out


def _sorted(
    program: Program, nodes: Mapping[int, Node], rms: Mapping[int, float]
) -> list[Influence]:
    whole = math.fsum(x * x for x in rms.values())
    influential = [
        Influence(
            program.values[n].name, nodes[n].line, x, x * x / whole, math.sqrt(whole - 0.75 * x * x)
        )
        for n, x in rms.items()
    ]
    return sorted(influential, key=lambda i: -i.rms)


class _Adjoint:
    """Derivatives of a program's nodes over the last updates of a record."""

    def __init__(
        self,
        program: Program,
        nodes: dict[int, Node],
        inputs: IntArray,
        states: IntArray,
        before: IntArray | None,
    ) -> None:
        self.program, self.nodes = program, nodes
        self.order = _ordered(nodes, program)
        count = min(len(inputs), UPDATES, max(2, _MOST // len(self.order)))
        self.some = slice(len(inputs) - count, len(inputs))
        if before is None:
            initial = [program.values[s].initial for s, _ in program.states]
            before = np.array(initial, dtype=np.int64)
        self.before = np.concatenate([before[None], states])[len(inputs) - count]
        run = list(twins(program, nodes, inputs[self.some], states[self.some], self.before))
        self.count = count
        with np.errstate(all="ignore"):
            parts = [_slopes(self.order, twin) for twin in run]
        self.slopes = {
            key: np.nan_to_num(np.concatenate([p[key] for p in parts]), posinf=0.0, neginf=0.0)
            for key in parts[0]
        }
        operands = {*program.outputs, *(v for op in program.ops for v in op.operands())}
        first = {node.number: value for value, node in reversed(nodes.items())}
        #: What holds a node for whatever needs it, not for some states and functions alone.
        self.common = operands & {*first.values()}
        #: Functions that read each value.
        self.functions: dict[int, list[int]] = {}
        read = function_arguments(program, nodes)
        for node in self.order:
            for value in (read.get((a.number, node.kind)) for a in node.args):
                if value is not None:
                    self.functions.setdefault(value, []).append(node.number)
        self.leaf = [nodes[s].number for s, _ in program.states]
        #: Of each next state by each state: (updates, next, state).
        self.jacobian = np.zeros((count, len(self.leaf), len(self.leaf)))
        for k, (_, after) in enumerate(program.states):
            slopes = self.sweep({nodes[after].number: np.ones(count)})
            for j, leaf in enumerate(self.leaf):
                if leaf in slopes:
                    self.jacobian[:, k, j] = slopes[leaf]

    def sweep(self, seeds: Mapping[int, FloatArray]) -> dict[int, FloatArray]:
        """Derivatives (updates,) by every node of a sum of nodes with these weights."""
        adjoint = dict(seeds)
        for node in reversed(self.order):
            own = adjoint.get(node.number)
            if own is None:
                continue
            for k, arg in enumerate(node.args):
                slope = self.slopes.get((node.number, k))
                if slope is not None:
                    before = adjoint.get(arg.number)
                    adjoint[arg.number] = own * slope if before is None else before + own * slope
        return adjoint

    def effects(self, output: int) -> dict[int, float]:
        """By value: root mean square of an output's error where each word is off by 1, at random.

        The output's errors are summed with random signs, so that a square of the sum's derivative
        is on average the sum of the squares of all.
        """
        program, nodes = self.program, self.nodes
        number, rng = nodes[program.outputs[output]].number, np.random.default_rng(_SEED)
        direct = self.sweep({number: np.ones(self.count)})
        total: dict[int, float] = {}
        for _ in range(_SIGNS):
            sign = rng.choice([-1.0, 1.0], self.count)
            later = np.zeros((self.count + 1, len(self.leaf)))
            rows = [direct.get(leaf, np.zeros(self.count)) for leaf in self.leaf]
            own = np.reshape(rows, (len(rows), self.count)).T
            for t in range(self.count - 1, -1, -1):
                later[t] = sign[t] * own[t] + later[t + 1] @ self.jacobian[t]
            seeds: dict[int, FloatArray] = {number: sign}
            for k, (_, after) in enumerate(program.states):
                node = nodes[after].number
                seeds[node] = seeds.get(node, np.zeros(self.count)) + later[1:, k]
            slopes = self.sweep(seeds)
            for value, source in nodes.items():
                if value in self.common:
                    at = slopes.get(source.number)
                else:
                    at = self._of_copy(value, slopes, later[1:])
                if at is not None:
                    total[value] = total.get(value, 0.0) + float(np.mean(at * at))
        return {value: math.sqrt(square / _SIGNS) for value, square in total.items()}

    def _of_copy(
        self, copy: int, slopes: Mapping[int, FloatArray], later: FloatArray
    ) -> FloatArray:
        """Derivative by a copy, in another format, which some states and functions alone read.

        Or by what is part of other operations, and a word only to replace a state.
        """
        at = np.zeros(self.count)
        for k, (_, after) in enumerate(self.program.states):
            if after == copy:
                at += later[:, k]
        for function in self.functions.get(copy, ()):
            at += slopes.get(function, 0.0) * self.slopes[function, 0]
        return at


def _ordered(nodes: Mapping[int, Node], program: Program) -> list[Node]:
    """All nodes that outputs and next states need, arguments first."""
    ahead = [nodes[n] for n in (*program.outputs, *(after for _, after in program.states))]
    needed: dict[int, Node] = {}
    while ahead:
        node = ahead.pop()
        if node.number not in needed:
            needed[node.number] = node
            ahead += node.args
    return [needed[number] for number in sorted(needed)]


def _slopes(order: Sequence[Node], twin: Twin) -> dict[tuple[int, int], FloatArray]:
    """Derivative of each node by each of its arguments, from the words of updates."""
    values: dict[int, FloatArray] = {}
    for node in order:
        values[node.number] = twin.argument(node)
    return {
        (node.number, k): slope
        for node in order
        for k, slope in _slopes_of(node, [values[a.number] for a in node.args], values[node.number])
    }


def _slopes_of(
    node: Node, args: Sequence[FloatArray], value: FloatArray
) -> Iterator[tuple[int, FloatArray]]:
    """Number and derivative of the arguments that count; conditions have none."""
    if node.kind in LEAVES:
        return
    for k in range(len(args)):
        slope = _SLOPES[node.kind](node, args, value, k)
        if slope is not None:
            yield k, np.broadcast_to(np.asarray(slope, dtype=np.float64), value.shape)


def _of_select(node: Node, a: Sequence[FloatArray], y: FloatArray, k: int) -> object:
    return None if k == 0 else (a[0] < 0.0) == (k == 1)


def _of_flip(node: Node, a: Sequence[FloatArray], y: FloatArray, k: int) -> object:
    return None if k == 0 else np.where(a[0] < 0.0, -1.0, 1.0)


#: dy/da[k] of each kind of node; None: no number.
_SLOPES: dict[str, Callable[[Node, Sequence[FloatArray], FloatArray, int], object]] = {
    "sum": lambda node, a, y, k: float(node.signs[k]),
    "mul": lambda node, a, y, k: a[1 - k],
    "select": _of_select,
    "flip": _of_flip,
    "complement": _of_flip,
    "abs": lambda node, a, y, k: np.sign(a[0]),
    "wrap": lambda node, a, y, k: 1.0,
    "bounded": lambda node, a, y, k: 1.0,
    "saturated": lambda node, a, y, k: np.abs(a[0]) <= node.value,
    # sin(pi (x + q/2))' = pi sin(pi (x + (q + 1)/2))
    "sin": lambda node, a, y, k: np.pi * np.cos(np.pi * (a[0] + 0.5 * node.quarter)),
    "asin": lambda node, a, y, k: 1.0 / (np.pi * np.sqrt(np.maximum(1.0 - a[0] ** 2, 1e-12))),
    "rsqrt": lambda node, a, y, k: -0.5 * y / np.maximum(a[0], 1e-300),
    "reciprocal": lambda node, a, y, k: -y * y,
}
