"""Images: microcode and initial memory contents of an engine, and the assembler that makes them.

A field of stage k of a slot issued in cycle t stands in ROM word t + k, so the hardware delays no
field.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import accumulate

from boresight.gateware.machine import Machine
from boresight.gateware.schedule.allocate import Allocation
from boresight.gateware.schedule.copies import copy_shift
from boresight.gateware.schedule.slots import Schedule, ScheduleError, Slot
from boresight.model.words.program import Negate, Scale, When


def rom_pieces(words: int) -> tuple[int, ...]:
    """Depths of the memories that form a ROM of ``words`` words, the deepest first.

    Each is a power of two, like block RAM, and at most half of the one before, so that one address
    bit each selects the memory of a word.
    """
    blocks = max(2, -(-words // 256))
    return tuple(256 << k for k in reversed(range(blocks.bit_length())) if blocks >> k & 1)


@dataclass(frozen=True)
class Image:
    """Contents of an engine's memories for one program or several."""

    #: Microwords in order, bits as in `Machine.fields`: the programs one after another, then their
    #: restart routines; at most ``Machine.rom_words``.
    rom: list[int]
    #: Initial register file, unsigned words; index = bank * bank_depth + offset.
    registers: list[int]
    #: Function tables, 1536 unsigned words; index = 512 * block + 4 * segment + coefficient.
    tables: list[int]
    #: Cycles of each program: words of the ROM that run.
    lengths: tuple[int, ...]
    #: Identifier of the build; its low 2 W bits can be read on the bus.
    digest: int = 0
    #: Cycles of each program's restart routine, which writes the initial words of its states as its
    #: next states. Empty: the programs keep their states after a reset.
    restarts: tuple[int, ...] = ()

    @property
    def ends(self) -> tuple[int, ...]:
        """Address behind the last word of each program, then of each restart routine."""
        return tuple(accumulate((*self.lengths, *self.restarts)))

    @property
    def bases(self) -> tuple[int, ...]:
        """Address of the first word of each program, then of each restart routine."""
        return (0, *self.ends[:-1])

    @property
    def starts(self) -> list[int]:
        """Address of the first word by the program's number, above it the bit for its restart.

        A number that no program has leads to program 0, so that an upset register does no harm.
        """
        count = len(self.lengths)
        size = 1 << (count - 1).bit_length()
        halves = self.bases[:count], self.bases[count:] or self.bases
        return [base for half in halves for base in (*half, *[0] * (size - count))]

    def program(self, number: int) -> list[int]:
        """Microwords of a program; of restart routine k with number = programs + k."""
        return self.rom[self.bases[number] : self.ends[number]]

    @classmethod
    def join(cls, images: Sequence[Image], *, digest: int) -> Image:
        """Join the images of programs with common registers.

        Raises
        ------
        ValueError
            Registers differ, or tables that both use.
        """
        tables = next((x.tables for x in images if any(x.tables)), images[0].tables)
        for image in images:
            if image.registers != images[0].registers:
                raise ValueError("registers of the programs must be common")
            if any(image.tables) and image.tables != tables:
                raise ValueError("function tables of the programs must be the same")
        programs = [w for x in images for w in x.rom[: sum(x.lengths)]]
        return replace(
            images[0],
            rom=programs + [w for x in images for w in x.rom[sum(x.lengths) :]],
            tables=tables,
            lengths=tuple(n for x in images for n in x.lengths),
            digest=digest,
            restarts=tuple(n for x in images for n in x.restarts),
        )

    def check(self, machine: Machine) -> None:
        """Raise ValueError where the image breaks a rule that its proof does not see.

        Only the last word of a program or restart routine returns, none both gets and emits, and a
        program gets an input word, a routine none.
        """
        for number, base in enumerate(self.bases):
            words = [decode(machine, word) for word in self.program(number)]
            is_long = len(words) > machine.prefetch
            returns = [w["home"] for w in words] == [0] * (len(words) - 1) + [1]
            both = any(w["get"] & w["emit"] for w in words)
            gets = any(w["get"] for w in words) == (number < len(self.lengths))
            if not (is_long and returns and gets) or both:
                raise ValueError(f"microcode from word {base} on breaks docs/engine.md")

    def hardware_rom(self, machine: Machine) -> tuple[list[int], ...]:
        """Contents of each of `rom_pieces`, with ``home`` `Machine.prefetch` words earlier.

        The program counter is ahead of the executed word by so many.
        """
        home = encode(machine, {"home": 1})
        rom = [value & ~home for value in self.rom]
        for end in self.ends:
            rom[end - 1 - machine.prefetch] |= home
        pieces = rom_pieces(len(rom))
        rom += [0] * sum(pieces)  # at least as many as are missing; the rest is cut off
        ends = accumulate(pieces)
        return tuple(rom[end - depth : end] for depth, end in zip(pieces, ends, strict=True))


#: (neg, neg_flag) of each sign and (when, when_flag) of each condition.
_NEGATE = {Negate.NO: (0, 0), Negate.YES: (1, 0), Negate.IF: (0, 1), Negate.UNLESS: (1, 1)}
_WHEN = {When.ALWAYS: (1, 0), When.IF: (0, 1), When.UNLESS: (1, 1)}
_SCALE = {Scale.NONE: 0, Scale.FULL: 1, Scale.EVEN: 2, Scale.HALF: 3}

Words = list[dict[str, int]]


