"""Slots: those of a scheduled program, those that an op can have, and the least cycles they take.

The machine writes a next state as the result of a group. A state whose next value is something
else (itself, an input, a constant, or a result that already is another state's next value) gets a
copy: one group of one term, value * 2^k >> (k - G).

The order of an op's terms is free, and the operands of a product may change ports. Only captures
restrict the order: a flag or normalisation count must be captured no later than the first slot that
uses it, a segment index strictly before. A capture shares the slot of a term with the value on port
``a``, or has a separate slot.

A lane's index, flag and count registers persist. A slot with a value on port ``a`` can capture it
for later ops in the lane, which then need no separate slot for it. Such a capture is a *gift*.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from graphlib import CycleError, TopologicalSorter
from itertools import product

from boresight.gateware.machine import Machine
from boresight.model.errors import InputError
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import Kind, Op, Overflow, Program, Scale, Term, Value

KINDS = ("index", "flag", "norm")
#: Captures that an op must make itself, by `KINDS`.
Need = tuple[bool, bool, bool]
#: Content of a capture register: value, and whether a quarter was added.
Key = tuple[int, bool]

#: Place of a slot without effect in an order.
IDLE = -1
#: Cycles that an operation is assumed to wait for a lane after its operands are ready. Longest
#: paths with it give shorter schedules than those of a machine with any number of lanes.
_WAIT = 3
_MOST = 12  # arrangements kept per op and need


class ScheduleError(InputError):
    """A program that does not fit the machine, or a schedule that breaks its rules."""


@dataclass(frozen=True)
class Slot:
    """One issue slot: one term, one capture or one emit of one lane.

    ``cycle`` is the cycle of stage 0. ``op`` numbers `Program.ops` (None: only an emit), ``term``
    its terms (None: the slot contributes nothing). ``a`` and ``b`` are the values on the two
    operand ports (``b`` None: table or nothing); with ``swap`` they are exchanged relative to the
    term. ``emit`` is the position in `Program.outputs` of the value ``a`` that is emitted.
    """

    cycle: int
    lane: int
    a: int
    b: int | None = None
    op: int | None = None
    term: int | None = None
    swap: bool = False
    cap_index: bool = False
    cap_flag: bool = False
    cap_norm: bool = False
    quarter: bool = False
    first: bool = False
    last: bool = False
    emit: int | None = None

    @property
    def reads_table(self) -> bool:
        """Whether the slot multiplies by a word of the tables."""
        return self.term is not None and self.b is None


@dataclass(frozen=True)
class Schedule:
    """A scheduled program.

    ``program`` is the lowered program (`with_copies`): the source program, ``source``
    its digest, with copies for states that need them. ``slots`` are in order of (cycle, lane),
    ``gets`` are the cycles at which the inputs are written, ``length`` counts the ROM words.
    ``urgent`` is the number of leading outputs whose latency was minimised first.
    """

    program: Program
    source: str
    machine: Machine
    slots: tuple[Slot, ...]
    gets: tuple[int, ...]
    length: int
    urgent: int

    @cached_property
    def ends(self) -> dict[int, Slot]:
        return {s.op: s for s in self.slots if s.op is not None}  # later ones replace earlier ones

    @property
    def interval(self) -> int:
        """Cycles from the first word of a record to the first word of the next."""
        return self.length

    @property
    def latencies(self) -> tuple[int, ...]:
        """Cycles from the first input word to each output word, both counted."""
        read = self.machine.stages.read
        words = {s.emit: s.cycle + read + 1 for s in self.slots if s.emit is not None}
        return tuple(words[k] for k in range(len(self.program.outputs)))

    @property
    def latency(self) -> int:
        """Latency of the last urgent output."""
        return self.latencies[self.urgent - 1] if self.urgent else 0

    def write_cycle(self, op: int) -> int:
        """Cycle at whose end the result of an op is written."""
        return self.ends[op].cycle + self.machine.stages.write


def copy_shift(word: int, arith: Arithmetic) -> int | None:
    """Shift that makes a product with the constant ``word`` a copy; None if impossible."""
    k = word.bit_length() - 1
    shift = k - arith.guard
    exact = word > 0 and word == 1 << k and k <= arith.word - 2
    return shift if exact and 0 <= shift <= arith.shift_max else None


def with_copies(program: Program) -> Program:
    """Return ``program`` with copies added after its values and ops.

    Outputs, saturation and states are those of ``program`` word for word.
    """
    arith = program.arithmetic
    values, ops = list(program.values), list(program.ops)
    names = {v.name for v in values}
    computed, states = set[int](), list[tuple[int, int]]()

    def add(value: Value) -> int:
        name = value.name
        while name in names:
            name += "_"
        values.append(replace(value, name=name))
        return len(values) - 1

    constants = program.of_kind(Kind.CONST)
    units = (n for n in constants if copy_shift(values[n].initial, arith) is not None)
    unit = next(units, None)
    for state, after in program.states:
        if values[after].kind is not Kind.OP or after in computed:
            if unit is None:
                frac = arith.guard
                unit = add(Value("one", Kind.CONST, frac, 1.0, 1.0, "constant", initial=1 << frac))
            shift = copy_shift(values[unit].initial, arith)
            assert shift is not None
            name, source = f"{values[state].name}.next", after
            after = add(replace(values[source], name=name, kind=Kind.OP, initial=0))
            ops.append(Op(after, (Term(source, unit, shift),), Overflow.WRAP))
        computed.add(after)
        states.append((state, after))
    return replace(program, values=tuple(values), ops=tuple(ops), states=tuple(states))


@dataclass(frozen=True)
class Arrangement:
    """Slots of one op, not yet in order (cycle and lane of `slots` have no meaning).

    ``before`` lists (earlier, later) pairs in an order in which release times propagate.
    """

    slots: tuple[Slot, ...]
    before: tuple[tuple[int, int], ...]

    @cached_property
    def reads(self) -> tuple[tuple[int, int | None], ...]:
        """Values on the two ports of each slot."""
        return tuple((s.a, s.b) for s in self.slots)

    def place(self, ready: Sequence[int], index_delay: int = 1) -> tuple[int, list[int]]:
        """Earliest first cycle, and the order of slots that allows it.

        ``ready`` is the first cycle at which each value may be read. `IDLE` in the order is a slot
        without effect: a captured index serves slots ``index_delay`` cycles later.
        """
        release = [ready[a] if b is None else max(ready[a], ready[b]) for a, b in self.reads]
        for earlier, later in self.before:
            by_index = self.slots[earlier].cap_index and self.slots[later].reads_table
            earliest = release[earlier] + (index_delay if by_index else 1)
            if earliest > release[later]:
                release[later] = earliest
        if len(release) == 1:
            return release[0], [0]
        order = sorted(range(len(release)), key=release.__getitem__)
        if index_delay > 1:
            order = self._spaced(order, index_delay)
        return max(release[k] - i for i, k in enumerate(order) if k != IDLE), order

    def _spaced(self, order: list[int], index_delay: int) -> list[int]:
        """The order with enough slots between the capture of the index and its first use."""
        capture = next((i for i, k in enumerate(order) if self.slots[k].cap_index), None)
        use = next((i for i, k in enumerate(order) if self.slots[k].reads_table), None)
        if capture is None or use is None:
            return order
        missing = max(0, index_delay - (use - capture))
        awaited = {earlier for earlier, _ in self.before}
        movable = [k for k in order[:capture] if k not in awaited]
        moved = movable[max(0, len(movable) - missing) :]
        return [
            *(k for k in order[:capture] if k not in moved),
            *(order[capture:use]),
            *moved,
            *[IDLE] * (missing - len(moved)),
            *order[use:],
        ]

    def ordered(self, order: Sequence[int]) -> list[Slot]:
        """The slots in an order that `place` returned."""
        out: list[Slot] = []
        for k in order:  # an idle slot reads the same as the slot before it
            out.append(Slot(0, 0, out[-1].a, op=out[-1].op) if k == IDLE else self.slots[k])
        return out


def uses(op: Op, term: int | None) -> Need:
    """Which captures a term relies on."""
    if term is None:
        return (False, False, False)
    t = op.terms[term]
    return t.coefficient is not None, t.conditional, t.scale is not Scale.NONE


def needs(op: Op) -> Need:
    """Which captures the op's terms rely on."""
    each = [uses(op, k) for k in range(len(op.terms))]
    index, flag, norm = (any(need[kind] for need in each) for kind in range(len(KINDS)))
    return index, flag, norm


