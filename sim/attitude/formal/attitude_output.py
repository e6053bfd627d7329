"""Proof of the output formatter: `gateware.attitude.system.attitude_output`."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Array, Assert, Assume, Cat, Const, Module, Mux, Signal, Value

from boresight.gateware.attitude.system.attitude_frame import OUTPUTS
from boresight.gateware.attitude.system.attitude_output import AttitudeOutput, OutputMode, _State
from boresight.gateware.attitude.system.attitude_text import LINE, Op
from boresight.gateware.attitude.system.interface import Place
from boresight.gateware.boards.frames import Kind
from boresight.sim.formal.harness import Harness, before, fixed, reached, unknown
from boresight.sim.formal.inside import Inside
from boresight.sim.formal.prove import Proof

__all__ = ["PROOFS", "Sent"]

#: Bytes of a word.
_SIZE = 4
#: Maximum cycles from a byte that is taken to the next one of a frame.
_PACE = 5
#: Of a line: an angle's product, its digits' subtractions.
_LINE_PACE = 58


class Sent(Harness[AttitudeOutput]):
    """A frame has the bytes of one update, in order; a line its characters, as many as it shall.

    Updates, settings and the line do anything. One word of the results is followed, which is any,
    but the same always; it changes with each update that is taken.
    """

    def surround(self, m: Module, dut: AttitudeOutput, inside: Inside) -> None:
        """Which updates are sent; the bytes of each; then the state machine, for induction."""
        for name in ("updated", "last_output", "mode", "divider", "flags"):
            port = getattr(dut, name)
            m.d.comb += port.eq(unknown(m, port.shape(), f"{name}_in"))
        m.d.comb += Assume(dut.last_output < 1 << dut.bits)
        ready = unknown(m, 1, "ready")
        m.d.comb += dut.o.ready.eq(ready)
        taken = dut.o.valid & ready

        # The results, of which one word is known.
        index, value = fixed(m, len(dut.port.index), "index"), unknown(m, 32, "value")
        word, newest = Signal(32, name="word"), unknown(m, 32, "newest")
        with m.If(dut.port.take):
            m.d.sync += word.eq(newest)
        hit, read = dut.port.index == index, word
        for k in range(dut.read_cycles):
            hit, read = before(m, hit, f"looked{k}"), before(m, read, f"read{k}")
        m.d.comb += [dut.port.value.eq(value), Assume(~hit | (value == read))]

        sending, text = Signal(name="sending"), Signal(name="sends_text")
        number, flags = Signal(8, name="number"), Signal(8, name="flags_taken")  # of the byte
        outputs = Signal(5, name="outputs")
        is_due, updates_left = Signal(name="is_due"), Signal(10, name="updates_left")
        wants_text = (dut.mode == OutputMode.TEXT) & Const(dut.text, 1)
        begins = is_due & ~sending
        m.d.comb += is_due.eq(
            dut.updated & ((dut.mode == OutputMode.BINARY) | wants_text) & (updates_left <= 1)
        )
        with m.If(is_due):
            m.d.sync += updates_left.eq(dut.divider)
        with m.Elif(dut.updated & (updates_left > 1)):
            m.d.sync += updates_left.eq(updates_left - 1)
        last = Signal(name="is_last")
        m.d.comb += last.eq(number == Mux(text, len(LINE) - 1, _SIZE * (2 + outputs)))
        with m.If(taken):
            m.d.sync += number.eq(number + 1)
        with m.If(taken & last):
            m.d.sync += [sending.eq(0), number.eq(0)]
        with m.If(begins):
            m.d.sync += [sending.eq(1), text.eq(wants_text), flags.eq(dut.flags)]
            m.d.sync += outputs.eq(len(OUTPUTS) if dut.text else dut.last_output + 1)
        place = (number - 1)[2:]
        result = Mux(place < 2, place, Place.OUTPUTS + place - 2)
        byte, part = Signal(8, name="byte_wanted"), (number - 1)[:2]
        m.d.comb += byte.eq(Mux((place == 0) & (part == 3), flags, word.word_select(part, 8)))
        known = (result == index) | ((place == 0) & (part == 3))
        data = dut.o.payload
        m.d.comb += [
            Assert(dut.port.take == begins),
            Assert(dut.events == Cat(begins, is_due & sending)),
            Assert(~dut.o.valid | sending),
            Assert(~dut.o.valid | (data.last == last)),
            Assert(~dut.o.valid | (data.raw == text)),
            Assert(~(dut.o.valid & ~text & (number == 0)) | (data.data == Kind.ATTITUDE)),
            Assert(~(dut.o.valid & ~text & (number != 0) & known) | (data.data == byte)),
        ]
        was_stalled = before(m, dut.o.valid & ~ready, "stood")
        previous = before(m, data.as_value(), "shown")
        m.d.comb += [
            Assert(~was_stalled | (dut.o.valid & (data.as_value() == previous))),
            reached(m, taken & ~text & (number == 2 * _SIZE if dut.text else last), "frame"),
            reached(m, is_due & sending, "skipped"),
        ]
        self.sending, self.text, self.number, self.last = sending, text, number, last
        self.byte, self.known, self.taken = byte, known, taken
        self.word, self.index, self.flags = word, index, flags
        m.d.comb += [
            Assert(~sending | text | (number <= _SIZE * (2 + outputs))),
            Assert(sending | (number == 0)),
            Assert(~text | Const(dut.text, 1)),
            Assert((outputs >= 1) | ~sending | text),
            Assert(outputs <= 1 << dut.bits),
            Assert(inside["left"] == updates_left),
            Assert(~sending | (inside["flags"] == flags)),
            Assert(~(sending & text) | (number < len(LINE))),
        ]
        words = len(OUTPUTS) if dut.text else inside["last"] + 1
        m.d.comb += Assert(~sending | (outputs == words))
        self._states(m, inside)

    def _states(self, m: Module, inside: Inside) -> None:
        """The state machine's place, and its way to the next byte."""
        dut, number, sending, text = self.dut, self.number, self.sending, self.text
        state, place, op = inside["state"], inside["place"], inside["op"]

        def at(*states: _State) -> Value:
            return Cat(state == s for s in states).any()

        in_frame = Mux(number <= 2 * _SIZE, number - 1, (4 << dut.bits) + number - 1 - 2 * _SIZE)
        before_byte = at(_State.FETCH, _State.LOAD, _State.SUBTRACT, _State.FORM, _State.PUT)
        within = at(_State.LOAD, _State.SUBTRACT, _State.FORM, _State.PUT)
        m.d.comb += [
            Assert(sending == (state != _State.IDLE)),
            Assert(inside["idle"] == ~sending),
            Assert((inside["text"] == text) | ~sending),
            Assert(~at(_State.KIND) | ((number == 0) & ~text)),
            Assert(~at(_State.KIND) | (place == 0)),
            Assert(~(sending & ~text & ~at(_State.KIND)) | before_byte),
            Assert(~(sending & ~text & ~at(_State.KIND)) | (number != 0)),
            Assert(~(before_byte & ~text) | (place == in_frame)),
            Assert(~(within & ~text) | (op == Op.HEX)),
            Assert(~(within & ~text) | (inside["code"] == Cat(Const(0, 1), in_frame))),
            Assert(~at(_State.FORM, _State.PUT) | (inside["ends"] == self.last)),
            Assert(~(at(_State.FORM) & ~text & self.known) | (inside["byte"] == self.byte)),
            Assert(~(at(_State.KIND) | (at(_State.IDLE) & sending)) | ~dut.o.payload.last),
            Assert(~(within & ~text) | ~at(_State.SUBTRACT)),
        ]
        if dut.text:
            self._line(m, inside, before_byte, within, at(_State.FORM), at(_State.MULTIPLY))
        wait_cycles = Signal(range(_PACE + 2))
        with m.If(~sending | dut.o.valid):
            m.d.sync += wait_cycles.eq(0)
        with m.Else():
            m.d.sync += wait_cycles.eq(wait_cycles + 1)
        pace = 2 + dut.read_cycles
        steps = {_State.FETCH: 0, _State.LOAD: dut.read_cycles, _State.FORM: 1 + dut.read_cycles}
        again = inside["again"] if dut.read_cycles == 2 else Const(0)
        m.d.comb += [
            Assert(text | (wait_cycles <= pace)),
            Assert(~again | at(_State.FETCH)),
            *(
                Assert(~at(s) | text | (wait_cycles == k + (again if s is _State.FETCH else 0)))
                for s, k in steps.items()
            ),
        ]

    def _line(
        self,
        m: Module,
        inside: Inside,
        before_byte: Value,
        within: Value,
        forms: Value,
        sums: Value,
    ) -> None:
        """Characters of a line that are literal or hexadecimal; the others are digits and signs."""
        dut, number, text, place = self.dut, self.number, self.text, inside["place"]
        ops = Array(Const(entry.op, 2) for entry in LINE)
        codes = Array(Const(entry.code, len(inside["code"])) for entry in LINE)
        op, code = Signal(2, name="op_wanted"), Signal.like(inside["code"], name="code_wanted")
        m.d.comb += [op.eq(ops[number]), code.eq(codes[number])]
        word, part, nibble = code[3:], code[1:3], Signal(4, name="nibble")
        of_flags = (word == 0) & part.all()
        byte = Mux(of_flags, self.flags, self.word.word_select(part, 8))
        known = (op == Op.HEX) & (of_flags | (Cat(word[:3], Const(0, 1), word[3]) == self.index))
        character = Mux(nibble > 9, nibble + ord("A") - 10, nibble + ord("0"))
        is_sent = dut.o.valid & text
        m.d.comb += [
            nibble.eq(byte.word_select(code[0], 4)),
            Assert(~(is_sent & (op == Op.LITERAL)) | (dut.o.payload.data == code)),
            Assert(~(is_sent & known) | (dut.o.payload.data == character)),
            reached(m, self.taken & text, "character"),
            # For induction.
            Assert(~(before_byte & text) | (place == number)),
            Assert(~(within & text) | ((inside["op"] == op) & (inside["code"] == code))),
            Assert(~(forms & text & known) | (inside["byte"] == byte)),
            Assert(~sums | (text & (number == place + 1))),
        ]


def _proof(name: str, cover: int, **parameters: Any) -> Proof:
    return Proof(
        name=f"output.{name}",
        depth=10,
        induction=4,
        cover=range(cover, cover + 1),
        claim=f"AttitudeOutput, {parameters}: a frame has kind, header with the flags, stamp and "
        "outputs of the one update taken at its start, each byte once, and ends with the last "
        "output; updates meanwhile are skipped; the next byte comes within the stated cycles; a "
        "line has its characters, and as many as it shall",
        harness=lambda: Sent(AttitudeOutput(**parameters)),
    )


PROOFS = (
    _proof("frames_and_lines", 40),
    _proof("frames_2", 60, text=False, outputs=2),
    _proof("frames_16", 70, text=False, outputs=16, read_cycles=2),
)
