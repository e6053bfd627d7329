"""Microcode ROM, program counter, clock enable and framing of the streams."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from amaranth.hdl import Cat, Module, Mux, Signal, Value
from amaranth.lib import data, memory, wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.engine.parts import Bitwise, choose, delayed
from boresight.gateware.machine import Machine
from boresight.gateware.microcode.image import Image, rom_pieces


class Sequencer(wiring.Component):
    """Steps through the microcode, stands still for the streams, and starts over after faults.

    The program counter addresses the ROM, whose registered output goes into one more register, the
    microword at work: behind the ROM there may be a multiplexer of several memories, and what
    decides about the clock enable must come early. A deeper machine has a register between memory
    and multiplexer, too. So the counter is `Machine.prefetch` words ahead. In the cycles after a
    reset, an abandoned update or a change of program, ``active`` is low until the first word.

    A record is framed by ``last``: too early, or missing at ``get_last``, and the update is
    abandoned, ``framing`` pulses and the program begins anew; after a missing ``last`` words are
    swallowed up to the next one.

    With ``anew`` in the cycle of ``start`` the restart routine of the program runs first, and ends
    like an update.

    **Latency** one microword per cycle; a fault costs `Machine.prefetch` + 1 cycles besides the
    words swallowed, a change of program one more, a restart those of its routine besides.
    """

    def __init__(self, *, machine: Machine, image: Image) -> None:
        self.machine = machine
        self.image = image
        microword = data.StructLayout({f.name: f.width for f in machine.fields})
        super().__init__(
            {
                "word": Out(microword),  # Microword at work.
                "active": Out(1),  # ``word`` is valid.
                "en": Out(1),  # Clock enable of the machine.
                # Handshake of the input stream.
                "i_valid": In(1),
                "i_last": In(1),
                "i_ready": Out(1),
                # Handshake of the output stream.
                "o_ready": In(1),
                "o_valid": Out(1),
                "program": In(range(len(image.lengths))),  # Number of the selected program.
                "anew": In(1),  # The program must restart.
                # A write to the register file is requested, for when the machine is idle.
                "request": In(1),
                # With ``request``: not to the register file, but the program or its states change.
                "switch": In(1),
                # The program counter is being set to the first word of ``program``.
                "start": Out(1),
                "claim": Out(1),  # The next first word of a record waits for that write.
                # The write is done in this cycle; the machine stands still. After a ``switch`` the
                # new program begins: ``program`` has its new value in the next cycle.
                "grant": Out(1),
                # The lane's bank is written: with a result, or that of lane 0 with an input word,
                # or that of lane 0 on ``grant``.
                "write": Out(machine.lanes),
                "idle": Out(1),  # The machine waits for the first word of a record.
                "commit": Out(1),  # The update, or the restart routine, ends with this cycle.
                "restarting": Out(1),  # The restart routine is at work.
                "framing": Out(1),  # The update is abandoned with this cycle.
            }
        )

    def elaborate(self, platform: Any) -> Module:
        m = Module()
        word, active, claim = self.word, self.active, self.claim
        # First word: addressed, out of the ROM (and out of the register behind it), at work.
        fill = Signal(self.machine.prefetch + 1)
        base = self._base(m)
        m.d.comb += [active.eq(fill[-1]), self.start.eq(~fill[0])]
        last = self._counter(m, base)

        started, swallow = Signal(name="started"), Signal(name="swallow")
        # A get proceeds when an input word is there, unless it is to be swallowed, or the bus
        # claims the write port before the first one. These conditions do not depend on the
        # microword, whose bits come late: the clock enable is one look-up table after them.
        offered, blocked, bad = (Signal(name=name) for name in ("offered", "blocked", "bad"))
        waits = _table(m, "blocked", _blocked, self.request, started, self.i_valid, swallow)
        m.d.comb += [
            claim.eq(self.request & ~started),
            offered.eq(self.i_valid & ~swallow),
            blocked.eq(waits),
            bad.eq(blocked | (self.i_last ^ word.get_last)),
        ]
        ends = (blocked, self.i_last, word.get_last)
        completed = (active, last, word.get, bad, word.emit, self.o_ready)
        m.d.comb += [
            *self._enables(m, offered, blocked),
            self.framing.eq(_table(m, "framing", _misframed, active, word.get, *ends)),
            self.grant.eq(active & word.get & claim),
            self.i_ready.eq(swallow | (active & word.get & ~claim)),
            self.o_valid.eq(active & word.emit),
            self.idle.eq(active & word.get & ~started & ~self.i_valid),
            self.commit.eq(_table(m, "commit", _completed, *completed)),
        ]
        again = _table(m, "again", _begun_anew, active, word.get, claim & self.switch, *ends)
        m.d.sync += fill.eq(Cat(1, fill))
        with m.If(again):
            m.d.sync += fill.eq(0)
        with m.If(active & word.get & ~blocked):
            m.d.sync += [
                started.eq(~(self.i_last | word.get_last)),
                swallow.eq(word.get_last & ~self.i_last),
            ]
        with m.If(swallow & self.i_valid & self.i_last):
            m.d.sync += swallow.eq(0)
        with m.If(self.commit):
            m.d.sync += self.restarting.eq(0)
        return m

    def _base(self, m: Module) -> Value:
        """Address of the first word of the program, or of its restart routine."""
        starts = self.image.starts
        anew = Signal()
        if self.image.restarts:
            m.d.comb += anew.eq(self.start & self.anew)
            with m.If(self.start):
                m.d.sync += self.restarting.eq(self.anew)
        # A memory: the Verilog of all programs of a machine differs only in those.
        m.submodules.bases = table = memory.Memory(
            shape=range(sum(rom_pieces(len(self.image.rom)))), depth=len(starts), init=starts
        )
        port = table.read_port(domain="comb")
        m.d.comb += port.addr.eq(Cat(self.program, anew))
        return port.data

    def _counter(self, m: Module, base: Value) -> Value:
        """The program counter and its ROM; 1 while the last word of the program is at work."""
        home = self.active & self.word.home
        # The last word comes so many words after ``home``.
        homes = Signal(self.machine.prefetch, reset_less=True)
        pc = Signal(len(base))
        with m.If(self.en):
            m.d.sync += [pc.eq(Mux(home | self.start, base, pc + 1)), homes.eq(Cat(home, homes))]
        self._rom(m, pc)
        return homes[-1]

    def _enables(self, m: Module, offered: Value, blocked: Value) -> list[Any]:
        """Write enables and the clock enable."""
        active, word, o_ready = self.active, self.word, self.o_ready
        for k in range(1, self.machine.lanes):
            result = (blocked, word[f"we{k}"], word.emit, o_ready)
            writes = _table(m, f"write{k}", _written_only, active, word.get, *result)
            m.d.comb += self.write[k].eq(writes)
        input_moves = Mux(self.claim, ~self.switch, offered)
        bits = (active, word.get, input_moves, word.we0, word.emit, o_ready)
        return [
            self.en.eq(_table(m, "en", _enabled, active, word.get, blocked, word.emit, o_ready)),
            self.write[0].eq(_table(m, "write0", _written, *bits)),
        ]

    def _rom(self, m: Module, pc: Signal) -> None:
        """The memories, and the word at work `Machine.prefetch` cycles after its address."""
        contents = self.image.hardware_rom(self.machine)
        (last, words), *others = reversed([*enumerate(contents)])
        chosen = self._piece(m, f"rom{last}", words, pc)
        for k, words in others:
            piece = self._piece(m, f"rom{k}", words, pc)
            # This memory holds all words up to the bit of its depth, the following ones the rest.
            behind = Signal(name=f"behind{k}", reset_less=True)
            with m.If(self.en):
                m.d.sync += behind.eq(pc[(len(words) - 1).bit_length()])
            waits = [f"behind{k}_out"] if self.machine.has("memory") else []
            chosen = Mux(delayed(m, behind, en=self.en, names=waits), chosen, piece)
        m.d.comb += self.word.eq(delayed(m, chosen, en=self.en, names=["word"]))

    def _piece(self, m: Module, name: str, words: list[int], pc: Value) -> Value:
        """Word of a memory, or of several in parallel, at an address."""
        columns, low = [], 0
        for column, width in enumerate(self.machine.rom_columns(len(words))):
            part = name if column == 0 else f"{name}_{column}"
            m.submodules[part] = rom = memory.Memory(
                shape=width,
                depth=len(words),
                init=[word >> low & (1 << width) - 1 for word in words],
                attrs={"rom_style": "block"},
            )
            port = rom.read_port()
            m.d.comb += [port.addr.eq(pc), port.en.eq(self.en)]
            waits = [f"{part}_out"] if self.machine.has("memory") else []
            columns.append(delayed(m, port.data, en=self.en, names=waits))
            low += width
        return Cat(*columns) if len(columns) > 1 else columns[0]


def _table(m: Module, name: str, function: Callable[..., Any], *bits: Value) -> Value:
    m.submodules[name] = unit = Bitwise(function=function, inputs=len(bits))
    return unit.connect(m, *bits)


def _enabled(active: Any, get: Any, blocked: Any, emit: Any, o_ready: Any) -> Any:
    """The machine is enabled: neither a get nor an emit waits."""
    return ~(active & (get & blocked | emit & ~o_ready))


def _blocked(request: Any, started: Any, i_valid: Any, swallow: Any) -> Any:
    """A get has to wait."""
    return request & ~started | ~(i_valid & ~swallow)


def _written_only(active: Any, get: Any, blocked: Any, we: Any, emit: Any, o_ready: Any) -> Any:
    """A result goes to another lane's bank."""
    return active & we & ~(get & blocked) & ~(emit & ~o_ready)


def _written(active: Any, get: Any, word: Any, we: Any, emit: Any, o_ready: Any) -> Any:
    """A word goes to lane 0's bank: from outside at a get, else a result."""
    return active & choose(get, word, we & ~(emit & ~o_ready))


def _misframed(active: Any, get: Any, blocked: Any, last: Any, get_last: Any) -> Any:
    """The word taken ends the stream's record or the program's, but not both."""
    return active & get & ~blocked & (last ^ get_last)


def _begun_anew(active: Any, get: Any, switch: Any, blocked: Any, last: Any, get_last: Any) -> Any:
    """The update is abandoned, or the program changes."""
    return active & get & (switch | ~blocked & (last ^ get_last))


def _completed(active: Any, last: Any, get: Any, bad: Any, emit: Any, o_ready: Any) -> Any:
    """The last word of the program is done, and without a fault."""
    return active & last & ~(get & bad) & ~(emit & ~o_ready)
