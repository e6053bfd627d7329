"""What list scheduling works on: nodes, their order, and the captures between them."""

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


@dataclass(frozen=True)
class Style:
    """Habits of one pass.

    Parameters
    ----------
    reuse : float
        Priority gained per slot saved by captures that the lane already holds.
    keep : float
        Priority lost by overwriting a capture that other ops still wait for.
    patience : float or None
        A lane is kept free for a node that will be ready within the group's length and is more
        urgent by this much. None: never.
    hold : bool
        A result of lane 0 may push later gets back by a cycle.
    detour : int
        Longest group that is let ahead because it makes a capture for the one behind it.
    stay : int
        A node that needs a capture of its own waits so many cycles for a lane that holds it.
    carry : bool
        An emit whose turn it is leaves with an op that reads its value, where one can start.
    """

    reuse: float = 4.0
    keep: float = 4.0
    patience: float | None = None
    hold: bool = True
    detour: int = 1
    stay: int = 2
    carry: bool = False


@dataclass(frozen=True)
class Attempt:
    """Result of a pass; ``score`` is what is compared (lower is better).

    ``groups`` are (node, lane, first cycle, slots in order).
    """

    score: tuple[int, int, int, int]
    groups: tuple[tuple[int, int, int, Sequence[Slot]], ...]
    gets: tuple[int, ...]
    length: int


class ListProblem:
    """Schedules one lowered program, as often as wanted, under changing priorities.

    Nodes are the ops (0 ...), then the emits in stream order. ``state_room`` is the most next
    states that each lane may compute; by default what its bank holds.
    """

    def __init__(
        self,
        program: Program,
        machine: Machine,
        *,
        far: Paths,
        urgent: int,
        state_room: Sequence[int] | None = None,
    ) -> None:
        self.program = program
        self.machine = machine
        self.urgent = urgent
        self.far = far
        self.n_ops = len(program.ops)
        self.nodes = self.n_ops + len(program.outputs)
        self.needs: list[Need] = [needs(op) for op in program.ops]
        self.keys = [keys(op) for op in program.ops]
        self.gifts = gifts(program)
        self.givers: dict[tuple[int, Key], list[int]] = defaultdict(list)
        for k, offers in enumerate(self.gifts):
            for g in offers:
                if k not in self.givers[g.kind, g.key]:
                    self.givers[g.kind, g.key].append(k)
        self.streamed = program.streamed
        self.awaited = set(self.streamed)
        self.state_room = tuple(state_room or [machine.state_slots] * machine.lanes)
        after = {n for _, n in program.states}
        self.makes_state = [op.dest in after for op in program.ops]
        self.consumers: list[list[int]] = [[] for _ in range(self.nodes)]
        self.producers: list[list[int]] = []
        self.waits = [0] * self.nodes
        producer = {op.dest: k for k, op in enumerate(program.ops)}
        for k in range(self.nodes):
            values = reads(program.ops[k]) if k < self.n_ops else {program.outputs[k - self.n_ops]}
            before = {producer[v] for v in values if v in producer}
            if k > self.n_ops:
                before.add(k - 1)  # emits keep the stream's order
            self.waits[k] = len(before)
            self.producers.append(sorted(before))
            for b in sorted(before):
                self.consumers[b].append(k)
        self._arranged: dict[tuple[int, Need], list[Arrangement]] = {}

    def arranged(self, node: int, need: Need) -> list[Arrangement]:
        """Ways to lay out a node that has to make the captures ``need``."""
        key = (node, need)
        if key not in self._arranged:
            if node < self.n_ops:
                found = arrangements(self.program.ops[node], node, need)
            else:
                j = node - self.n_ops
                found = [Arrangement((Slot(0, 0, self.program.outputs[j], emit=j),), ())]
            self._arranged[key] = found
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
