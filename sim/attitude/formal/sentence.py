"""Proof of the compass's sentences: `gateware.attitude.sensors.hmr3300_sentence`."""

from __future__ import annotations

from amaranth.hdl import Assert, Assume, Module, Mux, Signal, Value

from boresight.gateware.attitude.sensors.hmr3300_sentence import (
    DIGITS_MAX,
    SPACES_MAX,
    WHOLE_MAX,
    SentenceParser,
    Step,
)
from boresight.sim.formal.harness import before, reached, unknown
from boresight.sim.formal.inside import InductiveHarness
from boresight.sim.formal.prove import Proof

__all__ = ["PROOFS", "SentenceHarness"]

#: Parts of a number of the grammar.
_FRONT, _SIGNED, _WHOLE, _POINT, _TENTH, _RETURN = range(6)


class SentenceHarness(InductiveHarness[SentenceParser]):
    """SentenceParser: a sentence is good if and only if all its bytes are those of the grammar.

    Bytes, framing errors and pauses are any. Whether a number exceeds its limit is what the
    arithmetic says.
    """

    def surround(self, m: Module, dut: SentenceParser) -> None:
        """The grammar, byte by byte, a cycle after each."""
        inside = self.inside
        data, valid, error = (
            unknown(m, n, s) for n, s in ((8, "byte"), (1, "valid"), (1, "error"))
        )
        pause = unknown(m, 1, "pause")
        m.d.comb += [dut.data.eq(data), dut.valid.eq(valid), dut.error.eq(error)]
        m.d.comb += dut.pause.eq(pause)
        # A receiver gives a byte, or an error.
        m.d.comb += Assume(~(valid & error))
        received, byte = before(m, valid, "come"), before(m, data, "byte_before")
        had_error = before(m, error, "spoilt")
        exceeds_limit = inside.parts["arithmetic"].component.over

        def is_a(text: str) -> Value:
            return byte == ord(text)

        digit = (byte >= ord("0")) & (byte <= ord("9"))
        fits = Signal(name="fits")  # all bytes of the line, up to now
        part, number = Signal(range(6), name="part"), Signal(3, name="number_of")
        field, tenths, minus = (
            Signal(2, name="field_at"),
            Signal(name="is_tenths"),
            Signal(name="is_minus"),
        )
        byte_fits = Signal(name="byte_fits")
        ends = (is_a(",") & (field != 2)) | (is_a("\r") & (field == 2))
        may_point = (number <= WHOLE_MAX) & Mux(field == 0, ~minus, tenths)
        at_start = (part == _FRONT) & (field == 0) & (number == 0)
        m.d.comb += byte_fits.eq(0)
        with m.Switch(part):
            with m.Case(_FRONT):
                m.d.comb += byte_fits.eq(digit | is_a("-") | (is_a(" ") & (number != SPACES_MAX)))
            with m.Case(_SIGNED, _POINT):
                m.d.comb += byte_fits.eq(digit)
            with m.Case(_WHOLE):
                m.d.comb += byte_fits.eq(
                    (digit & (number != DIGITS_MAX))
                    | (is_a(".") & may_point)
                    | (ends & ~tenths & ~exceeds_limit)
                )
            with m.Case(_TENTH):
                m.d.comb += byte_fits.eq(ends & ~exceeds_limit)
        line = received & is_a("\n")
        complete = line & fits & (part == _RETURN)
        with m.If(line):
            m.d.sync += [fits.eq(1), part.eq(_FRONT), number.eq(0), field.eq(0)]
            m.d.sync += [tenths.eq(0), minus.eq(0)]
        with m.Elif(received & ~byte_fits):
            m.d.sync += fits.eq(0)
        with m.Elif(received & fits):
            with m.If(is_a(" ") | (digit & (part == _WHOLE))):
                m.d.sync += number.eq(number + 1)
            with m.Elif(is_a("-")):
                m.d.sync += [part.eq(_SIGNED), minus.eq(1)]
            with m.Elif(is_a(".")):
                m.d.sync += [part.eq(_POINT), tenths.eq(1)]
            with m.Elif(is_a(",")):
                m.d.sync += [part.eq(_FRONT), number.eq(0), field.eq(field + 1), minus.eq(0)]
            with m.Elif(is_a("\r")):
                m.d.sync += part.eq(_RETURN)
            with m.Elif(part == _POINT):
                m.d.sync += part.eq(_TENTH)
            with m.Elif(digit):
                m.d.sync += [part.eq(_WHOLE), number.eq(1)]
        with m.Elif(~received & (had_error | (pause & ~at_start))):
            m.d.sync += fits.eq(0)
        accepted = before(m, complete, "accepted")
        m.d.comb += [
            Assert(dut.line == before(m, accepted, "line_due")),
            Assert(~dut.line | (dut.is_counts == before(m, before(m, ~tenths, "c0"), "c1"))),
            reached(m, dut.line, "good_line"),
        ]
        step, values = (
            inside["step"],
            {
                _FRONT: Step.NUMBER,
                _SIGNED: Step.FIRST,
                _WHOLE: Step.MORE,
                _POINT: Step.TENTH,
                _TENTH: Step.AFTER,
                _RETURN: Step.LF,
            },
        )
        m.d.comb += [
            Assert(part <= _RETURN),
            Assert(field <= 2),
            *(Assert(~(fits & (part == p)) | (step == s)) for p, s in values.items()),
            Assert(~(fits & ((part == _FRONT) | (part == _WHOLE))) | (inside["count"] == number)),
            Assert(~(fits & (part == _WHOLE)) | (inside["negative"] == minus)),
            Assert(~(fits & (part == _SIGNED)) | (inside["negative"] & minus)),
            Assert(~(fits & (part == _FRONT)) | ~minus),
            Assert(fits | (step == Step.SKIP) | (step == Step.REPLY)),
            Assert(~fits | ((inside["field"] == field) & (inside["tenths"] == tenths))),
        ]


PROOFS = (
    Proof(
        name="sentence.grammar",
        short=False,
        harness=SentenceHarness,
        dut=SentenceParser,
        depth=3,
        induction=True,
        cover=17,
        reset=False,
    ),
)
