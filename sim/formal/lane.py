"""Proof of the datapath: `gateware.engine.lane` against the stages of `docs/engine.md`.

`LaneHarness` is the lane as the emulator steps it (`gateware.microcode.validation`), in plain
arithmetic: what microcode is proven to compute with that step, this lane computes.
"""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Assert, Const, Module, Mux, Signal, Value, signed

from boresight.gateware.engine.lane import FIELDS, Lane
from boresight.gateware.machine import Machine
from boresight.model.words.fixed import Arithmetic
from boresight.sim.formal.harness import Harness, Proof, drive, reached, unknown


class LaneHarness(Harness):
    """Lane: captures, masks, signs, shift, sum and clamp of `docs/engine.md`, stage by stage.

    Operands, fields and stalls are any. The product at shift is that of the multiplier.
    """

    def surround(self, m: Module, dut: Lane) -> None:
        """The stages in order; a number in a name is the stage that reads it, at depth 7."""
        arith, at = dut.machine.arithmetic, dut.machine.stages
        drive(m, dut, "en", "a", "b", *FIELDS, "outside", "which")
        for k in range(dut.sources):
            m.d.comb += dut.words[k].eq(unknown(m, arith.word, f"word{k}"))
        self.m, after = m, self.after
        flag, norm3 = self._captures(m)

        # Read: the multiplier sees the masked words.
        multiplier = self.inside.parts["multiplier"].component
        mask = (1 << arith.fraction_bits) - 1
        m.d.comb += [
            Assert(multiplier.a == Mux(dut.frac_a, dut.a & mask, dut.a).as_signed()),
            Assert(multiplier.b == Mux(dut.frac_b, dut.b & mask, dut.b).as_signed()),
            Assert(multiplier.en == dut.en),
        ]
        # Condition: sign and participation.
        negate3 = after(dut.neg ^ (dut.neg_flag & flag), 1, "negate3")
        skip3 = after(~(dut.when ^ (dut.when_flag & flag)), 1, "skip3")
        waits = range(at.condition + 2, at.accumulate)
        negate4, skip4 = negate3, skip3
        for k in waits:
            negate4, skip4 = after(negate4, 1, f"negate{k}"), after(skip4, 1, f"skip{k}")
            m.d.comb += [
                Assert(self.inside[f"invert{k}"] == negate4),
                Assert(self.inside[f"skip{k}"] == skip4),
            ]
        # Amount: the shift, less the part of the count, not below 0.
        part = Mux(dut.scale == 1, norm3, Mux(dut.scale == 2, norm3 & ~1, norm3 >> 1))
        amount = Signal(signed(8))
        m.d.comb += amount.eq(dut.shift - Mux(dut.scale == 0, 0, part))
        first_amount = after(Mux(amount < 0, 0, amount), 5, "amount_first")
        amount4 = first_amount
        for k in range(at.amount + 2, at.shift + 1):
            amount4 = after(amount4, 5, f"amount_{k}")
            m.d.comb += Assert(self.inside[f"amount{k}"] == amount4)
        # Shift: the term; negated it is the ones' complement and a carry.
        shifted = Signal(signed(2 * arith.word))
        product = multiplier.p
        if at.accumulate - at.shift > 1:  # the first level, by 0, 8, 16 or 24, is a cycle before
            product = after(product >> (amount4 & 24), signed(2 * arith.word), "coarse")
            amount4 = after(amount4, 5, "amount_last") & 7
            shifter = self.inside.parts["shifter"]
            low = shifter["coarse_out"]
            m.d.comb += [
                Assert(low == product[: len(low)].as_signed()),
                Assert(shifter["amount_out"] == amount4[:3]),
            ]
        m.d.comb += shifted.eq(product >> amount4)
        term = Mux(skip4, 0, Mux(negate4, ~shifted, shifted))
        r5 = after(term, signed(arith.acc_width), "r5")
        carry5 = after(~skip4 & negate4, 1, "carry5")
        # Accumulate: the sum, modulo 2^acc_width.
        acc6 = Signal(signed(arith.acc_width), name="acc6", reset_less=True)
        with m.If(dut.en):
            m.d.sync += acc6.eq(Mux(dut.first, 1 << (arith.guard - 1), acc6) + r5 + carry5)
        m.d.comb += [
            Assert(self.inside[f"invert{at.condition + 1}"] == negate3),
            Assert(self.inside[f"skip{at.condition + 1}"] == skip3),
            Assert(self.inside["amount"] == first_amount),
            Assert(self.inside["term"] == r5),
            Assert(self.inside["carry"] == carry5),
            Assert(self.inside["acc"] == acc6),
            reached(m, first_amount == 9, "shifted"),
        ]
        self._write(m, acc6)

    def after(self, value: Value, shape: Any, name: str, when: Any = 1, *, init: int = 0) -> Signal:
        """The value of the last enabled cycle in which ``when`` was true."""
        out = Signal(shape, name=name, init=init, reset_less=True)
        with self.m.If(self.dut.en & when):
            self.m.d.sync += out.eq(value)
        return out

    def _captures(self, m: Module) -> tuple[Signal, Signal]:
        """Read: flag, index and count of the raw word; the count serves the stage amount."""
        dut, arith, after = self.dut, self.dut.machine.arithmetic, self.after
        captured = Signal(arith.word)
        m.d.comb += captured.eq(dut.a + (dut.quarter << (arith.word - 2)))
        flag = after(captured[-1], 1, "flag", dut.cap_flag)
        index = (captured >> arith.fraction_bits)[: arith.INDEX_BITS]
        held = after(index, arith.INDEX_BITS, "index", dut.cap_index)
        count = Signal(5)
        m.d.comb += count.eq(_leading_sign_count(dut.a, arith))
        groups = range(0, arith.norm_max + 1, 4)
        # Before the first capture the count is that of no group.
        norm2 = after(count, 5, "norm2", dut.cap_norm, init=groups[-1])
        norm3 = after(norm2, 5, "norm3")
        leading = self.inside.parts["leading"]
        place = Value.cast(0)
        for k in reversed(groups):
            position = Const(k, 5) + leading[f"place{k}"]
            place = position if k == groups[-1] else Mux(leading[f"hit{k}"], position, place)
        m.d.comb += [
            Assert(dut.index == Mux(dut.cap_index, index, held)),
            Assert(self.inside["held"] == held),
            Assert(self.inside["flag"] == flag),
            Assert(place == norm2),
            Assert(leading.component.count == norm3),
            reached(m, norm3 == arith.norm_max, "counted"),
        ]
        return flag, norm3

    def _write(self, m: Module, acc6: Signal) -> None:
        """Limit and write: modulo 2^W, or clamped; or a word from outside."""
        dut, arith, after = self.dut, self.dut.machine.arithmetic, self.after
        wrap: Signal = dut.wrap
        limited = dut.machine.has("limit")
        if limited:  # what the clamp depends on is there a cycle before the word
            acc6 = after(acc6, signed(arith.acc_width), "acc7")
            wrap = after(wrap, 1, "wrap7")
        q = Signal(signed(arith.acc_width - arith.guard))
        clamped = Signal(signed(arith.word))
        above, below = q > arith.max_int, q < arith.min_int
        m.d.comb += [
            q.eq(acc6 >> arith.guard),
            clamped.eq(Mux(above, arith.max_int, Mux(below, arith.min_int, q))),
        ]
        result = Mux(wrap, q[: arith.word], clamped)
        outside = dut.words[0] if dut.sources == 1 else Mux(dut.which, dut.words[1], dut.words[0])
        # With one source the field that selects another is not used.
        is_defined = ~(dut.outside & dut.which) if dut.sources == 1 else Const(1)
        m.d.comb += [
            Assert(~is_defined | (dut.result == Mux(dut.outside, outside, result)[: arith.word])),
            Assert(dut.saturated == (dut.sticky & ~wrap & ~dut.outside & (clamped != q))),
            Assert(dut.beyond == (dut.sticky & wrap & ~dut.outside & (clamped != q))),
            reached(m, dut.saturated & (q < 0), "clamped_below"),
            reached(m, dut.saturated & (q > 0), "clamped_above"),
        ]
        if limited:
            m.d.comb += [
                Assert(self.inside["clamp7"] == (~wrap & (clamped != q))),
                Assert(self.inside["beyond7"] == (wrap & (clamped != q))),
                Assert(self.inside["negative7"] == (q < 0)),
                Assert(self.inside["q7"] == q[: arith.word]),
            ]


def _leading_sign_count(word: Value, arith: Arithmetic) -> Value:
    """Copies of the sign bit below the sign bit, at most `Arithmetic.norm_max`."""
    count: Value = Const(arith.norm_max, 5)
    for n in reversed(range(arith.norm_max)):
        count = Mux(word[arith.word - 2 - n] != word[-1], n, count)
    return count


def machine(word: int, depth: int = 7) -> Machine:
    """A machine with words of ``word`` bits; its lane does not depend on the rest."""
    return Machine(name="lane", lanes=1, arithmetic=Arithmetic(word), depth=depth)


def _proof(word: int, depth: int, *, sources: int = 1) -> Proof:
    return Proof(
        name=f"lane.{word}_d{depth}",
        harness=LaneHarness,
        dut=lambda: Lane(machine=machine(word, depth), sources=sources),
        depth=2,
        induction=True,
        cover=depth + 3,
    )


PROOFS = (_proof(18, 7), _proof(32, 7, sources=2), _proof(18, 12), _proof(32, 12))
