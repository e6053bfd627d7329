"""The first value of a program that leaves its float twin by more than its format explains.

The words of every update are known. Each traced node that a word holds is computed again in
float64 from the *words* that it reads, so that every operation is judged by itself, whatever errors
came before it. Where word and twin differ by more than rounding, something happened there: the word
was clamped, an argument lay below the floor of a function, or the float twin is no number.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from boresight.model.lowering.graph import ASIN_LIMIT, LEAVES, Node
from boresight.model.words.fixed import IntArray
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Program, Value

__all__ = ["WINDOW", "Culprit", "find_culprit", "outside"]

FloatArray = npt.NDArray[np.float64]

#: Updates that are looked at, the last of them being the one that went wrong.
WINDOW = 4096
#: Least significant bits that rounding, tables and constants explain.
_ROUNDING_LSB = 64.0
#: Share of a declared range by which rounding may leave it.
_RANGE_SLACK = 1e-3
#: Share of the word below which an argument is too coarse to be normalised.
_FEW = 0.375
#: Functions that normalise their argument.
_NORMALISED = ("rsqrt", "reciprocal")


@dataclass(frozen=True)
class Culprit:
    """What went wrong first.

    Attributes
    ----------
    step : int
        Update.
    value : str
        Name of the value in the program.
    line : str
        Where its author wrote it.
    why, cure : str
    """

    step: int
    value: str
    line: str
    why: str
    cure: str

    def __str__(self) -> str:
        where = f" ({self.line})" if self.line else ""
        return f"step {self.step}, value {self.value}{where}: {self.why}; {self.cure}"


def find_culprit(
    program: Program, nodes: dict[int, Node], inputs: IntArray, states: IntArray
) -> Culprit | None:
    """Look for the first update, and in it the first operation, that leaves its float twin.

    Where none does, a root or reciprocal whose argument holds few significant bits in the last
    update is to blame: what follows it is as coarse.

    Parameters
    ----------
    program, nodes
        As `Estimator.compile_traced` gives them.
    inputs : int64 (n, n_inputs)
        Input words; the last update is one that is known to be wrong.
    states : int64 (n, n_states)
        State words after each update.
    """
    n = len(inputs)
    first = max(0, n - WINDOW)
    machine = Interpreter(program, n - first)
    for k, (state, _) in enumerate(program.states):
        before = states[first - 1 : n - 1, k] if first else states[: n - 1, k]
        if not first:
            before = np.concatenate([[program.values[state].initial], before])
        machine.values[state] = before.astype(np.int64)
    machine.update(inputs[first:].T)
    words = machine.values_before_commit()
    twin = _Twin(program, nodes, words)
    found: list[tuple[int, int, int, Callable[[int, int, int], Culprit]]] = []
    for place, op in enumerate(program.ops):
        if op.dest in nodes:
            for wrong, said in (
                (twin.beyond(op.dest), twin.explain_range),
                (twin.leaves(op.dest), twin.explain),
            ):
                if wrong.any():
                    found.append((int(np.argmax(wrong)), place, op.dest, said))
    if not found:
        return twin.weakest(n - first - 1, first)
    step, _, value, explain = min(found, key=lambda f: f[:2])
    return explain(value, step, first)


class _Twin:
    """Float64 values of nodes, computed from the words of the values that they read."""

    def __init__(self, program: Program, nodes: dict[int, Node], words: list[IntArray]) -> None:
        self.program, self.nodes, self.words = program, nodes, words
        self._value_of = {node.number: number for number, node in reversed(nodes.items())}

    @property
    def _limits(self) -> tuple[int, int]:
        return self.program.arithmetic.min_int, self.program.arithmetic.max_int

    def real(self, value: int) -> FloatArray:
        """A value's words in its unit."""
        return self.program.format(value).real(self.words[value])

    def leaves(self, value: int) -> npt.NDArray[np.bool_]:
        """In which updates a value is further from its twin than rounding explains."""
        node, exact = self.nodes[value], self.real(value)
        with np.errstate(all="ignore"):
            twin = self.computed(node)
            apart = np.where(np.isinf(twin), 0.0, np.abs(twin - exact))  # 1/0: as large as it gets
            if node.kind == "wrap" or node.unit == "ht":
                apart = np.abs((apart + 1.0) % 2.0 - 1.0)
            scale = np.maximum(self._size(node), np.abs(twin))
        lsb = math.ldexp(1.0, -self.program.values[value].frac)
        relative = math.ldexp(1.0, 8 - self.program.arithmetic.word)
        return ~(apart <= _ROUNDING_LSB * lsb + relative * scale)

    def beyond(self, value: int) -> npt.NDArray[np.bool_]:
        """In which updates a value is outside the range its author declared, if one did.

        Its word may hold that; what was sized by the range does not.
        """
        said = self.program.values[self._declared(value)]
        if not said.range_source.startswith("declared"):
            return np.zeros(1, dtype=np.bool_)
        return outside(self.real(value), said)

    def explain_range(self, value: int, step: int, first: int) -> Culprit:
        """A value outside its declared range, in words."""
        node, said = self.nodes[value], self.program.values[self._declared(value)]
        for part in self._parts(node):
            found = self._function_fault(part, step)
            if found is not None:
                return Culprit(first + step, self._name(value), part.line or node.line, *found)
        at_limit = int(self.words[value][step]) in self._limits
        with np.errstate(all="ignore"):
            reached = float((self.computed(node) if at_limit else self.real(value))[step])
        return Culprit(
            first + step,
            self._name(value),
            node.line,
            ("saturates: " if at_limit else "")
            + f"{reached:.6g} does not fit its range [{said.low:.6g}, {said.high:.6g}]",
            f"widen the range ({said.range_source}) or limit the value",
        )

    def _size(self, node: Node) -> FloatArray:
        """Magnitude of the terms of a sum, since they may cancel."""
        if node.kind != "sum":
            return np.zeros(1)
        return np.asarray(sum(np.abs(self.argument(a)) for a in node.args), dtype=np.float64)

    def argument(self, node: Node) -> FloatArray:
        """A node as the program holds it: its word, or, where it is part of another, computed."""
        if node.number in self._value_of:
            return self.real(self._value_of[node.number])
        return self.computed(node)

    def computed(self, node: Node) -> FloatArray:
        """A node from its arguments."""
        if node.kind == "const":
            return np.full(len(self.words[0]), node.value)
        if node.kind in LEAVES:
            return self.real(self._value_of[node.number])
        args = [self.argument(a) for a in node.args]
        return np.asarray(_COMPUTE[node.kind](node, args), dtype=np.float64)

    def explain(self, value: int, step: int, first: int) -> Culprit:
        """In words."""
        node = self.nodes[value]
        with np.errstate(all="ignore"):
            twin = float(self.computed(node)[step])
        name, said = self._name(value), self.program.values[self._declared(value)]
        for part in self._parts(node):
            found = self._function_fault(part, step)
            if found is not None:
                return Culprit(first + step, name, part.line or node.line, *found)
        why = f"float64 has {twin:.6g} where the word has {float(self.real(value)[step]):.6g}"
        cure = "see its operands in the report"
        if int(self.words[value][step]) in self._limits:
            why = f"saturates: {twin:.6g} does not fit its range [{said.low:.6g}, {said.high:.6g}]"
            cure = f"widen the range ({said.range_source}) or limit the value"
        elif math.isnan(twin):
            why, cure = "no number in float64", "keep its arguments in their domain"
        return Culprit(first + step, name, node.line, why, cure)

    def weakest(self, step: int, first: int) -> Culprit | None:
        """The root or reciprocal whose argument has the fewest bits, if they are few."""
        found: list[tuple[int, int, Node]] = []
        for value, node in self.nodes.items():
            for part in self._parts(node):
                held = self._value_of.get(part.args[0].number) if part.kind in _NORMALISED else None
                if held is not None:
                    found.append((int(abs(self.words[held][step])).bit_length(), value, part))
        few = [f for f in found if f[0] <= _FEW * self.program.arithmetic.word]
        if not few:
            return None
        bits, value, part = min(few, key=lambda f: f[0])
        why = f"{part.kind}: argument {float(self.argument(part.args[0])[step]):.3g} has only "
        return Culprit(
            first + step, self._name(value), part.line, f"{why}{bits} significant bits", _cure(part)
        )

    def _declared(self, value: int) -> int:
        """The state that a value becomes; the value itself where it becomes none."""
        return next((state for state, after in self.program.states if after == value), value)

    def _name(self, value: int) -> str:
        """What a value is called, in words where its author gave it no name."""
        said, state = self.program.values[value].name, self._declared(value)
        if state != value:
            return f"state {self.program.values[state].name}"
        node = self.nodes[value]
        return said if node.name else f"{said}, {_role(node)}"

    def _parts(self, node: Node) -> list[Node]:
        """The node and those that are computed as part of it, arguments first."""
        out: list[Node] = []
        for arg in node.args:
            if arg.number not in self._value_of and arg.kind != "const":
                out += self._parts(arg)
        return [*out, node]

    def _function_fault(self, node: Node, step: int) -> tuple[str, str] | None:
        """What an argument out of a function's domain explains: why, cure."""
        if node.kind not in ("rsqrt", "reciprocal", "asin"):
            return None
        arg = node.args[0]
        x = float(self.argument(arg)[step])
        full = max(abs(arg.low), abs(arg.high))
        name = arg.name or f"the argument ({arg.line})"
        if node.kind == "rsqrt" and x < 0.0:
            return f"rsqrt: argument {x:.3g} is negative", f"keep {name} at 0 or above"
        if node.kind == "asin":
            inside = 0.0 <= x <= ASIN_LIMIT
            said = f"asin: argument {x:.3g} is outside 0 to {ASIN_LIMIT}"
            return None if inside else (said, f"limit {name}")
        bits = self.program.arithmetic.norm_max
        if x == 0.0 or abs(x) >= math.ldexp(full, -bits):
            return None
        return (
            f"{node.kind}: argument {abs(x) / full:.2g} of full scale is below the floor 2^-{bits}",
            _cure(node),
        )


