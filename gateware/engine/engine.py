"""The micro-programmed engine, one core that runs every estimator, and its operand memories."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import data, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.bus.core_registers import BusSignature, Registers
from boresight.gateware.engine.lane import FIELDS, Lane
from boresight.gateware.engine.parts import delayed
from boresight.gateware.engine.sequencer import Sequencer
from boresight.gateware.machine import Machine
from boresight.gateware.microcode.image import Image


def word_layout(word: int) -> data.StructLayout:
    """Payload of the engine's streams: a word, and the mark of the last one of a record."""
    return data.StructLayout({"data": word, "last": 1})


class Engine(wiring.Component):
    """Estimators as a core: records of input words in, records of output words out.

    `docs/engine.md` is the contract. A register selects the program of the image that runs. The
    whole engine stalls while an input word is missing or an output word is not taken.

    **Latency** that of the program: its word c is at work c cycles after the first input
    word of the record was taken, stalls not counted. With ``selector``, a port chooses the program
    instead of the bus.
    """

    def __init__(self, *, machine: Machine, image: Image, selector: bool = False) -> None:
        self.machine = machine
        self.image = image
        self.selector = selector
        # The program that shall run (`gateware.bus.core_registers`), whether it did in the cycle
        # before, a pulse when an update is abandoned, whether initial states are being loaded.
        outputs = dict.fromkeys(("chosen", "framing", "restarting"), Out(1))
        port = {"choice": In(range(len(image.lengths))), **outputs}
        word = machine.arithmetic.word
        super().__init__(
            {
                "i": In(stream.Signature(word_layout(word))),
                "o": Out(stream.Signature(word_layout(word))),
                "bus": In(BusSignature(word=word)),  # Parameters and status.
                "restart": In(1),  # The next update begins from the initial states.
                # A sticky result of the last completed update saturated; an input was beyond.
                "saturated_update": Out(1),
                "beyond_update": Out(1),
                **(port if selector else {}),
            }
        )

    def elaborate(self, platform: Any) -> Module:
        m = Module()
        machine = self.machine
        m.submodules.sequencer = sequencer = Sequencer(machine=machine, image=self.image)
        m.submodules.operands = operands = Operands(machine=machine, image=self.image)
        m.submodules.registers = registers = Registers(
            machine=machine,
            digest=self.image.digest,
            programs=len(self.image.lengths),
            selector=self.selector,
        )
        wiring.connect(m, wiring.flipped(self.bus), registers.bus)

        parity = self._parity(m, sequencer, registers.program)
        m.d.comb += [
            sequencer.i_valid.eq(self.i.valid),
            sequencer.i_last.eq(self.i.payload.last),
            self.i.ready.eq(sequencer.i_ready),
            sequencer.o_ready.eq(self.o.ready),
            self.o.valid.eq(sequencer.o_valid),
            self.o.payload.data.eq(operands.a[0]),  # an output word is an operand
            self.o.payload.last.eq(sequencer.word.emit_last),
            *self._control(sequencer, registers),
            registers.parity.eq(parity),
            self.saturated_update.eq(registers.saturated_update),
            self.beyond_update.eq(registers.beyond_update),
            operands.en.eq(sequencer.en),
            operands.parity.eq(parity),
        ]

        # A change of program and a restart are granted, too, whatever is on the bus meanwhile.
        granted = sequencer.grant & ~registers.switch
        if self.selector:
            m.d.comb += [
                registers.choice.eq(self.choice),
                self.chosen.eq(registers.chosen),
                self.framing.eq(sequencer.framing),
                self.restarting.eq(sequencer.restarting),
            ]
        # The choice among a lane's writes from outside does not depend on the handshakes; these
        # only affect the write enable.
        claimed = sequencer.word.get & sequencer.claim
        lanes = range(machine.lanes)
        raised = [self._lane(m, k, sequencer, operands, claimed, granted) for k in lanes]
        saturated, beyond = zip(*raised, strict=True)
        m.d.comb += [
            registers.saturated.eq(Cat(saturated).any()),
            registers.beyond.eq(Cat(beyond).any()),
        ]
        return m

    def _control(self, sequencer: Sequencer, registers: Registers) -> list[Any]:
        """Selected program and its restart, requests to write, end of an update."""
        return [
            sequencer.program.eq(registers.program),
            sequencer.anew.eq(registers.anew),
            registers.restart.eq(self.restart),
            registers.start.eq(sequencer.start),
            sequencer.request.eq(registers.request),
            sequencer.switch.eq(registers.switch),
            registers.grant.eq(sequencer.grant),
            registers.en.eq(sequencer.en),
            registers.framing.eq(sequencer.framing),
            registers.commit.eq(sequencer.commit & ~sequencer.restarting),
            registers.idle.eq(sequencer.idle),
        ]

    def _lane(
        self,
        m: Module,
        k: int,
        sequencer: Sequencer,
        operands: Operands,
        claimed: Value,
        granted: Value,
    ) -> tuple[Value, Value]:
        """Lane k between its operands and its bank; whether it saturated, and found a word beyond.

        Lane 0 also writes input words, every lane parameters of its bank.
        """
        m.submodules[f"lane{k}"] = lane = Lane(machine=self.machine, sources=1 if k else 2)
        word = sequencer.word
        fields = {name: word[f"{name}{k}"] for name in (*FIELDS, "we", "dest")}
        write = sequencer.write[k]
        writes = sequencer.active & fields["we"]  # if enabled
        raised = lane.saturated & writes, lane.beyond & writes
        offset: Value = self.bus.addr
        if self.machine.bus_bank_words < self.machine.bank_depth:  # the next bank's begin sooner
            offset = offset[: (self.machine.bus_bank_words - 1).bit_length()]
        if k == 0:
            if self.machine.lanes > 1:
                write = write & ~(claimed & self.bus.addr[8])
            m.d.comb += [
                lane.outside.eq(word.get),
                lane.which.eq(~sequencer.claim),
                lane.words[1].eq(self.i.payload.data),
            ]
        else:
            write = write | (granted & self.bus.addr[8])
            m.d.comb += lane.outside.eq(claimed)
        m.d.comb += [
            lane.en.eq(sequencer.en),
            *(getattr(lane, name).eq(fields[name]) for name in FIELDS),
            operands.a_addr[k].eq(word[f"a_addr{k}"]),
            operands.b_addr[k].eq(word[f"b_addr{k}"]),
            operands.table[k].eq(word[f"table{k}"]),
            operands.index[k].eq(lane.index),
            lane.a.eq(operands.a[k]),
            lane.b.eq(operands.b[k]),
            lane.words[0].eq(self.bus.w_data),
            operands.w_en[k].eq(write),
            operands.w_addr[k].eq(Mux(claimed, offset, fields["dest"])),
            operands.w_data[k].eq(lane.result),
        ]
        return raised

    def _parity(self, m: Module, sequencer: Sequencer, program: Signal) -> Signal:
        """Parity of the selected program: the current copy of its states."""
        parity = Signal(reset_less=True)
        with m.If(sequencer.commit):
            m.d.sync += parity.eq(~parity)
        if len(self.image.lengths) > 1:
            kept = Signal(len(self.image.lengths), reset_less=True)
            with m.If(sequencer.commit):
                m.d.sync += kept.bit_select(program, 1).eq(~parity)
            with m.If(sequencer.start):
                m.d.sync += parity.eq(kept.bit_select(program, 1))
        return parity


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
        (self._one_lane if self.machine.lanes == 1 else self._more_lanes)(m)
        return m

    def _state(self, offset: Value, parity: Value) -> Value:
        """Offset in a bank as the memory sees it."""
        state = offset[-1]
        return Cat(offset[:-2], offset[-2] ^ (parity & state), state)

    def _memory(self, m: Module, name: str, init: list[int]) -> memory.Memory:
        m.submodules[name] = store = memory.Memory(
            shape=self.machine.arithmetic.word,
            depth=len(init),
            init=init,
            attrs={"ram_style": "block"},
        )
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
        field, shared = self.b_addr[0], 4 * block - len(registers)
        a_store = self._memory(m, "a0", registers)
        b_store = self._memory(m, "b0", registers + self.image.tables[:shared])
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
            store = self._memory(m, name, self.image.tables[first:end])
            chosen = delayed(m, here, en=self.en, names=[f"{name}_select"])
            word = self._read(m, name, store, where)
            b = Mux(self._behind(m, chosen, f"{name}_chosen"), word, b)
        m.d.comb += [self.a[0].eq(a), self.b[0].eq(b)]

    def _more_lanes(self, m: Module) -> None:
        lanes, depth = self.machine.lanes, self.machine.bank_depth
        block = self.machine.TABLE_BLOCK
        tables = [
            self._memory(m, "tables0", self.image.tables[: 2 * block]),
            self._memory(m, "tables1", self.image.tables[2 * block :]),
        ]
        for lane in range(lanes):
            for side, field, out in (
                ("a", self.a_addr[lane], self.a[lane]),
                ("b", self.b_addr[lane], self.b[lane]),
            ):
                words = []
                for bank in range(lanes):
                    name = f"{side}{lane}_bank{bank}"
                    words_of_bank = self.image.registers[bank * depth : (bank + 1) * depth]
                    store = self._memory(m, name, words_of_bank)
                    self._write(m, store, bank)
                    words.append(self._read(m, name, store, self._state(field[:-1], self.parity)))
                bank_select = delayed(m, field[-1], en=self.en, names=[f"{side}{lane}_select"])
                bank_chosen = self._behind(m, bank_select, f"{side}{lane}_chosen")
                operand = Mux(bank_chosen, words[1], words[0])
                if side == "b":
                    # Two select bits: bank 0 or 1, tables 0 or 1.
                    table = delayed(m, self.table[lane], en=self.en, names=[f"table{lane}_select"])
                    with m.If(self.en), m.If(self.table[lane]):
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
