"""A decimal number, digit by digit, in serial arithmetic."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Cat, Const, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["BITS", "COUNT_MAX", "HEADING_MAX", "DecimalNumber"]

#: Largest heading, tenths of a degree.
HEADING_MAX = 3599
#: Largest magnitude of a magnetometer count.
COUNT_MAX = 32_767
#: Of a value.
BITS = 16


class DecimalNumber(wiring.Component):
    """One number, bit by bit, and the last three.

    10 x + digit = 2 x + 8 x + digit is added a bit a cycle, where the digit is what the delays of
    2 x and 8 x and the carry begin with. The limit is compared on the way.

    ``take`` makes it 10 times as large and adds ``digit``; ``store`` puts it, with its sign, after
    the numbers before and begins with 0. Either takes the 16 cycles that follow, and ``over`` one
    more.

    Parameters
    ----------
    angle_max : int, 0..9999
        Limit of numbers with tenths that are not the first.

    Members
    -------
    digit : In(4), take : In(1)
        A digit.
    store : In(1), negative : In(1)
        End of the number; ``negative`` must be stable.
    tenths, first : In(1)
        Selection of the limit.
    over : Out(1)
        The number exceeds its limit; valid for numbers of up to five digits.
    values : Out(48)
        The last three numbers.
    """

    def __init__(self, *, angle_max: int) -> None:
        self.angle_max = angle_max
        super().__init__(
            {
                "digit": In(4),
                "take": In(1),
                "store": In(1),
                "negative": In(1),
                "tenths": In(1),
                "first": In(1),
                "over": Out(1),
                "values": Out(48),
            }
        )

    def elaborate(self, platform: Any) -> Module:
        """A shift register of 16, delays of 1 and 3 bits, one full adder, one comparison."""
        m = Module()
        begin, run, storing = (Signal(name=n) for n in ("begin", "run", "storing"))
        timer = Signal(range(2 * BITS))  # the upper half are the bits
        index = timer[:-1]
        m.d.comb += [begin.eq(self.take | self.store), run.eq(timer[-1])]
        with m.If(begin):
            m.d.sync += [timer.eq(BITS), storing.eq(self.store)]
        with m.Else():
            m.d.sync += timer.eq(timer + run)

        number = Signal(BITS, reset_less=True)
        twice, fourfold, eightfold, carry, above, low, new = (
            Signal(name=n)
            for n in ("twice", "fourfold", "eightfold", "carry", "above", "low", "new")
        )
        m.d.comb += [low.eq(number[0]), new.eq(twice ^ eightfold ^ carry)]

        def bit_of(constant: int) -> Any:
            return Const(constant, BITS).bit_select(index, 1)

        bound = Mux(
            self.tenths,
            Mux(self.first, bit_of(HEADING_MAX), bit_of(self.angle_max)),
            bit_of(COUNT_MAX),
        )
        with m.If(begin):
            # The digit is 5 twice + 2 fourfold + eightfold + carry: twice counts at once and,
            # two bits later, as eightfold.
            def among(*digits: int) -> Any:
                return self.take & Const(sum(1 << d for d in digits), 16).bit_select(self.digit, 1)

            m.d.sync += [
                twice.eq(among(5, 6, 7, 8, 9)),
                fourfold.eq(among(2, 3, 4, 7, 8, 9)),
                eightfold.eq(among(1, 3, 4, 6, 8, 9)),
                carry.eq(among(4, 9)),
                above.eq(0),
            ]
        with m.Elif(run):
            m.d.sync += [
                number.eq(Cat(number[1:], new & ~storing)),
                Cat(twice, fourfold, eightfold).eq(Cat(low, twice, fourfold)),
                carry.eq(
                    Mux(
                        storing,
                        carry | low,
                        (twice & eightfold) | (twice & carry) | (eightfold & carry),
                    )
                ),
                above.eq(Mux(new == bound, above, new)),
            ]
        with m.If(run & storing):  # minus: the bits above the lowest one are inverted
            m.d.sync += self.values.eq(Cat(self.values[1:], low ^ (self.negative & carry)))
        # What has not come out of the delays and the carry counts 65,536 and more; the other two
        # delays hold bits 14 and 15 of four digits, which are 0.
        m.d.sync += self.over.eq(above | eightfold | carry)
        return m
