"""Machine description, read by scheduler, assembler, engine and reports."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

from boresight.model.errors import InputError
from boresight.model.words.fixed import Arithmetic


@dataclass(frozen=True)
class Field:
    """One field of the microword (`docs/engine.md`), and the pipeline stage that reads it."""

    name: str
    width: int
    stage: int


@dataclass(frozen=True)
class Stages:
    """Stages of the pipeline, in cycles after that of a slot's addresses (`docs/engine.md`)."""

    read: int  #: The raw operands are there: masks, captures, emit.
    condition: int  #: Sign and participation of the term, by the captured flag.
    amount: int  #: Shift amount, by the captured count.
    shift: int  #: The product is there and is shifted.
    accumulate: int  #: The term is added.
    limit: int  #: The sum is clamped or cut.
    write: int  #: The result is written.


@dataclass(frozen=True)
class Machine:
    """One configuration of the engine (`docs/engine.md`)."""

    name: str
    #: Multiply-accumulate lanes, 1 or 2.
    lanes: int
    #: Word, guard and accumulator widths.
    arithmetic: Arithmetic = Arithmetic()
    #: Maximum number of microwords of all programs of a core together.
    rom_words: int = 16384
    #: Words of the register file, all banks together: one of `REGISTER_WORDS`.
    register_words: int = field(default=512, kw_only=True)
    #: Cycles from the last slot of a group to the first slot that may read its result: 7 and the
    #: first ``depth - 7`` of `REGISTERS`; one of `DEPTHS`.
    depth: int = field(default=7, kw_only=True)

    #: Registers that a deeper pipeline has, in the order in which depth adds them: behind the
    #: memories, between clamp and write, at the multiplier, between its sums, in the shifter.
    REGISTERS = ("memory", "limit", "factor", "sum", "shifter")
    DEPTHS = (7, 9, 10, 12)
    REGISTER_WORDS = (512, 1024, 2048)
    #: Words of one block of the table memory and number of blocks.
    TABLE_BLOCK = 512
    TABLE_BLOCKS = 3
    #: Addresses of the bus for parameters, divided among the lanes' banks.
    PARAMETER_ADDRESSES = 512

    def has(self, register: str) -> bool:
        """Whether the pipeline has this one of `REGISTERS`."""
        return self.REGISTERS.index(register) < self.depth - 7

    @cached_property
    def stages(self) -> Stages:
        read = 1 + self.has("memory")
        shift = read + 3 + self.has("factor") + self.has("sum")
        accumulate = shift + 1 + self.has("shifter")
        limit = accumulate + 1
        return Stages(
            read=read,
            condition=read + 1,
            amount=read + 2,
            shift=shift,
            accumulate=accumulate,
            limit=limit,
            write=limit + self.has("limit"),
        )

    @property
    def prefetch(self) -> int:
        """Words by which the program counter is ahead of the word at work.

        The ROM's output passes a register, with `REGISTERS`' ``memory`` two.
        """
        return 2 + self.has("memory")

    @property
    def bank_depth(self) -> int:
        """Words of one register-file bank."""
        return self.register_words // self.lanes

    @property
    def state_slots(self) -> int:
        """State registers of one bank (each exists twice)."""
        return self.bank_depth // 4

    def parameter_register(self, number: int) -> int:
        """Register of the parameter with this number, counted over all programs of a core.

        They fill three eighths of a bank's lower half, then go on in the next bank; in the last
        one they may have `parameter_room`.
        """
        room = 3 * self.bank_depth // 16
        bank = min(number // room, self.lanes - 1)
        return bank * self.bank_depth + number - bank * room

    @property
    def bus_bank_words(self) -> int:
        """Addresses of the bus for each bank, from its first register on; of all machines alike."""
        return self.PARAMETER_ADDRESSES // self.lanes

    @property
    def parameter_room(self) -> int:
        """Registers of a bank that the bus can write: its lower half, or as far as addresses go."""
        return min(self.bank_depth // 2, self.bus_bank_words)

    def parameter_address(self, register: int) -> int:
        """Address at which the bus writes a register, one of a bank's lower half."""
        bank, offset = divmod(register, self.bank_depth)
        return bank * self.bus_bank_words + offset

    @property
    def register_bits(self) -> int:
        return (self.register_words - 1).bit_length()

    def remedy(self, wanted: int, room: int) -> str:
        """End of an error line: the configuration that has ``wanted`` registers, not ``room``."""
        larger = (m for m in ALL_CONFIGS.values() if m.lanes == self.lanes)
        candidates = (m for m in larger if m.register_words * room >= self.register_words * wanted)
        name = next((m.name for m in candidates if m.register_words > self.register_words), None)
        return f"; config {name} has more" if name else "; no configuration has as many"

    @cached_property
    def fields(self) -> tuple[Field, ...]:
        """Fields of the microword, least significant first; a lane's fields end in its number."""
        at, address = self.stages, self.register_bits
        lane = (
            (0, {"a_addr": address, "b_addr": address, "table": 1}),
            (at.read, dict.fromkeys(("frac_a", "frac_b", "cap_index", "cap_flag", "cap_norm"), 1)),
            (at.read, {"quarter": 1}),
            (at.condition, dict.fromkeys(("neg", "neg_flag", "when", "when_flag"), 1)),
            (at.amount, {"shift": 5, "scale": 2}),
            (at.accumulate, {"first": 1}),
            (at.write, {"we": 1}),
            (at.limit, {"wrap": 1}),
            (at.write, {"sticky": 1, "dest": (self.bank_depth - 1).bit_length()}),
        )
        common = {"get": at.write, "get_last": at.write, "emit": at.read, "emit_last": at.read}
        return (
            *(
                Field(f"{name}{k}", width, stage)
                for k in range(self.lanes)
                for stage, fields in lane
                for name, width in fields.items()
            ),
            *(Field(name, 1, stage) for name, stage in (common | {"home": at.write}).items()),
        )

    @property
    def word_bits(self) -> int:
        return sum(f.width for f in self.fields)

    def rom_columns(self, depth: int) -> tuple[int, ...]:
        """Widths of the parallel memories for ``depth`` microwords.

        With 2,048 words, a block RAM has 9 bits and half of one 4: a few bits beyond a multiple of
        9 get their own half, or yosys would build all of it of shallower RAMs and multiplexers.
        Machines with 512 registers are not split.
        """
        remainder = self.word_bits % 9
        if depth < 2048 or self.register_words == 512 or not 0 < remainder <= 4:
            return (self.word_bits,)
        return (self.word_bits - remainder, remainder)


#: The standard configurations.
CONFIGS = {"small": Machine(name="small", lanes=1), "fast": Machine(name="fast", lanes=2)}
#: All configurations, also those with two and four times the registers for larger cores.
ALL_CONFIGS = CONFIGS | {
    f"{m.name}-{words}": replace(m, name=f"{m.name}-{words}", register_words=words)
    for words in Machine.REGISTER_WORDS[1:]
    for m in CONFIGS.values()
}
#: Every machine by its name: a configuration, with ``-d9`` and so on at another depth than 7.
MACHINES = ALL_CONFIGS | {
    f"{m.name}-d{depth}": replace(m, name=f"{m.name}-d{depth}", depth=depth)
    for depth in Machine.DEPTHS[1:]
    for m in ALL_CONFIGS.values()
}


def machine_named(config: str) -> Machine:
    """The machine with this name, with words of the standard width; InputError for others."""
    if config not in MACHINES:
        *suffixes, last = (f"-d{depth}" for depth in Machine.DEPTHS[1:])
        raise InputError.at(
            "config",
            wanted=f"one of {', '.join(ALL_CONFIGS)}, followed by {', '.join(suffixes)} or {last} "
            "for another depth",
            found=repr(config),
            fix="choose one of these",
        )
    return MACHINES[config]
