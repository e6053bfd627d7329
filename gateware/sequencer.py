"""Microcode ROM, program counter, clock enable and framing of the streams."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from amaranth.hdl import Module, Signal, Value
from amaranth.lib import memory, wiring
from amaranth.lib.wiring import In, Out

from gateware.bitwise import Bitwise, choose
from gateware.image import Image
from gateware.machine import Machine
from gateware.microword import microword_layout

__all__ = ["Sequencer"]


class Sequencer(wiring.Component):
    """Steps through the microcode, stands still for the streams, and starts over after faults.

    The program counter addresses the ROM, whose registered output is the microword at work. In the
    cycle after a reset or an abandoned update there is none yet: ``active`` is low.

    A record is framed by ``last``: too early, or missing at ``get_last``, and the update is
    abandoned, ``framing`` pulses and the program begins anew; after a missing ``last`` words are
    swallowed up to the next one.

    **Latency** one microword per cycle; a fault costs one cycle besides the words swallowed.

    Parameters
    ----------
    machine : Machine
        Configuration.
    image : Image
        Microcode.

    Members
    -------
    word : Out(layout)
        Microword at work (`microword_layout`).
    active : Out(1)
        ``word`` is valid.
    en : Out(1)
        Clock enable of the machine.
    i_valid, i_last : In(1), i_ready : Out(1)
        Handshake of the input stream.
    o_ready : In(1), o_valid : Out(1)
        Handshake of the output stream.
    request : In(1)
        Somebody wants the register file's write port while the machine is idle.
    claim : Out(1)
        The next first word of a record waits for that somebody.
    grant : Out(1)
        The write port is free for that somebody in this cycle; the machine stands still.
    write : Out(lanes)
        The lane's bank is written: with a result, or that of lane 0 with an input word, or that of
        lane 0 on ``grant``.
    idle : Out(1)
        The machine waits for the first word of a record.
    commit : Out(1)
        The update ends with this cycle.
    framing : Out(1)
        The update is abandoned with this cycle.
    """

    def __init__(self, *, machine: Machine, image: Image) -> None:
        self.machine = machine
        self.image = image
        super().__init__({
            "word": Out(microword_layout(machine)),
            "active": Out(1),
            "en": Out(1),
            "i_valid": In(1),
            "i_last": In(1),
            "i_ready": Out(1),
            "o_ready": In(1),
            "o_valid": Out(1),
            "request": In(1),
            "claim": Out(1),
            "grant": Out(1),
            "write": Out(machine.lanes),
            "idle": Out(1),
            "commit": Out(1),
            "framing": Out(1),
        })

    def elaborate(self, platform: Any) -> Module:
        """ROM, counter, handshakes, framing."""
        m = Module()
        depth = self.machine.rom_words
        m.submodules.rom = rom = memory.Memory(
            shape=self.machine.word_bits, depth=depth,
            init=self.image.rom_early_home(self.machine), attrs={"rom_style": "block"})
        port = rom.read_port()
        pc = Signal(range(depth))
        word = self.word
        m.d.comb += [port.addr.eq(pc), port.en.eq(self.en), word.eq(port.data)]
        with m.If(self.en):
            m.d.sync += [pc.eq(pc + 1), self.active.eq(1)]
            with m.If((self.active & word.home) | self.framing):
                m.d.sync += pc.eq(0)
            with m.If(self.framing):
                m.d.sync += self.active.eq(0)

        started, swallow = Signal(), Signal()
        # A get proceeds when an input word is there, unless it is to be swallowed, or the bus
        # claims the write port before the first one. These need nothing of the microword, whose
        # bits come late: what decides about the clock enable is one look-up table behind them.
        offered, blocked, bad, claim = Signal(), Signal(), Signal(), self.claim

        def table(name: str, function: Callable[..., Any], *bits: Value) -> Value:
            m.submodules[name] = unit = Bitwise(function=function, inputs=len(bits))
            return unit.connect(m, *bits)

        m.d.comb += [
            claim.eq(self.request & ~started),
            offered.eq(self.i_valid & ~swallow),
            blocked.eq(table("blocked", _blocked, self.request, started, self.i_valid, swallow)),
            bad.eq(blocked | (self.i_last ^ word.get_last)),
        ]
        for k in range(1, self.machine.lanes):
            m.d.comb += self.write[k].eq(table(f"write{k}", _written_only, self.active, word.get,
                                               blocked, word[f"we{k}"], word.emit, self.o_ready))

        m.d.comb += [
            self.en.eq(table("en", _enabled, self.active, word.get, blocked, word.emit,
                             self.o_ready)),
            self.write[0].eq(table("write0", _written, self.active, word.get, claim | offered,
                                word.we0, word.emit, self.o_ready)),
            self.framing.eq(table("framing", _misframed, self.active, word.get, blocked,
                                  self.i_last, word.get_last)),
            self.grant.eq(self.active & word.get & claim),
            self.i_ready.eq(swallow | (self.active & word.get & ~claim)),
            self.o_valid.eq(self.active & word.emit),
            self.idle.eq(self.active & word.get & ~started & ~self.i_valid),
            self.commit.eq(table("commit", _completed, self.active, word.commit, word.get, bad,
                                 word.emit, self.o_ready)),
        ]
        with m.If(self.active & word.get & ~blocked):
            m.d.sync += [
                started.eq(~(self.i_last | word.get_last)),
                swallow.eq(word.get_last & ~self.i_last),
            ]
        with m.If(swallow & self.i_valid & self.i_last):
            m.d.sync += swallow.eq(0)
        return m


def _enabled(active: Any, get: Any, blocked: Any, emit: Any, o_ready: Any) -> Any:
    """The machine moves: neither a get nor an emit waits."""
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


def _completed(active: Any, commit: Any, get: Any, bad: Any, emit: Any, o_ready: Any) -> Any:
    """The last word of the program is done, and without a fault."""
    return active & commit & ~(get & bad) & ~(emit & ~o_ready)
