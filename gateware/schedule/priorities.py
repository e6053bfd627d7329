"""Urgency of ops: longest paths to the urgent outputs, and lower bounds from them."""

from __future__ import annotations

from dataclasses import dataclass

from boresight.gateware.machine import Machine
from boresight.gateware.schedule.arrange import arrangements, needs, reads
from boresight.gateware.schedule.slots import ScheduleError
from boresight.model.words.program import Kind, Op, Program, Scale


@dataclass(frozen=True)
class Paths:
    """Longest paths from the end of each node. Nodes are the ops, then the emits.

    ``urgent`` counts cycles to the emit of the last urgent output (None: no path to it),
    ``total`` the cycles to the end of the program. ``slots`` is the fewest slots of each node.
    ``latency_bound`` and ``length_bound`` are lower bounds for every schedule.
    """

    urgent: tuple[int | None, ...]
    total: tuple[int, ...]
    slots: tuple[int, ...]
    latency_bound: int
    length_bound: int


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


def _operands(program: Program) -> set[int | None]:
    """Values that some term reads, so that they can be on port a."""
    return {v for op in program.ops for t in op.terms for v in (t.a, t.b)}


def _separate_captures(program: Program, nodes: list[int]) -> int:
    """Number of captures for these ops that no term of the program can carry."""
    operands = _operands(program)
    captures = {
        v
        for k in nodes
        for v, required in zip(
            (program.ops[k].index, program.ops[k].flag, program.ops[k].norm),
            needs(program.ops[k]),
            strict=True,
        )
        if required
    }
    return len(captures - operands)


def paths(program: Program, machine: Machine, urgent: int) -> Paths:
    """Longest paths of a lowered program."""
    n_ops, n_out = len(program.ops), len(program.outputs)
    latency = machine.latency
    tail = [None] * n_ops + [urgent - 1 - j if j < urgent else None for j in range(n_out)]
    total = [latency] * n_ops + [machine.stages.read + n_out - j for j in range(n_out)]
    producer = {op.dest: k for k, op in enumerate(program.ops)}
    edges: dict[int, list[tuple[int, int]]] = {k: [] for k in range(n_ops)}
    for k, op in enumerate(program.ops):
        for value in sorted(reads(op)):
            if value in producer:
                edges[producer[value]].append(
                    (k, latency + slots_after(op, value, machine.index_delay) - 1)
                )
    for j, value in enumerate(program.outputs):
        if value in producer:
            edges[producer[value]].append((n_ops + j, latency))
    order = topological(program)
    for k in reversed(order):
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
    operands = _operands(program)
    slots += [int(v not in operands) for v in program.outputs]
    # Earliest end of every op, from the inputs.
    ready = {v: k + 1 for k, v in enumerate(program.streamed)}
    end: dict[int, int] = {}
    for k in order:
        op = program.ops[k]
        waits = [ready.get(v, 0) + slots_after(op, v, machine.index_delay) - 1 for v in reads(op)]
        end[k] = max([slots[k] - 1, *waits])
        ready[op.dest] = end[k] + latency
    emits = [ready.get(v, 0) for v in program.outputs]
    bound = max((e + urgent - 1 - j for j, e in enumerate(emits[:urgent])), default=0)
    last = max(
        [len(program.streamed)]
        + [e + latency for e in end.values()]
        + [e + total[n_ops + j] for j, e in enumerate(emits)]
    )
    # Lanes: every slot with a path to an urgent output comes before its last emit.
    urgent_ops = [k for k, t in enumerate(tail[:n_ops]) if t is not None]
    busy = sum(slots[k] for k in urgent_ops) + sum(slots[n_ops : n_ops + urgent])
    busy += _separate_captures(program, urgent_ops)
    bound = max(bound, -(-busy // machine.lanes) - 1)
    last = max(last, -(-(sum(slots) + _separate_captures(program, order)) // machine.lanes) + 1)
    return Paths(tuple(tail), tuple(total), tuple(slots), bound + machine.stages.read + 1, last)


def topological(program: Program) -> list[int]:
    """Ops in an order in which each follows those it reads; raises ScheduleError for a cycle."""
    defined = {n for n, v in enumerate(program.values) if v.kind is not Kind.OP}
    order: list[int] = []
    remaining = list(range(len(program.ops)))
    while remaining:
        waiting = []
        for k in remaining:
            if all(v in defined for v in reads(program.ops[k])):
                defined.add(program.ops[k].dest)
                order.append(k)
            else:
                waiting.append(k)
        if len(waiting) == len(remaining):
            name = program.values[program.ops[waiting[0]].dest].name
            raise ScheduleError(
                f"{program.name}: op {name} waits for itself or for a value that is never computed"
            )
        remaining = waiting
    return order
