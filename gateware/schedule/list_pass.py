"""List scheduling: in each cycle the most urgent group that can start is placed.

The nodes are the ops and the emits. The urgency of a node follows from longest paths to the urgent
outputs and to the program's end. Time only moves forward, so the content of each lane's capture
registers is known when a group is placed; a group whose index, flag or count is there needs no
separate capture.
"""

from __future__ import annotations

from bisect import bisect_left, insort
from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from heapq import heapify, heappop, heappush

from boresight.gateware.machine import Machine
from boresight.gateware.schedule.slots import (
    KINDS,
    Arrangement,
    Key,
    Need,
    Paths,
    ScheduleError,
    Slot,
    arrangements,
    gifts,
    give,
    keys,
    needs,
    reads,
)
from boresight.model.words.program import Program

#: Earliest start, number of slots, arrangement, order of its slots.
Fit = tuple[int, int, Arrangement, list[int]]
NOTHING: Need = (False, False, False)
#: Priority lost by overwriting a capture that other ops need.
_KEEP = 4
#: Longest group that is placed first because it makes a capture for the next one.
_DETOUR = 2
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
        self.needs: list[Need] = [needs(op) for op in program.ops]
        self.keys = [keys(op) for op in program.ops]
        self.terms = [len(op.terms) for op in program.ops]
        self.reads = [reads(op) for op in program.ops]
        #: Cycles from a slot that captures the segment index to the first slot that it serves.
        self.index_delay = machine.stages.read
        self.gifts = gifts(program)
        self.givers: dict[tuple[int, Key], list[int]] = defaultdict(list)
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
        if (node, need) not in self._arranged:
            if node < self.n_ops:
                ways = arrangements(self.program.ops[node], node, need)
            else:
                j = node - self.n_ops
                ways = [Arrangement((Slot(0, 0, self.program.outputs[j], emit=j),), ())]
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


def list_pass(problem: ListProblem, variant: Variant) -> Attempt:
    """Place every node once."""
    return _Pass(problem, variant).run()


