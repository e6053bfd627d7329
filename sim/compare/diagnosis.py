"""What went wrong first in a program, and which of its values waste bits; each with a cure.

Where a word and its float twin (`sim.compare.twin`) differ by more than rounding, something
happened there: the word was clamped, an argument lay below the floor of a function, or the twin is
no number. A word whose upper bits no log uses rounds coarser than it must: there a narrower range
gives more bits.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from boresight.firmware.build import WordRanges
from boresight.model.arrays import BoolArray, FloatArray
from boresight.model.declarations import PERIODS
from boresight.model.estimator import Estimator, Size
from boresight.model.kalman.declared import HELD, RESERVE, exponent, upwards
from boresight.model.kalman.update import CLAIMED, INDEFINITE, PREDICTED, SPREAD
from boresight.model.lowering.graph import ASIN_LIMIT, LEAVES, Node, declared_name
from boresight.model.lowering.profile import OBSERVED, Range
from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Kind, Overflow, Program
from boresight.sim.accuracy.covariance import covariance_of
from boresight.sim.compare.twin import KINDS, Traced, Twin, parts_of, twins
from boresight.sim.fit.observe import Observer
from boresight.sim.ranges.intervals import Ends, ends_of

MARGIN_BITS = 2  #: Bits above the largest value of a log that are no waste: other logs go further.
NAMED = 3  #: Values that messages name.
_ADVISED = 6  #: Ranges that a message about rounding names, all of which may be narrowed at once.
IF_ALWAYS = ", if it holds for all logs and parameters"  #: Condition of a narrower range.
RAISE = "raise sd_max of this Measurement"  #: Cure of a value that `Measurement.sd_max` bounds.
WIDEN = "widen the range"  #: Cure of a value that its range does not hold.
#: What helps where a covariance by hand is not exact enough.
_MODEL = "write the model with boresight.kalman, or one scalar update for each measurement"
#: What else keeps it positive.
_POSITIVE = "use Joseph's form, or limit it by ops.maximum(p, FLOOR)"
_WIDEST = 32  #: Widest word, bits.
_FEW = 0.375  #: Share of the word below which an argument is too coarse to be normalised.
#: Functions that normalise their argument.
_NORMALISED = {"rsqrt": "root", "reciprocal": "division"}
_NEAR = 4.0  #: Multiple of the floor of a normalised argument below which it counts as near.


class Culprit(NamedTuple):
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
    of: Traced,
    pieces: Iterable[tuple[IntArray, IntArray, BoolArray]],
    wrong: Sequence[int],
    among: Collection[int] | None = None,
) -> Culprit | None:
    """Look for the first update, and in it the first operation, that leaves its float twin.

    Where none does up to an update that is wrong, a root or reciprocal whose argument holds few
    significant bits in it is to blame: what follows it is as coarse.

    ``pieces`` are input words (n, n_inputs), state words after each update (n, n_states) and
    updates that begin from the initial states (n,), from the first update on; ``wrong`` are the
    updates that are known to be wrong, in their order; values ``among`` may be to blame, by default
    all.
    """
    start, before, ahead = 0, None, list(wrong)
    for inputs, states, anew in pieces:
        for twin in twins(of, inputs, states, before, start, anew):
            culprit = _first_leaving(twin, among)
            stop = twin.first + len(twin.words[0]) if culprit is None else culprit.step
            while ahead and ahead[0] < stop:
                if (weakest := _weakest(twin, ahead.pop(0) - twin.first, among)) is not None:
                    return weakest
            if culprit is not None or not ahead:
                return culprit if ahead else None
        start, before = start + len(inputs), states[-1]
    return None


def _first_leaving(twin: Twin, among: Collection[int] | None = None) -> Culprit | None:
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
    for part in parts_of(twin.nodes[value], twin.of.value_of):
        if (fault := _function_fault(twin, part, step)) is not None:
            return _named(twin, value, step, *fault, line=part.line)
    arithmetic = twin.program.arithmetic
    at_limit = int(twin.words[value][step]) in (arithmetic.min_int, arithmetic.max_int)
    with np.errstate(all="ignore"):
        exact = float(np.broadcast_to(twin.computed(twin.nodes[value]), len(twin.words[0]))[step])
    held = float(twin.real(value)[step])
    said = twin.program.values[twin.of.declared(value)]
    if ranged or at_limit:
        why = (
            f"{'saturates: ' * at_limit}{exact if at_limit else held:.6g} does not fit its range "
            f"[{said.low:.6g}, {said.high:.6g}]"
        )
        cure = f"{WIDEN} ({said.range_source}) or limit the value"
        if said.range_source.startswith(OBSERVED):
            cure = f"run boresight fit on this log, too (the range was {said.range_source})"
        if twin.nodes[value].unless == CLAIMED:
            cure = raise_text(twin.of, twin.nodes[value].line)
        if said.unit in PERIODS and max(-said.low, said.high) <= 0.5 * PERIODS[said.unit]:
            wrap = {"ht": "wrap_ht", "turn": "wrap_turns"}[said.unit]
            cure = f"an angle of a whole turn is wrapped: ops.{wrap}"
    elif math.isnan(exact):
        why, cure = "no number in float64", "keep its arguments in their domain"
    else:
        why = f"float64 has {exact:.6g} where the word has {held:.6g}"
        cure = f"{'use a wider word, or ' * (arithmetic.word < _WIDEST)}see the report"
    return _named(twin, value, step, why, cure)


def _named(
    twin: Twin, value: int, step: int, why: str, cure: str, line: str | None = None
) -> Culprit:
    """A culprit, with the name that its author gave, or in words where there is none."""
    node, name = twin.nodes[value], twin.of.name(value)
    if twin.of.declared(value) == value and node.title and not node.name:
        name = f"{name}, {KINDS.get(node.kind, node.kind)}"
    return Culprit(twin.first + step, name, line or node.line, why, cure)


def _function_fault(twin: Twin, node: Node, step: int) -> tuple[str, str] | None:
    """What an argument out of its function's domain explains, with the cure."""
    if node.kind not in (*_NORMALISED, "asin"):
        return None
    arg = node.args[0]
    x, name = float(twin.argument(arg)[step]), _argument(arg)
    full = max(abs(arg.low), abs(arg.high))
    if node.kind == "rsqrt" and x < 0.0:
        return f"rsqrt: argument {x:.3g} is negative", f"keep {name} at 0 or above"
    if node.kind == "asin":
        said = f"asin: argument {x:.3g} is outside 0 to {ASIN_LIMIT}"
        return None if 0.0 <= x <= ASIN_LIMIT else (said, f"limit {_argument(arg)}")
    bits = twin.program.arithmetic.norm_max
    if abs(x) >= math.ldexp(full, -bits) or (x == 0.0 and arg.low <= 0.0 <= arg.high):
        return None
    return (
        f"{node.kind}: argument {abs(x) / full:.2g} of full scale is below the floor 2^-{bits}",
        _more_bits(twin.of, node),
    )


