"""Proof of the memories that feed the lanes: `gateware.engine.operands`."""

from __future__ import annotations

from dataclasses import replace

from amaranth.hdl import Assert, Module, Mux, Signal, Value

from boresight.gateware.engine.operands import Operands
from boresight.gateware.machine import Machine, machine_named
from boresight.gateware.microcode.image import Image
from boresight.model.words.fixed import Arithmetic
from boresight.sim.formal.harness import Harness, drive, fixed, reached, unknown
from boresight.sim.formal.prove import Proof


def numbered(machine: Machine) -> Image:
    """An image whose table words are their own addresses, and whose registers are 0."""
    size = machine.TABLE_BLOCK * machine.TABLE_BLOCKS
    return Image(
        rom=[0] * 3, registers=[0] * machine.register_words, tables=list(range(size)), lengths=(3,)
    )


class OperandsHarness(Harness[Operands]):
    """Operand memories: a read gives what was last written to its register, or the table's word.

    One register and one word of the tables are followed, whichever they are, on every port. Both
    stay while the enable is low. The register is the physical one: the
    parity exchanges the copies of a state.
    """

    def surround(self, m: Module, dut: Operands) -> None:
        """Reads take effect `Stages.read` enabled cycles after; writes at once."""
        machine = self.dut.machine
        drive(m, dut, "en", "parity")
        for k in range(machine.lanes):
            for name in ("a_addr", "b_addr", "table", "index", "w_en", "w_addr", "w_data"):
                port = getattr(dut, name)[k]
                m.d.comb += port.eq(unknown(m, len(port), f"{name}{k}"))
        bank = fixed(m, 1, "bank") if machine.lanes == 2 else Value.cast(0)
        offset = fixed(m, machine.offset_bits, "offset")
        number = fixed(m, 11, "number")
        word = Signal(machine.arithmetic.word, name="word", reset_less=True)
        for k in range(machine.lanes):
            written = (bank == k) & dut.w_en[k]
            with m.If(written & (self._physical(dut.w_addr[k], dut.parity) == offset)):
                m.d.sync += word.eq(dut.w_data[k])
        self._copies(m, bank, offset, number, word)
        for k in range(machine.lanes):
            is_word = self._of_register(dut.a_addr[k], bank, offset)
            self._read(m, f"a{k}", is_word, word, dut.a[k], self._raw("a", k))
            is_word = ~dut.table[k] & self._of_register(dut.b_addr[k], bank, offset)
            self._read(m, f"b{k}", is_word, word, dut.b[k], self._raw("b", k))
            block, coefficient = dut.b_addr[k][2:4], dut.b_addr[k][:2]
            address = machine.TABLE_BLOCK * block + 4 * dut.index[k] + coefficient
            is_table = dut.table[k] & (address == number) & (block < machine.TABLE_BLOCKS)
            self._read(m, f"table{k}", is_table, number, dut.b[k], self._raw("b", k))

    def _of_register(self, address: Value, bank: Value, offset: Value) -> Value:
        """Whether a read of this address is one of the register."""
        machine, dut = self.dut.machine, self.dut
        low, parity = address[: machine.offset_bits], dut.parity
        in_bank = address[machine.offset_bits :] == bank if machine.lanes == 2 else Value.cast(1)
        return in_bank & (self._physical(low, parity) == offset)

    def _physical(self, offset: Value, parity: Value) -> Value:
        """Offset in a bank: bit c of the state region is exclusive-or the parity."""
        depth = self.dut.machine.bank_depth
        return Mux((offset >= depth // 2) & parity, offset ^ (depth // 4), offset)

    def _copies(self, m: Module, bank: Value, offset: Value, number: Value, word: Value) -> None:
        """For induction: every copy of the register has its word, the tables have theirs."""
        inside = self.inside
        machine, block = self.dut.machine, self.dut.machine.TABLE_BLOCK
        if machine.lanes == 1:
            shared = 4 * block - machine.register_words
            b0 = inside.word("b0", offset)
            table = Signal(machine.arithmetic.word, name="table_word")
            m.d.comb += [
                Assert(inside.word("a0", offset) == word),
                Assert(b0 == word),
                table.eq(inside.word("b0", (machine.register_words + number)[:11])),
                Assert((number >= shared) | (table == number)),
            ]
            if shared < 3 * block:
                rest = inside.word("tables2", number[:9])
                in_tables2 = (number >= 2 * block) & (number < 3 * block)
                m.d.comb += Assert(~in_tables2 | (rest == number))
            if shared < 2 * block:
                first = inside.word("tables0", number[:10])
                m.d.comb += Assert((number >= 2 * block) | (first == number))
            return
        for side in ("a", "b"):
            for lane in range(2):
                for k in range(2):
                    copy = inside.word(f"{side}{lane}_bank{k}", offset)
                    m.d.comb += Assert((bank != k) | (copy == word))
        first, second = (inside.word("tables0", number[:10]), inside.word("tables1", number[:9]))
        m.d.comb += [
            Assert((number >= 2 * block) | (first == number)),
            Assert((number < 2 * block) | (number >= 3 * block) | (second == number)),
        ]

    def _raw(self, side: str, lane: int) -> Value:
        """An operand at the memories, before the registers behind them."""

        def word(name: str, port: int = 0) -> Value:
            return self.inside.parts[name].component.read_ports[port].data

        if self.dut.machine.lanes == 1:
            raw = word(f"{side}0")
            for name in ("tables0", "tables2"):
                if side == "b" and name in self.inside.parts:
                    raw = Mux(self.inside[f"{name}_select"], word(name), raw)
            return raw
        bank = self.inside[f"{side}{lane}_select"]
        raw = Mux(bank, word(f"{side}{lane}_bank1"), word(f"{side}{lane}_bank0"))
        if side == "a":
            return raw
        table = Mux(bank, word("tables1", lane), word("tables0", lane))
        return Mux(self.inside[f"table{lane}_select"], table, raw)

    def _read(
        self, m: Module, name: str, chosen: Value, word: Value, out: Value, raw: Value
    ) -> None:
        """The word at a port after the enabled cycles of reading it."""
        was_read, value = chosen, word
        for k in range(1, self.dut.machine.stages.read + 1):
            was_read_before, was_read = was_read, Signal(name=f"{name}_chosen{k}", reset_less=True)
            read, value = value, Signal.like(out, name=f"{name}_value{k}", reset_less=True)
            with m.If(self.dut.en):
                m.d.sync += [was_read.eq(was_read_before), value.eq(read)]
            port_value = out if k == self.dut.machine.stages.read else raw
            m.d.comb += Assert(~was_read | (port_value == value))
        m.d.comb += reached(m, was_read & (value > 5), f"{name}_read")


def _proof(config: str, *, short: bool = False) -> Proof:
    machine = replace(machine_named(config), arithmetic=Arithmetic(18))
    return Proof(
        name=f"operands.{config}",
        harness=OperandsHarness,
        dut=lambda: Operands(machine=machine, image=numbered(machine)),
        depth=2,
        induction=True,
        cover=6,
        short=short,
    )


PROOFS = (
    _proof("small", short=True),
    _proof("small-2048"),
    _proof("fast"),
    _proof("small-1024-d9"),
)
