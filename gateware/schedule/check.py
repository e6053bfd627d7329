"""Checker: proves a schedule and its registers against the program, independent of the scheduler.

It replays the schedule cycle by cycle with *names* in place of words: each register holds the value
last written to it, each capture register the value captured. A schedule passes if every slot reads
the values of its op. Nothing here uses the code that made the schedule.
"""

from __future__ import annotations

from collections import Counter, defaultdict

from boresight.gateware.machine import Machine
from boresight.gateware.schedule.allocate import Allocation
from boresight.gateware.schedule.slots import Schedule, ScheduleError, Slot
from boresight.model.words.program import Kind, Negate, Op, Overflow, Program, Scale, Term, When


def check_schedule(
    program: Program, schedule: Schedule, allocation: Allocation, *, parameters_before: int = 0
) -> None:
    """Pass, or raise `ScheduleError` with the op and the cycle of the first fault.

    Parameters
    ----------
    program : Program
        The source program.
    schedule, allocation
        Its schedule and registers.
    parameters_before : int
        Parameters of the programs before it in the core. `gateware.schedule.check_core` checks
        that programs do not disturb each other.
    """
    _check_copies(program, schedule)
    _check_registers(schedule, allocation, parameters_before)
    _check_groups(schedule)
    _check_streams(schedule)
    _Replay(schedule, allocation).run()


def _fail(schedule: Schedule, cycle: int | None, op: int | None, message: str) -> ScheduleError:
    where = schedule.program.name
    if cycle is not None:
        where += f": cycle {cycle}"
    if op is not None:
        where += f": op {_name(schedule, schedule.program.ops[op].dest)}"
    return ScheduleError(f"{where}: {message}")


def _name(schedule: Schedule, value: int | None) -> str:
    return "nothing" if value is None else schedule.program.values[value].name


def _check_copies(program: Program, schedule: Schedule) -> None:
    """The scheduled program is the source program plus copies for states."""
    lowered = schedule.program
    unchanged = (
        lowered.values[: len(program.values)] == program.values
        and lowered.ops[: len(program.ops)] == program.ops
        and lowered.inputs == program.inputs
        and lowered.links == program.links
        and lowered.outputs == program.outputs
        and lowered.table_memory == program.table_memory
        and lowered.arithmetic == program.arithmetic
        and len(lowered.states) == len(program.states)
        and schedule.source == program.digest
    )
    if not unchanged or lowered.arithmetic != schedule.machine.arithmetic:
        raise _fail(schedule, None, None, "the schedule is not that of this program")
    producers = {op.dest: op for op in lowered.ops}
    if len(producers) != len(lowered.ops):
        raise _fail(schedule, None, None, "two ops make the same value")
    targets: set[int] = set()
    for (state, after), (state2, target) in zip(program.states, lowered.states, strict=True):
        copied = target == after or _copies(lowered, producers.get(target), after)
        if state != state2 or not copied or target not in producers or target in targets:
            raise _fail(
                schedule, None, None, f"state {_name(schedule, state)} has no separate next value"
            )
        targets.add(target)


def _copies(program: Program, op: Op | None, value: int) -> bool:
    """Whether ``op`` is value * 2^k >> (k - G), which equals the value."""
    if op is None or len(op.terms) != 1:
        return False
    t = op.terms[0]
    expected = Term(value, t.b, t.shift)
    if t != expected or t.b is None or program.values[t.b].kind is not Kind.CONST:
        return False
    return program.values[t.b].initial == 1 << (t.shift + program.arithmetic.guard)


