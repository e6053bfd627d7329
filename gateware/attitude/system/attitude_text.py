"""The line of text of an attitude: entries of its columns, and degrees by arithmetic."""

from __future__ import annotations

from enum import IntEnum
from typing import Any, NamedTuple

from amaranth.hdl import Cat, Const, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.attitude.system.attitude_frame import OUTPUTS

__all__ = ["LINE", "AngleDigits", "Op", "Place"]

_POWERS = (10_000, 1_000, 100, 10, 1)
_HUNDREDTHS = 36_000


class Op(IntEnum):
    """Kind of entry in a column of the line."""

    LITERAL = 0
    HEX = 1
    SIGN = 2
    DIGIT = 3


class Place(NamedTuple):
    """A column. ``code``: a character below 64; 8 times a word's code plus a nibble; a digit."""

    op: Op
    code: int


#: Code of the first output word; codes below are places in the result memory.
OUTPUT_CODE = 8


def _angle(name: str) -> list[Place]:
    word = OUTPUT_CODE + OUTPUTS.index(name)
    digits = [Place(Op.DIGIT, k) for k in range(len(_POWERS))]
    return [Place(Op.SIGN, 8 * word), *digits[:3], _literal("."), *digits[3:], _literal(" ")]


def _hexadecimal(word: int, high: int, low: int) -> list[Place]:
    return [Place(Op.HEX, 8 * word + nibble) for nibble in range(high, low - 1, -1)]


def _literal(character: str) -> Place:
    return Place(Op.LITERAL, ord(character))


#: The columns of a line, in order (`gateware.attitude.system.attitude_frame.text_line`).
LINE = (
    *_angle("heading"),
    *_angle("pitch"),
    *_angle("roll"),
    *_hexadecimal(0, 3, 0),
    _literal(" "),
    *_hexadecimal(0, 7, 4),
    _literal(" "),
    *_hexadecimal(OUTPUT_CODE + OUTPUTS.index("status"), 7, 5),
    _literal("\r"),
    _literal("\n"),
)


class AngleDigits(wiring.Component):
    """Degrees of an angle, two decimals, by additions: magnitude times 36000 / 2^W, rounded.

    Phase 1: a bit of the word per cycle, least significant first. Phase 2: powers of ten are taken
    away, one per cycle.

    **Latency** W cycles, then for each digit its value + 1 cycles.

    Members
    -------
    start : In(1)
        Begin a new angle.
    bit : In(1), negative : In(1), last : In(1), shift : In(1)
        With ``shift``: a bit of the word; the word's sign; whether the bit is the sign.
    power : In(3)
        Power of ten, from the cycle before ``subtract`` on: 0 is 10000, 4 is 1.
    subtract : In(1)
        Subtract it if possible.
    possible : Out(1)
        The subtraction is possible.
    """

    def __init__(self) -> None:
        super().__init__(
            {
                "start": In(1),
                "bit": In(1),
                "negative": In(1),
                "last": In(1),
                "shift": In(1),
                "power": In(3),
                "subtract": In(1),
                "possible": Out(1),
            }
        )

    def elaborate(self, platform: Any) -> Module:
        """One adder."""
        m = Module()
        rest = Signal(16)
        seen = Signal()  # a one has come: of a negative number the bits are inverted from then on
        taken = Signal(16)  # what is added to take the power away
        operand = Signal(16)
        carry = Signal()
        total = Signal(17)
        powers = Cat(~Const(power, 16) for power in _POWERS)
        m.d.sync += taken.eq(powers.word_select(self.power, 16))
        m.d.comb += [total.eq(rest + operand + carry), self.possible.eq(total[16])]
        with m.If(self.shift):
            m.d.comb += [
                operand.eq(Mux(self.bit ^ (self.negative & seen), _HUNDREDTHS, 0)),
                carry.eq(self.last),
            ]
        with m.Else():
            m.d.comb += [operand.eq(taken), carry.eq(1)]
        with m.If(self.start):
            m.d.sync += [rest.eq(0), seen.eq(0)]
        with m.Elif(self.shift):
            m.d.sync += [rest.eq(total >> 1), seen.eq(seen | self.bit)]
        with m.Elif(self.subtract & self.possible):
            m.d.sync += rest.eq(total)
        return m
