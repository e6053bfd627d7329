"""Float64 twins of a program's values, each computed from the *words* that it reads.

Every operation is so judged by itself, whatever errors came before it. The words of all updates are
made at once: the states before each are known. `check_sound` refuses what no core could compute
right, before anything runs.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from boresight.model.arrays import BoolArray, FloatArray
from boresight.model.declarations import PERIODS
from boresight.model.errors import InputError, placed
from boresight.model.estimator import Estimator, Size
from boresight.model.lowering.graph import LEAVES, Node, declared_name
from boresight.model.lowering.resolution import check_resolution, limits
from boresight.model.recorded import check_recorded, evaluate, sample
from boresight.model.words.fixed import IntArray
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Program, Value
from boresight.model.words.tables import ASIN, SIN
from boresight.sim.levels.build import Build
from boresight.sim.rotations.zyx import wrapped

CHUNK = 4096  #: Updates whose words are held at a time.
ROUNDING_LSB = 64.0  #: Least significant bits that rounding, tables and constants explain.
RELATIVE_BITS = 8  #: And as much of a value's magnitude, or of the terms of a sum: 2^(this - W).
#: Share of a declared range by which rounding may leave it, or a limit of 1 a range to 0.999.
RANGE_SLACK = 2e-3
#: Kinds of values that messages call otherwise.
KINDS = {
    **{"mul": "a product", "sum": "a sum", "select": "a selection", "flip": "a change of sign"},
    **{"bounded": "a bounded value", "saturated": "a limited value", "abs": "a magnitude"},
    **{"wrap": "a wrapped angle", "rsqrt": "an inverse root", "reciprocal": "a quotient"},
    **{"asin": "an arc sine", "sin": "a sine"},
    "normalised": "a scaled value",
}
#: Functions that look up their argument itself, by the block of their table.
_TABLES: dict[int | None, str] = {SIN.block: "sin", ASIN.block: "asin"}


@dataclass(frozen=True, eq=False)
class Traced:
    """An estimator, its program and the nodes of that: see `Estimator.compile_traced`.

    ``needs`` says of each of the estimator's sizes what suffices on the logs, where that is known.
    """

    estimator: Estimator
    program: Program
    nodes: dict[int, Node]
    needs: Mapping[Size, float] = field(default_factory=dict)

    @classmethod
    def of(cls, build: Build, number: int) -> Traced:
        return cls(build.estimators[number], build.programs[number], build.nodes[number])

    @cached_property
    def value_of(self) -> dict[int, int]:
        """The first value that holds a node, by the node's number."""
        return {node.number: number for number, node in reversed([*self.nodes.items()])}

    @cached_property
    def read_by(self) -> dict[tuple[int, str], int]:
        """The value that a kind of function reads of a node, by the node's number and the kind.

        Where the function wants a format of its own it is a copy.
        """
        reads = {(op.index, _TABLES.get(op.table)) for op in self.program.ops}
        reads |= {(op.norm, "rsqrt") for op in self.program.ops}
        return {
            (node.number, kind): value
            for value, node in self.nodes.items()
            for kind in ("sin", "asin", "rsqrt")
            if (value, kind) in reads
        }

    def becomes(self, value: int) -> int | None:
        """The state that a value, or a copy of it, replaces; None if there is none."""
        node = self.nodes.get(value)
        same = {value, *(n for n, other in self.nodes.items() if other is node)}
        return next((state for state, after in self.program.states if after in same), None)

    def declared(self, value: int) -> int:
        """The state that a value, or a copy of it, becomes; the value itself where it is none."""
        state = self.becomes(value)
        return value if state is None else state

    def name(self, value: int) -> str:
        """What its author calls a value: a state, name or output; or its kind, in the nearest."""
        state, node = self.becomes(value), self.nodes.get(value)
        if state is not None:
            return f"state {declared_name(self.program, self.nodes, state)}"
        is_named = node is not None and (node.name or node.title)
        named = None if is_named else self._nearest(value)
        if named is None:
            return declared_name(self.program, self.nodes, value)
        kind = "a part" if node is None else KINDS.get(node.kind, node.kind)
        return f"{kind} in {self.name(named).removeprefix('state ')}"

    def place(self, value: int) -> str:
        """What its author calls a value, and where it, or what it is a part of, is written."""
        node = self.nodes.get(value)
        if node is None and (of := self._nearest(value)) is not None:
            node = self.nodes[of]
        is_next = self.becomes(value) is not None
        name = self.name(value)
        return name if is_next or node is None or not node.line else f"{name}, {node.line}"

    def _nearest(self, value: int) -> int | None:
        """The first value made of a value that has a name of its author's."""
        reached = {value}
        for op in self.program.ops:
            if not reached.isdisjoint(op.operands()):
                reached.add(op.dest)
                node = self.nodes.get(op.dest)
                if node is not None and (node.name or node.title):
                    return op.dest
        return None


