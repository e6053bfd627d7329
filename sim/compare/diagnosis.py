"""What went wrong first in a program, and which of its values waste bits; each with a cure.

Where a word and its float twin (`sim.compare.twin`) differ by more than rounding, something
happened there: the word was clamped, an argument lay below the floor of a function, or the twin is
no number. A word whose upper bits no log uses rounds coarser than it must: there a narrower range
gives more bits.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from boresight.firmware.build import WordRanges
from boresight.model.arrays import BoolArray
from boresight.model.declarations import PERIODS
from boresight.model.estimator import Estimator
from boresight.model.kalman.update import CLAIMED, INDEFINITE, SPREAD
from boresight.model.lowering.graph import ASIN_LIMIT, LEAVES, Node, declared_name
from boresight.model.lowering.profile import Range
from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Kind, Overflow, Program
from boresight.sim.accuracy.covariance import has_covariance
from boresight.sim.compare.twin import KINDS, Twin, authors_name, becomes, parts_of, twins
from boresight.sim.ranges.intervals import Ends, ends_of

#: Bits above the largest value of a log that are no waste: other logs go further.
MARGIN_BITS = 2
#: Values that messages name.
NAMED = 3
#: Cure of a value that `Measurement.sd_max` bounds.
RAISE = "raise sd_max of this Measurement"
#: What helps where a covariance by hand is not exact enough.
_MODEL = "write the model with boresight.kalman, or one scalar update for each measurement"
#: Widest word, bits.
_WIDEST = 32
#: Share of the word below which an argument is too coarse to be normalised.
_FEW = 0.375
#: Functions that normalise their argument.
_NORMALISED = {"rsqrt": "root", "reciprocal": "division"}
#: Multiple of the floor of a normalised argument below which it counts as near.
_NEAR = 4.0


@dataclass(frozen=True)
class Culprit:
    """What went wrong first: update, name of the value, its author's line, reason, cure."""

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
    pieces: Iterable[tuple[IntArray, IntArray, BoolArray]],
    wrong: Sequence[int],
    among: Collection[int] | None = None,
    remedies: Mapping[str, str] = MappingProxyType({}),
) -> Culprit | None:
    """Look for the first update, and in it the first operation, that leaves its float twin.

    Where none does up to an update that is wrong, a root or reciprocal whose argument holds few
    significant bits in it is to blame: what follows it is as coarse.

    Parameters
    ----------
    program, nodes
        As `Estimator.compile_traced` gives them.
    pieces : iterable of (int64 (n, n_inputs), int64 (n, n_states), bool (n,))
        Input words, state words after each update, and updates that begin from the initial
        states; from the first update on.
    wrong : sequence of int
        Updates that are known to be wrong, in their order.
    among : collection of int, optional
        Values that may be to blame; by default all.
    remedies : mapping of str to str
        `Estimator.remedies`.
    """
    start, before, ahead = 0, None, list(wrong)
    for inputs, states, anew in pieces:
        at = 0
        while ahead and at < len(inputs):
            stop = min(len(inputs), ahead[0] + 1 - start)
            here = slice(at, stop)
            rows = inputs[here], states[here], before, start + at, anew[here]
            for twin in twins(program, nodes, *rows):
                if (culprit := _first_leaving(twin, among, remedies)) is not None:
                    return culprit
            if start + stop > ahead[0]:
                culprit = _weakest(twin, ahead.pop(0) - twin.first, among, remedies)
                if culprit is not None:
                    return culprit
            before, at = states[stop - 1], stop
        start += len(inputs)
        if not ahead:
            break
    return None


