"""Sentences of the HMR3300: bytes to three checked numbers."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import Any

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

#: Bits of a value.
BITS = 16
#: Largest heading, tenths of a degree, and magnitude of pitch and roll (what an inclination can be;
#: the compass itself says it measures to +-60 degrees, maker); largest magnitude of a count.
HEADING_MAX, ANGLE_MAX, COUNT_MAX = 3599, 900, 32_767
#: Maximum spaces before a number.
SPACES_MAX = 7
#: Digits in front of a point, digits of a count.
WHOLE_MAX, DIGITS_MAX = 3, 5


class Step(Enum):
    """State of the parser: the part that it expects."""

    NUMBER = 0  #: a number, or spaces in front of it; also the begin of a line
    FIRST = 1  #: the first digit after a sign
    MORE = 2  #: more digits, a point, or the end of the number
    TENTH = 3  #: the digit after the point
    AFTER = 4  #: the end of a number that has a point
    LF = 5  #: the end of a line that is good so far
    REPLY = 6  #: what follows a leading '#'
    SKIP = 7  #: the end of a line that is not good


#: Classes of bytes with one member.
_SIGNS = {"space": " ", "minus": "-", "point": ".", "comma": ",", "cr": "\r", "lf": "\n"}
_SIGNS |= {"sharp": "#", "refusal": "I"}


class _Line:
    """State of the parser within a line."""

    def __init__(self) -> None:
        self.step = Signal(Step, init=Step.SKIP)
        self.field = Signal(2)  # 0 to 2
        self.count = Signal(3)  # of spaces, then of digits
        self.tenths = Signal()  # its numbers have points
        self.negative = Signal()


class SentenceParser(wiring.Component):
    r"""Bytes to headings and magnetometer counts.

    A line ends with LF. It is good if all of it reads as one of these; all else is rejected, once
    for each line, at its first byte that does not fit::

        heading      _* D{1,3}.D , _* -?D{1,3}.D , _* -?D{1,3}.D CR LF
        counts       _* -?D{1,5} , _* -?D{1,5} , _* -?D{1,5} CR LF
        D 0 to 9, _* up to 7 spaces

    with a heading of at most 359.9, pitch and roll of at most +-90.0 degrees, counts of at
    most +-32,767. There is no plus sign. So no good line is longer than 43 bytes, and "-0.0"
    is 0. A line that begins with ``#I`` is the compass's answer to a command that it does not
    take; it counts as that and not as rejected, and the rest of it is skipped. A byte with a
    framing error spoils its line, and so does a pause in it: the rest may belong to the next one.

    **Latency** ``line`` comes `latency` cycles after LF. Bytes may come every `cycles_per_byte`
    cycles.
    """

    #: Fewest cycles from byte to byte.
    cycles_per_byte = BITS + 2
    #: Cycles from the LF of a good line to ``line``.
    latency = 3

    def __init__(self) -> None:
        super().__init__(
            {
                "data": In(8),
                "valid": In(1),
                "error": In(1),  # a byte had a framing error
                "pause": In(1),  # one that is longer than in any good line
                "line": Out(1),  # a good one; ``values`` and ``is_counts`` are new, and stay
                "is_counts": Out(1),  # else heading, pitch, roll
                "values": Out(signed(BITS)).array(3),  # counts, or tenths of a degree
                "rejected": Out(1),  # a line
                "invalid": Out(1),  # the compass has rejected a command
            }
        )

    def elaborate(self, platform: Any) -> Module:
        """Classes of bytes; a cycle later grammar and arithmetic."""
        m = Module()
        valid = Signal()
        error = Signal()
        m.d.sync += [valid.eq(self.valid), error.eq(self.error)]
        nibble, byte = self._byte(m)

        line = _Line()
        step, field, tenths = line.step, line.field, line.tenths
        values, over = self._arithmetic(m, valid, nibble, byte, line)
        good = Signal()
        kind = Signal()
        m.d.sync += [good.eq(0), self.line.eq(good), self.rejected.eq(0), self.invalid.eq(0)]
        with m.If(good):
            m.d.sync += self.is_counts.eq(kind)
            for k, value in enumerate(self.values):
                m.d.sync += value.eq(values.word_select(k, BITS))
        at_begin, following = self._following(m, byte, line, over)

        with m.If(valid):
            m.d.sync += [
                step.eq(following),
                self.rejected.eq((following == Step.SKIP) & (step != Step.SKIP)),
            ]
            self._advance(m, byte, line)
            with m.If((step == Step.REPLY) & byte["refusal"]):
                m.d.sync += [self.invalid.eq(1), self.rejected.eq(0)]
            with m.If(byte["lf"]):
                m.d.sync += [step.eq(Step.NUMBER), field.eq(0), tenths.eq(0)]
                with m.If(step == Step.LF):
                    m.d.sync += [good.eq(1), kind.eq(~tenths), self.rejected.eq(0)]
        with m.Elif(error | (self.pause & ~at_begin)):
            m.d.sync += [step.eq(Step.SKIP), self.rejected.eq(step != Step.SKIP)]
        return m

    def _byte(self, m: Module) -> tuple[Signal, Mapping[str, Signal]]:
        """The byte's low half and its class."""
        nibble = Signal(4)
        m.d.sync += nibble.eq(self.data[:4])

        def is_a(name: str, condition: Any) -> Signal:
            flag = Signal(name=name)
            m.d.sync += flag.eq(condition)
            return flag

        byte = {"digit": is_a("digit", (self.data[4:] == 3) & (self.data[:4] < 10))}
        byte |= {name: is_a(name, self.data == ord(sign)) for name, sign in _SIGNS.items()}
        return nibble, byte

    def _arithmetic(
        self, m: Module, valid: Signal, nibble: Signal, byte: Mapping[str, Signal], line: _Line
    ) -> tuple[Signal, Signal]:
        """The last three values, and whether the number is too large; `BITS` + 1 cycles later.

        A digit makes the number 10 x + digit, lowest bit first: each bit of x adds 10 to a carry,
        which begins with the digit and is at most 9. The end of a number moves it, with its sign,
        to the values.
        """
        number = Signal(BITS, reset_less=True)
        values = Signal(3 * BITS)
        timer = Signal(range(2 * BITS))  # the upper half are the bits
        storing, above, odd, over = (
            Signal(name=name) for name in ("storing", "above", "odd", "over")
        )
        carry = Signal(4)
        total = Signal(5)
        low = number[0]
        m.d.comb += total.eq(Mux(low & ~storing, 10, 0) + carry)

        def bit_of(constant: int) -> Value:
            return Const(constant, BITS).bit_select(timer[:-1], 1)

        angle = Mux(line.field == 0, bit_of(HEADING_MAX), bit_of(ANGLE_MAX))
        bound = Mux(line.tenths, angle, bit_of(COUNT_MAX))
        m.d.sync += over.eq(above | carry.any())  # a carry that is left counts 2**16 and more
        with m.If(valid & (byte["digit"] | byte["comma"] | byte["cr"] | byte["lf"])):
            m.d.sync += [
                timer.eq(BITS),
                storing.eq(~byte["digit"]),
                carry.eq(Mux(byte["digit"], nibble, 0)),
                above.eq(0),
                odd.eq(0),
            ]
        with m.Elif(timer[-1]):
            m.d.sync += [
                timer.eq(timer + 1),
                carry.eq(total[1:]),
                above.eq(Mux(total[0] == bound, above, total[0])),
                odd.eq(odd | low),
            ]
        with m.If(timer[-1]):
            m.d.sync += number.eq(Cat(number[1:], total[0]))
            with m.If(storing):  # minus: the bits above the lowest one that is set are inverted
                m.d.sync += values.eq(Cat(values[1:], low ^ (line.negative & odd)))
        return values, over

    def _following(
        self, m: Module, byte: Mapping[str, Signal], line: _Line, over: Value
    ) -> tuple[Signal, Signal]:
        """Whether a line has not begun yet, and the parser's next state."""
        step, count, field = line.step, line.count, line.field
        at_begin = Signal()
        following = Signal(Step)
        m.d.comb += at_begin.eq((step == Step.NUMBER) & (field == 0) & (count == 0))
        m.d.comb += following.eq(Step.SKIP)

        def end_of_number() -> None:
            with m.If(byte["comma"] & ~field[1] & ~over):
                m.d.comb += following.eq(Step.NUMBER)
            with m.If(byte["cr"] & field[1] & ~over):
                m.d.comb += following.eq(Step.LF)

        with m.Switch(step):
            with m.Case(Step.NUMBER):
                with m.If(byte["space"] & (count != SPACES_MAX)):
                    m.d.comb += following.eq(Step.NUMBER)
                with m.If(byte["minus"]):
                    m.d.comb += following.eq(Step.FIRST)
                with m.If(byte["digit"]):
                    m.d.comb += following.eq(Step.MORE)
                with m.If(byte["sharp"] & at_begin):
                    m.d.comb += following.eq(Step.REPLY)
            with m.Case(Step.FIRST), m.If(byte["digit"]):
                m.d.comb += following.eq(Step.MORE)
            with m.Case(Step.MORE):
                with m.If(byte["digit"] & (count != DIGITS_MAX)):
                    m.d.comb += following.eq(Step.MORE)
                signed_as_it_may = Mux(field == 0, ~line.negative, line.tenths)
                with m.If(byte["point"] & (count <= WHOLE_MAX) & signed_as_it_may):
                    m.d.comb += following.eq(Step.TENTH)
                with m.If(~line.tenths):
                    end_of_number()
            with m.Case(Step.TENTH), m.If(byte["digit"]):
                m.d.comb += following.eq(Step.AFTER)
            with m.Case(Step.AFTER):
                end_of_number()
            with m.Case(Step.LF, Step.REPLY, Step.SKIP):
                pass
        return at_begin, following

    def _advance(self, m: Module, byte: Mapping[str, Signal], line: _Line) -> None:
        """Update the state of the line."""
        with m.If(line.step == Step.NUMBER):
            m.d.sync += line.negative.eq(byte["minus"])
        with m.If((line.step == Step.MORE) & byte["point"]):
            m.d.sync += line.tenths.eq(1)
        # Spaces or digits: as many as before and one; the first digit is 1.
        ends = byte["comma"] | byte["cr"] | byte["lf"]
        first = byte["digit"] & (line.step == Step.NUMBER)
        with m.If(ends | (line.step == Step.FIRST) | first):
            m.d.sync += line.count.eq(byte["digit"])
        with m.Else():
            m.d.sync += line.count.eq(line.count + 1)
        with m.If(byte["comma"]):
            m.d.sync += line.field.eq(Cat(line.field == 0, line.field[0]))