def _argument(arg: Node) -> str:
    return arg.name or f"the argument ({arg.line})"


def _normalising(of: Traced) -> Iterator[tuple[int, Node]]:
    """Roots and reciprocals whose argument is a value: what each is part of, and itself."""
    for value, node in of.nodes.items():
        for part in parts_of(node, of.value_of):
            if part.kind in _NORMALISED and part.args[0].number in of.value_of:
                yield value, part


def _weakest(twin: Twin, step: int, among: Collection[int] | None) -> Culprit | None:
    """The root or reciprocal whose argument has the fewest bits, if they are few."""
    few = [
        (bits, value, part)
        for value, part in _normalising(twin.of)
        if among is None or value in among
        if (bits := int(abs(twin.words[twin.of.value_of[part.args[0].number]][step])).bit_length())
        <= _FEW * twin.program.arithmetic.word
    ]
    if not few:
        return None
    bits, value, part = min(few, key=lambda f: f[0])
    why = f"{part.kind}: argument {float(twin.argument(part.args[0])[step]):.3g} has only "
    why += f"{bits} significant bits"
    return _named(twin, value, step, why, _more_bits(twin.of, part), line=part.line)


def near_floor(of: Traced, ranges: WordRanges, reached: Mapping[int, Range]) -> str:
    """The root or reciprocal whose argument came nearest to its floor, within `_NEAR`; or empty."""
    arithmetic, nearest, text = of.program.arithmetic, _NEAR, ""
    last = {node.number: n for n, node in of.nodes.items()}  # a copy in the function's format
    for _, part in _normalising(of):
        held = last[part.args[0].number]
        low, high = reached[held]
        below = part.args[0].high < 0.0 or high < 0.0
        size, at = (max(-high, 0.0), ranges.high_at) if below else (max(low, 0.0), ranges.low_at)
        full = max(abs(part.args[0].low), abs(part.args[0].high))
        share = math.ldexp(size / full, arithmetic.norm_max) if 0.0 < full < math.inf else _NEAR
        # A root may be of 0; a divisor that is above 0 was rounded to it.
        if part.args[0].low <= 0.0 <= part.args[0].high and share == 0.0:
            continue
        if share < nearest:
            nearest = share
            text = (
                f"{part.line}: the argument of a {_NORMALISED[part.kind]}, {size:.3g} in step "
                f"{int(at[held])}, is only {share:.2g} times the smallest that "
                f"{arithmetic.word} bits can normalise; {_more_bits(of, part)}"
            )
    return text