def _check_registers(schedule: Schedule, allocation: Allocation, before: int) -> None:
    """Fixed addresses, initial words, the layout of the states."""
    machine, program = schedule.machine, schedule.program
    depth, half = machine.bank_depth, machine.bank_depth // 2
    where = allocation.addresses()
    mask = (1 << machine.arithmetic.word) - 1
    if len(allocation.initial) != depth * machine.lanes:
        raise _fail(
            schedule,
            None,
            None,
            f"{len(allocation.initial)} initial words, there must be {depth * machine.lanes}",
        )
    states = {n for pair in program.states for n in pair} | set(program.linked)
    unwritten = {where.get(after) for _, after in program.states}
    for n, address in where.items():
        name = _name(schedule, n)
        if not 0 <= address < depth * machine.lanes:
            raise _fail(schedule, None, None, f"register {address} of {name} does not exist")
        temporary = program.values[n].kind in (Kind.INPUT, Kind.OP) and address in unwritten
        if (address % depth >= half) != (n in states) and not temporary:
            raise _fail(schedule, None, None, f"{name} is on the wrong side of the state region")
        if (
            program.values[n].kind in (Kind.CONST, Kind.PARAM, Kind.STATE)
            and allocation.initial[address] != program.values[n].initial & mask
        ):
            raise _fail(
                schedule, None, None, f"register {address} must start with the word of {name}"
            )
    for k, n in enumerate(program.of_kind(Kind.PARAM)):
        fixed = _parameter_register(depth, machine.lanes, before + k)
        if where.get(n) != fixed:
            raise _fail(
                schedule,
                None,
                None,
                f"parameter {_name(schedule, n)} must be in register {fixed}, not {where.get(n)}",
            )
    for state, after in program.states:
        current, following = where[state], where[after]
        if current % depth - half >= half // 2 or following != current + half // 2:
            raise _fail(
                schedule,
                None,
                None,
                f"state {_name(schedule, state)}: registers "
                f"{current} and {following} must differ in bit c alone",
            )
    owners = Counter(where[s] for s, _ in program.states)
    if any(n > 1 for n in owners.values()):
        raise _fail(schedule, None, None, "two states share a register")


def _parameter_register(depth: int, lanes: int, number: int) -> int:
    """Register of the core's parameter ``number``: 48 of 256 words of each bank but the last."""
    if lanes == 1:
        return number
    room = depth * 48 // 256
    return number if number < room else depth + number - room


def _check_groups(schedule: Schedule) -> None:
    """Every op once, with exactly its terms, in consecutive slots of one lane."""
    program, machine = schedule.program, schedule.machine
    occupied: set[tuple[int, int]] = set()
    groups: dict[int, list[Slot]] = defaultdict(list)
    for s in schedule.slots:
        if s.cycle < 0 or not 0 <= s.lane < machine.lanes:
            raise _fail(schedule, s.cycle, s.op, f"lane {s.lane} or cycle {s.cycle} does not exist")
        if (s.cycle, s.lane) in occupied:
            raise _fail(schedule, s.cycle, s.op, f"two slots in lane {s.lane}")
        occupied.add((s.cycle, s.lane))
        if s.op is not None:
            groups[s.op].append(s)
        elif (
            s.emit is None
            or s.first
            or s.last
            or s.cap_index
            or s.cap_flag
            or s.cap_norm
            or s.b is not None
            or s.term is not None
        ):
            raise _fail(schedule, s.cycle, None, "a slot without op must be an emit and no more")
    for k, op in enumerate(program.ops):
        if k not in groups:
            raise _fail(schedule, None, k, "is missing")
        _check_group(schedule, k, op, sorted(groups.pop(k), key=lambda s: s.cycle))
    if groups:
        raise _fail(schedule, None, None, f"ops {sorted(groups)} do not exist")


def _check_group(schedule: Schedule, number: int, op: Op, slots: list[Slot]) -> None:
    """One group."""
    start, last = slots[0].cycle, len(slots) - 1
    terms = Counter(s.term for s in slots if s.term is not None)
    for k in range(len(op.terms)):
        if terms.pop(k, 0) != 1:
            raise _fail(schedule, start, number, f"term {k} must be issued once")
    if terms:
        raise _fail(schedule, start, number, f"terms {sorted(terms)} do not exist")
    for k, s in enumerate(slots):
        if s.cycle != start + k or s.lane != slots[0].lane:
            raise _fail(
                schedule,
                s.cycle,
                number,
                "the slots of a group must be consecutive cycles of one lane",
            )
        if s.first != (k == 0) or s.last != (k == last):
            raise _fail(schedule, s.cycle, number, "first and last must mark the ends of the group")
        if s.term is None:
            if s.b is not None or s.swap:
                raise _fail(schedule, s.cycle, number, "a slot without term must only capture")
            continue
        t = op.terms[s.term]
        if (s.b, s.a) != (t.a, t.b) if s.swap else (s.a, s.b) != (t.a, t.b):
            raise _fail(
                schedule,
                s.cycle,
                number,
                f"term {s.term} does not multiply {_name(schedule, s.a)} by {_name(schedule, s.b)}",
            )
        if (t.b is None) != (t.coefficient is not None) or (t.b is None and op.table is None):
            raise _fail(
                schedule,
                s.cycle,
                number,
                f"term {s.term} must have a value or a coefficient of the op's table",
            )
        if t.coefficient is not None and (
            s.swap
            or t.fraction_b
            or not 0 <= t.coefficient <= 3
            or not 0 <= (op.table or 0) < Machine.TABLE_BLOCKS
        ):
            raise _fail(schedule, s.cycle, number, f"term {s.term}: illegal table operand")
        if not 0 <= t.shift <= 31:
            raise _fail(schedule, s.cycle, number, f"shift must be 0 to 31, not {t.shift!r}")
    if op.overflow not in Overflow:
        raise _fail(schedule, start, number, "unknown overflow")


