"""Register allocation: every value of a schedule gets a register while it is read.

The lower half of the banks holds the parameters of all programs of a core, in order (the host
writes them, so their addresses depend on nothing else; `Machine.parameter_register`), then
temporary values (inputs in bank 0, results in the bank of their lane), then the constants. Only one
program runs at a time, so all share the registers of inputs and results; constants with the same
word share a register, too. The upper half holds the states, current ones at ``1 0 ...`` and next
ones at ``1 1 ...``, in the bank of the lane that computes the next value. Each program has
its own, so a program that does not run preserves its states. State registers that no program needs
hold initial words of states for the restart routines, the same word in both copies.

If the lower half does not suffice, temporary values also use the registers of next states of their
own program, until these are written.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from boresight.gateware.machine import Machine
from boresight.gateware.schedule.slots import Schedule, ScheduleError, copy_shift
from boresight.model.words.program import Kind


@dataclass(frozen=True)
class Allocation:
    """Registers of a program: ``addresses`` by value.

    ``initial`` are the unsigned words of all registers of the core before the first update, and
    ``constants`` the registers of its constants: pairs of word and address.
    """

    addresses: dict[int, int]
    initial: tuple[int, ...]
    constants: tuple[tuple[int, int], ...]


def allocate_together(schedules: Sequence[Schedule]) -> tuple[Allocation, ...]:
    """Assign registers to all values of the schedules, which have one machine.

    Raises ScheduleError if a bank is full; the message has the numbers required and available.
    """
    core = _Core(schedules[0].machine)
    parts = [_Allocator(schedule, core) for schedule in schedules]
    for part in parts:
        part.parameters()
    for part in parts:
        part.states()
    words = {word for part in parts for word in part.constant_words()}
    starts = {word for part in parts for word in part.start_words()} - words
    core.spare(sorted(starts))
    words |= starts - core.constants.keys()
    for spread in (False, True):
        shared = [part.temporaries(spread=spread) for part in parts]
        top = [max(tops) for tops in zip(*shared, strict=True)]
        if max(top) <= core.half and sum(core.half - n for n in top) >= len(words):
            break
    for part, tops in zip(parts, shared, strict=True):
        for bank, used in enumerate(tops):
            if used > core.half:
                raise part.full("parameters, inputs and results", bank, used, core.half)
    core.top = top
    initial = [0] * core.machine.register_words
    for part in parts:
        part.constants()
    for part in parts:
        part.fill(initial)
    return tuple(part.result(initial) for part in parts)


class _Core:
    """Registers in use by the programs of a core."""

    def __init__(self, machine: Machine) -> None:
        self.machine = machine
        self.half = machine.bank_depth // 2
        self.parameters = 0
        #: State pairs of each bank.
        self.states = [0] * machine.lanes
        #: First unused offset of each bank's lower half.
        self.top = [0] * machine.lanes
        #: Register of each constant word.
        self.constants: dict[int, int] = {}

    def spare(self, words: Iterable[int]) -> None:
        """Put constants into unused registers of states, as many as there are."""
        for word in words:
            bank = min(range(len(self.states)), key=self.states.__getitem__)
            if self.states[bank] < self.machine.state_slots:
                offset = self.half + self.states[bank]
                self.constants[word] = bank * self.machine.bank_depth + offset
                self.states[bank] += 1


class _Allocator:
    """Allocation of one program."""

    def __init__(self, schedule: Schedule, core: _Core) -> None:
        self.schedule, self.core = schedule, core
        self.program, self.machine = schedule.program, schedule.machine
        self.last_read = _last_reads(schedule)
        self.producer = {op.dest: k for k, op in enumerate(self.program.ops)}
        self.addresses: dict[int, int] = {}

    def result(self, initial: Iterable[int]) -> Allocation:
        return Allocation(self.addresses, tuple(initial), tuple(self.core.constants.items()))

    def fill(self, initial: list[int]) -> None:
        """Put this program's initial words into the core's."""
        program = self.program
        mask = (1 << self.machine.arithmetic.word) - 1
        following = dict(program.states)
        for n, address in self.addresses.items():
            value = program.values[n]
            if value.kind in (Kind.PARAM, Kind.STATE):
                initial[address] = value.initial & mask
            if value.kind is Kind.STATE:  # both copies, for either parity
                initial[self.addresses[following[n]]] = value.initial & mask
        for word, address in self.core.constants.items():
            initial[address] = word & mask
            if address % self.machine.bank_depth >= self.core.half:
                initial[address + self.machine.state_slots] = word & mask

    def full(self, kind: str, bank: int, wanted: int, room: int) -> ScheduleError:
        machine = self.machine
        addressed = kind == "parameters" and wanted > machine.bus_bank_words
        return ScheduleError(
            f"{self.program.name}: {kind} need {wanted} registers of bank {bank}, "
            f"the {machine.name} machine has {room} for them"
            + ("; the bus has no more addresses" if addressed else machine.remedy(wanted, room))
        )

    def parameters(self) -> None:
        """Fixed registers, after those of the programs before this one."""
        core, machine, params = self.core, self.machine, self.program.of_kind(Kind.PARAM)
        bank, room = machine.lanes - 1, machine.parameter_room
        last = machine.parameter_register(core.parameters + len(params) - 1)
        if (wanted := last + 1 - bank * machine.bank_depth) > room:
            raise self.full("parameters", bank, wanted, room)
        for n in params:
            address = machine.parameter_register(core.parameters)
            bank, offset = divmod(address, machine.bank_depth)
            core.parameters += 1
            core.top[bank] = offset + 1
            self.addresses[n] = address

    def states(self) -> None:
        machine, core = self.machine, self.core
        for state, after in self.program.states:
            bank = self.schedule.ends[self.producer[after]].lane
            base = bank * machine.bank_depth + core.half + core.states[bank]
            core.states[bank] += 1
            self.addresses |= {state: base, after: base + machine.state_slots}

    def temporaries(self, *, spread: bool) -> list[int]:
        """Inputs and results, in the order in which they are written; registers are reused.

        With ``spread``, registers of next states are used first, each for values last read before
        it is written. Returns the offset up to which each bank's lower half is needed.
        """
        schedule, program = self.schedule, self.program
        next_states = {after for _, after in program.states}
        unwritten = self._unwritten() if spread else [{} for _ in self.core.top]
        births = [(g, n, 0) for g, n in zip(schedule.gets, program.inputs, strict=True)]
        births += [
            (schedule.write_cycle(k), op.dest, schedule.ends[k].lane)
            for k, op in enumerate(program.ops)
            if op.dest not in next_states
        ]
        top = list(self.core.top)
        # Offset -> last read of its value.
        busy = [dict.fromkeys(offsets, -1) for offsets in unwritten]
        for written, n, bank in sorted(births):
            end = max(self.last_read.get(n, 0), written)
            available = [k for k, last in sorted(busy[bank].items()) if last < written]
            fit = [k for k in available if end < unwritten[bank].get(k, 0)]
            if fit:  # the shortest sufficient time
                offset = min(fit, key=unwritten[bank].__getitem__)
            else:
                offset = next((k for k in available if k not in unwritten[bank]), top[bank])
                top[bank] = max(top[bank], offset + 1)
            busy[bank][offset] = end
            self.addresses[n] = bank * self.machine.bank_depth + offset
        return top

    def _unwritten(self) -> list[dict[int, int]]:
        """For each bank, the cycles in which the program's next states are written, by offset."""
        out: list[dict[int, int]] = [{} for _ in self.core.top]
        for _, after in self.program.states:
            bank, offset = divmod(self.addresses[after], self.machine.bank_depth)
            out[bank][offset] = self.schedule.write_cycle(self.producer[after])
        return out

    def constant_words(self) -> set[int]:
        """Words of the constants that are read."""
        return {self.program.values[n].initial for n in self._constants()}

    def _constants(self) -> list[int]:
        return [n for n in self.program.of_kind(Kind.CONST) if n in self.last_read]

    def start_words(self) -> set[int]:
        """Words that the restart routine reads: initial ones, and one for copies."""
        starts = {self.program.values[state].initial for state, _ in self.program.states} - {0}
        arith, words = self.machine.arithmetic, starts | self.constant_words()
        if starts and all(copy_shift(word, arith) is None for word in words):
            starts.add(1 << arith.guard)
        return starts

    def constants(self) -> None:
        """Constants that are read: one register for each word, in the emptiest bank."""
        core, registers = self.core, self.core.constants
        read = {n: self.program.values[n].initial for n in self._constants()}
        words = (self.constant_words() | self.start_words()) - registers.keys()
        room = sum(core.half - top for top in core.top)
        if len(words) > room:
            capacity = core.half * len(core.top)
            raise ScheduleError(
                f"{self.program.name}: {len(words)} constants, {room} registers of the "
                f"{self.machine.name} machine left for them"
                f"{self.machine.remedy(capacity + len(words) - room, capacity)}"
            )
        for word in dict.fromkeys((*read.values(), *sorted(words))):
            if word not in registers:
                bank = min(range(len(core.top)), key=core.top.__getitem__)
                registers[word] = bank * self.machine.bank_depth + core.top[bank]
                core.top[bank] += 1
        for n, word in read.items():
            self.addresses[n] = registers[word]


def _last_reads(schedule: Schedule) -> dict[int, int]:
    last: dict[int, int] = {}
    for s in schedule.slots:  # in the order of their cycles
        last |= {v: s.cycle for v in (s.a, s.b) if v is not None}
    return last
