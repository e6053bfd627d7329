"""One pass of list scheduling: cycle by cycle, the most urgent group that can start, starts.

Time only moves forward, so what each lane's capture registers hold is known when a group is placed:
a group that finds its index, flag or count there needs no capture of its own.
"""

from __future__ import annotations

from bisect import insort
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

from gateware.arrange import Arrangement, Need, arrangements, needs, reads
from gateware.machine import Machine
from gateware.slots import ScheduleError, Slot
from model.program import Program

__all__ = ["Attempt", "ListPass", "Style"]


@dataclass(frozen=True)
class Style:
    """Habits of one pass.

    Parameters
    ----------
    reuse : float
        Priority gained per slot saved by captures that the lane already holds.
    keep : float
        Priority lost by overwriting an index that other ops still wait for.
    patience : float or None
        A lane is kept free for a node that will be ready within the group's length and is more
        urgent by this much. None: never.
    hold : bool
        A result of lane 0 may push later gets back by a cycle.
    """

    reuse: float = 4.0
    keep: float = 8.0
    patience: float | None = None
    hold: bool = True


@dataclass(frozen=True)
class Placed:
    """One group in time."""

    node: int
    lane: int
    start: int
    arrangement: Arrangement
    order: tuple[int, ...]


@dataclass(frozen=True)
class Attempt:
    """Result of a pass; ``score`` is what is compared (lower is better)."""

    score: tuple[int, int, int]
    placed: tuple[Placed, ...]
    gets: tuple[int, ...]
    length: int


_Fit = tuple[int, int, Arrangement, tuple[int, ...]]  # earliest start, slots, arrangement, order


class ListPass:
    """Schedules one lowered program, as often as wanted, under changing priorities.

    Nodes are the ops (0 ...), then the emits in stream order.
    """

    def __init__(self, program: Program, machine: Machine, *, urgent: int) -> None:
        self.program = program
        self.machine = machine
        self.urgent = urgent
        self.n_ops = len(program.ops)
        self.nodes = self.n_ops + len(program.outputs)
        producer = {op.dest: k for k, op in enumerate(program.ops)}
        self._consumers: list[list[int]] = [[] for _ in range(self.nodes)]
        self._waits = [0] * self.nodes
        for k in range(self.nodes):
            values = reads(program.ops[k]) if k < self.n_ops \
                else {program.outputs[k - self.n_ops]}
            before = {producer[v] for v in values if v in producer}
            if k > self.n_ops:
                before.add(k - 1)  # emits keep the stream's order
            self._waits[k] = len(before)
            for b in sorted(before):
                self._consumers[b].append(k)
        self._needs: list[Need] = [needs(op) for op in program.ops]
        self._keys = [((op.index, op.index_quarter), (op.flag, op.flag_quarter), op.norm)
                      for op in program.ops]
        self._arranged: dict[tuple[int, Need], list[Arrangement]] = {}
        self._inputs = set(program.inputs)

    def _arrangements(self, node: int, need: Need) -> list[Arrangement]:
        key = (node, need)
        if key not in self._arranged:
            if node < self.n_ops:
                found = arrangements(self.program.ops[node], node, need)
            else:
                j = node - self.n_ops
                found = [Arrangement((Slot(0, 0, self.program.outputs[j], emit=j),), (), False)]
            self._arranged[key] = found
        return self._arranged[key]

    def run(self, priority: Sequence[float], style: Style) -> Attempt:
        """Place every node once."""
        return _Run(self, priority, style).run()

    def slots(self, attempt: Attempt) -> tuple[Slot, ...]:
        """The attempt's groups as slots in order of cycle and lane."""
        out = []
        for p in attempt.placed:
            for i, k in enumerate(p.order):
                out.append(replace(
                    p.arrangement.slots[k], cycle=p.start + i, lane=p.lane,
                    first=i == 0 and p.node < self.n_ops,
                    last=i == len(p.order) - 1 and p.node < self.n_ops))
        return tuple(sorted(out, key=lambda s: (s.cycle, s.lane)))