def _more_bits(of: Traced, node: Node) -> str:
    """What gives the argument of a root or reciprocal more bits."""
    arg, remedies = node.args[0], of.estimator.remedies
    limits = f"[{arg.low:.3g}, {arg.high:.3g}]"
    if node.kind == "rsqrt" and node.line in remedies:
        cures = [*filter(None, [remedies[node.line]]), *map(str, oversized(of))]
        wider = "use a wider word, or " * (of.program.arithmetic.word < _WIDEST)
        text = "; ".join(cures) + IF_ALWAYS
        if not cures:
            text = f"{wider}lower sd and sd_max of the states that h reads"
        return f"the range {limits} of {SPREAD} is wide: {text}"
    return f"scale {_argument(arg)} up, or declare a narrower range than {limits}"


@dataclass(frozen=True)
class Wasted:
    """A value whose format has more bits than its values need."""

    number: int  #: of the value in the program.
    name: str  #: what its author calls it.
    line: str  #: where it is written.
    bits: int  #: that no update used, without a margin of `MARGIN_BITS`.
    low: float  #: to ``high``: a range that takes them, in the value's unit.
    high: float
    cure: str  #: what its author may write.

    def __str__(self) -> str:
        where = f" ({self.line})" if self.line else ""
        return f"{self.name}{where} wastes {self.bits} bit{'s' * (self.bits > 1)}: {self.cure}"


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


def wasted_bits(of: Traced, reached: Mapping[int, Range]) -> list[Wasted]:
    """List the values that waste bits because of their own range, the worst first.

    ``reached`` are extremes on the logs by the number of a value, in its unit; others are left out.
    """
    program, nodes, wasted = of.program, of.nodes, list[Wasted]()
    declared = {i.name: i.line for i in of.estimator.inputs}
    declared |= {x.name: x.line for x in of.estimator.states}
    wrapping = {op.dest for op in program.ops if op.overflow is Overflow.WRAP}
    for n, value in enumerate(program.values):
        if n not in reached or n in wrapping or value.kind in (Kind.PARAM, Kind.CONST):
            continue
        bits = math.floor(headroom_bits(program, n, reached[n])) - MARGIN_BITS
        if bits <= 0 or reached[n][0] == reached[n][1]:
            continue
        limit, low, high = _narrower(program, n, bits)
        full = -program.format(n).min
        if max(-low, high) > limit or 2.0 * max(-value.low, value.high) < full:
            continue  # the format is wider than the range, where terms are aligned
        own = declared_name(program, nodes, n)
        name, line = f"{value.kind.value} {own}", declared.get(own, "")
        if value.kind is Kind.OP:
            if n not in nodes or of.becomes(n) is not None or not _is_source(of, reached, n):
                continue
            name, line = of.name(n), nodes[n].line
        if cure := _cure(of, nodes.get(n), n, reached, low, high):
            wasted.append(Wasted(n, name, line, bits, low, high, cure))
    return sorted([*oversized(of), *wasted], key=lambda w: -w.bits)


def needs_of(
    of: Traced, params: Mapping[str, float] | None, pieces: Iterable[tuple[FloatArray, bool]]
) -> dict[Size, float]:
    """What suffices of each of an estimator's sizes on a log, in the unit of its author.

    Of a derivative the largest in float64 up to the next power of two, of a standard deviation the
    largest with `RESERVE`. ``pieces`` are inputs (n, n_inputs), and whether they begin from the
    initial states.
    """
    trace = of.estimator.record()
    sizes, observer = of.estimator.sizes, Observer(trace, of.estimator, params)
    observer.claims = False
    for inputs, anew in pieces:
        if anew:
            observer.reset()
        observer.add(inputs)
    needs, reached = dict[Size, float](), observer.reached
    for size in sizes:
        low, high = reached.get(size.value, (0.0, 0.0))
        if size.name == "slope_max" and (steepest := max(-low, high) / size.largest) > 0.0:
            needs[size] = size.stated * 2.0 ** exponent(steepest)
        elif size.name == "sd_max" and high > 0.0:
            needs[size] = size.stated * RESERVE * math.sqrt(high) / size.largest
    return needs