class Twin:
    """Some updates of a program, the first of which has number ``first``.

    ``words`` are int64 (n,) by value number.
    """

    def __init__(self, of: Traced, words: list[IntArray], first: int = 0) -> None:
        self.of, self.program, self.nodes = of, of.program, of.nodes
        self.words, self.first = words, first

    def real(self, value: int) -> FloatArray:
        """A value's words in its unit."""
        return self.program.format(value).real(self.words[value])

    def argument(self, node: Node) -> FloatArray:
        """A node as the program holds it: its word, or, where it is part of another, computed."""
        value = self.of.value_of.get(node.number)
        return self.computed(node) if value is None else self.real(value)

    def computed(self, node: Node) -> FloatArray:
        if node.kind == "const":
            return np.full(len(self.words[0]), node.value)
        if node.kind in LEAVES:
            return self.real(self.of.value_of[node.number])
        copies = [self.of.read_by.get((arg.number, node.kind)) for arg in node.args]
        args = [
            self.argument(arg) if copy is None else self.real(copy)
            for arg, copy in zip(node.args, copies, strict=True)
        ]
        return np.asarray(_COMPUTE[node.kind](node, args), dtype=np.float64)

    def deviation(self, value: int) -> tuple[FloatArray, FloatArray]:
        """How far a value is from its twin, and how large the twin or its terms are."""
        node = self.nodes[value]
        with np.errstate(all="ignore"):
            twin = self.computed(node)
            error = np.abs(twin - self.real(value))
            error = np.where(np.isinf(twin), 0.0, error)  # 1/0: as large as it gets
            if node.unit in PERIODS:
                error = np.abs(wrapped(error, PERIODS[node.unit]))
            # The terms of a sum may cancel.
            terms = node.args if node.kind == "sum" else []
            size = sum((np.abs(self.argument(a)) for a in terms), np.zeros(1))
            return error, np.maximum(size, np.abs(twin))

    def leaves(self, value: int) -> BoolArray:
        """In which updates a value is further from its twin than rounding explains."""
        error, size = self.deviation(value)
        word, node = self.program.arithmetic.word, self.nodes[value]
        # What is limited is as coarse as its own range.
        inner = parts_of(node, self.of.value_of)[:-1] if node.kind == "saturated" else []
        full = max((max(-part.low, part.high) for part in inner), default=0.0)
        lsb = max(self.program.format(value).lsb, math.ldexp(full, 1 - word))
        relative = math.ldexp(1.0, RELATIVE_BITS - word)
        return ~(error <= ROUNDING_LSB * lsb + relative * size)

    def beyond(self, value: int) -> BoolArray:
        """In which updates a value is outside the range its author declared, if one did.

        Its word may hold that; what was sized by the range does not.
        """
        declared = self.program.values[self.of.declared(value)]
        if not declared.range_source.startswith("declared"):
            return np.zeros(1, dtype=np.bool_)
        return outside(self.real(value), declared)


def parts_of(node: Node, values: Container[int]) -> list[Node]:
    """A node and the nodes that are computed as part of it, which no value holds."""
    inner = [a for a in node.args if a.number not in values and a.kind != "const"]
    return [*(part for arg in inner for part in parts_of(arg, values)), node]


def twins(
    of: Traced,
    inputs: IntArray,
    states: IntArray,
    before: IntArray | None = None,
    first: int = 0,
    anew: BoolArray | None = None,
) -> Iterator[Twin]:
    """All updates, the first of which has number ``first``, in chunks of `CHUNK`.

    ``inputs`` (n, n_inputs) and ``states`` (n, n_states), those after each update, are words, as
    the states ``before`` the first one are, by default the initial ones. In updates that are
    ``anew``, (n,), the initial ones come before, too.
    """
    program = of.program
    initial = np.array([program.values[s].initial for s, _ in program.states], dtype=np.int64)
    before = np.concatenate([(initial if before is None else before)[None], states[:-1]])
    if anew is not None:
        before[anew] = initial
    for start in range(0, len(inputs), CHUNK):
        some = slice(start, start + CHUNK)
        machine = Interpreter(program, len(inputs[some]))
        for k, (state, _) in enumerate(program.states):
            machine.values[state] = before[some, k]
        machine.update(inputs[some].T)
        yield Twin(of, machine.values_before_commit(), first + start)


def made_of(program: Program, values: Iterable[int]) -> set[int]:
    """Some values, and all that they are made of, in the same update or earlier."""
    needed, count = {*values}, 0
    while count < len(needed):
        count = len(needed)
        for op in reversed(program.ops):
            if op.dest in needed:
                needed.update(op.operands())
        needed.update(after for state, after in program.states if state in needed)
    return needed


def outside(values: FloatArray, declared: Value) -> BoolArray:
    """Which values lie outside a declared range by more than rounding."""
    slack = RANGE_SLACK * (declared.high - declared.low)
    return (values < declared.low - slack) | (values > declared.high + slack)


def _sum(node: Node, args: list[FloatArray]) -> FloatArray:
    return np.asarray(sum(s * a for s, a in zip(node.signs, args, strict=True)), dtype=np.float64)


