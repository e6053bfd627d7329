"""Register file and function tables: the memories that feed the lanes."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import memory, wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.engine.parts import delayed
from boresight.gateware.machine import Machine
from boresight.gateware.microcode.image import Image

BLOCK = {"ram_style": "block"}


class Operands(wiring.Component):
    """Operand memories of all lanes.

    Lane i writes bank i; every lane has its own copy of every bank for each of its operands. With
    one lane the function tables share the memory of operand b, behind the registers: all of them
    with 512 registers, blocks 0 and 1 with 1,024, none with 2,048; the others, and with two lanes
    all, have memories of their own, blocks 0 and 1 in one and block 2 in another (with two lanes
    of two read ports).
    The bit of a state's address that tells current from next state is XORed with ``parity`` on
    every port.

    **Latency** `Stages.read` cycles from address to operand; a word written in one cycle can be
    addressed in the next.
    """

    def __init__(self, *, machine: Machine, image: Image) -> None:
        self.machine = machine
        self.image = image
        #: Whether a register is behind the memories.
        self.registered = machine.has("memory")
        lanes, word = machine.lanes, machine.arithmetic.word
        super().__init__(
            {
                "en": In(1),  # Clock enable of reading. Writing has its own.
                "parity": In(1),  # Which half of the state region is current.
                # Addresses of each lane (fields of the microword).
                "a_addr": In(machine.register_bits).array(lanes),
                "b_addr": In(machine.register_bits).array(lanes),
                "table": In(1).array(lanes),
                # Segment index of each lane for table addresses.
                "index": In(machine.arithmetic.INDEX_BITS).array(lanes),
                # Operands of each lane.
                "a": Out(word).array(lanes),
                "b": Out(word).array(lanes),
                # Write port of each bank.
                "w_en": In(1).array(lanes),
                "w_addr": In(range(machine.bank_depth)).array(lanes),
                "w_data": In(word).array(lanes),
            }
        )

    def elaborate(self, platform: Any) -> Module:
        m = Module()
        if self.machine.lanes == 1:
            self._one_lane(m)
        else:
            self._more_lanes(m)
        return m

    def _state(self, offset: Value, parity: Value) -> Value:
        """Offset in a bank as the memory sees it."""
        state = offset[-1]
        return Cat(offset[:-2], offset[-2] ^ (parity & state), state)

    def _memory(self, m: Module, name: str, init: list[int], depth: int) -> memory.Memory:
        store = memory.Memory(
            shape=self.machine.arithmetic.word, depth=depth, init=init, attrs=BLOCK
        )
        m.submodules[name] = store
        return store

    def _write(self, m: Module, store: memory.Memory, lane: int) -> None:
        port = store.write_port()
        m.d.comb += [
            port.en.eq(self.w_en[lane]),
            port.addr.eq(self._state(self.w_addr[lane], self.parity)),
            port.data.eq(self.w_data[lane]),
        ]

    def _read(self, m: Module, name: str, store: memory.Memory, address: Value) -> Value:
        port = store.read_port()
        m.d.comb += [port.en.eq(self.en), port.addr.eq(address)]
        return self._behind(m, port.data, f"{name}_out")

    def _behind(self, m: Module, value: Value, name: str) -> Value:
        """A value that comes with the output of a memory, after the register behind it, if any."""
        return delayed(m, value, en=self.en, names=[name] if self.registered else [])

    def _one_lane(self, m: Module) -> None:
        registers, block = self.image.registers, self.machine.TABLE_BLOCK
        depth, field = 4 * block, self.b_addr[0]
        shared = depth - len(registers)
        a_store = self._memory(m, "a0", registers, len(registers))
        b_store = self._memory(m, "b0", registers + self.image.tables[:shared], depth)
        for store in (a_store, b_store):
            self._write(m, store, 0)
        # With 512 registers block k is quarter k + 1 of the memory, with 1,024 quarter k + 2.
        quarter = Cat(~field[2], field[2] ^ field[3]) if shared > 2 * block else Cat(field[2], 1)
        place, table = Cat(field[:2], self.index[0]), self.table[0]
        address = self._state(field, self.parity)
        if shared:
            offset = Cat(address, Const(0, 11 - len(address)))
            address = Mux(table, Cat(place, quarter), offset)
        a = self._read(m, "a0", a_store, self._state(self.a_addr[0], self.parity))
        b = self._read(m, "b0", b_store, address)
        for name, first, end, where, here in (
            ("tables0", shared, 2 * block, Cat(place, field[2]), table & ~field[3]),
            ("tables2", max(shared, 2 * block), 3 * block, place, table & field[3]),
        ):
            if first >= end:
                continue
            store = self._memory(m, name, self.image.tables[first:end], end - first)
            chosen = Signal(name=f"{name}_select", reset_less=True)
            with m.If(self.en):
                m.d.sync += chosen.eq(here)
            word = self._read(m, name, store, where)
            b = Mux(self._behind(m, chosen, f"{name}_chosen"), word, b)
        m.d.comb += [self.a[0].eq(a), self.b[0].eq(b)]

    def _more_lanes(self, m: Module) -> None:
        lanes, depth = self.machine.lanes, self.machine.bank_depth
        block = self.machine.TABLE_BLOCK
        tables = [
            self._memory(m, "tables0", self.image.tables[: 2 * block], 2 * block),
            self._memory(m, "tables1", self.image.tables[2 * block :], block),
        ]
        for lane in range(lanes):
            for side, field, out in (
                ("a", self.a_addr[lane], self.a[lane]),
                ("b", self.b_addr[lane], self.b[lane]),
            ):
                words = []
                for bank in range(lanes):
                    name = f"{side}{lane}_bank{bank}"
                    store = self._memory(
                        m, name, self.image.registers[bank * depth : (bank + 1) * depth], depth
                    )
                    self._write(m, store, bank)
                    words.append(self._read(m, name, store, self._state(field[:-1], self.parity)))
                bank_select = Signal(name=f"{side}{lane}_select", reset_less=True)
                with m.If(self.en):
                    m.d.sync += bank_select.eq(field[-1])
                bank_chosen = self._behind(m, bank_select, f"{side}{lane}_chosen")
                operand = Mux(bank_chosen, words[1], words[0])
                if side == "b":
                    # Two select bits: bank 0 or 1, tables 0 or 1.
                    table = Signal(name=f"table{lane}_select", reset_less=True)
                    with m.If(self.en):
                        m.d.sync += table.eq(self.table[lane])
                        with m.If(self.table[lane]):
                            m.d.sync += bank_select.eq(field[3])
                    address = Cat(field[:2], self.index[lane], field[2])
                    coefficient = Mux(
                        bank_chosen,
                        self._read(m, f"tables1_{lane}", tables[1], address[:-1]),
                        self._read(m, f"tables0_{lane}", tables[0], address),
                    )
                    operand = Mux(
                        self._behind(m, table, f"table{lane}_chosen"), coefficient, operand
                    )
                m.d.comb += out.eq(operand)