def oversized(of: Traced) -> list[Wasted]:
    """What an author declares larger than the logs need, where less gives more bits."""
    groups = dict[tuple[str, str, bool], dict[Size, float]]()
    known: Mapping[str, Sequence[str]] = getattr(of.estimator, "groups", {})
    vectors = {x: name for name, members in known.items() if len(members) > 1 for x in members}
    for size, need in of.needs.items():
        # Components of a vector have one sd_max; derivatives of a measurement are one argument.
        own = size.name == "sd_max" and bool(size.state)
        whose = size.line + vectors.get(size.state, size.state) * own
        groups.setdefault((size.name, whose, own), {})[size] = need
    wasted = []
    for (name, _, of_states), needs in groups.items():
        need, states = max(needs.values()), dict.fromkeys(x.state for x in needs)
        size = next(iter(needs))
        if name == "slope_max":
            most = {x: max(n for s, n in needs.items() if s.state == x) for x in states}
            text = ", ".join(f'"{state}": 2**{exponent(n)}' for state, n in most.items())
            whose, text = "slope_max", f"slope_max={{{text}}}"
            bits = max(math.log2(x.stated / most[x.state]) for x in needs)
        else:
            need = upwards(need)
            whose = f"sd_max of {', '.join(states) if of_states else 'this Measurement'}"
            text, bits = f"sd_max={need:g}", math.log2(max(s.stated for s in needs) / need)
            if of_states:  # the word of a variance
                scaled = (x * size.largest / size.stated for x in (size.stated, need))
                before, after = (exponent(x * x) for x in scaled)
                bits = before - after
        if bits >= 1.0:
            value, cure = _bounded_by(of, size), f"{text} suffices"
            wasted.append(Wasted(value, whose, size.line, math.floor(bits), -need, need, cure))
    return sorted(wasted, key=lambda w: -w.bits)


def _bounded_by(of: Traced, size: Size) -> int:
    """The program's value that a size bounds; -1 where it is part of another one."""
    if size.name == "sd_max" and size.state:
        return of.program.find(f"p_{size.state}_{size.state}")
    for n, node in of.nodes.items():
        is_slope = node.kind == "saturated" and node.value == size.largest
        if node.line == size.line and (is_slope if size.state else node.reason == SPREAD):
            return n
    return -1


def raise_text(of: Traced, line: str) -> str:
    """Cure of a value that the largest standard deviation of a measurement does not hold."""
    most = [n for s, n in of.needs.items() if s.name == "sd_max" and not s.state and s.line == line]
    return RAISE + (f" to {upwards(max(most)):g}" if most else "")


def _narrower(program: Program, value: int, bits: int) -> tuple[float, float, float]:
    """Magnitude that gives the word of a value so many bits more, and its range within that."""
    limit = float(f"{0.999 * math.ldexp(-program.format(value).min, -bits):.4g}")
    said = program.values[value]
    return limit, max(said.low, -limit), min(said.high, limit)


def _cure(
    of: Traced, node: Node | None, value: int, reached: Mapping[int, Range], low: float, high: float
) -> str:
    """What gives a value more bits: a narrower range, or what it follows from; or nothing."""
    said, limits = of.program.values[value], f"[{low:.4g}, {high:.4g}]"
    known = of.estimator.remedies
    if said.kind is not Kind.OP and said.name in of.estimator.covariance_elements:
        return ""  # see `oversized`
    if node is not None and node.unless in (INDEFINITE, CLAIMED):
        return known.get(node.line) or known.get(PREDICTED + node.line, "")
    if node is not None and not node.name and node.line in known:
        return ""  # of the filter, not of the author
    if said.kind is not Kind.OP or (node is not None and node.kind in ("bounded", "saturated")):
        return f"narrow its range to {limits}"
    return f"bound it to {limits} with ops.bounded"


def _is_source(of: Traced, reached: Mapping[int, Range], value: int) -> bool:
    """Whether an operation wastes bits whatever ranges its operands have."""
    node = of.nodes[value]
    if node.kind in ("bounded", "saturated"):
        return True
    if node.kind in LEAVES:
        return False

    def ends(arg: Node) -> Ends:
        number = of.value_of.get(arg.number, -1)
        low, high = (arg.value,) * 2 if arg.kind == "const" else reached.get(number, (None, None))
        if low is None or high is None:
            return ends_of(arg, [*map(ends, arg.args)])
        return np.array([low]), np.array([high])

    with np.errstate(all="ignore"):
        low, high = ends_of(node, [*map(ends, node.args)])
    largest = max(-reached[value][0], reached[value][1], of.program.format(value).lsb)
    return bool(max(-low[0], high[0]) >= largest * 2.0 ** (MARGIN_BITS + 1))


