"""One pass of list scheduling: cycle by cycle, the most urgent group that can start, starts.

Time only moves forward, so what each lane's capture registers hold is known when a group is placed:
a group that finds its index, flag or count there needs no capture of its own.
"""

from __future__ import annotations

from bisect import insort
from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from heapq import heappop, heappush

from gateware.arrange import Arrangement, Need, arrangements, needs, reads
from gateware.captures import KINDS, Key, gifts, give, keys
from gateware.machine import Machine
from gateware.priorities import Paths
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
        Priority lost by overwriting a capture that other ops still wait for.
    patience : float or None
        A lane is kept free for a node that will be ready within the group's length and is more
        urgent by this much. None: never.
    hold : bool
        A result of lane 0 may push later gets back by a cycle.
    detour : int
        Longest group that is let ahead because it makes a capture for the one behind it.
    """

    reuse: float = 4.0
    keep: float = 4.0
    patience: float | None = None
    hold: bool = True
    detour: int = 1


@dataclass(frozen=True)
class Attempt:
    """Result of a pass; ``score`` is what is compared (lower is better).

    ``groups`` are (node, lane, first cycle, slots in order).
    """

    score: tuple[int, int, int, int]
    groups: tuple[tuple[int, int, int, Sequence[Slot]], ...]
    gets: tuple[int, ...]
    length: int


#: Earliest start, number of slots, arrangement, order of its slots.
_Fit = tuple[int, int, Arrangement, list[int]]
_NEVER = 1 << 30
_NOTHING: Need = (False, False, False)


class ListPass:
    """Schedules one lowered program, as often as wanted, under changing priorities.

    Nodes are the ops (0 ...), then the emits in stream order.
    """

    def __init__(self, program: Program, machine: Machine, *, far: Paths, urgent: int) -> None:
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
        self.inputs = set(program.inputs)
        self.consumers: list[list[int]] = [[] for _ in range(self.nodes)]
        self.waits = [0] * self.nodes
        producer = {op.dest: k for k, op in enumerate(program.ops)}
        for k in range(self.nodes):
            values = reads(program.ops[k]) if k < self.n_ops else {program.outputs[k - self.n_ops]}
            before = {producer[v] for v in values if v in producer}
            if k > self.n_ops:
                before.add(k - 1)  # emits keep the stream's order
            self.waits[k] = len(before)
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

    def run(self, priority: Sequence[float], style: Style,
            limit: tuple[int, int] | None = None) -> Attempt | None:
        """Place every node once.

        ``limit`` is the latency and length to stay within: the pass gives up, and returns None, as
        soon as it is sure to exceed the latency, or the length at exactly that latency.
        """
        return _Run(self, priority, style, limit).run()

    def slots(self, attempt: Attempt) -> tuple[Slot, ...]:
        """The attempt's groups as slots in order of cycle and lane."""
        out = []
        for node, lane, start, slots in attempt.groups:
            op = node < self.n_ops
            out += [replace(s, cycle=start + i, lane=lane, first=op and i == 0,
                            last=op and i == len(slots) - 1) for i, s in enumerate(slots)]
        return tuple(sorted(out, key=lambda s: (s.cycle, s.lane)))


