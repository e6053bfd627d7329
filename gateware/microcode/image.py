"""Images: microcode and initial memory contents of an engine, and the assembler that makes them.

A field of stage k of a slot issued in cycle t stands in ROM word t + k, so the hardware delays no
field. `check_memories` reads the memories in the Verilog of a core back.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import accumulate

from boresight.gateware.machine import Machine
from boresight.gateware.schedule.allocate import Allocation
from boresight.gateware.schedule.slots import Schedule, ScheduleError, Slot, copy_shift
from boresight.model.words.program import Negate, Scale, When


class Refuted(Exception):
    """A translation does not compute what its program says: a bug of the compiler."""


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
        """Join images of programs with common registers; ValueError if tables differ."""
        tables = next((x.tables for x in images if any(x.tables)), images[0].tables)
        for image in images:
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
    registers = allocation.addresses
    stage = {f.name: f.stage for f in machine.fields}

    for slot in schedule.slots:
        for name, value in _slot_fields(schedule, registers, slot).items():
            words[slot.cycle + stage[name]][name] = value
    for k, (cycle, value) in enumerate(zip(schedule.gets, program.inputs, strict=True)):
        last, offset = int(k == len(schedule.gets) - 1), registers[value] % machine.bank_depth
        words[cycle] |= {"get": 1, "get_last": last, "dest0": offset}
    words[-1]["home"] = 1
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
    registers, constants = allocation.addresses, dict(allocation.constants)
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
    if slot.op is not None:
        op = schedule.program.ops[slot.op]
        for name in ("cap_index", "cap_flag", "cap_norm", "quarter", "first"):
            fields[name] = int(getattr(slot, name))
        if slot.last:
            overflow = op.overflow
            fields |= {"we": 1, "wrap": int(overflow.wraps), "sticky": int(overflow.is_sticky)}
            fields["dest"] = registers[op.dest] % schedule.machine.bank_depth
    if slot.op is not None and slot.term is not None:
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
    for f in machine.fields:
        word |= values.get(f.name, 0) << at
        at += f.width
    return word


def decode(machine: Machine, word: int) -> dict[str, int]:
    """Fields of one microword."""
    out = {}
    for f in machine.fields:
        out[f.name] = word & ((1 << f.width) - 1)
        word >>= f.width
    return out


_WORD = re.compile(r"(?m)^\s+(\w+)\[(\d+)\] = \d+'(h|d)([0-9a-f]+);$")
_ROM = re.compile(r"rom(\d+)(?:_(\d+))?")


def check_memories(machine: Machine, image: Image, verilog: str) -> None:
    """Raise Refuted unless the memories of ``verilog`` hold the image's words.

    The layout is that of `docs/engine.md`: every lane has copies of every bank for both operands,
    the tables follow the registers of operand b or have memories of their own, ``home`` stands
    `Machine.prefetch` words earlier than in the image, and ``bases`` are `Image.starts`.
    """
    memories: dict[str, list[int]] = {}
    for name, at, base, digits in _WORD.findall(verilog):
        words = memories.setdefault(name, [])
        if int(at) != len(words):
            raise Refuted(f"core.v: word {at} of memory {name} follows word {len(words) - 1}")
        words.append(int(digits, 16 if base == "h" else 10))
    roms = {name: memories.pop(name) for name in list(memories) if _ROM.fullmatch(name)}
    wanted = data_memories(machine, image) | {"bases": image.starts}
    for name in sorted(wanted.keys() | memories.keys()):
        _compare(name, memories.get(name, []), wanted.get(name, []))
    _check_rom(machine, image, roms)


def data_memories(machine: Machine, image: Image) -> dict[str, list[int]]:
    """Words of the register and table memories of a core, every copy, by name."""
    depth, block, lanes = machine.bank_depth, machine.TABLE_BLOCK, range(machine.lanes)
    registers, tables = image.registers, image.tables
    if machine.lanes == 1:
        shared = 4 * block - len(registers)
        out = {"a0": registers, "b0": registers + tables[:shared]}
        out |= {"tables0": tables[shared : 2 * block], "tables2": tables[max(shared, 2 * block) :]}
        return {name: words for name, words in out.items() if words}
    out = {
        f"{side}{lane}_bank{bank}": registers[bank * depth : (bank + 1) * depth]
        for side in "ab"
        for lane in lanes
        for bank in lanes
    }
    return out | {"tables0": tables[: 2 * block], "tables1": tables[2 * block :]}


def _check_rom(machine: Machine, image: Image, roms: dict[str, list[int]]) -> None:
    """Compare the microwords, with ``home`` where the hardware expects it."""
    pieces: dict[int, list[int]] = {}
    for name, column in sorted(roms.items()):
        match = _ROM.fullmatch(name)
        assert match is not None
        piece, high = int(match[1]), match[2]
        columns = machine.rom_columns(len(column))
        shift = sum(columns[: int(high)]) if high else 0
        before = pieces.setdefault(piece, [0] * len(column))
        pieces[piece] = [a | b << shift for a, b in zip(before, column, strict=True)]
    words = [word for k in sorted(pieces) for word in pieces[k]]
    home = encode(machine, {"home": 1})
    returns = {end - 1 - machine.prefetch for end in image.ends}
    wanted = [w & ~home | (k in returns) * home for k, w in enumerate(image.rom)]
    _compare("rom", words[: len(wanted)], wanted)
    _compare("rom, behind the programs,", words[len(wanted) :], [0] * (len(words) - len(wanted)))


def _compare(name: str, words: Sequence[int], wanted: Sequence[int]) -> None:
    if len(words) != len(wanted):
        raise Refuted(f"core.v: memory {name} must have {len(wanted)} words, not {len(words)}")
    for k, (word, expected) in enumerate(zip(words, wanted, strict=True)):
        if word != expected:
            raise Refuted(f"core.v: word {k} of memory {name} must be {expected:#x}, not {word:#x}")