def _first_leaving(
    twin: Twin,
    among: Collection[int] | None = None,
    remedies: Mapping[str, str] = MappingProxyType({}),
) -> Culprit | None:
    """The first operation of some updates that leaves its twin or its range."""
    candidates = [
        (int(np.argmax(wrong)), op.dest, ranged)
        for op in twin.program.ops
        if op.dest in twin.nodes and (among is None or op.dest in among)
        for wrong, ranged in ((twin.beyond(op.dest), True), (twin.leaves(op.dest), False))
        if wrong.any()
    ]
    if not candidates:
        return None
    step, value, ranged = min(candidates, key=lambda f: f[0])  # the first op of several
    for part in parts_of(twin.nodes[value], twin.value_of):
        if (fault := _function_fault(twin, part, step, remedies)) is not None:
            return _named(twin, value, step, *fault, line=part.line)
    arithmetic = twin.program.arithmetic
    at_limit = int(twin.words[value][step]) in (arithmetic.min_int, arithmetic.max_int)
    with np.errstate(all="ignore"):
        exact = float(np.broadcast_to(twin.computed(twin.nodes[value]), len(twin.words[0]))[step])
    held = float(twin.real(value)[step])
    said = twin.program.values[twin.declared(value)]
    if ranged or at_limit:
        why = (
            f"{'saturates: ' * at_limit}{exact if at_limit else held:.6g} does not fit its range "
            f"[{said.low:.6g}, {said.high:.6g}]"
        )
        cure = f"widen the range ({said.range_source}) or limit the value"
        cure = RAISE if twin.nodes[value].unless == CLAIMED else cure
        if said.unit in PERIODS and max(-said.low, said.high) <= 0.5 * PERIODS[said.unit]:
            wrap = {"ht": "wrap_ht", "turn": "wrap_turns"}[said.unit]
            cure = f"an angle of a whole turn is wrapped: ops.{wrap}"
    elif math.isnan(exact):
        why, cure = "no number in float64", "keep its arguments in their domain"
    else:
        why = f"float64 has {exact:.6g} where the word has {held:.6g}"
        cure = "see its operands in the report"
    return _named(twin, value, step, why, cure)


def _named(
    twin: Twin, value: int, step: int, why: str, cure: str, line: str | None = None
) -> Culprit:
    """A culprit, with the name that its author gave, or in words where there is none."""
    node, name = twin.nodes[value], authors_name(twin.program, twin.nodes, value)
    if twin.declared(value) == value and node.title and not node.name:
        name = f"{name}, {KINDS.get(node.kind, node.kind)}"
    return Culprit(twin.first + step, name, line or node.line, why, cure)


def _function_fault(
    twin: Twin, node: Node, step: int, remedies: Mapping[str, str]
) -> tuple[str, str] | None:
    """What an argument out of its function's domain explains, with the cure."""
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
        _more_bits(node, remedies),
    )


def _weakest(
    twin: Twin, step: int, among: Collection[int] | None, remedies: Mapping[str, str]
) -> Culprit | None:
    """The root or reciprocal whose argument has the fewest bits, if they are few."""
    candidates: list[tuple[int, int, Node]] = []
    for value, node in twin.nodes.items():
        for part in parts_of(node, twin.value_of) if among is None or value in among else ():
            held = twin.value_of.get(part.args[0].number) if part.kind in _NORMALISED else None
            if held is not None:
                candidates.append((int(abs(twin.words[held][step])).bit_length(), value, part))
    few = [f for f in candidates if f[0] <= _FEW * twin.program.arithmetic.word]
    if not few:
        return None
    bits, value, part = min(few, key=lambda f: f[0])
    why = f"{part.kind}: argument {float(twin.argument(part.args[0])[step]):.3g} has only "
    why += f"{bits} significant bits"
    return _named(twin, value, step, why, _more_bits(part, remedies), line=part.line)


def near_floor(
    program: Program,
    nodes: Mapping[int, Node],
    ranges: WordRanges,
    reached: Mapping[int, Range],
    remedies: Mapping[str, str],
) -> str:
    """The root or reciprocal whose argument came nearest to its floor, within `_NEAR`; or empty."""
    value_of = {node.number: number for number, node in nodes.items()}
    bits, worst = program.arithmetic.norm_max, (_NEAR, "")
    for part in (p for node in nodes.values() for p in parts_of(node, value_of)):
        held = value_of.get(part.args[0].number) if part.kind in _NORMALISED else None
        if held is None:
            continue
        low, high = reached[held]
        size, at = (low, ranges.low_at) if low > 0.0 else (max(-high, 0.0), ranges.high_at)
        full = max(abs(part.args[0].low), abs(part.args[0].high))
        share = math.ldexp(size / full, bits) if math.isfinite(full) and full else _NEAR
        if 0.0 < share < worst[0]:
            text = (
                f"{part.line}: the argument of a {_NORMALISED[part.kind]}, {size:.3g} in step "
                f"{int(at[held])}, is only {share:.2g} times the least that "
                f"{program.arithmetic.word} bits normalise; {_more_bits(part, remedies)}"
            )
            worst = share, text
    return worst[1]