def assemble(schedule: Schedule, allocation: Allocation) -> Image:
    """Return the contents of all memories for a schedule, with the source program's digest."""
    machine, program = schedule.machine, schedule.program
    words: Words = [{} for _ in range(schedule.length)]
    registers = allocation.addresses()
    stage = {f.name: f.stage for f in machine.fields}

    def put(cycle: int, name: str, value: int) -> None:
        word = cycle + stage[name]
        if word >= len(words):
            raise ScheduleError(
                f"{program.name}: field {name} of cycle {cycle} falls behind the "
                f"program's {len(words)} words"
            )
        if words[word].setdefault(name, value) != value:
            raise ScheduleError(f"{program.name}: field {name} of word {word} wanted twice")

    for slot in schedule.slots:
        for name, value in _slot_fields(schedule, registers, slot).items():
            put(slot.cycle, name, value)
    for k, (cycle, value) in enumerate(zip(schedule.gets, program.inputs, strict=True)):
        for name, bits in (
            ("get", 1),
            ("get_last", int(k == len(schedule.gets) - 1)),
            ("dest0", registers[value] % machine.bank_depth),
        ):
            put(cycle - stage[name], name, bits)
    put(schedule.length - 1 - stage["home"], "home", 1)
    mask = (1 << machine.arithmetic.word) - 1
    size = Machine.TABLE_BLOCK * Machine.TABLE_BLOCKS
    if len(program.table_memory) > size:
        raise ScheduleError(
            f"{program.name}: table memory must be {size} words or fewer, not "
            f"{len(program.table_memory)!r}"
        )
    tables = [w & mask for w in program.table_memory]
    restart = _restart_routine(schedule, allocation)
    return Image(
        rom=[encode(machine, w) for w in (*words, *restart)],
        registers=list(allocation.initial),
        tables=tables + [0] * (size - len(tables)),
        lengths=(schedule.length,),
        digest=int(schedule.source, 16),
        restarts=(len(restart),),
    )


def _restart_routine(schedule: Schedule, allocation: Allocation) -> Words:
    """Words that write the initial words of the states as their next ones, each a copy."""
    machine, program = schedule.machine, schedule.program
    registers, constants = allocation.addresses(), dict(allocation.constants)
    stage = {f.name: f.stage for f in machine.fields}
    copies: list[list[tuple[int, int]]] = [[] for _ in range(machine.lanes)]
    for state, after in program.states:
        bank, offset = divmod(registers[after], machine.bank_depth)
        copies[bank].append((offset, program.values[state].initial))
    words: Words = [{} for _ in range(max(map(len, copies)) + stage["home"])]
    shifts = {w: copy_shift(w, machine.arithmetic) for w in sorted(constants)}
    unit, shift = next(((w, s) for w, s in shifts.items() if s is not None), (0, 0))
    for lane, items in enumerate(copies):
        for cycle, (offset, word) in enumerate(items):
            fields = {"first": 1, "we": 1, "dest": offset}
            if word:  # else a sum of no terms
                fields |= {"a_addr": constants[word], "b_addr": constants[unit]}
                fields |= {"when": 1, "shift": shift}
            for name, value in fields.items():
                words[cycle + stage[f"{name}{lane}"]][f"{name}{lane}"] = value
    words[-1]["home"] = 1
    return words


def _slot_fields(schedule: Schedule, registers: dict[int, int], slot: Slot) -> dict[str, int]:
    """Fields of one slot by name; missing ones are 0."""
    lane, fields, common = slot.lane, {"a_addr": registers[slot.a]}, dict[str, int]()
    if slot.emit is not None:
        common = {"emit": 1, "emit_last": int(slot.emit == len(schedule.program.outputs) - 1)}
    op = None if slot.op is None else schedule.program.ops[slot.op]
    if op is not None:
        for name in ("cap_index", "cap_flag", "cap_norm", "quarter", "first"):
            fields[name] = int(getattr(slot, name))
    if op is not None and slot.last:
        fields |= {"we": 1, "wrap": int(op.overflow.wraps), "sticky": int(op.overflow.is_sticky)}
        fields["dest"] = registers[op.dest] % schedule.machine.bank_depth
    if op is not None and slot.term is not None:
        term = op.terms[slot.term]
        if term.coefficient is not None:
            assert op.table is not None
            fields |= {"table": 1, "b_addr": op.table << 2 | term.coefficient}
        else:
            assert slot.b is not None
            fields["b_addr"] = registers[slot.b]
        fraction = (term.fraction_a, term.fraction_b)
        fields |= {"frac_a": int(fraction[slot.swap]), "frac_b": int(fraction[not slot.swap])}
        fields["neg"], fields["neg_flag"] = _NEGATE[term.negate]
        fields["when"], fields["when_flag"] = _WHEN[term.when]
        fields |= {"shift": term.shift, "scale": _SCALE[term.scale]}
    return common | {f"{name}{lane}": value for name, value in fields.items()}


def encode(machine: Machine, values: dict[str, int]) -> int:
    """One microword from its fields; missing ones are 0."""
    word = at = 0
    names = set()
    for f in machine.fields:
        value = values.get(f.name, 0)
        if not 0 <= value < 1 << f.width:
            raise ValueError(f"field {f.name} must be 0 to {(1 << f.width) - 1}, not {value!r}")
        word |= value << at
        at += f.width
        names.add(f.name)
    if unknown := set(values) - names:
        raise ValueError(f"fields must be those of the machine, not {sorted(unknown)!r}")
    return word


def decode(machine: Machine, word: int) -> dict[str, int]:
    """Fields of one microword."""
    out = {}
    for f in machine.fields:
        out[f.name] = word & ((1 << f.width) - 1)
        word >>= f.width
    if word:
        raise ValueError(f"word must have {machine.word_bits} bits, not more")
    return out
