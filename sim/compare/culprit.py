"""The first value of a program that leaves its float twin by more than its format explains.

Where word and twin (`sim.compare.twin`) differ by more than rounding, something happened there: the
word was clamped, an argument lay below the floor of a function, or the float twin is no number.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from boresight.model.declarations import PERIODS
from boresight.model.kalman.update import SPREAD
from boresight.model.lowering.expand import ASIN_LIMIT
from boresight.model.lowering.graph import Node
from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Program
from boresight.sim.compare.twin import KINDS, Twin, authors_name, parts_of, twins

#: Share of the word below which an argument is too coarse to be normalised.
_FEW = 0.375
#: Functions that normalise their argument.
_NORMALISED = ("rsqrt", "reciprocal")
_CALLED = {"rsqrt": "root", "reciprocal": "division"}
#: Multiple of the floor of a normalised argument below which it counts as near.
_NEAR = 4.0


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
        value = self.value if self.value.startswith(("a ", "an ")) else f"value {self.value}"
        return f"step {self.step}, {value}{where}: {self.why}; {self.cure}"


def find_culprit(
    program: Program,
    nodes: dict[int, Node],
    pieces: Iterable[tuple[IntArray, IntArray]],
    wrong: Sequence[int],
    among: Collection[int] | None = None,
) -> Culprit | None:
    """Look for the first update, and in it the first operation, that leaves its float twin.

    Where none does up to an update that is wrong, a root or reciprocal whose argument holds few
    significant bits in it is to blame: what follows it is as coarse.

    Parameters
    ----------
    program, nodes
        As `Estimator.compile_traced` gives them.
    pieces : iterable of (int64 (n, n_inputs), int64 (n, n_states))
        Input words, and state words after each update, from the first update on.
    wrong : sequence of int
        Updates that are known to be wrong, in their order.
    among : collection of int, optional
        Values that may be to blame; by default all.
    """
    start, before, ahead = 0, None, list(wrong)
    for inputs, states in pieces:
        at = 0
        while ahead and at < len(inputs):
            stop = min(len(inputs), ahead[0] + 1 - start)
            here = slice(at, stop)
            for twin in twins(program, nodes, inputs[here], states[here], before, start + at):
                if (culprit := _first_leaving(twin, among)) is not None:
                    return culprit
            if start + stop > ahead[0]:
                culprit = _weakest(twin, ahead.pop(0) - twin.first, among)
                if culprit is not None:
                    return culprit
            before, at = states[stop - 1], stop
        start += len(inputs)
        if not ahead:
            break
    return None


def _first_leaving(twin: Twin, among: Collection[int] | None = None) -> Culprit | None:
    """The first operation of some updates that leaves its twin or its range."""
    candidates: list[tuple[int, int, Callable[[Twin, int, int], Culprit]]] = []
    for op in twin.program.ops:
        if op.dest in twin.nodes and (among is None or op.dest in among):
            for wrong, said in (
                (twin.beyond(op.dest), _explain_range),
                (twin.leaves(op.dest), _explain),
            ):
                if wrong.any():
                    candidates.append((int(np.argmax(wrong)), op.dest, said))
    if not candidates:
        return None
    step, value, explain = min(candidates, key=lambda f: f[0])  # the first op of several
    return explain(twin, value, step)


def _explain_range(twin: Twin, value: int, step: int) -> Culprit:
    """A value outside its declared range, in words."""
    if (fault := _fault_within(twin, value, step)) is not None:
        return fault
    at_limit = _at_limit(twin, value, step)
    with np.errstate(all="ignore"):
        reached = twin.computed(twin.nodes[value]) if at_limit else twin.real(value)
    return _named(
        twin,
        value,
        step,
        ("saturates: " if at_limit else "") + _does_not_fit(twin, value, float(reached[step])),
        _wider(twin, value),
    )


def _explain(twin: Twin, value: int, step: int) -> Culprit:
    """A value that left its twin, in words."""
    if (fault := _fault_within(twin, value, step)) is not None:
        return fault
    with np.errstate(all="ignore"):
        exact = float(twin.computed(twin.nodes[value])[step])
    why = f"float64 has {exact:.6g} where the word has {float(twin.real(value)[step]):.6g}"
    cure = "see its operands in the report"
    if _at_limit(twin, value, step):
        why, cure = f"saturates: {_does_not_fit(twin, value, exact)}", _wider(twin, value)
    elif math.isnan(exact):
        why, cure = "no number in float64", "keep its arguments in their domain"
    return _named(twin, value, step, why, cure)


def _named(
    twin: Twin, value: int, step: int, why: str, cure: str, line: str | None = None
) -> Culprit:
    """A culprit, with the name that its author gave, or in words where there is none."""
    node, name = twin.nodes[value], authors_name(twin.program, twin.nodes, value)
    if twin.declared(value) == value and node.title and not node.name:
        name = f"{name}, {KINDS.get(node.kind, node.kind)}"
    return Culprit(twin.first + step, name, line or node.line, why, cure)


def _at_limit(twin: Twin, value: int, step: int) -> bool:
    arith = twin.program.arithmetic
    return int(twin.words[value][step]) in (arith.min_int, arith.max_int)


def _does_not_fit(twin: Twin, value: int, reached: float) -> str:
    said = twin.program.values[twin.declared(value)]
    return f"{reached:.6g} does not fit its range [{said.low:.6g}, {said.high:.6g}]"


def _wider(twin: Twin, value: int) -> str:
    said = twin.program.values[twin.declared(value)]
    if said.unit in PERIODS and max(-said.low, said.high) <= 0.5 * PERIODS[said.unit]:
        wrap = {"ht": "wrap_ht", "turn": "wrap_turns"}[said.unit]
        return f"an angle of a whole turn is wrapped: ops.{wrap}"
    return f"widen the range ({said.range_source}) or limit the value"


def _fault_within(twin: Twin, value: int, step: int) -> Culprit | None:
    """What an argument out of its function's domain explains, in any part of a value."""
    for part in twin.parts(twin.nodes[value]):
        fault = _function_fault(twin, part, step)
        if fault is not None:
            return _named(twin, value, step, *fault, line=part.line)
    return None


