"""Proof of the datapath: `gateware.engine.lane` against the stages of `docs/engine.md`.

`LaneHarness` is the lane as the emulator steps it (`gateware.microcode.emulator`), in plain
arithmetic: what microcode is proven to compute with that step, this lane computes.
"""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Assert, Cat, Const, Module, Mux, Signal, Value, signed

from boresight.gateware.engine.lane import FIELDS, Lane
from boresight.gateware.engine.multiplier import Multiplier
from boresight.gateware.machine import Machine
from boresight.model.words.fixed import Arithmetic
from boresight.sim.formal.harness import Harness, drive, reached, unknown
from boresight.sim.formal.prove import Proof


class _Registers:
    """Registers of a harness: like those of the component they have an enable and no reset."""

    def __init__(self, m: Module, en: Signal) -> None:
        self.m = m
        self.en = en

    def after(self, value: Value, shape: Any, name: str, when: Any = 1, *, init: int = 0) -> Signal:
        """The value of the last enabled cycle in which ``when`` was true."""
        out = Signal(shape, name=name, init=init, reset_less=True)
        with self.m.If(self.en & when):
            self.m.d.sync += out.eq(value)
        return out


class LaneHarness(Harness[Lane]):
    """Lane: captures, masks, signs, shift, sum and clamp of `docs/engine.md`, stage by stage.

    Operands, fields and stalls are any. The product at shift is that of the multiplier
    (`FourSlicesHarness`).
    """

    def surround(self, m: Module, dut: Lane) -> None:
        """The stages in order; a number in a name is the stage that reads it, at depth 7."""
        arith, at = dut.machine.arithmetic, dut.machine.stages
        drive(m, dut, "en", "a", "b", *FIELDS, "outside", "which")
        for k in range(dut.sources):
            m.d.comb += dut.words[k].eq(unknown(m, arith.word, f"word{k}"))
        register = _Registers(m, dut.en)
        flag, norm3 = self._captures(m, register)

        # Read: the multiplier sees the masked words.
        multiplier = self.inside.parts["multiplier"].component
        mask = (1 << arith.fraction_bits) - 1
        m.d.comb += [
            Assert(multiplier.a == Mux(dut.frac_a, dut.a & mask, dut.a).as_signed()),
            Assert(multiplier.b == Mux(dut.frac_b, dut.b & mask, dut.b).as_signed()),
            Assert(multiplier.en == dut.en),
        ]
        # Condition: sign and participation.
        negate3 = register.after(dut.neg ^ (dut.neg_flag & flag), 1, "negate3")
        skip3 = register.after(~(dut.when ^ (dut.when_flag & flag)), 1, "skip3")
        waits = range(at.condition + 2, at.accumulate)
        negate4, skip4 = negate3, skip3
        for k in waits:
            negate4 = register.after(negate4, 1, f"negate{k}")
            skip4 = register.after(skip4, 1, f"skip{k}")
            m.d.comb += [
                Assert(self.inside[f"invert{k}"] == negate4),
                Assert(self.inside[f"skip{k}"] == skip4),
            ]
        # Amount: the shift, less the part of the count, not below 0.
        part = Mux(dut.scale == 1, norm3, Mux(dut.scale == 2, norm3 & ~1, norm3 >> 1))
        amount = Signal(signed(8))
        m.d.comb += amount.eq(dut.shift - Mux(dut.scale == 0, 0, part))
        first_amount = register.after(Mux(amount < 0, 0, amount), 5, "amount_first")
        amount4 = first_amount
        for k in range(at.amount + 2, at.shift + 1):
            amount4 = register.after(amount4, 5, f"amount_{k}")
            m.d.comb += Assert(self.inside[f"amount{k}"] == amount4)
        # Shift: the term; negated it is the ones' complement and a carry.
        shifted = Signal(signed(2 * arith.word))
        product = multiplier.p
        if at.accumulate - at.shift > 1:  # the first level, by 0, 8, 16 or 24, is a cycle before
            product = register.after(product >> (amount4 & 24), signed(2 * arith.word), "coarse")
            amount4 = register.after(amount4, 5, "amount_last") & 7
            shifter = self.inside.parts["shifter"]
            low = shifter["coarse_out"]
            m.d.comb += [
                Assert(low == product[: len(low)].as_signed()),
                Assert(shifter["amount_out"] == amount4[:3]),
            ]
        m.d.comb += shifted.eq(product >> amount4)
        term = Mux(skip4, 0, Mux(negate4, ~shifted, shifted))
        r5 = register.after(term, signed(arith.acc_width), "r5")
        carry5 = register.after(~skip4 & negate4, 1, "carry5")
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
        self._write(m, register, acc6)

    def _captures(self, m: Module, register: _Registers) -> tuple[Signal, Signal]:
        """Read: flag, index and count of the raw word; the count serves the stage amount."""
        dut, arith = self.dut, self.dut.machine.arithmetic
        captured = Signal(arith.word)
        m.d.comb += captured.eq(dut.a + (dut.quarter << (arith.word - 2)))
        flag = register.after(captured[-1], 1, "flag", dut.cap_flag)
        index = (captured >> arith.fraction_bits)[: arith.INDEX_BITS]
        held = register.after(index, arith.INDEX_BITS, "index", dut.cap_index)
        count = Signal(5)
        m.d.comb += count.eq(_leading_sign_count(dut.a, arith))
        groups = range(0, arith.norm_max + 1, 4)
        # Before the first capture the count is that of no group.
        norm2 = register.after(count, 5, "norm2", dut.cap_norm, init=groups[-1])
        norm3 = register.after(norm2, 5, "norm3")
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

    def _write(self, m: Module, register: _Registers, acc6: Signal) -> None:
        """Limit and write: modulo 2^W, or clamped; or a word from outside."""
        dut, arith = self.dut, self.dut.machine.arithmetic
        wrap: Signal = dut.wrap
        limited = dut.machine.has("limit")
        if limited:  # what the clamp depends on is there a cycle before the word
            acc6 = register.after(acc6, signed(arith.acc_width), "acc7")
            wrap = register.after(wrap, 1, "wrap7")
        q = Signal(signed(arith.acc_width - arith.guard))
        clamped = Signal(signed(arith.word))
        m.d.comb += [
            q.eq(acc6 >> arith.guard),
            clamped.eq(
                Mux(q > arith.max_int, arith.max_int, Mux(q < arith.min_int, arith.min_int, q))
            ),
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


class FourSlicesHarness(Harness[Multiplier]):
    """Multiplier: slices get the halves of the factors, the product is the sum of theirs.

    With a = ah 2^17 + al and b = bh 2^17 + bl, `p` is al bl + (ah bl + al bh) 2^17 + ah bh 2^34
    of the factors of `Multiplier.latency` enabled cycles before, where each product is that of its
    slice.
    """

    def surround(self, m: Module, dut: Multiplier) -> None:
        """Products in the cycle in which their slice has them, and one and two cycles later."""
        inside = self.inside
        drive(m, dut, "en", "a", "b")
        register = _Registers(m, dut.en)
        cut = Multiplier.CUT
        halves = {"l": lambda w: w[:cut], "h": lambda w: w[cut:].as_signed()}
        products = {}
        for name in ("ll", "hl", "lh", "hh"):
            part = inside.parts[name]
            m.d.comb += Assert(part.component.en == dut.en)
            late = name in ("lh", "hh")  # one cycle later, its factors waiting in the slice
            registers = [*["0"] * (dut.factors and late), *["1"] * (dut.factors or late)]
            for side, word in (("a", dut.a), ("b", dut.b)):
                value = halves[name["ab".index(side)]](word)
                if name == "hh" and dut.sums:
                    value = register.after(value, value.shape(), f"hh_{side}")
                    m.d.comb += Assert(inside[f"{side}_high"] == value)
                m.d.comb += Assert(getattr(part.component, side) == value)
                for k in registers:
                    value = register.after(value, signed(18), f"{name}_{side}{k}")
                    m.d.comb += Assert(part[f"{side}{k}"] == value)
            # al bl is below 2^34: never negative.
            products[name] = part.component.m.as_unsigned() if name == "ll" else part.component.m

        def later(values: dict[str, Value], number: int) -> dict[str, Value]:
            return {
                name: register.after(value, value.shape(), f"{name}{number}")
                for name, value in values.items()
            }

        hh = {"hh": products.pop("hh")}
        lh = {"lh": products.pop("lh")}
        second = later(products, 2) | lh
        last = later(second, 3)
        if dut.sums:  # slice hh comes a cycle later than lh
            third, last = last, later(last | hh, 4)
            m.d.comb += [
                Assert(
                    inside.parts["lh"]["p0"] == (third["ll"] >> cut) + third["hl"] + third["lh"]
                ),
                Assert(inside["low_next"] == third["ll"][:cut]),
            ]
        else:
            last |= later(hh, 3)
        total = Signal(signed(2 * dut.word))
        m.d.comb += [
            total.eq(last["ll"] + ((last["hl"] + last["lh"]) << cut) + (last["hh"] << (2 * cut))),
            # For induction: the sums on their way.
            Assert(inside.parts["hl"]["p0"] == (second["ll"] >> cut) + second["hl"]),
            Assert(inside["low"] == second["ll"][:cut]),
            Assert(dut.p == total),
            reached(m, dut.p < -1, "negative"),
        ]


class OneSliceHarness(Harness[Multiplier]):
    """Multiplier: the slice gets the upper 18 bits of the factors, tables add the other products.

    With a = ah 2^k + al and b = bh 2^k + bl, `p` is ah bh 4^k + ah bl 2^k + al b of the factors of
    `Multiplier.latency` enabled cycles before, where ah bh is that of the slice.
    """

    def surround(self, m: Module, dut: Multiplier) -> None:
        """Every register, cycle by cycle; a number in a name is the cycle that reads it."""
        inside = self.inside
        low = dut.word - 18
        drive(m, dut, "en", "a", "b")
        register, part = _Registers(m, dut.en), inside.parts["slice"]
        m.d.comb += Assert(part.component.en == dut.en)
        words: dict[str, Value] = {"a": dut.a, "b": dut.b}
        for side, word in words.items():
            value: Value = word[low:].as_signed()
            m.d.comb += Assert(getattr(part.component, side) == value)
            for k in ["0"] * dut.factors + ["1"]:
                value = register.after(value, signed(18), f"slice_{side}{k}")
                m.d.comb += Assert(part[f"{side}{k}"] == value)
            if dut.factors:
                words[side] = register.after(word, word.shape(), f"late_{side}")
                m.d.comb += Assert(inside[f"{side}_late"] == words[side])
        a, b = words.values()
        rest: Value = Const(0)
        for name, factor, bits in (("ah", a[low:].as_signed(), b[:low]), ("b", b, a[:low])):
            multiplicand = register.after(factor, factor.shape(), f"{name}_1")
            digits = register.after(bits, low, f"{name}_digits_1")
            for bit in range(low):
                m.d.comb += Assert(inside[f"{name}_row{bit}"] == Mux(digits[bit], multiplicand, 0))
            product = multiplicand * digits
            product = register.after(product, product.shape(), f"{name}_2")
            m.d.comb += Assert(inside[f"{name}_product"] == product)
            rest += product << (low if name == "ah" else 0)
        shape = signed(2 * dut.word)
        total: Value = register.after((part.component.m << (2 * low)) + rest, shape, "total_3")
        m.d.comb += Assert(Cat(inside["rest_low"], part["p0"])[: 2 * dut.word].as_signed() == total)
        if dut.sums:
            total = register.after(total, shape, "total_4")
        m.d.comb += [Assert(dut.p == total), reached(m, dut.p < -1, "negative")]


def machine(word: int, depth: int = 7) -> Machine:
    """A machine with words of ``word`` bits; its lane does not depend on the rest."""
    return Machine(name="lane", lanes=1, arithmetic=Arithmetic(word), depth=depth)


def _lane(word: int, depth: int, *, sources: int = 1, short: bool = False) -> Proof:
    return Proof(
        name=f"lane.stages_{word}_d{depth}",
        harness=LaneHarness,
        dut=lambda: Lane(machine=machine(word, depth), sources=sources),
        depth=2,
        induction=True,
        cover=depth + 3,
        short=short,
    )


def _product(word: int, depth: int, *, short: bool = False) -> Proof:
    lane = machine(word, depth)

    def dut() -> Multiplier:
        return Multiplier(word=word, factors=lane.has("factor"), sums=lane.has("sum"))

    return Proof(
        name=f"lane.product_{word}_d{depth}",
        harness=OneSliceHarness if word <= Multiplier.ONE_SLICE else FourSlicesHarness,
        dut=dut,
        depth=2,
        induction=True,
        cover=depth,
        short=short,
    )


PROOFS = (
    _lane(18, 7, short=True),
    _lane(32, 7, sources=2),
    _lane(18, 12),
    _lane(32, 12),
    _product(20, 7, short=True),
    _product(32, 7),
    _product(20, 12),
    _product(32, 12),
)
