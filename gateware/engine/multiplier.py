"""Signed multiplier of DSP48A1 slices."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Cat, Module, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.engine.dsp48a1 import DSP48A1, X, Z
from boresight.model.words.fixed import WORDS

__all__ = ["Multiplier"]


class Multiplier(wiring.Component):
    """Signed word times word, exact, one product per cycle.

    A word above 18 bits is cut into an unsigned low part of `CUT` = 17 bits and a signed high
    part; the four partial products are summed along the slices' post-adders::

        a = ah 2^17 + al, b = bh 2^17 + bl
        a b = al bl + (ah bl + al bh) 2^17 + ah bh 2^34

        cycle     slice ll          slice hl                slice lh           slice hh
        0         M = al bl         M = ah bl               A, B               A, B
        1                           P = C(ll.M >> 17) + M   M = al bh          M = ah bh
        2                                                   P = PCIN + M   ->  P = C(lh.P >> 17) + M
        3         product = hh.P : lh.P[16:0] : ll.M[16:0]

    **Latency** 3 cycles: factors at the ports in cycle 0 give the product at the port in cycle 3.

    Parameters
    ----------
    word : int, 18..32
        Bits of a factor, W. One slice for 18, else four.

    Members
    -------
    en : In(1)
        Clock enable of every register.
    a, b : In(signed(W))
        Factors.
    p : Out(signed(2 * W))
        Product.
    """

    #: Bits of the unsigned low part: a slice multiplies 18 x 18 signed.
    CUT = 17

    def __init__(self, *, word: int = 32) -> None:
        if not isinstance(word, int) or word not in WORDS:
            raise ValueError(
                f"word must be an integer from {WORDS[0]} to {WORDS[-1]}, not {word!r}"
            )
        self.word = word
        super().__init__(
            {"en": In(1), "a": In(signed(word)), "b": In(signed(word)), "p": Out(signed(2 * word))}
        )

    @property
    def latency(self) -> int:
        """Cycles from factors to product."""
        return 3

    @property
    def slices(self) -> int:
        """DSP48A1 slices in use."""
        return 1 if self.word == 18 else 4

    def elaborate(self, platform: Any) -> Module:
        """The slices and the delays of the low bits."""
        m = Module()
        if self.slices == 1:
            m.submodules.slice = dsp = DSP48A1(a1reg=True, b1reg=True, mreg=True, preg=True)
            m.d.comb += [dsp.en.eq(self.en), dsp.a.eq(self.a), dsp.b.eq(self.b), self.p.eq(dsp.p)]
            return m

        cut = self.CUT
        m.submodules.ll = ll = DSP48A1(mreg=True, x=X.ZERO)
        m.submodules.hl = hl = DSP48A1(mreg=True, preg=True, z=Z.C)
        m.submodules.lh = lh = DSP48A1(a1reg=True, b1reg=True, mreg=True, z=Z.PCIN)
        m.submodules.hh = hh = DSP48A1(a1reg=True, b1reg=True, mreg=True, preg=True, z=Z.C)
        for dsp in (ll, hl, lh, hh):
            m.d.comb += dsp.en.eq(self.en)
        for dsp, a_high, b_high in ((ll, 0, 0), (hl, 1, 0), (lh, 0, 1), (hh, 1, 1)):
            m.d.comb += [
                dsp.a.eq(self.a[cut:].as_signed() if a_high else self.a[:cut]),
                dsp.b.eq(self.b[cut:].as_signed() if b_high else self.b[:cut]),
            ]
        m.d.comb += [hl.c.eq(ll.m[cut:]), lh.pcin.eq(hl.pcout), hh.c.eq(lh.p[cut:].as_signed())]
        # The bits that need no more addition wait in flip-flops (no reset, so that they stay
        # beside the slices; the pair of ``low`` is kept from becoming a shift register).
        low = Signal(cut, reset_less=True)
        low_next = Signal(cut, reset_less=True)
        middle = Signal(cut, reset_less=True)
        with m.If(self.en):
            m.d.sync += [low.eq(ll.m[:cut]), low_next.eq(low), middle.eq(lh.p[:cut])]
        m.d.comb += self.p.eq(Cat(low_next, middle, hh.p))
        return m