def keys(op: Op) -> tuple[Key | None, Key | None, Key | None]:
    """Required content of the lane's capture registers for an op."""
    pairs = ((op.index, op.index_quarter), (op.flag, op.flag_quarter), (op.norm, False))
    index, flag, norm = (
        (v, q) if required and v is not None else None
        for (v, q), required in zip(pairs, needs(op), strict=True)
    )
    return index, flag, norm


def reads(op: Op) -> set[int]:
    """Values required by the op: operands, and captures that its terms use."""
    captured = {key[0] for key in keys(op) if key is not None}
    return captured | {v for t in op.terms for v in (t.a, t.b) if v is not None}


def slots_after(op: Op, value: int, index_delay: int = 1) -> int:
    """Cycles to the end of ``op``, at least, from the one in which ``value`` is readable.

    They are the slots that cannot come before, a capture before them, and the ``index_delay``
    between a capture of the segment index and its first use.
    """
    late = {k for k, t in enumerate(op.terms) if value in (t.a, t.b)}
    users = [{k for k in range(len(op.terms)) if uses(op, k)[kind]} for kind in range(3)]
    extra = False
    for captured, user in zip((op.index, op.flag, op.norm), users, strict=True):
        if value == captured:
            extra = extra or not (late - user if user is users[0] else late)
            late = late | user
    waits = index_delay + len(users[0]) if value == op.index and users[0] else 1
    return max(waits, len(late) + extra)