class _Run:
    """State of one pass."""

    def __init__(self, problem: ListPass, priority: Sequence[float], style: Style) -> None:
        self.p = problem
        self.style = style
        self.priority = priority
        program, machine = problem.program, problem.machine
        self.latency = machine.latency
        self.write = machine.STAGE_WRITE
        self.gets = list(range(len(program.inputs)))
        self.horizon = -1  # latest get that a placed slot relies on
        self.ready = [0] * len(program.values)
        for v, g in zip(program.inputs, self.gets, strict=True):
            self.ready[v] = g + 1
        self.waits = list(problem._waits)
        self.candidates: list[tuple[float, int]] = []
        for k in range(problem.nodes):
            if not self.waits[k]:
                insort(self.candidates, (-priority[k], k))
        self.fits: dict[tuple[int, Need], list[_Fit]] = {}
        self.free = [0] * machine.lanes
        nothing = ((None, False), (None, False), None)
        self.held: list[list[object]] = [list(nothing) for _ in self.free]
        self.writes0: set[int] = set()
        self.placed: list[Placed] = []
        self.pending = Counter(problem._keys[k][0] for k in range(problem.n_ops)
                               if problem._needs[k][0])

    def run(self) -> Attempt:
        problem = self.p
        t = 0
        limit = 64 + 8 * problem.machine.rom_words
        while len(self.placed) < problem.nodes:
            skip: set[int] = set()
            while True:
                lanes = [k for k, f in enumerate(self.free) if f <= t]
                if not lanes:
                    break
                best = self.choose(t, lanes, skip)
                if best is None:
                    break
                node, lane, fit = best
                if self.style.patience is not None and self.impatient(t, node, lane, fit[1]):
                    skip.add(node)
                    continue
                self.place(t, node, lane, fit)
            t += 1
            if t > limit:
                raise ScheduleError(f"{problem.program.name}: no schedule within {limit} cycles")
        return self.result()

    def fit(self, node: int, lane: int) -> tuple[list[_Fit], int]:
        """Ways to place a node in a lane now, the shortest first; slots saved by what it holds."""
        problem = self.p
        need: Need = (False, False, False)
        full = need
        if node < problem.n_ops:
            full = problem._needs[node]
            held, keys = self.held[lane], problem._keys[node]
            need = (full[0] and held[0] != keys[0], full[1] and held[1] != keys[1],
                    full[2] and held[2] != keys[2])
        found = self._fits(node, need)
        saved = 0 if need == full else self._fits(node, full)[0][1] - found[0][1]
        return found, saved

    def _fits(self, node: int, need: Need) -> list[_Fit]:
        found = self.fits.get((node, need))
        if found is None:
            found = []
            for x in self.p._arrangements(node, need):
                start, order = x.place(self.ready)
                n = len(order)
                if all(start + n < f[0] + f[1] or n == f[1] and start < f[0] for f in found):
                    found = [f for f in found if f[1] < n]
                    found.append((start, n, x, tuple(order)))
            self.fits[node, need] = found
        return found

    def choose(self, t: int, lanes: list[int], skip: set[int]) -> tuple[int, int, _Fit] | None:
        """The most urgent node that can start at ``t``."""
        problem, style = self.p, self.style
        best: tuple[int, int, _Fit] | None = None
        best_key = float("-inf")
        most = 2 * style.reuse
        last_get = self.gets[-1] if self.gets else -1
        for minus, node in self.candidates:
            if most - minus <= best_key:
                break
            if node in skip:
                continue
            is_op = node < problem.n_ops
            for lane in reversed(lanes):  # lane 0 also serves gets and emits
                if not is_op and (lane or t < last_get and t + 1 in self.gets):
                    continue
                found, saved = self.fit(node, lane)
                for f in found:
                    if f[0] <= t:
                        break
                else:
                    continue
                if lane == 0 and is_op and t + f[1] - 1 + self.write <= last_get \
                        and not self.may_write(t + f[1] - 1 + self.write):
                    continue
                key = style.reuse * saved - minus
                if is_op and f[2].index:
                    held = self.held[lane][0]
                    if held != problem._keys[node][0] and self.pending[held] > 0:  # type: ignore
                        key -= style.keep
                if key > best_key:
                    best, best_key = (node, lane, f), key
        return best

    def may_write(self, cycle: int) -> bool:
        """Whether lane 0 may write its result in this cycle, if need be by delaying a get."""
        return cycle not in self.gets or self.style.hold and cycle > self.horizon

    def impatient(self, t: int, node: int, lane: int, length: int) -> bool:
        """Whether a group would stand in the way of one that is more urgent and nearly ready."""
        assert self.style.patience is not None
        if length == 1:
            return False
        bar = -self.priority[node] - self.style.patience
        for minus, other in self.candidates:
            if minus >= bar:
                return False
            if other == node or other >= self.p.n_ops and lane:
                continue
            start = min(f[0] for f in self.fit(other, lane)[0])
            if t < start < t + length and (other >= self.p.n_ops or all(
                    f > start for k, f in enumerate(self.free) if k != lane)):
                return True
        return False

    def place(self, t: int, node: int, lane: int, fit: _Fit) -> None:
        _, length, arrangement, order = fit
        problem = self.p
        self.placed.append(Placed(node, lane, t, arrangement, order))
        self.candidates.remove((-self.priority[node], node))
        self.free[lane] = t + length
        for k in range(length):
            for v in arrangement.reads(k):
                if v in problem._inputs:
                    self.horizon = max(self.horizon, self.ready[v] - 1)
        if node < problem.n_ops:
            end = t + length - 1
            op = problem.program.ops[node]
            self.ready[op.dest] = end + self.latency
            keys, held = problem._keys[node], self.held[lane]
            if arrangement.index:
                held[0] = keys[0]
            for s in arrangement.slots:
                if s.cap_flag:
                    held[1] = keys[1]
                if s.cap_norm:
                    held[2] = keys[2]
            if problem._needs[node][0]:
                self.pending[keys[0]] -= 1
            if lane == 0:
                self.writes0.add(end + self.write)
                if self.gets and end + self.write <= self.gets[-1]:
                    self.delay(end + self.write)
        for k in problem._consumers[node]:
            self.waits[k] -= 1
            if not self.waits[k]:
                insort(self.candidates, (-self.priority[k], k))

    def delay(self, cycle: int) -> None:
        """Move gets from ``cycle`` on out of the way of lane 0's writes."""
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
        n_ops, read = problem.n_ops, problem.machine.STAGE_READ
        length = self.gets[-1] + 1 if self.gets else 1
        emits = 0
        urgent = 0
        for p in self.placed:
            if p.node < n_ops:
                length = max(length, p.start + len(p.order) + self.write)
            else:
                length = max(length, p.start + read + 1)
                emits += p.start
                if p.node - n_ops == problem.urgent - 1:
                    urgent = p.start + read + 1
        return Attempt((urgent, length, emits), tuple(self.placed), tuple(self.gets), length)