def _check_streams(schedule: Schedule) -> None:
    """Order of gets and emits, ports, length."""
    program, gets = schedule.program, schedule.gets
    read, write = schedule.machine.stages.read, schedule.machine.stages.write
    if len(gets) != len(program.streamed):
        raise _fail(schedule, None, None, f"{len(gets)} gets for {len(program.streamed)} inputs")
    if gets and gets[0] != 0 or any(b <= a for a, b in zip(gets, gets[1:], strict=False)):
        raise _fail(schedule, None, None, "gets must start in cycle 0 and follow in stream order")
    emits = [s for s in sorted(schedule.slots, key=lambda s: s.cycle) if s.emit is not None]
    if [s.emit for s in emits] != list(range(len(program.outputs))):
        raise _fail(schedule, None, None, "emits must be every output once in stream order")
    for s in emits:
        assert s.emit is not None
        if s.lane != 0:
            raise _fail(schedule, s.cycle, None, "only lane 0 can emit")
        if s.a != program.outputs[s.emit]:
            raise _fail(
                schedule,
                s.cycle,
                None,
                f"output {s.emit} is "
                f"{_name(schedule, program.outputs[s.emit])}, not {_name(schedule, s.a)}",
            )
        if s.cycle + read in gets:
            raise _fail(schedule, s.cycle, None, f"emit {s.emit} works in the cycle of a get")
    for s in schedule.slots:
        if s.last and s.lane == 0 and s.cycle + write in gets:
            raise _fail(schedule, s.cycle, s.op, "the result is written in the cycle of a get")
        end = s.cycle + (write if s.op is not None else read)
        if end >= schedule.length:
            raise _fail(schedule, s.cycle, s.op, f"is not finished in {schedule.length} cycles")
    if gets and gets[-1] >= schedule.length:
        raise _fail(schedule, gets[-1], None, f"get behind the end at {schedule.length}")
    if schedule.length > schedule.machine.rom_words:
        raise _fail(
            schedule,
            None,
            None,
            f"{schedule.length} microwords, the machine has {schedule.machine.rom_words}",
        )


def _word_of(program: Program, value: int) -> object:
    """Key that values of one register must have in common."""
    if link := program.linked.get(value):
        return link.program, link.state
    return Kind.CONST if program.values[value].kind is Kind.CONST else value


