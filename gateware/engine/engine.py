"""The micro-programmed engine: one core that runs every estimator."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Cat, Module, Mux, Signal, Value
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.bus.core_registers import BusSignature, Registers
from boresight.gateware.engine.lane import FIELDS, Lane
from boresight.gateware.engine.operands import Operands
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
        port = {"choice": In(range(len(image.lengths)))}
        port |= {name: Out(1) for name in ("chosen", "framing", "restarting")}
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
        raised = [
            self._lane(m, k, sequencer, operands, claimed=claimed, granted=granted)
            for k in range(machine.lanes)
        ]
        for flag, lanes in zip(
            (registers.saturated, registers.beyond), zip(*raised, strict=True), strict=True
        ):
            m.d.comb += flag.eq(Cat(lanes).any())
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
        *,
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