def _more_bits(node: Node, remedies: Mapping[str, str]) -> str:
    """What gives the argument of a root or reciprocal more bits."""
    arg = node.args[0]
    if node.kind == "rsqrt" and node.line in remedies:
        return (
            f"for a narrower range of {SPREAD} than [{arg.low:.3g}, {arg.high:.3g}] "
            f"{remedies[node.line]}"
        )
    name = arg.name or f"the argument ({arg.line})"
    return f"scale {name} up, or declare a narrower range than [{arg.low:.3g}, {arg.high:.3g}]"


@dataclass(frozen=True)
class Wasted:
    """A value whose format has more bits than its values need.

    Attributes
    ----------
    number : int
        Of the value in the program.
    name, line : str
        What its author calls it, and where it is written.
    bits : int
        Wasted bits: those that no update used, without a margin of `MARGIN_BITS`.
    low, high : float
        A range that takes them, in the value's unit.
    cure : str
        What its author may write.
    """

    number: int
    name: str
    line: str
    bits: int
    low: float
    high: float
    cure: str

    def __str__(self) -> str:
        where = f" ({self.line})" if self.line else ""
        return f"{self.name}{where} wastes {self.bits} bits: {self.cure}"


def reached_by(program: Program, ranges: WordRanges) -> dict[int, Range]:
    """Extremes of every value in its unit."""
    return {
        n: (float(program.format(n).real(low)), float(program.format(n).real(high)))
        for n, (low, high) in enumerate(zip(ranges.low, ranges.high, strict=True))
    }


def headroom_bits(program: Program, value: int, reached: Range) -> float:
    """How often the largest value seen could double before it left the format."""
    form = program.format(value)
    largest = max(-reached[0], reached[1] + form.lsb, form.lsb)
    return math.log2(-form.min / largest)


def wasted_bits(
    estimator: Estimator, program: Program, nodes: Mapping[int, Node], reached: Mapping[int, Range]
) -> list[Wasted]:
    """List the values that waste bits because of their own range, the worst first.

    Parameters
    ----------
    estimator : Estimator
    program, nodes
        As its `compile_traced` gives them.
    reached : mapping of int to (float, float)
        Extremes on the logs by the number of a value, in its unit; others are left out.
    """
    wasted = []
    declared = {i.name: i.line for i in estimator.inputs}
    declared |= {s.name: s.line for s in estimator.states}
    wrapping = {op.dest for op in program.ops if op.overflow is Overflow.WRAP}
    numbers = {node.number: n for n, node in sorted(nodes.items(), reverse=True)}
    for n, value in enumerate(program.values):
        if n not in reached or n in wrapping or value.kind in (Kind.PARAM, Kind.CONST):
            continue
        bits = math.floor(headroom_bits(program, n, reached[n])) - MARGIN_BITS
        if bits <= 0 or reached[n][0] == reached[n][1]:
            continue
        form, node = program.format(n), nodes.get(n)
        limit = _limit(program, n, bits)
        low, high = max(value.low, -limit), min(value.high, limit)
        if max(-low, high) > limit or 2.0 * max(-value.low, value.high) < -form.min:
            continue  # the format is wider than the range, where terms are aligned
        own = declared_name(program, nodes, n)
        name, line = f"{value.kind.value} {own}", declared.get(own, "")
        if value.kind is Kind.OP:
            if node is None or becomes(program, nodes, n) is not None:
                continue
            if not _is_source(program, node, reached, numbers, n):
                continue
            name, line = authors_name(program, nodes, n), node.line
        if cure := _cure(estimator, program, node, n, reached, low, high):
            wasted.append(Wasted(n, name, line, bits, low, high, cure))
    return sorted(wasted, key=lambda w: -w.bits)


def _limit(program: Program, value: int, bits: int) -> float:
    """Magnitude that gives the word of a value so many bits more."""
    return float(f"{0.999 * math.ldexp(-program.format(value).min, -bits):.4g}")


