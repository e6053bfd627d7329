"""Programs that read what another program of their core keeps (`Input.source`).

The output that is read becomes a state of the program that computes it, unless it is the next value
of one already. So it changes when an update of that program is complete and at no other time,
whatever stalls, faults or resets there are; and the reader finds it as it finds a state of its own,
but under the parity of the program that owns it. The states that others may read stand in a
`Window` of the state region, by which the hardware tells whose parity counts.

`gateware.schedule.check_core` proves that a reader reads nothing else of other programs.
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
    """The last state slots of every bank: those that other programs may read.

    Parameters
    ----------
    size : int
        How many of each bank, a power of two.
    owners : tuple of int
        Whose they are, in equal blocks of a power of two: numbers of programs.
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
        """The program whose parity a slot goes by; None for that of the program that runs."""
        index = (slot - (slots - self.size)) // self.block
        return self.owners[index] if 0 <= index < len(self.owners) else None


def tied(programs: Sequence[Program]) -> list[Program]:
    """The programs of one core, with their links to each other made.

    Parameters
    ----------
    programs : sequence of Program
        Of `model.linking.linked_estimators`, in the order of their numbers.

    Raises
    ------
    ValueError
        A linked input has not the binary point of its source: the estimators were not linked.
    """
    made = {p.name: p for p in programs}
    for program in programs:
        links = []
        for link in program.links:
            owner = made.get(link.program)
            if owner is None:
                links.append(replace(link, state=None))
                continue
            owner, state = _keeping(owner, link.output)
            if program.values[link.value].frac != owner.values[state].frac:
                raise ValueError(
                    f"{program.name} must take {link.program}.{link.output} as "
                    f"{owner.format(state)}, not as {program.format(link.value)}"
                )
            made[owner.name] = owner
            links.append(replace(link, state=state))
        if links:
            made[program.name] = replace(made[program.name], links=tuple(links))
    return [made[p.name] for p in programs]


def _keeping(program: Program, output: str) -> tuple[Program, int]:
    """The program with a state that is the output of its last complete update, and that state."""
    number = program.outputs[program.output_names.index(output)]
    for state, after in program.states:
        if after == number:
            return program, state
    of, taken = program.values[number], {v.name for v in program.values}
    name = f"{output}.kept"
    while name in taken:
        name += "_"
    first = first_word(program, output)
    kept = Value(name, Kind.STATE, of.frac, of.low, of.high, of.range_source, of.unit, first)
    state = len(program.values)
    return (
        replace(program, values=(*program.values, kept), states=(*program.states, (state, number))),
        state,
    )


def open_states(programs: Sequence[Program]) -> list[set[int]]:
    """For each program, its states that others read."""
    return [
        {
            link.state
            for reader in programs
            for link in reader.links
            if link.program == program.name and link.state is not None
        }
        for program in programs
    ]


def window_of(schedules: Sequence[Schedule]) -> Window | None:
    """The window for the programs of a core: as large as the other states leave room.

    None if nobody reads what another keeps.

    Raises
    ------
    ScheduleError
        There is no room for it.
    """
    opened = open_states([s.program for s in schedules])
    owners = tuple(k for k, states in enumerate(opened) if states)
    if not owners:
        return None
    machine = schedules[0].machine
    counts: list[Counter[int]] = []
    others: Counter[int] = Counter()
    for schedule, states in zip(schedules, opened, strict=True):
        producer = {op.dest: k for k, op in enumerate(schedule.program.ops)}
        banks = {s: schedule.ends[producer[after]].lane for s, after in schedule.program.states}
        counts.append(Counter(banks[s] for s in states))
        others.update(bank for s, bank in banks.items() if s not in states)
    most = max(n for c in counts for n in c.values())
    size = machine.state_slots // 2
    while size:
        window = Window(size, owners)
        if most > window.block:
            break
        if max(others.values(), default=0) <= machine.state_slots - size:
            return window
        size //= 2
    raise ScheduleError(
        f"{', '.join(schedules[k].program.name for k in owners)}: no room in the {machine.name} "
        f"machine for {sum(sum(c.values()) for c in counts)} words that other programs read, "
        f"beside {sum(others.values())} states{machine.remedy}"
    )