class _Pass:
    """Nodes placed so far, and the choices of a pass."""

    def __init__(self, problem: ListProblem, variant: Variant) -> None:
        self.p, self.variant = problem, variant
        self.priority = problem.priorities(variant)
        program, machine = problem.program, problem.machine
        self.read, self.write = machine.stages.read, machine.stages.write
        self.gets = list(range(len(program.inputs)))
        self.horizon = -1  # latest get that a placed slot relies on
        self.ready = [0] * len(program.values)
        for g, v in enumerate(program.inputs):
            self.ready[v] = g + 1
        self.fits: dict[tuple[int, Need], list[Fit]] = {}
        self.free = [0] * machine.lanes
        self.held: list[list[Key | None]] = [[None, None, None] for _ in self.free]
        #: First cycle in which each lane's captured index serves.
        self.index_from = [0] * machine.lanes
        #: Number of unplaced ops that need each key.
        self.pending: list[Counter[Key]] = [Counter() for _ in KINDS]
        for wanted in problem.keys:
            for pending, key in zip(self.pending, wanted, strict=True):
                if key is not None:
                    pending[key] += 1
        #: Next states that each lane may still compute.
        self.state_quota = list(problem.state_quota)
        self.writes0: set[int] = set()
        self.groups: list[tuple[int, int, int, Sequence[Slot]]] = []
        self.waits = list(problem.waits)
        self.emits: list[int] = []
        #: Nodes whose operands are all scheduled, until they can start.
        self.asleep: list[tuple[int, int]] = []
        #: Nodes that can start about now, the most urgent first.
        self.awake: list[tuple[int, int]] = []
        for k in range(problem.nodes):
            if not self.waits[k]:
                self.enqueue(k)

    def enqueue(self, node: int) -> None:
        """Queue a node whose operands are all scheduled, until its earliest start."""
        dummies = 0
        if node < self.p.n_ops:
            full = self.p.arranged(node, self.p.needs[node])
            dummies = len(full[-1].slots) - self.p.terms[node]
        heappush(self.asleep, (self.fit(node, NOTHING)[0][0] - dummies, node))

    def fit(self, node: int, need: Need) -> list[Fit]:
        """Ways to place a node, the shortest first; longer ones only if they end earlier."""
        fits = self.fits.get((node, need))
        if fits is None:
            fits = []
            for x in self.p.arranged(node, need):
                start, order = x.place(self.ready, self.p.index_delay)
                n = len(order)
                if all(start + n < f[0] + f[1] for f in fits):
                    fits = [f for f in fits if f[1] < n]
                    fits.append((start, n, x, order))
            self.fits[node, need] = fits
        return fits

    def wanted(self, kind: int, key: Key | None) -> bool:
        """Whether unplaced ops need a capture."""
        return key is not None and self.pending[kind][key] > 0

    def may_write(self, cycle: int) -> bool:
        """Whether lane 0 may write its result in this cycle, if necessary by delaying a get."""
        return cycle not in self.gets or (self.variant.delay_gets and cycle > self.horizon)

    def may_look_up(self, t: int, lane: int, need: Need, fit: Fit) -> bool:
        """Whether the lane's index serves a group that starts now and relies on it."""
        if need[0] or t >= self.index_from[lane]:
            return True
        slots = fit[2].ordered(fit[3])
        return all(t + i >= self.index_from[lane] for i, s in enumerate(slots) if s.reads_table)

    def may_start(self, t: int, node: int, lane: int, need: Need, fit: Fit) -> bool:
        """Whether an op can start now: its operands, room for a state, a cycle to write it."""
        return (
            fit[0] <= t
            and (self.state_quota[lane] > 0 or not self.p.makes_state[node])
            and (lane > 0 or self.may_write(t + fit[1] - 1 + self.write))
            and self.may_look_up(t, lane, need, fit)
        )

    def place(self, t: int, node: int, lane: int, fit: Fit, forced: tuple[int, Key] | None) -> None:
        """Put a group into a lane."""
        _, length, arrangement, order = fit
        problem = self.p
        slots: Sequence[Slot] = arrangement.ordered(order)
        del self.awake[bisect_left(self.awake, (-self.priority[node], node))]
        self.free[lane] = t + length
        read = {v for ports in arrangement.reads for v in ports if v is not None}
        for v in read & problem.awaited:
            self.horizon = max(self.horizon, self.ready[v] - 1)
        if node < problem.n_ops:
            end = t + length - 1
            op = problem.program.ops[node]
            if problem.makes_state[node]:
                self.state_quota[lane] -= 1
            self.ready[op.dest] = end + problem.machine.depth
            captured = self.held[lane]
            for kind, key in enumerate(problem.keys[node]):
                if key is not None:
                    captured[kind] = key
                    self.pending[kind][key] -= 1
            if problem.gifts[node]:
                slots = give(
                    slots,
                    op,
                    problem.gifts[node],
                    captured,
                    lambda kind, key: (
                        (kind, key) == forced
                        or self.pending[kind][key] > 0
                        and not self.wanted(kind, captured[kind])
                    ),
                )
            for i, s in enumerate(slots):
                if s.cap_index:
                    self.index_from[lane] = t + i + problem.index_delay
            if lane == 0:
                slots = self.ride(t, slots)
                self.writes0.add(end + self.write)
                self.delay(end + self.write)
        self.groups.append((node, lane, t, slots))
        if node >= problem.n_ops:
            self.emits.append(t)
        self.follow(node)

    def ride(self, t: int, slots: Sequence[Slot]) -> Sequence[Slot]:
        """Let the next emits of the stream share slots that read their values."""
        problem = self.p
        out = list(slots)
        for i, s in enumerate(out):
            emitted = len(self.emits)
            node = problem.n_ops + emitted
            if node == problem.nodes:
                break
            value = problem.program.outputs[emitted]
            if value not in (s.a, s.b) or t + i + self.read in self.gets:
                continue
            if s.a != value:
                if s.cap_index or s.cap_flag or s.cap_norm:
                    continue
                s = replace(s, a=value, b=s.a, swap=not s.swap)
            out[i] = replace(s, emit=emitted)
            entry = (-self.priority[node], node)
            if entry in self.awake:
                self.awake.remove(entry)
            else:
                self.asleep = [x for x in self.asleep if x[1] != node]
                heapify(self.asleep)
            self.emits.append(t + i)
            self.follow(node)
        return out

    def follow(self, node: int) -> None:
        """Queue the nodes that wait for ``node``, which is placed, and for nothing else."""
        for consumer in self.p.consumers[node]:
            self.waits[consumer] -= 1
            if not self.waits[consumer]:
                self.enqueue(consumer)

    def delay(self, cycle: int) -> None:
        """Delay gets from ``cycle`` on that collide with writes of lane 0."""
        if cycle not in self.gets:
            return
        following = cycle
        for k, g in enumerate(self.gets):
            if g < cycle:
                continue
            while following in self.writes0:
                following += 1
            self.gets[k] = following
            self.ready[self.p.program.inputs[k]] = following + 1
            following += 1
        self.fits.clear()

    def result(self) -> Attempt:
        problem = self.p
        least = problem.machine.prefetch + 1
        length = max(self.gets[-1] + 1 if self.gets else least, least)
        count = sum(len(slots) for *_, slots in self.groups)
        for node, _, start, slots in self.groups:
            if node < problem.n_ops:
                length = max(length, start + len(slots) + self.write)
        words = [cycle + self.read + 1 for cycle in self.emits]
        length = max([length, *words[-1:]])
        latency = words[problem.urgent - 1] if problem.urgent else 0
        return Attempt(
            (latency, length, count, sum(words)), tuple(self.groups), tuple(self.gets), length
        )

    def run(self) -> Attempt:
        problem = self.p
        t = 0
        limit = 8 * problem.machine.rom_words
        while self.asleep or self.awake:
            while self.asleep and self.asleep[0][0] <= t:
                node = heappop(self.asleep)[1]
                insort(self.awake, (-self.priority[node], node))
            skip: set[int] = set()
            while self.awake:
                lanes = [k for k, f in enumerate(self.free) if f <= t]
                best = self.choose(t, lanes, skip) if lanes else None
                if best is None:
                    break
                node, lane, fit = best
                if self.delays_another(t, node, lane, fit[1]):
                    skip.add(node)
                    continue
                for kind, key in self.dummies(fit[2]):
                    giver = self.giver(t, lane, kind, key)
                    if giver is not None:
                        self.place(t, giver[0], lane, giver[1], (kind, key))
                        break
                else:
                    self.place(t, node, lane, fit, None)
            t += 1
            if t > limit:
                raise ScheduleError(f"{problem.program.name}: no schedule within {limit} cycles")
        return self.result()

    def need(self, node: int, lane: int) -> Need:
        """Captures that a node must make itself in a lane."""
        if node >= self.p.n_ops:
            return NOTHING
        a, b, c = self.p.keys[node]
        index, flag, norm = self.held[lane]
        return (
            a is not None and a != index,
            b is not None and b != flag,
            c is not None and c != norm,
        )

    def choose(self, t: int, lanes: list[int], skip: set[int]) -> tuple[int, int, Fit] | None:
        """The most urgent node that can start at ``t``."""
        problem, reuse = self.p, self.variant.reuse
        best: tuple[int, int, Fit] | None = None
        best_key = float("-inf")
        most = len(KINDS) * reuse
        for minus, node in self.awake:
            if most - minus <= best_key:
                break
            is_op = node < problem.n_ops
            full = problem.needs[node] if is_op else NOTHING
            # Only a capture that is there already raises a node above its priority.
            if node in skip or full == NOTHING and -minus <= best_key:
                continue
            for lane in reversed(lanes):  # lane 0 also serves gets and emits
                need = NOTHING if full == NOTHING else self.need(node, lane)
                fits = self.fits.get((node, need)) or self.fit(node, need)
                key = -minus
                if need != full:
                    key += reuse * (self.fit(node, full)[0][1] - fits[0][1])
                if key <= best_key:
                    continue
                for f in fits:
                    if f[0] <= t:
                        break
                else:
                    continue
                if not is_op:
                    if lane or t + self.read in self.gets:
                        continue
                elif not self.may_start(t, node, lane, need, f):
                    continue
                else:
                    held = enumerate(self.held[lane])
                    key -= _KEEP * sum(need[kind] and self.wanted(kind, x) for kind, x in held)
                if key > best_key:
                    best, best_key = (node, lane, f), key
        if problem.emits_with_ops and best is not None and best[0] >= problem.n_ops:
            return self.op_with(t, best[0], skip) or best
        return best

    def op_with(self, t: int, emit: int, skip: set[int]) -> tuple[int, int, Fit] | None:
        """The most urgent op that could start in lane 0 with the value of an emit."""
        value = self.p.program.outputs[emit - self.p.n_ops]
        for _, node in self.awake:
            if node < self.p.n_ops and node not in skip and value in self.p.reads[node]:
                need = self.need(node, 0)
                fit = self.fit(node, need)[0]
                if self.may_start(t, node, 0, need, fit):
                    return node, 0, fit
        return None

    def delays_another(self, t: int, node: int, lane: int, length: int) -> bool:
        """Whether a group would delay one that is more urgent and nearly ready."""
        if length == 1:
            return False
        bar = -self.priority[node]
        for minus, other in self.awake:
            if minus >= bar:
                return False
            start = min(f[0] for f in self.fit(other, self.need(other, lane)))
            others = (f for k, f in enumerate(self.free) if k != lane)
            if t < start < t + length and all(f > start for f in others):
                return True
        return False

    def dummies(self, arrangement: Arrangement) -> list[tuple[int, Key]]:
        """Captures of an arrangement in separate slots, which follow those of the terms."""
        op = arrangement.slots[0].op
        if op is None:
            return []
        return [
            (kind, key)
            for s in arrangement.slots[self.p.terms[op] :]
            for kind, key in enumerate(self.p.keys[op])
            if getattr(s, f"cap_{KINDS[kind]}") and key is not None
        ]

    def giver(self, t: int, lane: int, kind: int, key: Key) -> tuple[int, Fit] | None:
        """A short group that can start now and capture what another would need a slot for."""
        for other in self.p.givers.get((kind, key), ()):
            if self.p.needs[other][kind] or (-self.priority[other], other) not in self.awake:
                continue
            need = self.need(other, lane)
            f = self.fit(other, need)[0]
            if f[1] <= _DETOUR and self.may_start(t, other, lane, need, f):
                return other, f
        return None