def _carriers(op: Op, value: int, *, index: bool) -> list[tuple[int, bool] | None]:
    """Terms (with swap) that can have ``value`` on port a; None is a separate slot."""
    out: list[tuple[int, bool] | None] = []
    for k, t in enumerate(op.terms):
        if t.a == value and not (index and t.coefficient is not None):
            out.append((k, False))
        elif t.b == value:
            out.append((k, True))
    return [*out, None]


def _build(
    op: Op,
    number: int,
    wanted: dict[str, tuple[int, bool]],
    choice: dict[str, tuple[int, bool] | None],
) -> Arrangement | None:
    """One arrangement, or None if the choice of carriers is contradictory."""
    swaps: dict[int, bool] = {}
    for carrier in choice.values():
        if carrier is not None and swaps.setdefault(*carrier) != carrier[1]:
            return None
    slots = []
    for k, t in enumerate(op.terms):
        a, b = (t.b, t.a) if swaps.get(k, False) else (t.a, t.b)
        assert a is not None
        slots.append(Slot(0, 0, a, b, op=number, term=k, swap=swaps.get(k, False)))
    places: dict[str, int] = {}
    quarters: dict[int, bool] = {}
    for kind, carrier in choice.items():
        value, quarter = wanted[kind]
        if carrier is None:
            for k in range(len(op.terms), len(slots)):  # share a slot that already captures
                if slots[k].a == value and (kind == "norm" or quarters.get(k, quarter) == quarter):
                    break
            else:
                slots.append(Slot(0, 0, value, op=number))
                k = len(slots) - 1
        else:
            k = carrier[0]
        if kind != "norm" and quarters.setdefault(k, quarter) != quarter:
            return None
        places[kind] = k
        slots[k] = replace(slots[k], **{f"cap_{kind}": True}, quarter=quarters.get(k, False))
    edges = [
        (places[kind], k)
        for k in range(len(op.terms))
        for kind, used in zip(KINDS, uses(op, k), strict=True)
        if used and kind in places and (kind == "index" or k != places[kind])
    ]
    ordered = _topological(edges)
    return None if ordered is None else Arrangement(tuple(slots), ordered)


def _topological(edges: list[tuple[int, int]]) -> tuple[tuple[int, int], ...] | None:
    """Edges sorted so that each comes after those into its tail; None if there is a cycle."""
    graph = TopologicalSorter[int]()
    for earlier, later in edges:
        graph.add(later, earlier)
    try:
        order = [*graph.static_order()]
    except CycleError:
        return None
    return tuple(sorted(edges, key=lambda edge: order.index(edge[0])))


def arrangements(op: Op, number: int, need: Need) -> list[Arrangement]:
    """Arrangements of an op that makes the captures ``need``; the shortest first."""
    wanted = {
        kind: key
        for kind, key, required in zip(KINDS, keys(op), need, strict=True)
        if required and key is not None
    }
    ways = (_carriers(op, value, index=kind == "index") for kind, (value, _) in wanted.items())
    built = (
        _build(op, number, wanted, dict(zip(wanted, way, strict=True))) for way in product(*ways)
    )
    return sorted((x for x in built if x is not None), key=lambda x: len(x.slots))[:_MOST]


