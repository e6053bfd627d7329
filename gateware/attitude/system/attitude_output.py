"""Attitudes to the host: frames or lines of text, as many as the line can carry."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.attitude.bus.results import ResultPort
from boresight.gateware.attitude.system.attitude_frame import OUTPUTS
from boresight.gateware.attitude.system.attitude_text import LINE, AngleDigits, Op
from boresight.gateware.boards.framer import body_layout
from boresight.gateware.boards.frames import Kind

__all__ = ["AttitudeOutput", "OutputMode"]


class OutputMode(IntEnum):
    """Form of the output."""

    OFF = 0
    BINARY = 1
    TEXT = 2


class _State(IntEnum):
    """States for a byte: address of the result, byte of the result, character, transmission."""

    IDLE = 0
    FETCH = 1
    LOAD = 2
    SUBTRACT = 3
    FORM = 4
    PUT = 5
    KIND = 6
    MULTIPLY = 7


#: Cycles from the count of a bit to its addition.
_BIT_DELAY = 2


class AttitudeOutput(wiring.Component):
    """Sends every n-th update, unless the one before is still being sent: then that is skipped.

    An update being sent is held by this reader of the results, so it does not change while the
    line needs it, and nothing ever waits for the line.

    `gateware.attitude.system.attitude_frame` defines frames and lines, and makes them in software.

    Words have 32 bits. Without ``text`` there are frames only, of 2 words and as many as the update
    has outputs; lines need the outputs of an attitude (`attitude_frame.OUTPUTS`).

    **Latency** 1 cycle from ``updated`` to a frame's first byte, 4 to a line's; then 4 cycles per
    byte, 5 with ``read_cycles`` 2, or what the line needs. Text: also 34 cycles
    per angle and up to 10 per digit.

    Parameters
    ----------
    text : bool
        Whether every update has the outputs of an attitude.
    outputs : int, 1 to 16
        Maximum number of outputs of an update.
    read_cycles : 1 or 2
        Of the results.

    Members
    -------
    updated : In(1)
        A new update is complete.
    last_output : In(4)
        Number of its last output word, taken with it.
    mode : In(2)
        `OutputMode`; taken with each update.
    divider : In(10)
        Every ``divider``-th update, from the next one sent on; 0 counts as 1.
    flags : In(8)
        Upper byte of the header, taken with each update.
    port : Out(ResultPort(word=32))
        The results.
    o : Out(stream of {data: 8, last: 1, raw: 1})
        Bodies of frames, or lines as raw text.
    events : Out
        One-cycle pulses, by `EVENTS`.
    """

    #: Meaning of the bits of ``events``: an update is sent; one that was due is not.
    EVENTS = ("attitude_sent", "attitude_skipped")

    def __init__(self, *, text: bool = True, outputs: int = 8, read_cycles: int = 1) -> None:
        if not 1 <= outputs <= 16 or (text and outputs != len(OUTPUTS)):
            raise ValueError(f"outputs must be 1 to 16, 8 with text, not {outputs!r}")
        self.text = text
        self.read_cycles = read_cycles
        #: Bits of the number of an output.
        self.bits = 3 if outputs <= 8 else 4
        super().__init__(
            {
                "updated": In(1),
                "last_output": In(4),
                "mode": In(2),
                "divider": In(10),
                "flags": In(8),
                "port": Out(ResultPort(word=32)),
                "o": Out(stream.Signature(body_layout)),
                "events": Out(len(self.EVENTS)),
            }
        )

    def elaborate(self, platform: Any) -> Module:
        """Start of a transmission; position in the frame or line; its byte; its character."""
        m = Module()
        s = _Place(self.bits)
        start, flags = self._begin(m, s)
        self._entry(m, s)

        # The byte of the result there.
        word, value = s.code[3:], self.port.value
        multiplying = s.state == _State.MULTIPLY
        low, is_output = s.entry_code[3 : 3 + self.bits], s.entry_code[3 + self.bits]
        m.d.comb += self.port.index.eq(Cat(low, Const(0, 4 - self.bits), is_output))
        m.d.sync += s.byte.eq(value.word_select(Mux(multiplying, s.bit[3:5], s.code[1:3]), 8))
        with m.If(~word.any() & s.code[1:3].all()):
            m.d.sync += s.byte.eq(flags)
        shown = self._character(m, s) if self.text else s.byte
        m.d.comb += [
            self.o.valid.eq((s.state == _State.KIND) | (s.state == _State.PUT)),
            self.o.payload.raw.eq(s.text),
        ]
        self._states(m, s, start, Mux(s.text, shown, s.byte))
        return m

    def _begin(self, m: Module, s: _Place) -> tuple[Signal, Signal]:
        """Select the updates to send, and store their data."""
        left = Signal(10)  # updates until the next one that is sent
        due = Signal()
        later = left[1:].any()
        idle = Signal(init=1)
        start = Signal()
        flags = Signal(8)
        is_text = (self.mode == OutputMode.TEXT) if self.text else Const(0)
        m.d.comb += [
            due.eq(self.updated & ((self.mode == OutputMode.BINARY) | is_text) & ~later),
            start.eq(due & idle),
            self.port.take.eq(start),
            self.events.eq(Cat(start, due & ~idle)),
        ]
        with m.If(start):
            m.d.sync += idle.eq(0)
        with m.If((s.state == _State.PUT) & self.o.ready & s.ends):
            m.d.sync += idle.eq(1)
        with m.If(due):
            m.d.sync += left.eq(self.divider)
        with m.Elif(self.updated & later):
            m.d.sync += left.eq(left - 1)
        with m.If(idle):  # up to ``start``
            m.d.sync += [flags.eq(self.flags), s.text.eq(is_text)]
            if not self.text:
                m.d.sync += s.last.eq(self.last_output)
        return start, flags

    def _entry(self, m: Module, s: _Place) -> None:
        """Entry at the place, registered from LOAD on; the next place.

        Places of a frame are 0 to 7, then those of the outputs, so that high bits say which word.
        """
        ends = s.place == Cat(Const(3, 2), s.last[: self.bits], Const(1))
        if self.text:
            columns = Cat(Cat(Const(e.op, 2), Const(e.code, len(s.entry_code))) for e in LINE)
            m.d.comb += Cat(s.entry_op, s.entry_code).eq(
                columns.word_select(s.place, len(s.entry_op) + len(s.entry_code))
            )
            ends = Mux(s.text, s.place == len(LINE) - 1, s.place == 63)
        with m.If(~s.text):
            m.d.comb += [s.entry_op.eq(Op.HEX), s.entry_code.eq(Cat(Const(0), s.place))]
        m.d.sync += [s.op.eq(s.entry_op), s.code.eq(s.entry_code), s.ends.eq(ends)]
        m.d.comb += s.next_place.eq(s.place + 1)
        with m.If(~s.text & (s.place == 7)):
            m.d.comb += s.next_place.eq(4 << self.bits)

    def _character(self, m: Module, s: _Place) -> Signal:
        """Character of a line for the byte."""
        m.submodules.digits = digits = AngleDigits()
        low = Signal(3)
        multiplying = s.state == _State.MULTIPLY
        m.d.sync += [
            low.eq(s.bit),
            digits.bit.eq(s.byte.bit_select(low, 1)),
            digits.negative.eq(self.port.value[31]),
            digits.shift.eq(multiplying & s.bit.any() & ~digits.last),
        ]
        m.d.comb += [
            digits.power.eq(s.code),
            digits.last.eq(s.bit == 31 + _BIT_DELAY),
            digits.start.eq((s.op == Op.SIGN) & (s.state == _State.LOAD)),
            digits.subtract.eq(s.state == _State.SUBTRACT),
            s.possible.eq(digits.possible),
            s.multiplied.eq(digits.last),
        ]
        shown = Signal(4)
        character = Signal(8)
        m.d.comb += shown.eq(Mux(s.op == Op.HEX, Mux(s.code[0], s.byte[4:], s.byte[:4]), s.digit))
        with m.Switch(s.op):
            with m.Case(Op.LITERAL):
                m.d.comb += character.eq(s.code[:6])
            with m.Case(Op.SIGN):
                m.d.comb += character.eq(Mux(digits.negative, ord("-"), ord("+")))
            with m.Default():
                m.d.comb += character.eq(Mux(shown > 9, ord("A") - 10, ord("0")) + shown)
        return character

    def _states(self, m: Module, s: _Place, start: Signal, shown: Value) -> None:
        """One byte after another."""
        with m.Switch(s.state):
            with m.Case(_State.IDLE):
                m.d.sync += [
                    s.place.eq(0),
                    self.o.payload.data.eq(Kind.ATTITUDE),
                    self.o.payload.last.eq(0),
                ]
                with m.If(start):
                    is_text = (self.mode == OutputMode.TEXT) if self.text else Const(0)
                    m.d.sync += s.state.eq(Mux(is_text, _State.FETCH, _State.KIND))
            with m.Case(_State.KIND), m.If(self.o.ready):
                m.d.sync += s.state.eq(_State.FETCH)
            with m.Case(_State.FETCH):
                m.d.sync += [s.digit.eq(0), s.bit.eq(0)]
                with m.If(self._is_fetched(m, s)):
                    m.d.sync += s.state.eq(_State.LOAD)
            with m.Case(_State.LOAD):
                is_digit = (s.op == Op.DIGIT) if self.text else Const(0)
                m.d.sync += s.state.eq(Mux(is_digit, _State.SUBTRACT, _State.FORM))
            with m.Case(_State.SUBTRACT):
                with m.If(s.possible):
                    m.d.sync += s.digit.eq(s.digit + 1)
                with m.Else():
                    m.d.sync += s.state.eq(_State.FORM)
            with m.Case(_State.FORM):
                m.d.sync += [
                    self.o.payload.data.eq(shown),
                    self.o.payload.last.eq(s.ends),
                    s.state.eq(_State.PUT),
                ]
            with m.Case(_State.PUT), m.If(self.o.ready):
                m.d.sync += [s.place.eq(s.next_place), s.state.eq(_State.FETCH)]
                with m.If(s.ends):
                    m.d.sync += s.state.eq(_State.IDLE)
                with m.Elif((s.op == Op.SIGN) if self.text else Const(0)):
                    m.d.sync += [s.place.eq(s.place), s.state.eq(_State.MULTIPLY)]
            with m.Case(_State.MULTIPLY):
                m.d.sync += s.bit.eq(s.bit + 1)
                with m.If(s.multiplied):
                    m.d.sync += [s.place.eq(s.next_place), s.state.eq(_State.FETCH)]

    def _is_fetched(self, m: Module, s: _Place) -> Value:
        """Whether the result comes in the next cycle."""
        if self.read_cycles == 1:
            return Const(True)
        again = Signal()
        m.d.sync += again.eq((s.state == _State.FETCH) & ~again)
        return again


class _Place:
    """Position in a frame or line, and its entry."""

    def __init__(self, bits: int) -> None:
        self.state = Signal(_State)
        self.text = Signal()
        self.last = Signal(4)
        self.place = Signal(3 + bits)
        self.next_place = Signal(3 + bits)
        self.bit = Signal(6)
        self.entry_op = Signal(2)
        self.entry_code = Signal(4 + bits)
        self.op = Signal(2)
        self.code = Signal(4 + bits)
        self.ends = Signal()
        self.byte = Signal(8)
        self.digit = Signal(4)
        self.possible = Signal()
        self.multiplied = Signal()
