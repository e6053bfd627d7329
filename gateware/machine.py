"""Machine description, read by scheduler, checker, assembler, engine and reports."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from boresight.model.words.fixed import Arithmetic


@dataclass(frozen=True)
class Field:
    """One field of the microword.

    ``stage`` is the pipeline stage (cycles after the address stage) that reads it.
    """

    name: str
    width: int
    stage: int
    meaning: str


@dataclass(frozen=True)
class Machine:
    """One configuration of the engine (`docs/engine.md`).

    Parameters
    ----------
    name : str
        Name of the configuration.
    lanes : int, 1 or 2
        Multiply-accumulate lanes.
    arithmetic : Arithmetic
        Word, guard and accumulator widths.
    rom_words : int, >= 16
        Maximum number of microwords of all programs of a core together.
    register_words : int, 512 or 1024
        Words of the register file, all banks together.
    """

    name: str
    lanes: int
    arithmetic: Arithmetic = Arithmetic()
    rom_words: int = 4096
    register_words: int = field(default=512, kw_only=True)

    #: Stages of the pipeline (see docs/engine.md).
    STAGE_READ = 1
    STAGE_MULTIPLY = 2
    STAGE_AMOUNT = 3
    STAGE_SHIFT = 4
    STAGE_ACCUMULATE = 5
    STAGE_WRITE = 6
    #: Words of one block of the table memory and number of blocks.
    TABLE_BLOCK = 512
    TABLE_BLOCKS = 3
    #: Addresses of the bus for parameters, divided among the lanes' banks.
    PARAMETER_ADDRESSES = 512

    def __post_init__(self) -> None:
        if self.lanes not in (1, 2):
            raise ValueError(f"lanes must be 1 or 2, not {self.lanes!r}")
        if self.rom_words < 16:
            raise ValueError(f"rom_words must be 16 or more, not {self.rom_words!r}")
        if self.register_words not in (512, 1024):
            raise ValueError(f"register_words must be 512 or 1024, not {self.register_words!r}")

    @property
    def latency(self) -> int:
        """Cycles from the last slot of a group to the first slot that may read its result."""
        return self.STAGE_WRITE + 1

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
        one they have no such limit.
        """
        room = 3 * self.bank_depth // 16
        bank = min(number // room, self.lanes - 1)
        return bank * self.bank_depth + number - bank * room

    @property
    def bus_bank_words(self) -> int:
        """Addresses of the bus for each bank: from its first register on, as far as its lower half.

        So the bus has the same addresses however many registers there are.
        """
        return self.PARAMETER_ADDRESSES // self.lanes

    def parameter_address(self, register: int) -> int:
        """Address at which the bus writes a register, one of a bank's lower half."""
        bank, offset = divmod(register, self.bank_depth)
        return bank * self.bus_bank_words + offset

    @property
    def register_bits(self) -> int:
        """Bits of a register address, bank and offset."""
        return (self.register_words - 1).bit_length()

    @property
    def offset_bits(self) -> int:
        """Bits of an offset in a bank."""
        return (self.bank_depth - 1).bit_length()

    @property
    def remedy(self) -> str:
        """End of an error line about missing registers: the configuration with more of them."""
        larger = (m for m in ALL_CONFIGS.values() if m.lanes == self.lanes)
        name = next((m.name for m in larger if m.register_words > self.register_words), None)
        return f"; config {name} has more" if name else ""

    def fields(self) -> tuple[Field, ...]:
        """Fields of the microword, least significant first; a lane's fields end in its number."""
        out: list[Field] = []
        for k in range(self.lanes):
            out += [
                Field(f"a_addr{k}", self.register_bits, 0, "register address of operand a"),
                Field(
                    f"b_addr{k}",
                    self.register_bits,
                    0,
                    "register address of operand b, or with table: "
                    "bits 1:0 coefficient, bits 3:2 block",
                ),
                Field(f"table{k}", 1, 0, "operand b comes from the table memory"),
                Field(f"frac_a{k}", 1, 1, "replace a by its bits below the segment index"),
                Field(f"frac_b{k}", 1, 1, "replace b by its bits below the segment index"),
                Field(f"cap_index{k}", 1, 1, "capture the segment index of a"),
                Field(f"cap_flag{k}", 1, 1, "capture the sign of a"),
                Field(f"cap_norm{k}", 1, 1, "capture the leading-sign count of a"),
                Field(f"quarter{k}", 1, 1, "captures see a plus a quarter of the word's range"),
                Field(f"neg{k}", 1, 2, "negate the term"),
                Field(f"neg_flag{k}", 1, 2, "exclusive-or the negation with the flag"),
                Field(f"when{k}", 1, 2, "the term takes part (with when_flag: when the flag is 0)"),
                Field(f"when_flag{k}", 1, 2, "exclusive-or when with the flag"),
                Field(f"shift{k}", 5, 3, "right shift of the product"),
                Field(
                    f"scale{k}",
                    2,
                    3,
                    "0: shift, 1: shift - n, 2: shift - (n & ~1), 3: shift - (n >> 1)",
                ),
                Field(f"first{k}", 1, 5, "first slot of a group: start from the rounding half"),
                Field(f"we{k}", 1, 6, "write the result"),
                Field(f"wrap{k}", 1, 6, "result is modulo 2^W"),
                Field(f"sticky{k}", 1, 6, "saturation raises the flag"),
                Field(f"dest{k}", self.offset_bits, 6, "offset in the lane's bank"),
            ]
        out += [
            Field("get", 1, 6, "lane 0 writes the next input word instead of a result"),
            Field("get_last", 1, 6, "this get is the last of the record"),
            Field("emit", 1, 1, "raw a of lane 0 goes to the output stream"),
            Field("emit_last", 1, 1, "this emit is the last of the record"),
            Field("home", 1, 6, "last word: the states' parity flips, the program begins anew"),
        ]
        return tuple(out)

    @property
    def word_bits(self) -> int:
        """Width of the microword."""
        return sum(f.width for f in self.fields())

    def rom_columns(self, depth: int) -> tuple[int, ...]:
        """Widths of the parallel memories for ``depth`` microwords.

        With 2,048 words, a block RAM has 9 bits and half of one 4: a few bits beyond a multiple of
        9 get their own half, or yosys would build all of it of shallower RAMs and multiplexers.
        Machines with 512 registers are not split, for unchanged Verilog.
        """
        rest = self.word_bits % 9
        if depth < 2048 or self.register_words == 512 or not 0 < rest <= 4:
            return (self.word_bits,)
        return (self.word_bits - rest, rest)


#: The standard configurations.
CONFIGS = {"small": Machine(name="small", lanes=1), "fast": Machine(name="fast", lanes=2)}
#: All configurations, also those with twice the registers for larger cores.
ALL_CONFIGS = CONFIGS | {
    f"{m.name}-1024": replace(m, name=f"{m.name}-1024", register_words=1024)
    for m in CONFIGS.values()
}
