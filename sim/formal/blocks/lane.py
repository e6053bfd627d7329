"""Proof of the datapath: `gateware.engine.lane` against the stages of `docs/engine.md`.

`InStages` is the lane as the emulator steps it (`gateware.microcode.emulator`), in plain
arithmetic: what microcode is proven to compute with that step, this lane computes.
"""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Assert, Const, Elaboratable, Module, Mux, Signal, Value, signed

from boresight.gateware.engine.lane import FIELDS, Lane
from boresight.gateware.engine.multiplier import Multiplier
from boresight.gateware.machine import Machine
from boresight.model.words.fixed import Arithmetic
from boresight.sim.formal.harness import reached, unknown
from boresight.sim.formal.inside import Inside
from boresight.sim.formal.prove import Proof

__all__ = ["PROOFS", "InStages", "OfPartialProducts", "machine"]


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


class InStages(Elaboratable):
    """Every register and output of a lane, stage by stage, for any operands, fields and stalls.

    The product in stage 4 is that of the multiplier in the lane (`OfPartialProducts`).

    Parameters
    ----------
    dut : Lane
        Component.
    """

    def __init__(self, dut: Lane) -> None:
        self.dut = dut
        self.arith = dut.machine.arithmetic

    def elaborate(self, platform: Any) -> Module:
        """The stages in order; a number at the end of a name is the stage that reads it."""
        m, dut, arith = Module(), self.dut, self.arith
        m.submodules.dut = (inside := Inside(dut, platform)).module
        for name in ("en", "a", "b", *FIELDS, "outside", "which"):
            port = getattr(dut, name)
            m.d.comb += port.eq(unknown(m, len(port), name))
        for k in range(dut.sources):
            m.d.comb += dut.words[k].eq(unknown(m, arith.word, f"word{k}"))
        register = _Registers(m, dut.en)
        flag, norm3 = self._captures(m, inside, register)

        # Stage 1: the multiplier sees the masked words.
        multiplier = inside.parts["multiplier"].component
        mask = (1 << arith.fraction_bits) - 1
        m.d.comb += [
            Assert(multiplier.a == Mux(dut.frac_a, dut.a & mask, dut.a).as_signed()),
            Assert(multiplier.b == Mux(dut.frac_b, dut.b & mask, dut.b).as_signed()),
            Assert(multiplier.en == dut.en),
        ]
        # Stage 2: sign and participation.
        negate3 = register.after(dut.neg ^ (dut.neg_flag & flag), 1, "negate3")
        skip3 = register.after(~(dut.when ^ (dut.when_flag & flag)), 1, "skip3")
        negate4 = register.after(negate3, 1, "negate4")
        skip4 = register.after(skip3, 1, "skip4")
        # Stage 3: the shift, less the part of the count, not below 0.
        part = Mux(dut.scale == 1, norm3, Mux(dut.scale == 2, norm3 & ~1, norm3 >> 1))
        less = Signal(signed(8))
        m.d.comb += less.eq(dut.shift - Mux(dut.scale == 0, 0, part))
        amount4 = register.after(Mux(less < 0, 0, less), 5, "amount4")
        # Stage 4: the term; negated it is the ones' complement and a carry.
        shifted = Signal(signed(2 * arith.word))
        m.d.comb += shifted.eq(multiplier.p >> amount4)
        term = Mux(skip4, 0, Mux(negate4, ~shifted, shifted))
        r5 = register.after(term, signed(arith.acc_width), "r5")
        carry5 = register.after(~skip4 & negate4, 1, "carry5")
        # Stage 5: the sum, modulo 2^acc_width.
        acc6 = Signal(signed(arith.acc_width), name="acc6", reset_less=True)
        with m.If(dut.en):
            m.d.sync += acc6.eq(Mux(dut.first, 1 << (arith.guard - 1), acc6) + r5 + carry5)
        m.d.comb += [
            Assert(inside["invert3"] == negate3),
            Assert(inside["skip3"] == skip3),
            Assert(inside["invert4"] == negate4),
            Assert(inside["skip4"] == skip4),
            Assert(inside["amount"] == amount4),
            Assert(inside["term"] == r5),
            Assert(inside["carry"] == carry5),
            Assert(inside["acc"] == acc6),
            reached(m, amount4 == 9, "shifted"),
        ]
        self._write(m, acc6)
        return m

    def _captures(self, m: Module, inside: Inside, register: _Registers) -> tuple[Signal, Signal]:
        """Stage 1: flag, index and count of the raw word; the count serves stage 3."""
        dut, arith = self.dut, self.arith
        seen = Signal(arith.word)
        m.d.comb += seen.eq(dut.a + (dut.quarter << (arith.word - 2)))
        flag = register.after(seen[-1], 1, "flag", dut.cap_flag)
        index = (seen >> arith.fraction_bits)[: arith.INDEX_BITS]
        held = register.after(index, arith.INDEX_BITS, "index", dut.cap_index)
        count = Signal(5)
        m.d.comb += count.eq(_leading_sign_count(dut.a, arith))
        groups = range(0, arith.norm_max + 1, 4)
        # Before the first capture the count is that of no group.
        norm2 = register.after(count, 5, "norm2", dut.cap_norm, init=groups[-1])
        norm3 = register.after(norm2, 5, "norm3")
        leading = inside.parts["leading"]
        place = Value.cast(0)
        for k in reversed(groups):
            here = Const(k, 5) + leading[f"place{k}"]
            place = here if k == groups[-1] else Mux(leading[f"hit{k}"], here, place)
        m.d.comb += [
            Assert(dut.index == Mux(dut.cap_index, index, held)),
            Assert(inside["held"] == held),
            Assert(inside["flag"] == flag),
            Assert(place == norm2),
            Assert(leading.component.count == norm3),
            reached(m, norm3 == arith.norm_max, "counted"),
        ]
        return flag, norm3

    def _write(self, m: Module, acc6: Signal) -> None:
        """Stage 6: modulo 2^W, or clamped; or a word from outside."""
        dut, arith = self.dut, self.arith
        q = Signal(signed(arith.acc_width - arith.guard))
        clamped = Signal(signed(arith.word))
        m.d.comb += [
            q.eq(acc6 >> arith.guard),
            clamped.eq(
                Mux(q > arith.max_int, arith.max_int, Mux(q < arith.min_int, arith.min_int, q))
            ),
        ]
        result = Mux(dut.wrap, q[: arith.word], clamped)
        outside = dut.words[0] if dut.sources == 1 else Mux(dut.which, dut.words[1], dut.words[0])
        # With one source the field that selects another is not used.
        used = ~(dut.outside & dut.which) if dut.sources == 1 else Const(1)
        m.d.comb += [
            Assert(~used | (dut.result == Mux(dut.outside, outside, result)[: arith.word])),
            Assert(dut.saturated == (dut.sticky & ~dut.wrap & ~dut.outside & (clamped != q))),
            reached(m, dut.saturated & (q < 0), "clamped_below"),
            reached(m, dut.saturated & (q > 0), "clamped_above"),
        ]