class _Replay:
    """The schedule with names in place of words."""

    def __init__(self, schedule: Schedule, allocation: Allocation) -> None:
        self.schedule = schedule
        program = schedule.program
        self.where = allocation.addresses()
        lanes = schedule.machine.lanes
        #: Values whose word each register holds; several only for equal constants, and for inputs
        #: that read the same word of another program.
        self.contents: dict[int, set[int]] = defaultdict(set)
        self.fixed: set[int] = set()
        for n, address in self.where.items():
            lasting = program.values[n].kind in (Kind.CONST, Kind.PARAM, Kind.STATE)
            if lasting or n in program.linked:
                self.contents[address].add(n)
                self.fixed.add(address)
        for address, values in self.contents.items():
            if len({_word_of(program, n) for n in values}) > 1:
                raise _fail(
                    schedule,
                    None,
                    None,
                    f"register {address} is shared by "
                    + " and ".join(_name(schedule, n) for n in sorted(values)),
                )
        self.writes: dict[int, dict[int, int]] = defaultdict(dict)
        self.captured: list[dict[str, tuple[int, bool]]] = [{} for _ in range(lanes)]
        #: Indices captured in each lane, by the cycle of the first slot that they serve.
        self.indices: list[dict[int, tuple[int, bool]]] = [{} for _ in range(lanes)]
        for s in schedule.slots:
            if s.last and s.op is not None:
                self.write(
                    s.cycle + schedule.machine.stages.write, program.ops[s.op].dest, s.lane, s.op
                )
        for n, cycle in zip(program.streamed, schedule.gets, strict=True):
            self.write(cycle, n, 0, None)

    def write(self, cycle: int, value: int, lane: int, op: int | None) -> None:
        """Record a write and check its register."""
        address = self.where.get(value)
        if address is None or address // self.schedule.machine.bank_depth != lane:
            raise _fail(
                self.schedule,
                cycle,
                op,
                f"lane {lane} writes "
                f"{_name(self.schedule, value)} to register {address}, which is not in its "
                "bank",
            )
        if address in self.fixed:
            raise _fail(
                self.schedule,
                cycle,
                op,
                f"register {address} of "
                f"{_name(self.schedule, min(self.contents[address]))} is overwritten",
            )
        self.writes[cycle][address] = value

    def run(self) -> None:
        """All cycles, then the states."""
        issued: dict[int, list[Slot]] = defaultdict(list)
        for s in self.schedule.slots:
            issued[s.cycle].append(s)
        for cycle in range(self.schedule.length):
            for s in issued[cycle]:
                self.slot(s)
            for address, value in self.writes[cycle].items():
                self.contents[address] = {value}
        for state, after in self.schedule.program.states:
            if self.contents[self.where[after]] != {after}:
                raise _fail(
                    self.schedule,
                    self.schedule.length - 1,
                    None,
                    f"the next value of state {_name(self.schedule, state)} is lost",
                )

    def slot(self, s: Slot) -> None:
        """Operands, captures and their use in one slot."""
        self.read(s, s.a)
        if s.b is not None:
            self.read(s, s.b)
        if s.op is None:
            return
        op = self.schedule.program.ops[s.op]
        captured = self.captured[s.lane]
        term = None if s.term is None else op.terms[s.term]
        indices = self.indices[s.lane]
        for cycle in [c for c in indices if c <= s.cycle]:
            captured["index"] = indices.pop(cycle)
        if term is not None and term.coefficient is not None:
            self.holds(s, "index", op.index, op.index_quarter)
        if s.cap_index:
            indices[s.cycle + self.schedule.machine.index_delay] = (s.a, s.quarter)
        if s.cap_flag:
            captured["flag"] = (s.a, s.quarter)
        if s.cap_norm:
            captured["norm"] = (s.a, False)
        if term is None:
            return
        if term.negate in (Negate.IF, Negate.UNLESS) or term.when in (When.IF, When.UNLESS):
            self.holds(s, "flag", op.flag, op.flag_quarter)
        if term.scale is not Scale.NONE:
            self.holds(s, "norm", op.norm, False)

    def read(self, s: Slot, value: int) -> None:
        """Check that the register of ``value`` holds it and is not written in this cycle."""
        schedule = self.schedule
        name, address = _name(schedule, value), self.where.get(value)
        if address is None:
            raise _fail(schedule, s.cycle, s.op, f"{name} has no register")
        if value not in self.contents[address]:
            contents = ", ".join(_name(schedule, n) for n in sorted(self.contents[address]))
            raise _fail(
                schedule,
                s.cycle,
                s.op,
                f"reads {name} from register {address}, which holds {contents or 'nothing'}",
            )
        if address in self.writes[s.cycle]:
            raise _fail(
                schedule, s.cycle, s.op, f"reads register {address} of {name} while it is written"
            )

    def holds(self, s: Slot, kind: str, value: int | None, quarter: bool) -> None:
        """Check that the lane's capture register was captured from ``value``."""
        captured = self.captured[s.lane].get(kind)
        if captured != (value, quarter):
            found = (
                "nothing"
                if captured is None
                else _name(self.schedule, captured[0]) + (" plus quarter" if captured[1] else "")
            )
            wanted = _name(self.schedule, value) + (" plus quarter" if quarter else "")
            raise _fail(
                self.schedule,
                s.cycle,
                s.op,
                f"wants the {kind} of {wanted}, the lane holds that of {found}",
            )
