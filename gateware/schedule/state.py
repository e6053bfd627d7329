"""State of a list scheduling pass: placed nodes, and what follows from them."""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from heapq import heapify, heappush

from boresight.gateware.schedule.arrange import Arrangement, Need
from boresight.gateware.schedule.captures import KINDS, Key, give
from boresight.gateware.schedule.problem import Attempt, ListProblem, Variant
from boresight.gateware.schedule.slots import Slot

#: Earliest start, number of slots, arrangement, order of its slots.
Fit = tuple[int, int, Arrangement, list[int]]
NOTHING: Need = (False, False, False)


class ListState:
    """Nodes placed so far."""

    def __init__(self, problem: ListProblem, variant: Variant) -> None:
        self.p = problem
        self.variant = variant
        self.priority = problem.priorities(variant)
        program, machine = problem.program, problem.machine
        self.read, self.write = machine.stages.read, machine.stages.write
        self.gets = list(range(len(program.inputs)))
        self.horizon = -1  # latest get that a placed slot relies on
        self.ready = [0] * len(program.values)
        for v, g in zip(program.inputs, self.gets, strict=True):
            self.ready[v] = g + 1
        self.fits: dict[tuple[int, Need], list[Fit]] = {}
        self.free = [0] * machine.lanes
        self.held: list[list[Key | None]] = [[None, None, None] for _ in self.free]
        #: First cycle in which each lane's captured index serves.
        self.index_from = [0] * machine.lanes
        #: Number of unplaced ops that need each key.
        self.pending: list[Counter[Key]] = [Counter() for _ in KINDS]
        for wanted in problem.keys:
            for kind, key in enumerate(wanted):
                if key is not None:
                    self.pending[kind][key] += 1
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
        use = next((i for i, s in enumerate(slots) if s.reads_table), None)
        return use is None or t + use >= self.index_from[lane]

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
        for ports in arrangement.reads:
            for v in ports:
                if v in problem.awaited and v is not None:
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
            self.emit(node, t)
            return
        for k in problem.consumers[node]:
            self.follow(k)

    def ride(self, t: int, slots: Sequence[Slot]) -> Sequence[Slot]:
        """Let the next emits of the stream share slots that read their values."""
        problem = self.p
        out = list(slots)
        for i, s in enumerate(out):
            node = problem.n_ops + self.emitted
            if node == problem.nodes:
                break
            value = problem.program.outputs[self.emitted]
            if value not in (s.a, s.b) or t + i + self.read in self.gets:
                continue
            if s.a != value:
                if s.cap_index or s.cap_flag or s.cap_norm:
                    continue
                s = replace(s, a=value, b=s.a, swap=not s.swap)
            out[i] = replace(s, emit=self.emitted)
            entry = (-self.priority[node], node)
            if entry in self.awake:
                self.awake.remove(entry)
            else:
                self.asleep = [x for x in self.asleep if x[1] != node]
                heapify(self.asleep)
            self.emit(node, t + i)
        return out

    @property
    def emitted(self) -> int:
        """Number of emits placed."""
        return len(self.emits)

    def emit(self, node: int, cycle: int) -> None:
        """Record an emit in ``cycle``."""
        self.emits.append(cycle)
        for k in self.p.consumers[node]:
            self.follow(k)

    def follow(self, node: int) -> None:
        """One of the nodes that ``node`` waits for is placed."""
        self.waits[node] -= 1
        if not self.waits[node]:
            self.enqueue(node)

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
        """Times of everything placed."""
        problem = self.p
        least = problem.machine.prefetch + 1
        length = max(self.gets[-1] + 1 if self.gets else least, least)
        count = 0
        for node, _, start, slots in self.groups:
            count += len(slots)
            if node < problem.n_ops:
                length = max(length, start + len(slots) + self.write)
        words = [cycle + self.read + 1 for cycle in self.emits]
        length = max([length, *words[-1:]])
        latency = words[problem.urgent - 1] if problem.urgent else 0
        return Attempt(
            (latency, length, count, sum(words)), tuple(self.groups), tuple(self.gets), length
        )
