"""Proof of the core's sequencer: `gateware.engine.sequencer`, with a tiny image."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Array, Assert, Const, Module, Mux, Signal

from boresight.gateware.engine.sequencer import Sequencer
from boresight.gateware.machine import Machine, machine_named
from boresight.gateware.microcode.image import Image, encode
from boresight.sim.formal.harness import Harness, Proof, drive, reached, unknown

#: Programs, word by word: the fields that are 1. The second gets its only word late.
PROGRAMS = (
    ("get we", "we", "get", "get get_last", "emit we", "", "emit"),
    ("we", "get get_last", "emit", "emit", "we"),
)
#: Their restart routines.
RESTARTS = (("we", "", "we", "we"), ("", "", "", "", "we"))
_PARTS = PROGRAMS + RESTARTS
_LONGEST, _LONGEST_RESTART = (max(map(len, parts)) for parts in (PROGRAMS, RESTARTS))


def tiny_image(machine: Machine) -> Image:
    """`PROGRAMS` and `RESTARTS` as an image."""
    rom: list[int] = []
    for words in _PARTS:
        for number, text in enumerate(words):
            fields = dict.fromkeys(text.split(), 1)
            fields |= {f"we{lane}": fields.get("we", 0) for lane in range(machine.lanes)}
            fields |= {"shift0": len(rom), "home": int(number == len(words) - 1)}
            rom.append(encode(machine, fields))
    return Image(
        rom=rom,
        registers=[0] * machine.register_words,
        tables=[0] * 1536,
        lengths=tuple(map(len, PROGRAMS)),
        restarts=tuple(map(len, RESTARTS)),
    )


class SequencerHarness(Harness):
    """Sequencer: its outputs follow the rules of `docs/engine.md` in every cycle.

    Grants come only at the first word of a record. The machine is back there within the longest
    program, the longest restart routine and `Machine.prefetch` + 2 cycles in which the streams
    flow.

    The program changes as `gateware.bus.core_registers` changes it: in the cycle after a granted
    switch. ``anew`` has any value in any cycle, and is obeyed in that of ``start`` alone: no update
    is torn, and what restarts begins with the routine's first word.
    """

    def surround(self, m: Module, dut: Sequencer) -> None:
        """Sets ``at``, the executed word of the rules; negative values count the cycles to it."""
        #: Cycles without an executed word after a reset, a fault or a change of program.
        self.fill = dut.machine.prefetch + 1
        drive(m, dut, "i_valid", "i_last", "o_ready", "request", "switch", "anew")
        self.program = Signal(range(len(PROGRAMS)))
        next_program = unknown(m, 1, "other")
        self.restarting = Signal(name="restarts")
        self.part = Signal(range(len(_PARTS)))  # program or restart routine
        m.d.comb += [
            dut.program.eq(self.program),
            self.part.eq(self.program + Mux(self.restarting, len(PROGRAMS), 0)),
        ]
        with m.If(dut.grant & dut.switch):
            m.d.sync += self.program.eq(next_program)
        self._rules(m)
        self._back_to_idle(m)

    def _field(self, field: str) -> Any:
        rows = Array(
            Array(Const(field in text.split(), 1) for text in (*words, *[""] * (8 - len(words))))
            for words in _PARTS
        )
        return self.active & rows[self.part][self.at[:3]]

    def _word(self) -> Any:
        """The executed word, with ``home`` where the hardware has it."""
        words, bits = self.dut.image.hardware_rom(self.dut.machine)[0], self.dut.machine.word_bits
        address = (Array(self.dut.image.bases)[self.part] + self.at)[:5].as_unsigned()
        return Array(Const(word, bits) for word in words[:32])[address]

    def _rules(self, m: Module) -> None:
        """Outputs of a cycle, and the executed word of the next."""
        dut = self.dut
        self.at = at = Signal(range(-self.fill, 8), init=-self.fill)
        self.begun = begun = Signal(name="begun")
        self.swallowing = swallowing = Signal(name="swallowing")
        self.active, self.length = Signal(name="at_work"), Signal(range(8), name="length")
        first, takes, moves, fault, grant, home = (
            Signal(name=n) for n in ("first", "takes", "moves", "fault", "granted", "at_home")
        )
        self.waits = first
        get, emit = self._field("get"), self._field("emit")
        results = moves & self._field("we")
        m.d.comb += [
            self.active.eq(at >= 0),
            self.length.eq(Array(map(len, _PARTS))[self.part]),
            home.eq(at == self.length - 1),
            first.eq(get & ~begun),
            grant.eq(first & dut.request),
            takes.eq(get & dut.i_valid & ~swallowing & ~grant),
            moves.eq(~(get & ~takes) & ~(emit & ~dut.o_ready)),
            fault.eq(takes & (dut.i_last ^ self._field("get_last"))),
            Assert(dut.active == self.active),
            Assert(~self.active | (dut.word.as_value() == self._word())),
            Assert(dut.en == moves),
            Assert(dut.grant == grant),
            Assert(dut.start == (at == -self.fill)),
            Assert(dut.i_ready == (swallowing | (get & ~grant))),
            Assert(dut.o_valid == emit),
            Assert(dut.idle == (first & ~dut.i_valid)),
            Assert(dut.commit == (home & moves & ~fault)),
            Assert(dut.restarting == self.restarting),
            Assert(dut.framing == fault),
            Assert(dut.write[0] == (takes | (grant & ~dut.switch) | results)),
            *(Assert(dut.write[lane] == results) for lane in range(1, dut.machine.lanes)),
        ]
        with m.If(at == -self.fill):
            m.d.sync += self.restarting.eq(dut.anew)
        with m.Elif(home & moves & ~fault):
            m.d.sync += self.restarting.eq(0)
        with m.If(swallowing & dut.i_valid & dut.i_last):
            m.d.sync += swallowing.eq(0)
        with m.If(takes):
            m.d.sync += [
                begun.eq(~(dut.i_last | self._field("get_last"))),
                swallowing.eq(self._field("get_last") & ~dut.i_last),
            ]
        with m.If(fault | (grant & dut.switch)):
            m.d.sync += at.eq(-self.fill)
        with m.Elif(moves):
            m.d.sync += at.eq(Mux(home, 0, at + 1))
        m.d.comb += [
            reached(m, fault & ~dut.i_last, "late_last"),
            *(reached(m, dut.commit & (self.part == k), f"end{k}") for k in range(len(_PARTS))),
            reached(m, grant & ~dut.switch, "written"),
        ]

    def _back_to_idle(self, m: Module) -> None:
        """Cycles in which both streams flow, since the machine last waited at its start."""
        limit = _LONGEST + _LONGEST_RESTART + self.fill + 1
        count = Signal(range(limit + 2))
        dut = self.dut
        flows = dut.i_valid & dut.o_ready & ~(self.swallowing & ~dut.i_last)
        with m.If(self.waits):
            m.d.sync += count.eq(0)
        with m.Elif(flows):
            m.d.sync += count.eq(count + 1)
        m.d.comb += Assert(count <= limit)


def _proof(config: str) -> Proof:
    machine = machine_named(config)
    return Proof(
        name=f"sequencer.{config}",
        harness=SequencerHarness,
        dut=lambda: Sequencer(machine=machine, image=tiny_image(machine)),
        depth=24,
    )


PROOFS = (_proof("small"), _proof("fast"), _proof("small-d9"))
