"""Urgency of operations: longest paths to the urgent outputs and to the end of the program."""

from __future__ import annotations

from dataclasses import dataclass

from boresight.gateware.machine import Machine
from boresight.gateware.schedule.arrange import arrangements, reads
from boresight.model.words.program import Op, Program, Scale

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
    users = [
        {k for k, t in enumerate(op.terms) if t.coefficient is not None},
        {k for k, t in enumerate(op.terms) if t.conditional},
        {k for k, t in enumerate(op.terms) if t.scale is not Scale.NONE},
    ]
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
            tail_cost = tail[consumer]
            if tail_cost is not None:
                tail[k] = max(tail[k] or 0, tail_cost + cost)
    slots = [
        min(len(x.slots) for x in arrangements(op, k, (False, False, False)))
        for k, op in enumerate(program.ops)
    ]
    # An emit can share a slot that reads its value.
    operands = {v for op in program.ops for t in op.terms for v in (t.a, t.b)}
    slots += [int(v not in operands) for v in program.outputs]
    return Paths(tuple(tail), tuple(total), tuple(slots))