#: Each kind of node in float64.
_COMPUTE: dict[str, Callable[[Node, list[FloatArray]], object]] = {
    "sum": _sum,
    # 0 times 1/0 is 0, as in the words and in the reference, whose roots have a floor.
    "mul": lambda node, a: np.where((a[0] == 0.0) | (a[1] == 0.0), 0.0, a[0] * a[1]),
    "select": lambda node, a: np.where(a[0] < 0.0, a[1], a[2]),
    "flip": lambda node, a: np.where(a[0] < 0.0, -a[1], a[1]),
    "abs": lambda node, a: np.abs(a[0]),
    "wrap": lambda node, a: (a[0] + 0.5 * node.value) % node.value - 0.5 * node.value,
    "bounded": lambda node, a: a[0],
    "saturated": lambda node, a: np.clip(a[0], -node.value, node.value),
    "sin": lambda node, a: np.sin(np.pi * (a[0] + 0.5 * node.quarter)),
    "asin": lambda node, a: np.arcsin(a[0]) / np.pi,
    # As `ops.rsqrt` of zero; of what is negative there is none.
    "rsqrt": lambda node, a: np.where(a[0] < 0.0, np.nan, 1.0 / np.sqrt(np.maximum(a[0], 1e-300))),
    "reciprocal": lambda node, a: 1.0 / a[0],
    # By the power of two that brings the size into [1/2, 1).
    "normalised": lambda node, a: np.ldexp(a[0], -np.frexp(a[1])[1]),
}


#: Drawn updates in which words have to move, and the fewest of them without a saturation.
ROWS, FEWEST_CLEAN = 128, 16
#: Share of these updates in which float64 has to leave a word that stands still.
MOVING_SHARE = 0.1
FACTOR = 4.0  #: How many times the accepted error it has to leave it by.


def check_sound(build: Build, inputs: Sequence[FloatArray] | None = None) -> None:
    """Refuse estimators whose record is not their step, or whose words cannot hold what they are.

    ``inputs`` (rows, n_inputs) of each estimator are in their units, for its parameters as chosen;
    by default drawn from the declared ranges. Raises InputError as `model.recorded.check_recorded`
    and `model.lowering.resolution.check_resolution`, or where the word of an output or next state
    stands still and float64 moves by more than it may be off: in updates of drawn states in which
    nothing saturates.
    """
    for k, estimator in enumerate(build.estimators):
        own, chosen = None if inputs is None else inputs[k], build.values[k]
        check_recorded(estimator, own, None if own is None else chosen)
        check_resolution(build.programs[k], build.nodes[k])
        _check_moving(Traced.of(build, k), sample(estimator, own, chosen))


def _check_moving(of: Traced, leaves: Mapping[tuple[str, str], FloatArray]) -> None:
    """Raise InputError where a word stands still that moves in float64."""
    estimator, program, nodes = of.estimator, of.program, of.nodes
    leaves = {name: values[:ROWS] for name, values in leaves.items()}
    rows = len(next(iter(leaves.values())))
    machine = Interpreter(program, rows)
    for (number, _), state in zip(program.states, estimator.states, strict=True):
        machine.values[number] = program.format(number).quantise(leaves["state", state.name])
    inputs = [
        program.format(number).quantise(leaves["input", i.name])
        for number, i in zip(program.inputs, estimator.inputs, strict=True)
    ]
    clean = ~machine.update(np.stack(inputs))[1]
    if np.count_nonzero(clean) < FEWEST_CLEAN:
        return
    twin = Twin(of, [words[clean] for words in machine.values_before_commit()])
    trace = estimator.trace()
    results = [*trace.outputs.values(), *(after for _, _, after in trace.states)]
    with np.errstate(all="ignore"):
        values = evaluate(trace, leaves)
        for (number, limit, what), result in zip(limits(program, nodes), results, strict=True):
            exact = np.broadcast_to(values[result.number], rows)[clean]
            form = program.format(number)
            error = np.abs(np.clip(exact, form.min, form.max) - twin.real(number))
            decided = number not in nodes  # a constant, by a claim that is compared on its own
            if (
                not decided
                and _still(twin, number)
                and np.mean(error > FACTOR * limit) > MOVING_SHARE
            ):
                lost = next(_lost(twin, number), number)
                said, line = program.values[lost], nodes[lost].line if lost in nodes else ""
                raise InputError.at(
                    placed(line, f"{program.name}, value {said.name}"),
                    wanted=f"an LSB that resolves its changes, for {what}",
                    found=f"{program.format(lost).lsb:.3g}, for the range {nodes[lost].range}",
                    fix="limit what it is made of with ops.bounded or ops.clip",
                )


def _still(twin: Twin, number: int) -> bool:
    return int(np.ptp(twin.words[number])) == 0


def _lost(twin: Twin, number: int) -> Iterator[int]:
    """Values that a value is made of which stand still though their arguments move, first first."""
    needed = {number}
    for op in reversed(twin.program.ops):
        if op.dest in needed:
            needed.update(op.operands())
    for op in twin.program.ops:
        part = op.dest in needed and op.dest in twin.nodes and _still(twin, op.dest)
        if part and np.ptp(twin.computed(twin.nodes[op.dest])) > 0.0:
            yield op.dest