def _leading_sign_count(word: Value, arith: Arithmetic) -> Value:
    """Copies of the sign bit below the sign bit, at most `Arithmetic.norm_max`."""
    count: Value = Const(arith.norm_max, 5)
    for n in reversed(range(arith.norm_max)):
        count = Mux(word[arith.word - 2 - n] != word[-1], n, count)
    return count


class OfPartialProducts(Elaboratable):
    """The multiplier's slices get the halves of the factors, and their products are summed.

    With a = ah 2^17 + al and b = bh 2^17 + bl, `p` is al bl + (ah bl + al bh) 2^17 + ah bh 2^34
    of the factors of three enabled cycles before, where each product is that of its slice.

    Parameters
    ----------
    dut : Multiplier
        Component, of four slices.
    """

    def __init__(self, dut: Multiplier) -> None:
        self.dut = dut

    def elaborate(self, platform: Any) -> Module:
        """Products in the cycle in which their slice has them, and one and two cycles later."""
        m, dut = Module(), self.dut
        m.submodules.dut = (inside := Inside(dut, platform)).module
        for name in ("en", "a", "b"):
            port = getattr(dut, name)
            m.d.comb += port.eq(unknown(m, port.shape(), name))
        register = _Registers(m, dut.en)
        cut = Multiplier.CUT
        halves = {"l": lambda w: w[:cut], "h": lambda w: w[cut:].as_signed()}
        products = {}
        for name in ("ll", "hl", "lh", "hh"):
            part = inside.parts[name]
            a, b = halves[name[0]](dut.a), halves[name[1]](dut.b)
            m.d.comb += [
                Assert(part.component.a == a),
                Assert(part.component.b == b),
                Assert(part.component.en == dut.en),
            ]
            if name in ("lh", "hh"):  # one cycle later, its factors waiting in the slice
                m.d.comb += [
                    Assert(part["a1"] == register.after(a, signed(18), f"{name}_a")),
                    Assert(part["b1"] == register.after(b, signed(18), f"{name}_b")),
                ]
            # al bl is below 2^34: never negative.
            products[name] = part.component.m.as_unsigned() if name == "ll" else part.component.m
        now = {name: products[name] for name in ("lh", "hh")}
        now |= {
            name: register.after(products[name], products[name].shape(), f"{name}2")
            for name in ("ll", "hl")
        }
        last = {name: register.after(now[name], now[name].shape(), f"{name}3") for name in now}
        total = Signal(signed(2 * dut.word))
        m.d.comb += [
            total.eq(last["ll"] + ((last["hl"] + last["lh"]) << cut) + (last["hh"] << (2 * cut))),
            # For induction: the sums on their way.
            Assert(inside.parts["hl"]["p0"] == (now["ll"] >> cut) + now["hl"]),
            Assert(inside["low"] == now["ll"][:cut]),
            Assert(dut.p == total),
            reached(m, dut.p < -1, "negative"),
        ]
        return m


def machine(word: int) -> Machine:
    """A machine with words of ``word`` bits; its lane does not depend on the rest."""
    return Machine(name="lane", lanes=1, arithmetic=Arithmetic(word))


def _lane(word: int, sources: int) -> Proof:
    return Proof(
        name=f"lane.stages_{word}_{sources}",
        depth=2,
        induction=1,
        cover=range(9, 10),
        short=word == 18 or sources == 1 and word == 32,
        claim=f"Lane of {word}-bit words, {sources} outside word(s), any operands, fields and "
        "stalls: captures, masks, signs, shift, sum, clamp as docs/engine.md says, stage by stage",
        harness=lambda: InStages(Lane(machine=machine(word), sources=sources)),
    )


def _product(word: int) -> Proof:
    return Proof(
        name=f"lane.product_{word}",
        depth=2,
        induction=1,
        cover=range(6, 7),
        short=word == 32,
        claim=f"Multiplier of {word}-bit words, any factors and stalls: its slices get the "
        "halves of the factors, and the product is the sum of theirs, three cycles later",
        harness=lambda: OfPartialProducts(Multiplier(word=word)),
    )


PROOFS = (
    *(_lane(word, sources) for word, sources in ((32, 1), (32, 2), (24, 1), (18, 1))),
    *map(_product, (32, 24)),
)
