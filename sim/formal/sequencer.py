"""Proof of the core's sequencer: `gateware.engine.sequencer`, with a tiny image."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Array, Assert, Cat, Const, Module, Mux, Signal

from boresight.gateware.engine.sequencer import Sequencer
from boresight.gateware.machine import Machine, machine_named
from boresight.gateware.microcode.image import Image, encode
from boresight.sim.formal.harness import Harness, drive, reached, unknown
from boresight.sim.formal.prove import Proof

#: Programs, word by word: the fields that are 1. The second gets its only word late.
PROGRAMS = (
    ("get we", "we", "get", "get_last", "emit we", "", "emit"),
    ("we", "get_last", "emit", "emit", "we"),
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
            if "get_last" in fields:
                fields["get"] = 1
            for lane in range(machine.lanes):
                fields[f"we{lane}"] = fields.get("we", 0)
            fields.pop("we", None)
            fields["home"] = int(number == len(words) - 1)
            rom.append(encode(machine, {"shift0": len(rom), **fields}))
    return Image(
        rom=rom,
        registers=[0] * machine.register_words,
        tables=[0] * 1536,
        lengths=tuple(map(len, PROGRAMS)),
        restarts=tuple(map(len, RESTARTS)),
    )


class SequencerHarness(Harness[Sequencer]):
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
        self._registers(m)
        self._back_to_idle(m)

    def _field(self, field: str) -> Any:
        """A field of the executed word."""
        names = {"get": ("get", "get_last")}.get(field, (field,))
        bits = [
            [
                int(any(n in words[k].split() for n in names)) if k < len(words) else 0
                for k in range(max(map(len, _PARTS)))
            ]
            for words in _PARTS
        ]
        return (
            self.active
            & Array(Array(Const(b, 1) for b in row) for row in bits)[self.part][
                Mux(self.active, self.at[:3], 0)
            ]
        )

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
            Assert(dut.en == moves),
            Assert(dut.grant == grant),
            Assert(dut.start == (at == -self.fill)),
            Assert(dut.i_ready == (swallowing | (get & ~grant))),
            Assert(dut.o_valid == emit),
            Assert(dut.idle == (first & ~dut.i_valid)),
            Assert(dut.commit == (home & moves & ~fault)),
            Assert(dut.restarting == self.restarting),
            Assert(dut.framing == fault),
            Assert(dut.write[0] == (takes | (grant & ~dut.switch) | (moves & self._field("we")))),
            *(
                Assert(dut.write[lane] == (moves & self._field("we")))
                for lane in range(1, dut.machine.lanes)
            ),
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

    def _registers(self, m: Module) -> None:
        """Counter and words in the ROM's registers: for induction."""
        dut, at, length = self.dut, self.at, self.length
        pc, fill, homes = self.inside["pc"], self.inside["fill"], self.inside["homes"]
        contents = [0] * (1 << len(pc))
        for number, word in enumerate(dut.image.hardware_rom(dut.machine)[0]):
            contents[number] = word
        microwords = Array(
            Const(word, dut.machine.word_bits) for word in contents[: dut.image.ends[-1]]
        )
        bases = Array(dut.image.bases)

        def ahead(words: int) -> Any:
            """Address so many words ahead; behind the last word the program begins."""
            address, position = Signal(5, name=f"ahead{words}"), Signal(5, name=f"position{words}")
            m.d.comb += position.eq(at + words)
            behind = at + words >= length
            m.d.comb += address.eq(
                Mux(behind, bases[self.program] + position - length, bases[self.part] + position)
            )
            return address

        out = self.inside.parts["rom0"].component.read_ports[0].data
        # Behind the counter: the ROM's output, then that of the register behind it, if any.
        outputs = [out, self.inside["rom0_out"]] if dut.machine.has("memory") else [out]
        m.d.comb += [
            *(
                Assert((at < -words) | (output == microwords[ahead(words)]))
                for words, output in enumerate(reversed(outputs), start=1)
            ),
            Assert((at >= -self.fill) & (at < length) & (self.program < len(PROGRAMS))),
            Assert(fill == (1 << (self.fill + Mux(at < 0, at, 0)).as_unsigned()[:3]) - 1),
            Assert((at == -self.fill) | (pc == ahead(self.fill - 1))),
            Assert((at > -self.fill) | ~self.restarting),
            Assert(~self.active | (dut.word.as_value() == microwords[ahead(0)])),
            Assert(
                ~self.active
                | (homes == Cat(at == length - len(homes) + k for k in range(len(homes))))
            ),
            Assert(self.inside["started"] == self.begun),
            Assert(self.inside["swallow"] == self.swallowing),
            Assert(self.begun == (self.past_first_get & (at <= self.first("get_last")))),
            Assert(~(self.begun & self.swallowing)),
        ]

    def first(self, field: str) -> Any:
        """Number of the first word with a field."""
        numbers = (next(k for k, text in enumerate(p) if field in text) for p in PROGRAMS)
        return Array(numbers)[self.program]

    @property
    def past_first_get(self) -> Any:
        """A word behind the first get is at work."""
        return ~self.restarting & (self.at > self.first("get"))

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
        restart = Mux(self.restarting, 0, _LONGEST_RESTART)
        m.d.comb += [
            Assert(count <= limit),
            # For induction.
            Assert(
                Mux(
                    self.past_first_get,
                    count + self.first("get") + 1 <= self.at,
                    count <= _LONGEST + self.fill + restart + self.at,
                )
            ),
        ]


def _proof(config: str, *, short: bool = False) -> Proof:
    machine = machine_named(config)
    return Proof(
        name=f"sequencer.{config}",
        harness=SequencerHarness,
        dut=lambda: Sequencer(machine=machine, image=tiny_image(machine)),
        depth=6,
        induction=True,
        cover=30,
        short=short,
    )


PROOFS = (_proof("small", short=True), _proof("fast"), _proof("small-d9"))
