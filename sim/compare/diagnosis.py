"""Which values of a program waste bits on a log, and how their authors give them more.

A word whose upper bits no log uses rounds coarser than it must. The bits are lost where a range is
declared, or where intervals lose what is known; there a narrower range gives more bits.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from boresight.firmware.build import WordRanges
from boresight.model.estimator import Estimator
from boresight.model.kalman.update import INDEFINITE
from boresight.model.lowering.graph import LEAVES, Node, declared_name
from boresight.model.lowering.profile import Range
from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Kind, Overflow, Program
from boresight.sim.compare.twin import authors_name, becomes
from boresight.sim.ranges.intervals import Ends, ends_of

#: Bits above the largest value of a log that are no waste: other logs go further.
MARGIN_BITS = 2
#: Values that messages name.
NAMED = 3


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
        limit = float(f"{0.999 * math.ldexp(-form.min, -bits):.4g}")
        low, high = max(value.low, -limit), min(value.high, limit)
        if max(-low, high) > limit or 2.0 * max(-value.low, value.high) < -form.min:
            continue  # the format is wider than the range, where terms are aligned
        if value.kind is Kind.OP:
            if node is None or becomes(program, nodes, n) is not None:
                continue
            if not _is_source(program, node, reached, numbers, n):
                continue
        if value.kind is Kind.OP:
            name, line = authors_name(program, nodes, n), node.line if node else ""
            derived = False
        else:
            own = declared_name(program, nodes, n)
            name, line = f"{value.kind.value} {own}", declared.get(own, "")
            derived = own in estimator.covariance_elements
        cure = _cure(value.kind, node, f"[{low:.4g}, {high:.4g}]", derived)
        wasted.append(Wasted(n, name, line, bits, low, high, cure))
    return sorted(wasted, key=lambda w: -w.bits)


def _cure(kind: Kind, node: Node | None, limits: str, derived: bool) -> str:
    """What gives a value more bits."""
    if derived:
        return "lower sd_max of its states"
    if node is not None and node.unless == INDEFINITE:
        return "lower sd_max of its states or of its Measurement"
    if kind is not Kind.OP or (node is not None and node.kind in ("bounded", "saturated")):
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
        number = numbers.get(arg.number)
        if arg.kind == "const":
            return np.array([arg.value]), np.array([arg.value])
        if number is not None and number in reached:
            low, high = reached[number]
            return np.array([low]), np.array([high])
        return ends_of(arg, [*map(ends, arg.args)])

    with np.errstate(all="ignore"):
        low, high = ends_of(node, [*map(ends, node.args)])
    largest = max(-reached[value][0], reached[value][1], program.format(value).lsb)
    return bool(max(-low[0], high[0]) >= largest * 2.0 ** (MARGIN_BITS + 1))


def coarse_state(
    program: Program, nodes: Mapping[int, Node], changes: IntArray, reached: Mapping[int, Range]
) -> str:
    """The state whose changes have the fewest bits: each update rounds it, perhaps to one side."""
    computed = [
        k
        for k, (_, after) in enumerate(program.states)
        if after in nodes and nodes[after].kind not in LEAVES
    ]
    if not computed:
        return "use a wider word"
    k = min(computed, key=lambda k: int(changes[k]))
    state, after = program.states[k]
    name = authors_name(program, nodes, after)
    where = f" ({nodes[after].line})" if nodes[after].line else ""
    unused = math.floor(headroom_bits(program, state, reached[state]))
    value = program.values[state]
    narrow = f"narrow its range [{value.low:g}, {value.high:g}], " if unused > 1 else ""
    return (
        f"{name}{where} changes by at most {int(changes[k])} of its last bits in an update and "
        f"leaves {unused} bits unused: {narrow}use a wider word, or carry the remainder in a "
        "second state (model.algebra.carried)"
    )


def rounding_text(nodes: Mapping[int, Node], wasted: Sequence[Wasted], coarse: str) -> str:
    """What to do where no single operation is to blame."""
    text = "no operation leaves its float twin: rounding adds up; "
    if not wasted:
        return text + coarse
    fitted = any(node.fit is not None for node in nodes.values())
    fit = "" if fitted else "; or choose formats by boresight fit"
    return text + "; ".join(map(str, wasted[:NAMED])) + fit
