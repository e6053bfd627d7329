"""Register allocation: every value of a schedule gets a register, for as long as it is needed.

The lower half of a bank holds, from offset 0 of bank 0 on, the parameters in the order of the
program (their addresses depend on nothing else: the host writes them), then what lives for a while
(inputs in bank 0, results in the bank of their lane), then the constants. Constants with the same
word share a register. The upper half holds the states, current ones at ``1 0 ...`` and next ones
at ``1 1 ...``, in the bank of the lane that computes the next value.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass

from gateware.machine import Machine
from gateware.slots import Schedule, ScheduleError
from model.program import Kind

__all__ = ["Allocation", "Tenant", "allocate", "parameter_addresses", "result_bank"]


@dataclass(frozen=True)
class Tenant:
    """``value`` owns register ``address`` from cycle ``start`` (readable) to ``end`` (last read).

    Parameters, constants and current states own theirs from cycle 0 to the end of the program.
    """

    value: int
    address: int
    start: int
    end: int


@dataclass(frozen=True)
class Allocation:
    """Where every value lives.

    ``tenants`` has one entry for each value that has a register, in the order of values;
    ``initial`` are the unsigned words of all registers before the first update.
    """

    tenants: tuple[Tenant, ...]
    initial: tuple[int, ...]

    def addresses(self) -> dict[int, int]:
        """Register of each value."""
        return {t.value: t.address for t in self.tenants}

    def occupant(self, address: int, cycle: int) -> int | None:
        """Value that a read of ``address`` in ``cycle`` is meant for."""
        for t in self.tenants:
            if t.address == address and t.start <= cycle <= t.end:
                return t.value
        return None

    def used(self, machine: Machine) -> tuple[tuple[int, int], ...]:
        """Registers in use per bank: lower half, state pairs."""
        depth = machine.bank_depth
        lower: list[set[int]] = [set() for _ in range(machine.lanes)]
        state: list[set[int]] = [set() for _ in range(machine.lanes)]
        for t in self.tenants:
            bank, offset = divmod(t.address, depth)
            if offset < depth // 2:
                lower[bank].add(offset)
            else:
                state[bank].add(offset % machine.state_slots)
        return tuple((len(a), len(b)) for a, b in zip(lower, state, strict=True))

    def to_json(self) -> str:
        """The allocation as JSON."""
        return json.dumps(asdict(self), indent=1, sort_keys=True)

    @classmethod
    def from_json(cls, text: str) -> Allocation:
        """Inverse of `to_json`."""
        d = json.loads(text)
        return cls(tuple(Tenant(**t) for t in d["tenants"]), tuple(d["initial"]))


def parameter_addresses(schedule: Schedule) -> dict[str, int]:
    """Register of each parameter by name: what the host writes to."""
    program = schedule.program
    return {program.values[n].name: k for k, n in enumerate(program.of_kind(Kind.PARAM))}


def result_bank(schedule: Schedule, op: int) -> int:
    """Bank that the result of an op is written to: that of its lane."""
    return schedule.ends[op].lane


def allocate(schedule: Schedule) -> Allocation:
    """Give every value of the schedule a register.

    Raises
    ------
    ScheduleError
        If a bank is full; the message counts what was wanted and what there is.
    """
    return _Allocator(schedule).run()


class _Allocator:
    def __init__(self, schedule: Schedule) -> None:
        self.schedule = schedule
        self.program = schedule.program
        self.machine = schedule.machine
        self.last_read = _last_reads(schedule)
        self.tenants: dict[int, Tenant] = {}
        self.half = self.machine.bank_depth // 2
        #: First offset of each bank's lower half that nobody has owned yet.
        self.top = [0] * self.machine.lanes
        self.end = schedule.length - 1

    def run(self) -> Allocation:
        program = self.program
        params = program.of_kind(Kind.PARAM)
        if len(params) > self.half:
            raise self.full("parameters", 0, len(params), self.half)
        for n in params:
            self.own(n, self.top[0], 0, self.end)
            self.top[0] += 1
        self.states()
        self.temporaries()
        self.constants()
        mask = (1 << self.machine.arithmetic.word) - 1
        initial = [0] * (self.machine.bank_depth * self.machine.lanes)
        following = dict(program.states)
        for n, t in self.tenants.items():
            value = program.values[n]
            if value.kind in (Kind.PARAM, Kind.CONST, Kind.STATE):
                initial[t.address] = value.initial & mask
            if value.kind is Kind.STATE:  # both copies: whatever the parity is
                initial[self.tenants[following[n]].address] = value.initial & mask
        return Allocation(tuple(self.tenants[n] for n in sorted(self.tenants)), tuple(initial))

    def own(self, value: int, address: int, start: int, end: int) -> None:
        self.tenants[value] = Tenant(value, address, start, end)

    def full(self, what: str, bank: int, wanted: int, there: int) -> ScheduleError:
        return ScheduleError(f"{self.program.name}: {what} need {wanted} registers of bank {bank}, "
                             f"the {self.machine.name} machine has {there} for them")

    def states(self) -> None:
        """Pairs of current and next states."""
        machine = self.machine
        producer = {op.dest: k for k, op in enumerate(self.program.ops)}
        count = [0] * machine.lanes
        for state, after in self.program.states:
            bank = result_bank(self.schedule, producer[after])
            base = bank * machine.bank_depth + self.half + count[bank]
            self.own(state, base, 0, self.end)
            written = self.schedule.write_cycle(producer[after])
            self.own(after, base + machine.state_slots, written + 1, self.end)
            count[bank] += 1
        for bank, n in enumerate(count):
            if n > machine.state_slots:
                raise self.full("states", bank, n, machine.state_slots)

    def temporaries(self) -> None:
        """Inputs and results, in the order in which they are written; registers are reused."""
        schedule, program = self.schedule, self.program
        births = [(g, n, 0) for g, n in zip(schedule.gets, program.inputs, strict=True)]
        births += [(schedule.write_cycle(k), op.dest, result_bank(schedule, k))
                   for k, op in enumerate(program.ops) if op.dest not in self.tenants]
        start = list(self.top)
        busy: list[dict[int, int]] = [{} for _ in start]  # offset -> last read of its owner
        for written, n, bank in sorted(births):
            offset = next((k for k, end in sorted(busy[bank].items()) if end < written),
                          self.top[bank])
            self.top[bank] = max(self.top[bank], offset + 1)
            end = max(self.last_read.get(n, 0), written)
            busy[bank][offset] = end
            self.own(n, bank * self.machine.bank_depth + offset, written + 1, end)
        for bank, top in enumerate(self.top):
            if top > self.half:
                raise self.full("parameters, inputs and results", bank, top, self.half)

    def constants(self) -> None:
        """Constants that are read: one register for each word, in the emptiest bank."""
        owner: dict[int, int] = {}
        wanted = [n for n in self.program.of_kind(Kind.CONST) if n in self.last_read]
        words = {self.program.values[n].initial for n in wanted}
        room = sum(self.half - top for top in self.top)
        if len(words) > room:
            raise ScheduleError(f"{self.program.name}: {len(words)} constants, {room} registers of "
                                f"the {self.machine.name} machine left for them")
        for n in wanted:
            word = self.program.values[n].initial
            if word not in owner:
                bank = min(range(len(self.top)), key=self.top.__getitem__)
                owner[word] = bank * self.machine.bank_depth + self.top[bank]
                self.top[bank] += 1
            self.own(n, owner[word], 0, self.end)


def _last_reads(schedule: Schedule) -> dict[int, int]:
    """Cycle of the last read of every value."""
    last: dict[int, int] = {}
    for s in schedule.slots:
        reads: Iterable[int] = (s.a,) if s.b is None else (s.a, s.b)
        for v in reads:
            last[v] = max(last.get(v, 0), s.cycle)
    return last