def _function_fault(twin: Twin, node: Node, step: int) -> tuple[str, str] | None:
    if node.kind not in (*_NORMALISED, "asin"):
        return None
    arg = node.args[0]
    x = float(twin.argument(arg)[step])
    full = max(abs(arg.low), abs(arg.high))
    name = arg.name or f"the argument ({arg.line})"
    if node.kind == "rsqrt" and x < 0.0:
        return f"rsqrt: argument {x:.3g} is negative", f"keep {name} at 0 or above"
    if node.kind == "asin":
        inside = 0.0 <= x <= ASIN_LIMIT
        said = f"asin: argument {x:.3g} is outside 0 to {ASIN_LIMIT}"
        return None if inside else (said, f"limit {name}")
    bits = twin.program.arithmetic.norm_max
    if abs(x) >= math.ldexp(full, -bits) or (x == 0.0 and arg.low <= 0.0 <= arg.high):
        return None
    return (
        f"{node.kind}: argument {abs(x) / full:.2g} of full scale is below the floor 2^-{bits}",
        _more_bits(node),
    )


def _weakest(twin: Twin, step: int, among: Collection[int] | None) -> Culprit | None:
    """The root or reciprocal whose argument has the fewest bits, if they are few."""
    candidates: list[tuple[int, int, Node]] = []
    for value, node in twin.nodes.items():
        for part in twin.parts(node) if among is None or value in among else ():
            held = twin.value_of.get(part.args[0].number) if part.kind in _NORMALISED else None
            if held is not None:
                candidates.append((int(abs(twin.words[held][step])).bit_length(), value, part))
    few = [f for f in candidates if f[0] <= _FEW * twin.program.arithmetic.word]
    if not few:
        return None
    bits, value, part = min(few, key=lambda f: f[0])
    why = f"{part.kind}: argument {float(twin.argument(part.args[0])[step]):.3g} has only "
    return _named(
        twin, value, step, f"{why}{bits} significant bits", _more_bits(part), line=part.line
    )


def near_floor(
    program: Program, nodes: Mapping[int, Node], least: Callable[[int], tuple[float, int]]
) -> str:
    """The root or reciprocal whose argument came nearest to its floor, within `_NEAR`; or empty.

    Parameters
    ----------
    least : callable
        Least magnitude of a value in a run, and its update.
    """
    value_of = {node.number: number for number, node in nodes.items()}
    parts = (p for node in nodes.values() for p in parts_of(node, value_of))
    bits, worst = program.arithmetic.norm_max, (_NEAR, "")
    for part in parts:
        held = value_of.get(part.args[0].number) if part.kind in _NORMALISED else None
        if held is None:
            continue
        size, step = least(held)
        full = max(abs(part.args[0].low), abs(part.args[0].high))
        share = math.ldexp(size / full, bits) if math.isfinite(full) and full else _NEAR
        if 0.0 < share < worst[0]:
            text = (
                f"{part.line}: the argument of a {_CALLED[part.kind]}, {size:.3g} in step {step}, "
                f"is only {share:.2g} times the least that {program.arithmetic.word} bits "
                f"normalise; {_more_bits(part)}"
            )
            worst = share, text
    return worst[1]


def _more_bits(node: Node) -> str:
    """What gives the argument of a root or reciprocal more bits."""
    arg = node.args[0]
    if arg.source.startswith(f"declared: {SPREAD}"):
        return (
            f"give this Measurement sd_max, the largest standard deviation of its h, for a "
            f"narrower range of h P h + r than [{arg.low:.3g}, {arg.high:.3g}]"
        )
    name = arg.name or f"the argument ({arg.line})"
    return f"scale {name} up, or declare a narrower range than [{arg.low:.3g}, {arg.high:.3g}]"
