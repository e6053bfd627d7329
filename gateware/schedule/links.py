"""Links between the programs of a core (`Input.source`).

The output that is read becomes a state of the program that computes it, unless it is already the
next value of one. So it changes only when an update of that program is complete, with any stalls,
faults or resets. The reader reads it like one of its own states, but with the parity of the other
program. States that others may read are in a `Window` of the state region, from which the hardware
determines whose parity applies.

`gateware.schedule.check_core` proves that a reader reads no other words of other programs.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

from boresight.gateware.schedule.slots import Schedule, ScheduleError
from boresight.model.linking import first_word
from boresight.model.words.program import Kind, Program, Value


@dataclass(frozen=True)
class Window:
    """The last state slots of every bank, which other programs may read.

    Parameters
    ----------
    size : int
        Number of slots in each bank, a power of two.
    owners : tuple of int
        Numbers of the programs that own equal blocks of slots, a power of two each.
    """

    size: int
    owners: tuple[int, ...]

    @property
    def block(self) -> int:
        """Slots of an owner in each bank."""
        return self.size >> (len(self.owners) - 1).bit_length()

    def first(self, owner: int, slots: int) -> int:
        """First slot of a program's block, of ``slots`` in a bank."""
        return slots - self.size + self.owners.index(owner) * self.block

    def owner(self, slot: int, slots: int) -> int | None:
        """Program whose parity applies to a slot; None for the program that runs."""
        index = (slot - (slots - self.size)) // self.block
        return self.owners[index] if 0 <= index < len(self.owners) else None


def tied(programs: Sequence[Program]) -> list[Program]:
    """Return the programs of one core with links to each other.

    Parameters
    ----------
    programs : sequence of Program
        Programs of `model.linking.linked_estimators`, in the order of their numbers.

    Raises
    ------
    ValueError
        A linked input and its source differ in the binary point: the estimators were not linked.
    """
    linked = {p.name: p for p in programs}
    for program in programs:
        links = []
        for link in program.links:
            owner, state = linked.get(link.program), None
            if owner is not None:
                owner, state = _with_state(owner, link.output)
                if program.values[link.value].frac != owner.values[state].frac:
                    raise ValueError(
                        f"{program.name} must take {link.program}.{link.output} as "
                        f"{owner.format(state)}, not as {program.format(link.value)}"
                    )
                linked[owner.name] = owner
            links.append(replace(link, state=state))
        if links:
            linked[program.name] = replace(linked[program.name], links=tuple(links))
    return [linked[p.name] for p in programs]


def _with_state(program: Program, output: str) -> tuple[Program, int]:
    """Return the program with a state for the output of its last complete update, and the state."""
    number = program.outputs[program.output_names.index(output)]
    for state, after in program.states:
        if after == number:
            return program, state
    v, names = program.values[number], {v.name for v in program.values}
    name = f"{output}.kept"
    while name in names:
        name += "_"
    first = first_word(program, output)
    copy = Value(name, Kind.STATE, v.frac, v.low, v.high, v.range_source, v.unit, first)
    state = len(program.values)
    return (
        replace(program, values=(*program.values, copy), states=(*program.states, (state, number))),
        state,
    )


def open_states(programs: Sequence[Program]) -> list[set[int]]:
    """For each program, its states that other programs read."""
    opened: dict[str, set[int]] = {program.name: set() for program in programs}
    for reader in programs:
        for link in reader.links:
            if link.state is not None:
                opened[link.program].add(link.state)
    return [opened[program.name] for program in programs]


def window_of(schedules: Sequence[Schedule]) -> Window | None:
    """The window for the programs of a core, as large as the other states permit.

    None without links.

    Raises
    ------
    ScheduleError
        The window does not fit.
    """
    opened = open_states([s.program for s in schedules])
    owners = tuple(k for k, states in enumerate(opened) if states)
    if not owners:
        return None
    (machine,) = {schedule.machine for schedule in schedules}
    counts: list[Counter[int]] = []
    closed: Counter[int] = Counter()
    for schedule, states in zip(schedules, opened, strict=True):
        producer = {op.dest: k for k, op in enumerate(schedule.program.ops)}
        banks = {s: schedule.ends[producer[after]].lane for s, after in schedule.program.states}
        counts.append(Counter(banks[s] for s in states))
        closed.update(bank for s, bank in banks.items() if s not in states)
    largest = max(n for c in counts for n in c.values())
    size = machine.state_slots // 2
    while size:
        window = Window(size, owners)
        if largest > window.block:
            break
        if all(n <= machine.state_slots - size for n in closed.values()):
            return window
        size //= 2
    raise ScheduleError(
        f"{', '.join(schedules[k].program.name for k in owners)}: no room in the {machine.name} "
        f"machine for {sum(sum(c.values()) for c in counts)} words that other programs read, "
        f"beside {sum(closed.values())} states{machine.remedy(2, 1)}"
    )
