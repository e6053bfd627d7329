"""One pass of list scheduling: in each cycle the most urgent group that can start is placed.

Time only moves forward, so the content of each lane's capture registers is known when a group is
placed; a group whose index, flag or count is there needs no separate capture.
"""

from __future__ import annotations

from bisect import insort
from heapq import heappop

from boresight.gateware.schedule.arrange import Arrangement, Need
from boresight.gateware.schedule.captures import KINDS, Key
from boresight.gateware.schedule.problem import Attempt, ListProblem, Variant
from boresight.gateware.schedule.slots import ScheduleError
from boresight.gateware.schedule.state import NOTHING, Fit, ListState

#: Priority lost by overwriting a capture that other ops need.
_KEEP = 4
#: Longest group that is placed first because it makes a capture for the next one.
_DETOUR = 2


def list_pass(problem: ListProblem, variant: Variant) -> Attempt:
    """Place every node once."""
    return _Pass(problem, variant).run()


class _Pass(ListState):
    """The choices of a pass."""

    def run(self) -> Attempt:
        """Place every node."""
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
                else:
                    if not self.may_start(t, node, lane, need, f):
                        continue
                    for kind, held in enumerate(self.held[lane]):
                        if need[kind] and self.wanted(kind, held):
                            key -= _KEEP
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
