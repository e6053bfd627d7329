"""The problem of list scheduling: nodes, their order, and the captures between them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace

from boresight.gateware.machine import Machine
from boresight.gateware.schedule.arrange import Arrangement, Need, arrangements, needs, reads
from boresight.gateware.schedule.captures import Key, gifts, keys
from boresight.gateware.schedule.priorities import Paths
from boresight.gateware.schedule.slots import Slot
from boresight.model.words.program import Program

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
        self.program = program
        self.machine = machine
        self.urgent = urgent
        self.far = far
        self.n_ops = len(program.ops)
        self.nodes = self.n_ops + len(program.outputs)
        self.needs: list[Need] = [needs(op) for op in program.ops]
        self.keys = [keys(op) for op in program.ops]
        self.terms = [len(op.terms) for op in program.ops]
        self.reads = [reads(op) for op in program.ops]
        #: Cycles from a slot that captures the segment index to the first slot that it serves.
        self.index_delay = machine.stages.read
        self.gifts = gifts(program)
        self.givers: dict[tuple[int, Key], list[int]] = defaultdict(list)
        for k, offers in enumerate(self.gifts):
            for g in offers:
                if k not in self.givers[g.kind, g.key]:
                    self.givers[g.kind, g.key].append(k)
        self.awaited = set(program.inputs)
        self.state_quota = tuple(state_quota or [machine.state_slots] * machine.lanes)
        after = {n for _, n in program.states}
        self.makes_state = [op.dest in after for op in program.ops]
        self.consumers: list[list[int]] = [[] for _ in range(self.nodes)]
        self.producers: list[list[int]] = []
        producer = {op.dest: k for k, op in enumerate(program.ops)}
        for k in range(self.nodes):
            values = self.reads[k] if k < self.n_ops else {program.outputs[k - self.n_ops]}
            before = {producer[v] for v in values if v in producer}
            if k > self.n_ops:
                before.add(k - 1)  # emits keep the stream's order
            self.producers.append(sorted(before))
            for b in sorted(before):
                self.consumers[b].append(k)
        self.waits = list(map(len, self.producers))
        #: Whether the next emit shares a slot with an op that reads its value and can start: where
        #: outputs are a large part of all nodes.
        self.emits_with_ops = 2 * len(program.outputs) >= self.n_ops
        self._arranged: dict[tuple[int, Need], list[Arrangement]] = {}

    def priorities(self, variant: Variant) -> list[int]:
        """Priority of every node: cycles that follow it, plus `_LEAD` for urgent nodes."""
        return [
            (total if urgent is None else urgent + _LEAD) + (slots - 1) * variant.whole_group
            for urgent, total, slots in zip(
                self.far.urgent, self.far.total, self.far.slots, strict=True
            )
        ]

    def arranged(self, node: int, need: Need) -> list[Arrangement]:
        """Arrangements of a node that makes the captures ``need``."""
        key = (node, need)
        if key not in self._arranged:
            if node < self.n_ops:
                ways = arrangements(self.program.ops[node], node, need)
            else:
                j = node - self.n_ops
                ways = [Arrangement((Slot(0, 0, self.program.outputs[j], emit=j),), ())]
            self._arranged[key] = ways
        return self._arranged[key]

    def slots(self, attempt: Attempt) -> tuple[Slot, ...]:
        """The attempt's groups as slots in order of cycle and lane."""
        out = []
        for node, lane, start, slots in attempt.groups:
            op = node < self.n_ops
            out += [
                replace(
                    s,
                    cycle=start + i,
                    lane=lane,
                    first=op and i == 0,
                    last=op and i == len(slots) - 1,
                )
                for i, s in enumerate(slots)
            ]
        return tuple(sorted(out, key=lambda s: (s.cycle, s.lane)))