def _cure(
    estimator: Estimator,
    program: Program,
    node: Node | None,
    value: int,
    reached: Mapping[int, Range],
    low: float,
    high: float,
) -> str:
    """What gives a value more bits: a narrower range, or what it follows from; or nothing."""
    said, limits = program.values[value], f"[{low:.4g}, {high:.4g}]"
    elements = estimator.covariance_elements
    if said.kind is not Kind.OP and said.name in elements:
        cures = []
        for name, (i, j) in elements.items():
            if i == j and i in elements[said.name] and program.find(name) in reached:
                n = program.find(name)
                share = math.sqrt(2.0**MARGIN_BITS * reached[n][1] / program.values[n].high)
                cures += [f"multiply sd_max of {i} by {share:.2g}"] if share < 0.7 else []
        return " and ".join(cures)
    if node is not None and node.unless in (INDEFINITE, CLAIMED):
        known = estimator.remedies.get(node.line)
        return known or "lower sd_max of its states or of its Measurement"
    if said.kind is not Kind.OP or (node is not None and node.kind in ("bounded", "saturated")):
        return f"narrow its range to {limits}"
    return f"bound it to {limits} with ops.bounded"


def _is_source(
    program: Program,
    node: Node,
    reached: Mapping[int, Range],
    numbers: Mapping[int, int],
    value: int,
) -> bool:
    """Whether an operation wastes bits whatever ranges its operands have."""
    if node.kind in ("bounded", "saturated"):
        return True
    if node.kind in LEAVES:
        return False

    def ends(arg: Node) -> Ends:
        number = numbers.get(arg.number, -1)
        low, high = (arg.value,) * 2 if arg.kind == "const" else reached.get(number, (None, None))
        if low is None or high is None:
            return ends_of(arg, [*map(ends, arg.args)])
        return np.array([low]), np.array([high])

    with np.errstate(all="ignore"):
        low, high = ends_of(node, [*map(ends, node.args)])
    largest = max(-reached[value][0], reached[value][1], program.format(value).lsb)
    return bool(max(-low[0], high[0]) >= largest * 2.0 ** (MARGIN_BITS + 1))


def rounding_text(
    estimator: Estimator,
    program: Program,
    nodes: Mapping[int, Node],
    wasted: Sequence[Wasted],
    changes: IntArray,
    reached: Mapping[int, Range],
) -> str:
    """What to do where no single operation is to blame.

    Parameters
    ----------
    changes : int64 (n_states,)
        Largest change of each state in an update, last bits.
    """
    text = "no operation leaves its float twin: rounding adds up; "
    fitted = any(node.fit is not None for node in nodes.values())
    by_hand = not estimator.covariance_elements and has_covariance(estimator)
    model = f", or {_MODEL}" if by_hand else ""
    if by_hand and fitted:  # parts of products of matrices have no line of their own
        wasted = [w for w in wasted if program.values[w.number].kind is not Kind.OP]
    if wasted:
        fit = "" if fitted else "; or choose formats by boresight fit"
        return text + "; ".join(map(str, wasted[:NAMED])) + fit + model
    wider = "use a wider word, or " * (program.arithmetic.word < _WIDEST)
    if by_hand:
        return f"{text}its covariance is written by hand: {wider}{_MODEL}"
    computed = [
        k
        for k, (_, after) in enumerate(program.states)
        if after in nodes and nodes[after].kind not in LEAVES
    ]
    if not computed:
        return text + (wider.removesuffix(", or ") or "accept a larger tolerance")
    # The state whose changes have the fewest bits: each update rounds it, perhaps to one side.
    k = min(computed, key=lambda k: int(changes[k]))
    state, after = program.states[k]
    name = authors_name(program, nodes, after)
    where = f" ({nodes[after].line})" if nodes[after].line else ""
    unused, narrow = math.floor(headroom_bits(program, state, reached[state])), ""
    if unused > MARGIN_BITS:
        said, limit = program.values[state], _limit(program, state, unused - MARGIN_BITS)
        low, high = max(said.low, -limit), min(said.high, limit)
        cure = _cure(estimator, program, None, state, reached, low, high)
        narrow = f"{cure}, " if cure else ""
    return (
        f"{text}{name}{where} changes by at most {int(changes[k])} of its last bits in an update "
        f"and leaves {unused} bits unused: {narrow}{wider}carry the remainder in a second state "
        "(model.algebra.carried)"
    )