@dataclass(frozen=True)
class Paths:
    """Longest paths from the end of each node. Nodes are the ops, then the emits.

    ``urgent`` counts cycles to the emit of the last urgent output (None: no path to it),
    ``total`` the cycles to the end of the program. ``slots`` is the fewest slots of each node.
    """

    urgent: tuple[int | None, ...]
    total: tuple[int, ...]
    slots: tuple[int, ...]


def paths(program: Program, machine: Machine, urgent: int) -> Paths:
    """Longest paths of a lowered program."""
    n_ops, n_out = len(program.ops), len(program.outputs)
    latency = machine.depth + _WAIT
    tail = [None] * n_ops + [urgent - 1 - j if j < urgent else None for j in range(n_out)]
    total = [latency] * n_ops + [machine.stages.read + n_out - j for j in range(n_out)]
    producer = {op.dest: k for k, op in enumerate(program.ops)}
    edges: dict[int, list[tuple[int, int]]] = {k: [] for k in range(n_ops)}
    for k, op in enumerate(program.ops):
        for value in sorted(reads(op)):
            if value in producer:
                cost = latency + slots_after(op, value, machine.stages.read) - 1
                edges[producer[value]].append((k, cost))
    for j, value in enumerate(program.outputs):
        if value in producer:
            edges[producer[value]].append((n_ops + j, latency))
    for k in reversed(range(n_ops)):
        for consumer, cost in edges[k]:
            total[k] = max(total[k], total[consumer] + cost)
            if (tail_cost := tail[consumer]) is not None:
                tail[k] = max(tail[k] or 0, tail_cost + cost)
    slots = [
        min(len(x.slots) for x in arrangements(op, k, (False, False, False)))
        for k, op in enumerate(program.ops)
    ]
    # An emit can share a slot that reads its value.
    operands = {v for op in program.ops for t in op.terms for v in (t.a, t.b)}
    slots += [int(v not in operands) for v in program.outputs]
    return Paths(tuple(tail), tuple(total), tuple(slots))


@dataclass(frozen=True)
class Gift:
    """The slot of ``term`` has the value of ``key`` on port a, or on b with ``swap``.

    ``kind`` is an index of `KINDS`.
    """

    kind: int
    key: Key
    term: int
    swap: bool


def gifts(program: Program) -> list[list[Gift]]:
    """For each op, the captures it could make for others."""
    wanted: dict[int, dict[tuple[int, Key], None]] = defaultdict(dict)  # each once, in order
    for op in program.ops:
        for kind, key in enumerate(keys(op)):
            if key is not None:
                wanted[key[0]][kind, key] = None
    out = []
    for op in program.ops:
        offers = []
        for k in reversed(range(len(op.terms))):  # prefer late slots, with less effect on others
            t = op.terms[k]
            offers += [Gift(kind, key, k, False) for kind, key in wanted.get(t.a, ())]
            if t.b is not None and t.b != t.a:
                offers += [Gift(kind, key, k, True) for kind, key in wanted.get(t.b, ())]
        out.append(offers)
    return out


def give(
    slots: Sequence[Slot],
    op: Op,
    offers: Sequence[Gift],
    registers: list[Key | None],
    wish: Callable[[int, Key], bool],
) -> list[Slot]:
    """Add gifts to ``slots`` (one op's, in order) if ``wish`` accepts them; updates ``registers``.

    ``wish`` is called only for captures that do not disturb the op's terms.
    """
    out = list(slots)
    for gift in offers:
        kind, key = gift.kind, gift.key
        if registers[kind] == key:
            continue
        at = next(i for i, s in enumerate(out) if s.term == gift.term)
        s = out[at]
        last_use = max((i for i, x in enumerate(out) if uses(op, x.term)[kind]), default=-1)
        # An index serves the slots after its capture, the others the capturing slot too.
        if at < last_use or at == last_use and kind != 0:
            continue
        if any(getattr(x, f"cap_{KINDS[kind]}") for x in out[at:]):
            continue
        if s.swap != gift.swap:
            if s.cap_index or s.cap_flag or s.cap_norm:
                continue
            assert s.b is not None  # of two different values: a square's are never exchanged
            s = replace(s, a=s.b, b=s.a, swap=not s.swap)
        if kind != 2 and (s.cap_index or s.cap_flag) and s.quarter != key[1]:
            continue
        if not wish(kind, key):
            continue
        quarter = s.quarter if kind == 2 else key[1]
        out[at] = replace(s, **{f"cap_{KINDS[kind]}": True}, quarter=quarter)
        registers[kind] = key
    return out
