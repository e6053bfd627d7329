"""The problem of list scheduling: nodes, their order, and the captures between them.

The urgency of a node follows from longest paths to the urgent outputs and to the program's end.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace

from boresight.gateware.machine import Machine
from boresight.gateware.schedule import arrange
from boresight.gateware.schedule.slots import Slot
from boresight.model.words.program import Op, Program

#: Cycles that an operation is assumed to wait for a lane after its operands are ready. Longest
#: paths with it give shorter schedules than those of a machine with any number of lanes.
_WAIT = 3


@dataclass(frozen=True)
class Paths:
    """Longest paths from the end of each node. Nodes are the ops, then the emits.

    ``urgent`` counts cycles to the emit of the last urgent output (None: no path to it),
    ``total`` the cycles to the end of the program. ``slots`` is the fewest slots of each node.
    """

    urgent: tuple[int | None, ...]
    total: tuple[int, ...]
    slots: tuple[int, ...]


def slots_after(op: Op, value: int, index_delay: int = 1) -> int:
    """Cycles to the end of ``op``, at least, from the one in which ``value`` is readable.

    They are the slots that cannot come before, a capture before them, and the ``index_delay``
    between a capture of the segment index and its first use.
    """
    late = {k for k, t in enumerate(op.terms) if value in (t.a, t.b)}
    users = [{k for k in range(len(op.terms)) if arrange.uses(op, k)[kind]} for kind in range(3)]
    extra = False
    for captured, user in zip((op.index, op.flag, op.norm), users, strict=True):
        if value == captured:
            extra = extra or not (late - user if user is users[0] else late)
            late = late | user
    waits = index_delay + len(users[0]) if value == op.index and users[0] else 1
    return max(waits, len(late) + extra)


def paths(program: Program, machine: Machine, urgent: int) -> Paths:
    """Longest paths of a lowered program."""
    n_ops, n_out = len(program.ops), len(program.outputs)
    latency = machine.depth + _WAIT
    tail = [None] * n_ops + [urgent - 1 - j if j < urgent else None for j in range(n_out)]
    total = [latency] * n_ops + [machine.stages.read + n_out - j for j in range(n_out)]
    producer = {op.dest: k for k, op in enumerate(program.ops)}
    edges: dict[int, list[tuple[int, int]]] = {k: [] for k in range(n_ops)}
    for k, op in enumerate(program.ops):
        for value in sorted(arrange.reads(op)):
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
        min(len(x.slots) for x in arrange.arrangements(op, k, (False, False, False)))
        for k, op in enumerate(program.ops)
    ]
    # An emit can share a slot that reads its value.
    operands = {v for op in program.ops for t in op.terms for v in (t.a, t.b)}
    slots += [int(v not in operands) for v in program.outputs]
    return Paths(tuple(tail), tuple(total), tuple(slots))


#: Priority of urgent nodes above the others, in cycles.
_LEAD = 1000


@dataclass(frozen=True)
class Variant:
    """What one pass prefers; none of the variants is the best for every program."""

    #: Priority gained per slot saved by captures that the lane already holds.
    reuse: int
    #: Whether a result of lane 0 may delay later gets by a cycle.
    delay_gets: bool
    #: Whether a node is as urgent as its first slot; otherwise as its last one.
    whole_group: bool


@dataclass(frozen=True)
class Attempt:
    """Result of a pass; a lower ``score`` is better.

    ``groups`` are (node, lane, first cycle, slots in order).
    """

    score: tuple[int, int, int, int]
    groups: tuple[tuple[int, int, int, Sequence[Slot]], ...]
    gets: tuple[int, ...]
    length: int


class ListProblem:
    """A lowered program, for any number of passes.

    Nodes are the ops (0 ...), then the emits in stream order. ``state_quota`` is the maximum number
    of next states that each lane may compute; by default the capacity of its bank.
    """

    def __init__(
        self,
        program: Program,
        machine: Machine,
        *,
        far: Paths,
        urgent: int,
        state_quota: Sequence[int] | None = None,
    ) -> None:
        self.program, self.machine = program, machine
        self.urgent, self.far = urgent, far
        self.n_ops = len(program.ops)
        self.nodes = self.n_ops + len(program.outputs)
        self.needs: list[arrange.Need] = [arrange.needs(op) for op in program.ops]
        self.keys = [arrange.keys(op) for op in program.ops]
        self.terms = [len(op.terms) for op in program.ops]
        self.reads = [arrange.reads(op) for op in program.ops]
        #: Cycles from a slot that captures the segment index to the first slot that it serves.
        self.index_delay = machine.stages.read
        self.gifts = arrange.gifts(program)
        self.givers: dict[tuple[int, arrange.Key], list[int]] = defaultdict(list)
        for k, offers in enumerate(self.gifts):
            for kind_and_key in dict.fromkeys((g.kind, g.key) for g in offers):
                self.givers[kind_and_key].append(k)
        self.awaited = set(program.inputs)
        self.state_quota = tuple(state_quota or [machine.state_slots] * machine.lanes)
        after = {n for _, n in program.states}
        self.makes_state = [op.dest in after for op in program.ops]
        self.consumers: list[list[int]] = [[] for _ in range(self.nodes)]
        self.waits: list[int] = []
        producer = {op.dest: k for k, op in enumerate(program.ops)}
        for k in range(self.nodes):
            values = self.reads[k] if k < self.n_ops else {program.outputs[k - self.n_ops]}
            before = {producer[v] for v in values if v in producer}
            if k > self.n_ops:
                before.add(k - 1)  # emits keep the stream's order
            self.waits.append(len(before))
            for b in sorted(before):
                self.consumers[b].append(k)
        #: Whether the next emit shares a slot with an op that reads its value and can start: where
        #: outputs are a large part of all nodes.
        self.emits_with_ops = 2 * len(program.outputs) >= self.n_ops
        self._arranged: dict[tuple[int, arrange.Need], list[arrange.Arrangement]] = {}

    def priorities(self, variant: Variant) -> list[int]:
        """Priority of every node: cycles that follow it, plus `_LEAD` for urgent nodes."""
        return [
            (total if urgent is None else urgent + _LEAD) + (slots - 1) * variant.whole_group
            for urgent, total, slots in zip(
                self.far.urgent, self.far.total, self.far.slots, strict=True
            )
        ]

    def arranged(self, node: int, need: arrange.Need) -> list[arrange.Arrangement]:
        """Arrangements of a node that makes the captures ``need``."""
        if (node, need) not in self._arranged:
            if node < self.n_ops:
                ways = arrange.arrangements(self.program.ops[node], node, need)
            else:
                j = node - self.n_ops
                ways = [arrange.Arrangement((Slot(0, 0, self.program.outputs[j], emit=j),), ())]
            self._arranged[node, need] = ways
        return self._arranged[node, need]

    def slots(self, attempt: Attempt) -> tuple[Slot, ...]:
        """The attempt's groups as slots in order of cycle and lane."""
        out = []
        for node, lane, start, slots in attempt.groups:
            op = node < self.n_ops
            for i, s in enumerate(slots):
                ends = {"first": op and i == 0, "last": op and i == len(slots) - 1}
                out.append(replace(s, cycle=start + i, lane=lane, **ends))
        return tuple(sorted(out, key=lambda s: (s.cycle, s.lane)))
