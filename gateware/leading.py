"""Leading-sign count of a word, in two steps."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Cat, Module, Mux, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from model.fixed import Arithmetic

__all__ = ["LeadingSignCount"]


class LeadingSignCount(wiring.Component):
    """Copies of the sign bit below the sign bit of a word, at most `Arithmetic.norm_max`.

    Bits are looked at in groups of four, highest first. Step one finds for every group whether it
    holds a bit unlike its upper neighbour and where the first such bit is; step two picks the
    first such group.

    **Latency** 2 cycles from ``capture`` to ``count``.

    Parameters
    ----------
    arithmetic : Arithmetic
        Widths.

    Members
    -------
    en : In(1)
        Clock enable.
    i : In(W)
        Word.
    capture : In(1)
        Take the word; the count stays until the next one is taken.
    count : Out(5)
        The count.
    """

    #: Bits of a group.
    GROUP = 4

    def __init__(self, *, arithmetic: Arithmetic) -> None:
        self.arithmetic = arithmetic
        super().__init__({
            "en": In(1),
            "i": In(arithmetic.word),
            "capture": In(1),
            "count": Out(range(arithmetic.shift_max + 1)),
        })

    def elaborate(self, platform: Any) -> Module:
        """Both steps."""
        m = Module()
        word, limit = self.arithmetic.word, self.arithmetic.norm_max
        differs = [self.i[word - 1 - k] ^ self.i[word - 2 - k] for k in range(limit)]

        groups: list[tuple[Value, int, Value]] = []
        for first in range(0, limit, self.GROUP):
            bits = differs[first:first + self.GROUP]
            hit = Signal(name=f"hit{first}", reset_less=True)
            where = Signal(2, name=f"where{first}", reset_less=True)
            position: Value | int = len(bits) - 1
            for k in reversed(range(len(bits) - 1)):
                position = Mux(bits[k], k, position)
            with m.If(self.en & self.capture):
                m.d.sync += [hit.eq(Cat(bits).any()), where.eq(position)]
            groups.append((hit, first, where))

        # When no bit differs the count is the limit.
        count: Value | int = limit
        for hit, first, where in reversed(groups):
            count = Mux(hit, first + where if first % self.GROUP else Cat(where, Value.cast(
                first // self.GROUP)), count)
        result = Signal.like(self.count, reset_less=True)
        with m.If(self.en):
            m.d.sync += result.eq(count)
        m.d.comb += self.count.eq(result)
        return m