def _cure(node: Node) -> str:
    """What gives the argument of a root or reciprocal more bits."""
    arg = node.args[0]
    name = arg.name or f"the argument ({arg.line})"
    return f"scale {name} up, or declare a narrower range than [{arg.low:.3g}, {arg.high:.3g}]"


def outside(values: FloatArray, said: Value) -> npt.NDArray[np.bool_]:
    """Which values lie outside a declared range by more than rounding."""
    slack = _RANGE_SLACK * (said.high - said.low)
    return (values < said.low - slack) | (values > said.high + slack)


def _role(node: Node) -> str:
    return {"mul": "a product", "sum": "a sum", "select": "a selection"}.get(node.kind, node.kind)


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
    "wrap": lambda node, a: (a[0] + 1.0) % 2.0 - 1.0,
    "bounded": lambda node, a: a[0],
    "saturated": lambda node, a: np.clip(a[0], -node.value, node.value),
    "sin": lambda node, a: np.sin(np.pi * (a[0] + 0.5 * node.quarter)),
    "asin": lambda node, a: np.arcsin(a[0]) / np.pi,
    # As `ops.rsqrt` of zero; of what is negative there is none.
    "rsqrt": lambda node, a: np.where(a[0] < 0.0, np.nan, 1.0 / np.sqrt(np.maximum(a[0], 1e-300))),
    "reciprocal": lambda node, a: 1.0 / a[0],
}
