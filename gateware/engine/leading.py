"""Leading-sign count of a word, in two steps."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Cat, Const, Module, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.engine.bitwise import next_value
from boresight.model.words.fixed import Arithmetic


class LeadingSignCount(wiring.Component):
    """Copies of the sign bit below the sign bit of a word, at most `Arithmetic.norm_max`.

    Bits are looked at in groups of four, highest first. Step one finds for every group whether it
    holds a bit unlike its upper neighbour and where the first such bit is; step two picks the
    first such group.

    **Latency** 2 cycles from ``capture`` to ``count``.

    Parameters
    ----------
    free : bool
        Whether the clock enable is free of ``capture``, which then chooses in front of registers.
    """

    #: Bits of a group.
    GROUP = 4

    def __init__(self, *, arithmetic: Arithmetic, free: bool = False) -> None:
        self.arithmetic = arithmetic
        self.free = free
        super().__init__(
            {
                "en": In(1),  # Clock enable.
                "i": In(arithmetic.word),  # Word.
                "capture": In(1),  # Take the word; the count stays until the next one is taken.
                "count": Out(range(arithmetic.shift_max + 1)),  # The count.
            }
        )

    def elaborate(self, platform: Any) -> Module:
        """Both steps."""
        m = Module()
        word, limit = self.arithmetic.word, self.arithmetic.norm_max
        differs = [self.i[word - 1 - k] ^ self.i[word - 2 - k] for k in range(limit)]
        take = self.en if self.free else self.en & self.capture
        # The last group needs no hit: if no bit differs, its position is that of the limit.
        firsts = range(0, limit + 1, self.GROUP)
        hits, places = [], []
        for first in firsts:
            bits = differs[first : first + self.GROUP]
            hit = Signal(name=f"hit{first}", reset_less=True)
            place = Signal(2, name=f"place{first}", reset_less=True)
            with m.If(take):
                for register, value in ((hit, Cat(bits).any()), (place, self._position(bits))):
                    new = next_value(register, value, when=self.capture) if self.free else value
                    m.d.sync += register.eq(new)
            hits.append(hit)
            places.append(place)

        # One-hot choice of the first group that is hit, written as AND-OR.
        choice = [hit & ~Cat(hits[:k]).any() for k, hit in enumerate(hits[:-1])]
        choice.append(~Cat(hits[:-1]).any())
        count: Value = Const(0, len(self.count))
        for group, (chosen, place) in enumerate(zip(choice, places, strict=True)):
            count = count | (
                Cat(place, Const(group, len(self.count) - 2)) & chosen.replicate(len(self.count))
            )
        result = Signal.like(self.count, reset_less=True)
        with m.If(self.en):
            m.d.sync += result.eq(count)
        m.d.comb += self.count.eq(result)
        return m

    @staticmethod
    def _position(bits: list[Value]) -> Value:
        """Position 0..3 of the first set bit; the number of bits if none is set."""
        below = [~bit for bit in bits] + [Const(1)] * 3
        second = below[0] & (bits[1] if len(bits) > 1 else Const(len(bits) == 1))
        two_or_three = below[0] & below[1] & Const(len(bits) > 1)
        three = two_or_three & below[2] & Const(len(bits) > 2)
        return Cat(second | three, two_or_three)