class _Run:
    """State of one pass."""

    def __init__(self, problem: ListPass, priority: Sequence[float], style: Style,
                 limit: tuple[int, int] | None) -> None:
        self.p = problem
        self.limit = limit or (_NEVER, _NEVER)
        self.urgent_slots = sum(n for n, tail in zip(problem.far.slots, problem.far.urgent,
                                                     strict=True) if tail is not None)
        self.over = False
        self.style = style
        self.priority = priority
        program, machine = problem.program, problem.machine
        self.write = machine.STAGE_WRITE
        self.gets = list(range(len(program.inputs)))
        self.horizon = -1  # latest get that a placed slot relies on
        self.ready = [0] * len(program.values)
        for v, g in zip(program.inputs, self.gets, strict=True):
            self.ready[v] = g + 1
        self.fits: dict[tuple[int, Need], list[_Fit]] = {}
        self.free = [0] * machine.lanes
        self.held: list[list[Key | None]] = [[None, None, None] for _ in self.free]
        #: How many ops still want each key.
        self.pending: list[Counter[Key]] = [Counter() for _ in KINDS]
        for wanted in problem.keys:
            for kind, key in enumerate(wanted):
                if key is not None:
                    self.pending[kind][key] += 1
        self.writes0: set[int] = set()
        self.groups: list[tuple[int, int, int, Sequence[Slot]]] = []
        self.waits = list(problem.waits)
        #: Nodes whose operands are all on their way, until they could start.
        self.asleep: list[tuple[int, int]] = []
        #: Nodes that could start about now, the most urgent first.
        self.awake: list[tuple[float, int]] = []
        for k in range(problem.nodes):
            if not self.waits[k]:
                self.known(k)

    def known(self, node: int) -> None:
        """All operands of a node have their times: it waits for its earliest start."""
        dummies = 0
        if node < self.p.n_ops:
            full = self.p.arranged(node, self.p.needs[node])
            dummies = len(full[-1].slots) - len(self.p.program.ops[node].terms)
        heappush(self.asleep, (self.fit(node, _NOTHING)[0][0] - dummies, node))

    def run(self) -> Attempt | None:
        """The pass."""
        problem = self.p
        t = 0
        limit = 64 + 8 * problem.machine.rom_words
        while len(self.groups) < problem.nodes:
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
                if self.style.patience is not None and self.impatient(t, node, lane, fit[1]):
                    skip.add(node)
                    continue
                for kind, key in self.dummies(fit[2]):
                    giver = self.giver(t, node, lane, kind, key)
                    if giver is not None:
                        self.place(t, giver[0], lane, giver[1], (kind, key))
                        break
                else:
                    self.place(t, node, lane, fit, None)
            if self.over:
                return None
            t += 1
            if t > limit:
                raise ScheduleError(f"{problem.program.name}: no schedule within {limit} cycles")
        return self.result()

    def need(self, node: int, lane: int) -> Need:
        """Captures that a node would have to make itself in a lane."""
        if node >= self.p.n_ops:
            return _NOTHING
        a, b, c = self.p.keys[node]
        held = self.held[lane]
        return (a is not None and a != held[0], b is not None and b != held[1],
                c is not None and c != held[2])

    def fit(self, node: int, need: Need) -> list[_Fit]:
        """Ways to place a node, the shortest first, each longer one only if it starts so early
        that it ends first."""
        found = self.fits.get((node, need))
        if found is None:
            found = []
            for x in self.p.arranged(node, need):
                start, order = x.place(self.ready)
                n = len(order)
                if all(start + n < f[0] + f[1] or n == f[1] and start < f[0] for f in found):
                    found = [f for f in found if f[1] < n]
                    found.append((start, n, x, order))
            self.fits[node, need] = found
        return found

    def choose(self, t: int, lanes: list[int], skip: set[int]) -> tuple[int, int, _Fit] | None:
        """The most urgent node that can start at ``t``."""
        problem, style = self.p, self.style
        best: tuple[int, int, _Fit] | None = None
        best_key = float("-inf")
        most = 2 * style.reuse
        last_get = self.gets[-1] if self.gets else -1
        for minus, node in self.awake:
            if most - minus <= best_key:
                break
            if node in skip:
                continue
            is_op = node < problem.n_ops
            for lane in reversed(lanes):  # lane 0 also serves gets and emits
                if not is_op and (lane or t < last_get and t + 1 in self.gets):
                    continue
                need = self.need(node, lane)
                found = self.fit(node, need)
                for f in found:
                    if f[0] <= t:
                        break
                else:
                    continue
                if lane == 0 and is_op and not self.may_write(t + f[1] - 1 + self.write):
                    continue
                key = -minus
                if is_op:
                    full = problem.needs[node]
                    if need != full:
                        key += style.reuse * (self.fit(node, full)[0][1] - found[0][1])
                    if style.keep:
                        for kind in (0, 1, 2):
                            if need[kind] and self.wanted(kind, self.held[lane][kind]):
                                key -= style.keep
                if key > best_key:
                    best, best_key = (node, lane, f), key
        return best

    def wanted(self, kind: int, key: Key | None) -> bool:
        """Whether ops still to come want a capture."""
        return key is not None and self.pending[kind][key] > 0

    def may_write(self, cycle: int) -> bool:
        """Whether lane 0 may write its result in this cycle, if need be by delaying a get."""
        return not self.gets or cycle > self.gets[-1] or cycle not in self.gets \
            or self.style.hold and cycle > self.horizon

    def impatient(self, t: int, node: int, lane: int, length: int) -> bool:
        """Whether a group would stand in the way of one that is more urgent and nearly ready."""
        assert self.style.patience is not None
        if length == 1:
            return False
        bar = -self.priority[node] - self.style.patience
        for minus, other in self.awake:
            if minus >= bar:
                return False
            if other == node or other >= self.p.n_ops and lane:
                continue
            start = min(f[0] for f in self.fit(other, self.need(other, lane)))
            if t < start < t + length and (other >= self.p.n_ops or all(
                    f > start for k, f in enumerate(self.free) if k != lane)):
                return True
        return False

    def dummies(self, arrangement: Arrangement) -> list[tuple[int, Key]]:
        """Captures of an arrangement that take slots of their own."""
        out = []
        for s in arrangement.slots:
            if s.term is None and s.op is not None:
                for kind, name in enumerate(KINDS):
                    key = self.p.keys[s.op][kind]
                    if getattr(s, f"cap_{name}") and key is not None:
                        out.append((kind, key))
        return out

    def giver(self, t: int, node: int, lane: int, kind: int, key: Key) -> tuple[int, _Fit] | None:
        """A short group that can start now and capture what ``node`` would need a slot for."""
        for other in self.p.givers.get((kind, key), ()):
            if other == node or self.waits[other] or (-self.priority[other], other) \
                    not in self.awake or self.p.needs[other][kind]:
                continue
            f = self.fit(other, self.need(other, lane))[0]
            if f[0] <= t and f[1] <= self.style.detour \
                    and (lane or self.may_write(t + f[1] - 1 + self.write)):
                return other, f
        return None

    def place(self, t: int, node: int, lane: int, fit: _Fit, forced: tuple[int, Key] | None
              ) -> None:
        """Put a group into a lane."""
        _, length, arrangement, order = fit
        problem = self.p
        slots: Sequence[Slot] = [arrangement.slots[k] for k in order]
        self.awake.remove((-self.priority[node], node))
        self.free[lane] = t + length
        for s in slots:
            for v in (s.a, s.b):
                if v in problem.inputs and v is not None:
                    self.horizon = max(self.horizon, self.ready[v] - 1)
        if node < problem.n_ops:
            end = t + length - 1
            op = problem.program.ops[node]
            self.ready[op.dest] = end + problem.machine.latency
            held = self.held[lane]
            for kind, key in enumerate(problem.keys[node]):
                if key is not None:
                    held[kind] = key
                    self.pending[kind][key] -= 1
            if problem.gifts[node]:
                slots = give(slots, op, problem.gifts[node], held, lambda kind, key:
                             (kind, key) == forced or self.pending[kind][key] > 0
                             and not self.wanted(kind, held[kind]))
            if lane == 0:
                self.writes0.add(end + self.write)
                if self.gets and end + self.write <= self.gets[-1]:
                    self.delay(end + self.write)
        self.groups.append((node, lane, t, slots))
        self.watch(t, node, t + length - 1)
        for k in problem.consumers[node]:
            self.waits[k] -= 1
            if not self.waits[k]:
                self.known(k)

    def watch(self, t: int, node: int, end: int) -> None:
        """Note when the limit can no longer be met."""
        far, (latency, length) = self.p.far, self.limit
        tail = far.urgent[node]
        read = Machine.STAGE_READ
        if tail is not None:
            self.urgent_slots -= far.slots[node]
            more = self.urgent_slots // len(self.free)  # cycles that the rest needs at least
            if max(end + tail, t + more) + read + 1 > latency:
                self.over = True
            if not self.urgent_slots and end + read + 1 < latency:
                self.limit = (_NEVER, _NEVER)
        if end + far.total[node] > length and self.limit[0] != _NEVER:
            # Too long, unless the latency still gets better.
            self.over = self.over or not self.urgent_slots

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
        """Times of everything placed."""
        problem = self.p
        n_ops, read = problem.n_ops, problem.machine.STAGE_READ
        length = max(self.gets[-1] + 1 if self.gets else 2, 2)
        emits = urgent = count = 0
        for node, _, start, slots in self.groups:
            count += len(slots)
            if node < n_ops:
                length = max(length, start + len(slots) + self.write)
            else:
                length = max(length, start + read + 1)
                emits += start
                if node - n_ops == problem.urgent - 1:
                    urgent = start + read + 1
        return Attempt((urgent, length, count, emits), tuple(self.groups), tuple(self.gets),
                       length)
