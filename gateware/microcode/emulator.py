"""Cycle-level emulator of the machine, written from `docs/engine.md` alone.

It executes an image like the hardware, stage by stage, one ROM word per cycle, so that a difference
between model and core can be located to the cycle. `Emulator` computes with integers;
`gateware.microcode.validation` executes the same stages on terms in place of words.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, cast

from boresight.gateware.machine import Machine, Stages
from boresight.gateware.microcode.assemble import decode
from boresight.gateware.microcode.image import Image


@dataclass(frozen=True)
class Write:
    """A register written at the end of ``cycle`` (cycles with the machine running)."""

    cycle: int
    address: int
    word: int


@dataclass
class Record:
    """Result of one update: output words with their cycles, register writes."""

    outputs: list[int] = field(default_factory=list)
    emitted: list[int] = field(default_factory=list)
    lasts: list[bool] = field(default_factory=list)
    writes: list[Write] = field(default_factory=list)
    cycles: int = 0


class _Delay(deque[Any]):
    """Registers in a row: an item comes out as many cycles later as there are registers."""

    def through(self, item: Any) -> Any:
        """Put an item in; return the item that comes out in this cycle."""
        self.append(item)
        return self.popleft()


class Lane:
    """Registers of one lane. Fields of the microword act at their stages, so only data wait.

    Parameters
    ----------
    word, condition, term : callable
        First content of a register with this name, by kind of register.
    """

    def __init__(
        self,
        stages: Stages,
        word: Callable[[str], Any],
        condition: Callable[[str], Any],
        term: Callable[[str], Any],
    ) -> None:
        def registers(name: str, first: int, last: int, content: Callable[[str], Any]) -> _Delay:
            return _Delay(content(f"{name}{k}") for k in reversed(range(first + 1, last + 1)))

        at = stages
        self.operands = registers("ab", 0, at.read, lambda n: (word(n), word(f"{n} b")))
        self.products = registers("product", at.read, at.shift, word)
        self.conditions = registers(
            "condition", at.condition, at.shift, lambda n: (condition(n), condition(n))
        )
        self.amounts = registers("amount", at.amount, at.shift, word)
        self.terms = registers("r", at.shift, at.accumulate, term)
        self.sums = registers("sum", at.limit, at.write, lambda n: (word(n), 0))
        self.acc, self.index, self.flag = word("acc"), word("index"), word("flag")
        self.counts = [word("norm1"), word("norm2")]  #: captured last, and a cycle before


class Emulator:
    """The machine with an image in its memories; program 0 runs until `select`.

    Attributes
    ----------
    registers : list of int
        The register file, signed words.
    number : int
        Number of the selected program.
    parities : list of int
        Parity of each program: the current copy of its states.
    saturated, beyond, framing : bool
        Sticky flags.
    """

    def __init__(self, machine: Machine, image: Image) -> None:
        self.machine = machine
        self.image = image
        programs = range(len(image.lengths))
        parts = range(len(image.bases))
        self._roms = [[decode(machine, w) for w in image.program(k)] for k in parts]
        self._lane_roms = [
            [
                [
                    {n[:-1]: v for n, v in w.items() if n.endswith(str(k))}
                    for k in range(machine.lanes)
                ]
                for w in rom
            ]
            for rom in self._roms
        ]
        self.number = 0
        self._part = 0  #: program or restart routine that runs
        self.parities = [0 for _ in programs]
        self.registers = [self._signed(w) for w in image.registers]
        self.tables = [self._signed(w) for w in image.tables]
        self.pc = self.cycle = 0
        self.saturated = self.beyond = False
        self.framing = False
        self.swallowing = False
        #: Registers that are written at the end of this cycle.
        self.writing: set[int] = set()
        self.lanes = [self._lane(k) for k in range(machine.lanes)]

    def _lane(self, number: int) -> Lane:
        """A lane before the first update."""
        zeros = (lambda _: 0,) * 3
        return Lane(self.machine.stages, *zeros)

    def _signed(self, word: int) -> int:
        bits = self.machine.arithmetic.word
        word &= (1 << bits) - 1
        return word - (word >> (bits - 1) << bits)

    @property
    def rom(self) -> list[dict[str, int]]:
        """Decoded words of the selected program, or of its restart routine while that runs."""
        return self._roms[self._part]

    @property
    def parity(self) -> int:
        """Current copy of the selected program's states."""
        return self.parities[self.number]

    def physical(self, address: int, parity: int) -> int:
        """Register address with the parity in bit c of the state region."""
        half = self.machine.bank_depth // 2
        if address % self.machine.bank_depth >= half and parity:
            address ^= half // 2
        return address

    def _read(self, register: int) -> int:
        """The word of a register in this cycle."""
        return self.registers[register]

    def select(self, number: int) -> None:
        """Host write of the program's number; only between updates."""
        if self.pc != 0:
            raise ValueError("the program must be selected between updates")
        if 0 <= number < len(self.parities):
            self.number = self._part = number

    def restart(self) -> Record:
        """Run the restart routine of the selected program; only between updates."""
        if self.pc != 0:
            raise ValueError("the program must be restarted between updates")
        record = Record()
        self._part += len(self.parities)
        self._step(None, record)
        while self.pc:
            self._step(None, record)
        self._part = self.number
        return record

    def update(self, words: Sequence[int]) -> Record:
        """Feed one record, ``last`` with its last word, and run until the machine is idle again."""
        return self.feed((w, k == len(words) - 1) for k, w in enumerate(words))

    def feed(self, stream: Iterator[tuple[int, bool]]) -> Record:
        """Run on words with ``last`` flags until the stream is empty and the machine waits."""
        record = Record()
        pending = next(stream, None)
        while True:
            if self.swallowing:
                if pending is None:
                    return record
                self.swallowing = not pending[1]
                pending = next(stream, None)
                continue
            takes = self.rom[self.pc]["get"]
            if takes and pending is None:
                return record
            self._step(pending if takes else None, record)
            if takes:
                pending = next(stream, None)
            elif self.pc == 0 and not self.rom[0]["get"]:
                return record

    def _step(self, input_word: tuple[int, bool] | None, record: Record) -> None:
        """One cycle in which the machine runs."""
        word = self.rom[self.pc]
        lane_fields = self._lane_roms[self._part][self.pc]
        self.writing = {
            self.physical(k * self.machine.bank_depth + f["dest"], self.parity)
            for k, f in enumerate(lane_fields)
            if f["we"] or (input_word is not None and k == 0)
        }
        writes: list[tuple[int, int]] = []
        for k, lane in enumerate(self.lanes):
            if word["emit"] and k == 0:
                record.outputs.append(lane.operands[0][0])
                record.emitted.append(self.cycle)
                record.lasts.append(bool(word["emit_last"]))
            fields = lane_fields[k]
            written = self._stages(lane, fields, input_word[0] if input_word and k == 0 else None)
            if written is not None:
                address = k * self.machine.bank_depth + fields["dest"]
                writes.append((self.physical(address, self.parity), written))
        for address, value in writes:
            self.registers[address] = value
            record.writes.append(Write(self.cycle, address, value))
        self.pc, self.cycle = self.pc + 1, self.cycle + 1
        record.cycles = self.cycle
        if input_word is not None and input_word[1] != bool(word["get_last"]):
            self.framing = True
            self.swallowing = not input_word[1]
            self.pc = self.cycle = 0
        elif word["home"]:
            self.parities[self.number] ^= 1
            self.pc = self.cycle = 0

    def _stages(self, lane: Lane, f: dict[str, int], input_word: int | None) -> int | None:
        """Run all stages of one lane; return the word written, if any."""
        # Read: captures of this cycle see the raw A; they are used one or two cycles later.
        a, b = lane.operands.popleft()
        conditions = (
            self._condition(f["neg"], f["neg_flag"], lane.flag),
            self._condition(f["when"], f["when_flag"], lane.flag),
        )
        amount = self._amount(f["shift"], f["scale"], lane.counts[1])
        lane.counts[1] = lane.counts[0]
        if f["cap_index"]:
            lane.index = self._index(a, f["quarter"])
        if f["cap_flag"]:
            lane.flag = self._sign(a, f["quarter"])
        if f["cap_norm"]:
            lane.counts[0] = self._count(a)
        # Multiply the masked words, shift, accumulate, limit, write.
        factor_a = self._fraction(a) if f["frac_a"] else a
        factor_b = self._fraction(b) if f["frac_b"] else b
        product = lane.products.through(self._product(factor_a, factor_b))
        negate, take = lane.conditions.through(conditions)
        shifted = self._shifted(product, lane.amounts.through(amount), negate, take)
        term = lane.terms.through(shifted)
        total, wrap = lane.sums.through((lane.acc, f["wrap"]))
        lane.acc = self._sum(None if f["first"] else lane.acc, term)
        result: int | None = None
        if input_word is not None:
            result = input_word
        elif f["we"]:
            result = self._result(total, wrap=bool(wrap), sticky=bool(f["sticky"]))
        # Address
        at_a, at_b = (self.physical(f[field], self.parity) for field in ("a_addr", "b_addr"))
        if f["table"]:
            block, coefficient = f["b_addr"] >> 2 & 3, f["b_addr"] & 3
            word_b = self._coefficient(block, coefficient, lane.index)
        else:
            word_b = self._read(at_b)
        lane.operands.append((self._read(at_a), word_b))
        return result

    def _result(self, acc: int, *, wrap: bool, sticky: bool) -> int:
        """Word of the accumulator; raises the flag, if sticky, where the sum does not fit."""
        arith = self.machine.arithmetic
        q = acc >> arith.guard
        word = self._signed(q) if wrap else min(max(q, arith.min_int), arith.max_int)
        self.beyond |= sticky and wrap and word != q
        self.saturated |= sticky and not wrap and word != q
        return word

    def _sum(self, acc: int | None, shifted: Any) -> int:
        """The accumulator (None: the rounding half) and one term more."""
        arith = self.machine.arithmetic
        width = arith.acc_width
        total = ((1 << (arith.guard - 1) if acc is None else acc) + shifted) & ((1 << width) - 1)
        return cast(int, total - (total >> (width - 1) << width))

    def _shifted(self, product: int, amount: int, negate: Any, take: Any) -> Any:
        """Term of a product."""
        r = product >> amount
        return (-r if negate else r) if take else 0

    def _amount(self, shift: int, scale: int, count: int) -> int:
        """Right shift of a product."""
        return max(0, shift - (0, count, count & ~1, count >> 1)[scale])

    def _product(self, a: int, b: int) -> int:
        return a * b

    def _condition(self, bit: int, flagged: int, flag: int) -> Any:
        """The bit, exclusive-or the flag if ``flagged``."""
        return bit ^ (flagged & flag)

    def _fraction(self, word: int) -> int:
        """Bits of a word below the segment index."""
        return word & ((1 << self.machine.arithmetic.fraction_bits) - 1)

    def _coefficient(self, block: int, coefficient: int, index: int) -> int:
        """Word of the table memory."""
        return self.tables[block * Machine.TABLE_BLOCK + index * 4 + coefficient]

    def _biased(self, word: int, quarter: int) -> int:
        """Word that a capture reads: plus a quarter, if it asks for that."""
        return self._signed(word + (quarter << (self.machine.arithmetic.word - 2)))

    def _index(self, word: int, quarter: int) -> int:
        """Segment index."""
        arith = self.machine.arithmetic
        return (self._biased(word, quarter) >> arith.fraction_bits) & ((1 << arith.INDEX_BITS) - 1)

    def _sign(self, word: int, quarter: int) -> int:
        return int(self._biased(word, quarter) < 0)

    def _count(self, word: int) -> int:
        """Leading-sign count."""
        arith = self.machine.arithmetic
        return min(arith.word - 1 - max(word, ~word).bit_length(), arith.norm_max)
