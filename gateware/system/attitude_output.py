"""Attitudes to the host: frames or lines of text, as many as the line can take."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

from amaranth.hdl import Cat, Const, Module, Mux, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.boards.framer import body_layout
from boresight.gateware.boards.frames import Kind
from boresight.gateware.bus.results import ResultPort
from boresight.gateware.system.attitude_text import LINE, AngleDigits, Op

__all__ = ["AttitudeOutput", "OutputMode"]


class OutputMode(IntEnum):
    """What is sent."""

    OFF = 0
    BINARY = 1
    TEXT = 2


class _State(IntEnum):
    """Of a byte: address of the result, the byte in it, the character, the line's turn."""

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

    What is being sent is an update that this reader of the results has taken, so it stays as it is
    however long the line needs, and nothing ever waits for the line.

    `gateware.system.attitude_frame` says what is sent, and does the same in software.

    Words have 32 bits.

    **Latency** 1 cycle from ``updated`` to a frame's first byte, 4 to a line's; then 4 cycles per
    byte, or what the line needs. Text: also 34 cycles per angle and up to 10 per digit.

    Members
    -------
    updated : In(1)
        There is a new update.
    mode : In(2)
        `OutputMode`; taken with each update.
    divider : In(10)
        Every ``divider``-th update, from the next one sent on; 0 counts as 1.
    flags : In(8)
        Upper byte of the header, taken with each update.
    port : Out(ResultPort)
        The results.
    o : Out(stream of {data: 8, last: 1, raw: 1})
        Bodies of frames, or lines as raw text.
    events : Out
        One-cycle pulses, by `EVENTS`.
    """

    #: Meaning of the bits of ``events``: an update is sent; one that was due is not.
    EVENTS = ("attitude_sent", "attitude_skipped")

    def __init__(self) -> None:
        super().__init__(
            {
                "updated": In(1),
                "mode": In(2),
                "divider": In(10),
                "flags": In(8),
                "port": Out(ResultPort(word=32)),
                "o": Out(stream.Signature(body_layout)),
                "events": Out(len(self.EVENTS)),
            }
        )

    def elaborate(self, platform: Any) -> Module:
        """When to send; where in the frame or line; the byte there."""
        m = Module()
        state, text = Signal(_State), Signal()
        left, due = Signal(10), Signal()  # updates until the next one that is sent
        later = left[1:].any()
        idle, start, flags = state == _State.IDLE, Signal(), Signal(8)
        enabled = (self.mode == OutputMode.BINARY) | (self.mode == OutputMode.TEXT)
        m.d.comb += [
            due.eq(self.updated & enabled & ~later),
            start.eq(due & idle),
            self.port.take.eq(start),
            self.events.eq(Cat(start, due & ~idle)),
        ]
        with m.If(due):
            m.d.sync += left.eq(self.divider)
        with m.Elif(self.updated & later):
            m.d.sync += left.eq(left - 1)
        with m.If(start):
            m.d.sync += [flags.eq(self.flags), text.eq(self.mode == OutputMode.TEXT)]

        # Place in the line; or in the words of the frame: 0 to 7, then 32 to 63, so that its high
        # bits say which word.
        # What stands there is in flip-flops from LOAD on.
        place, bit = Signal(6), Signal(6)
        entry_op, entry_code = Signal(2), Signal(7)
        with m.Switch(place):
            for k, entry in enumerate(LINE):
                with m.Case(k):
                    m.d.comb += [entry_op.eq(entry.op), entry_code.eq(entry.code)]
        with m.If(~text):
            m.d.comb += [entry_op.eq(Op.HEX), entry_code.eq(Cat(Const(0, 1), place))]
        op, code, ends, next_place = Signal(2), Signal(7), Signal(), Signal(6)
        m.d.sync += [
            op.eq(entry_op),
            code.eq(entry_code),
            ends.eq(Mux(text, place == len(LINE) - 1, place == 63)),
        ]
        m.d.comb += next_place.eq(place + 1)
        with m.If(~text & (place == 7)):
            m.d.comb += next_place.eq(32)

        # The byte of the result there.
        word, value, byte = code[3:], self.port.value, Signal(8)
        multiplying = state == _State.MULTIPLY
        m.d.comb += self.port.index.eq(Cat(entry_code[3:6], Const(0, 1), entry_code[6]))
        m.d.sync += byte.eq(value.word_select(Mux(multiplying, bit[3:5], code[1:3]), 8))
        with m.If(~word.any() & code[1:3].all()):
            m.d.sync += byte.eq(flags)

        # Its character.
        m.submodules.digits = digits = AngleDigits()
        digit, low = Signal(4), Signal(3)
        m.d.sync += [
            low.eq(bit),
            digits.bit.eq(byte.bit_select(low, 1)),
            digits.negative.eq(value[31]),
            digits.shift.eq(multiplying & bit.any() & ~digits.last),
        ]
        m.d.comb += [
            digits.power.eq(code),
            digits.last.eq(bit == 31 + _BIT_DELAY),
            digits.start.eq((op == Op.SIGN) & (state == _State.LOAD)),
            digits.subtract.eq(state == _State.SUBTRACT),
        ]
        shown, character = Signal(4), Signal(8)
        m.d.comb += shown.eq(Mux(op == Op.HEX, Mux(code[0], byte[4:], byte[:4]), digit))
        with m.Switch(op):
            with m.Case(Op.LITERAL):
                m.d.comb += character.eq(code[:6])
            with m.Case(Op.SIGN):
                m.d.comb += character.eq(Mux(digits.negative, ord("-"), ord("+")))
            with m.Default():
                m.d.comb += character.eq(Mux(shown > 9, ord("A") - 10, ord("0")) + shown)

        m.d.comb += [
            self.o.valid.eq((state == _State.KIND) | (state == _State.PUT)),
            self.o.payload.raw.eq(text),
        ]
        with m.Switch(state):
            with m.Case(_State.IDLE):
                m.d.sync += [
                    place.eq(0),
                    self.o.payload.data.eq(Kind.ATTITUDE),
                    self.o.payload.last.eq(0),
                ]
                with m.If(start):
                    m.d.sync += state.eq(
                        Mux(self.mode == OutputMode.TEXT, _State.FETCH, _State.KIND)
                    )
            with m.Case(_State.KIND), m.If(self.o.ready):
                m.d.sync += state.eq(_State.FETCH)
            with m.Case(_State.FETCH):
                m.d.sync += [digit.eq(0), bit.eq(0), state.eq(_State.LOAD)]
            with m.Case(_State.LOAD):
                m.d.sync += state.eq(Mux(op == Op.DIGIT, _State.SUBTRACT, _State.FORM))
            with m.Case(_State.SUBTRACT):
                with m.If(digits.possible):
                    m.d.sync += digit.eq(digit + 1)
                with m.Else():
                    m.d.sync += state.eq(_State.FORM)
            with m.Case(_State.FORM):
                m.d.sync += [
                    self.o.payload.data.eq(Mux(text, character, byte)),
                    self.o.payload.last.eq(ends),
                    state.eq(_State.PUT),
                ]
            with m.Case(_State.PUT), m.If(self.o.ready):
                m.d.sync += [place.eq(next_place), state.eq(_State.FETCH)]
                with m.If(ends):
                    m.d.sync += state.eq(_State.IDLE)
                with m.Elif(op == Op.SIGN):
                    m.d.sync += [place.eq(place), state.eq(_State.MULTIPLY)]
            with m.Case(_State.MULTIPLY):
                m.d.sync += bit.eq(bit + 1)
                with m.If(digits.last):
                    m.d.sync += [place.eq(next_place), state.eq(_State.FETCH)]
        return m