def variances_of(estimator: Estimator) -> set[int]:
    """Numbers of the states that are variances.

    A name like p00 may be another quantity's, such as a coefficient. It is a variance if it is
    declared from 0 on, or if it begins above 0 and there are others.
    """
    covariance, states = covariance_of(estimator), estimator.states
    several = len(covariance.axes) > 1
    return {
        k
        for i, j, k in covariance.elements
        if i == j and (states[k].low >= 0.0 or (several and states[k].initial > 0.0))
    }


def positive_text(of: Traced, exact: float) -> str:
    """Why a variance is below 0, and what keeps it above; ``exact`` is its least in float64."""
    built = bool(of.estimator.covariance_elements)
    if exact < 0.0:
        cure = "raise the process noise" if built else f"{_MODEL}; or {_POSITIVE}"
        return f"in float64, too ({exact:.3g}): the model makes the covariance indefinite; {cure}"
    why = f"in float64 never below {exact:.3g}: rounding makes the covariance indefinite"
    wider = "use a wider word, or " * (of.program.arithmetic.word < _WIDEST)
    if built:
        return f"{why}; {wider}raise floor, or the process noise"
    fit = "choose formats by boresight fit, or " * (of.estimator.profile is None)
    return f"{why}; {fit}{wider}{_MODEL}; or {_POSITIVE}"


def rounding_text(
    of: Traced, wasted: Sequence[Wasted], changes: IntArray, reached: Mapping[int, Range]
) -> str:
    """What to do where no single operation is to blame.

    ``changes`` (n_states,) is the largest change of each state in an update, last bits.
    """
    estimator, program, nodes = of.estimator, of.program, of.nodes
    most = RESERVE * math.sqrt(HELD)
    full = [s.state for s, n in of.needs.items() if s.name == "sd_max" and n > most * s.stated]
    if held := ", ".join(filter(None, full)):
        return (
            f"the variance of {held} is held at its largest, in fixed point perhaps in other "
            "updates than in float64; raise sd_max"
        )
    text = "no single operation is wrong: rounding adds up; "
    fitted = any(node.fit is not None for node in nodes.values())
    by_hand = not estimator.covariance_elements and bool(covariance_of(estimator).axes)
    if by_hand and fitted:  # parts of products of matrices have no line of their own
        wasted = [w for w in wasted if program.values[w.number].kind is not Kind.OP]
    if wasted:
        fits = estimator.profile is None and not estimator.sizes
        others = ["choose formats by boresight fit"] * fits
        others += ["use a wider word"] * (program.arithmetic.word < _WIDEST)
        others += [_MODEL] * by_hand
        several = {(w.cure, w.line): w for w in reversed(wasted)}  # of those with one the first
        named = [w for w in wasted if several[w.cure, w.line] is w][:_ADVISED]
        return text + "; ".join(map(str, named)) + IF_ALWAYS + "".join(f"; or {x}" for x in others)
    wider = "use a wider word, or " * (program.arithmetic.word < _WIDEST)
    if estimator.sizes:
        return (
            f"{text}no smaller sd_max or slope_max gains a bit on this log: {wider}lower sd, and "
            "sd_max with it, if the states are better known at the start"
        )
    if by_hand:
        return f"{text}its covariance is written by hand: {wider}{_MODEL}"
    computed = [
        (int(change), state, after)
        for change, (state, after) in zip(changes, program.states, strict=True)
        if after in nodes and nodes[after].kind not in LEAVES
    ]
    if not computed:
        return text + (wider.removesuffix(", or ") or "accept a larger tolerance")
    # The state whose changes have the fewest bits: each update rounds it, perhaps to one side.
    change, state, after = min(computed, key=lambda k: k[0])
    name = of.name(after)
    where = f" ({nodes[after].line})" if nodes[after].line else ""
    unused, narrow = math.floor(headroom_bits(program, state, reached[state])), ""
    if unused > MARGIN_BITS:
        _, low, high = _narrower(program, state, unused - MARGIN_BITS)
        cure = _cure(of, None, state, reached, low, high)
        narrow = f"{cure}{IF_ALWAYS}; or " if cure else ""
    return (
        f"{text}{name}{where} changes by at most {change} LSB in an update and leaves "
        f"{unused} bits unused: {narrow}{wider}carry the remainder in a second state "
        "(model.algebra.carried)"
    )
