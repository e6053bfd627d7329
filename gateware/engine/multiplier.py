"""Signed multiplier of DSP48A1 slices."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Cat, Module, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.engine.delay import delayed
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

    With ``factors`` every slice registers its factors (once more) in cycle 0, and all else is a
    cycle later. With ``sums`` slice lh registers its sum, and slice hh waits for it.

    **Latency** 3 cycles, and one for each of ``factors`` and ``sums``: factors at the ports in
    cycle 0 give the product at the port in cycle 3, 4 or 5.

    Parameters
    ----------
    word : int, 18..32
        Bits of a factor, W. One slice for 18, else four.
    factors : bool
        Whether factors are registered before any use.
    sums : bool
        Whether the last sum but one is registered.

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

    def __init__(self, *, word: int = 32, factors: bool = False, sums: bool = False) -> None:
        if not isinstance(word, int) or word not in WORDS:
            raise ValueError(
                f"word must be an integer from {WORDS[0]} to {WORDS[-1]}, not {word!r}"
            )
        self.word = word
        self.factors = factors
        self.sums = sums
        super().__init__(
            {"en": In(1), "a": In(signed(word)), "b": In(signed(word)), "p": Out(signed(2 * word))}
        )

    @property
    def latency(self) -> int:
        """Cycles from factors to product."""
        return 3 + self.factors + self.sums

    @property
    def slices(self) -> int:
        """DSP48A1 slices in use."""
        return 1 if self.word == 18 else 4

    def elaborate(self, platform: Any) -> Module:
        """The slices and the delays of the low bits."""
        m = Module()
        f = self.factors
        if self.slices == 1:
            m.submodules.slice = dsp = DSP48A1(
                a0reg=f, b0reg=f, a1reg=True, b1reg=True, mreg=True, preg=True
            )
            product = delayed(m, dsp.p, en=self.en, names=["product"] if self.sums else [])
            m.d.comb += [dsp.en.eq(self.en), dsp.a.eq(self.a), dsp.b.eq(self.b)]
            m.d.comb += self.p.eq(product)
            return m

        cut = self.CUT
        late: dict[str, Any] = {"a0reg": f, "b0reg": f, "a1reg": True, "b1reg": True, "mreg": True}
        m.submodules.ll = ll = DSP48A1(a1reg=f, b1reg=f, mreg=True, x=X.ZERO)
        m.submodules.hl = hl = DSP48A1(a1reg=f, b1reg=f, mreg=True, preg=True, z=Z.C)
        m.submodules.lh = lh = DSP48A1(**late, preg=self.sums, z=Z.PCIN)
        m.submodules.hh = hh = DSP48A1(**late, preg=True, z=Z.C)
        for dsp in (ll, hl, lh, hh):
            m.d.comb += dsp.en.eq(self.en)
        for dsp, a_high, b_high in ((ll, 0, 0), (hl, 1, 0), (lh, 0, 1), (hh, 1, 1)):
            a: Value = self.a[cut:].as_signed() if a_high else self.a[:cut]
            b: Value = self.b[cut:].as_signed() if b_high else self.b[:cut]
            if dsp is hh and self.sums:
                a = delayed(m, a, en=self.en, names=["a_high"])
                b = delayed(m, b, en=self.en, names=["b_high"])
            m.d.comb += [dsp.a.eq(a), dsp.b.eq(b)]
        m.d.comb += [hl.c.eq(ll.m[cut:]), lh.pcin.eq(hl.pcout), hh.c.eq(lh.p[cut:].as_signed())]
        # The bits that need no more addition wait in flip-flops (no reset, so that they stay
        # beside the slices; the pair of ``low`` is kept from becoming a shift register).
        low = Signal(cut, reset_less=True)
        low_next = Signal(cut, reset_less=True)
        middle = Signal(cut, reset_less=True)
        with m.If(self.en):
            m.d.sync += [low.eq(ll.m[:cut]), low_next.eq(low), middle.eq(lh.p[:cut])]
        low_last = delayed(m, low_next, en=self.en, names=["low_last"] if self.sums else [])
        m.d.comb += self.p.eq(Cat(low_last, middle, hh.p))
        return m
