"""Signed multiplier of DSP48A1 slices of Spartan-6, and the slice itself."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

from amaranth.hdl import Cat, ClockSignal, Const, Instance, Module, Mux, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.engine.parts import delayed, is_spartan6


class Z(IntEnum):
    """Second operand of the post-adder, OPMODE[3:2]."""

    ZERO = 0
    PCIN = 1
    C = 3


class DSP48A1(wiring.Component):
    """One DSP48A1 slice with a constant operation and one clock enable.

    The part of the slice that Boresight uses: no pre-adder, no carry in, no resets. For a platform
    with such slices (`is_spartan6`) this is the vendor's primitive, otherwise a behavioural
    description of it; both are proved equal in the tests.

    ::

        M = A * B        P = Z + M   or   Z

    **Latency** Each parameter that is true adds one register: A and B pass ``reg0 + reg1`` of them,
    the product ``mreg`` and the sum ``preg``. The sum has the product if it ``adds``, and ``z``;
    ``Z.PCIN`` demands that ``pcin`` be the ``pcout`` of another slice.
    """

    def __init__(
        self,
        *,
        reg0: bool = False,
        reg1: bool = False,
        mreg: bool = False,
        preg: bool = False,
        adds: bool = True,
        z: Z = Z.ZERO,
    ) -> None:
        self.registers = {"a0reg": reg0, "a1reg": reg1, "b0reg": reg0, "b1reg": reg1}
        self.registers |= {"creg": False, "mreg": mreg, "preg": preg}
        self.adds = adds
        self.z = z
        super().__init__(
            {
                "en": In(1),  # Clock enable of every register.
                # Factors.
                "a": In(signed(18)),
                "b": In(signed(18)),
                "c": In(signed(48)),  # Addend.
                "pcin": In(signed(48)),  # Addend from the cascade.
                "m": Out(signed(36)),  # Product, after ``mreg``.
                # Sum, after ``preg``; to the fabric and to the cascade.
                "p": Out(signed(48)),
                "pcout": Out(signed(48)),
            }
        )

    def elaborate(self, platform: Any) -> Module:
        return self._primitive() if is_spartan6(platform) else self._behaviour()

    def _primitive(self) -> Module:
        m = Module()
        registers = {f"p_{name.upper()}": int(used) for name, used in self.registers.items()}
        enables = {f"i_CE{name}": self.en for name in ("A", "B", "C", "M", "P")}
        idle = ("CED", "CECARRYIN", "CEOPMODE", "CARRYIN")
        resets = (f"RST{name}" for name in ("A", "B", "C", "D", "M", "P", "CARRYIN", "OPMODE"))
        unused = {f"i_{name}": Const(0) for name in (*idle, *resets)}
        m.submodules.slice = Instance(
            "DSP48A1",
            **registers,
            **{f"p_{name}REG": 0 for name in ("D", "OPMODE", "CARRYIN", "CARRYOUT")},
            p_CARRYINSEL="OPMODE5",
            p_RSTTYPE="SYNC",
            i_CLK=ClockSignal(),
            **enables,
            **unused,
            i_D=Const(0, 18),
            i_OPMODE=Const(self.z << 2 | self.adds, 8),
            **{f"i_{name.upper()}": getattr(self, name) for name in ("a", "b", "c", "pcin")},
            **{f"o_{name.upper()}": getattr(self, name) for name in ("m", "p", "pcout")},
        )
        return m

    def _behaviour(self) -> Module:
        m = Module()

        def after(value: Value, name: str, register: str) -> Value:
            used = [name] if self.registers[register] else []
            return delayed(m, value, en=self.en, names=used)

        a, b = (
            after(after(port, f"{side}0", f"{side}0reg"), f"{side}1", f"{side}1reg")
            for side, port in (("a", self.a), ("b", self.b))
        )
        product = Signal.like(self.m)
        m.d.comb += [product.eq(a * b), self.m.eq(after(product, "m0", "mreg"))]
        z = {Z.ZERO: 0, Z.PCIN: self.pcin, Z.C: self.c}[self.z]
        total = Signal.like(self.p)
        m.d.comb += [
            total.eq(z + (self.m if self.adds else 0)),
            self.p.eq(after(total, "p0", "preg")),
            self.pcout.eq(self.p),
        ]
        return m


class Multiplier(wiring.Component):
    """Signed word times word, exact, one product per cycle.

    The slice multiplies 18 x 18 bits signed. What words of up to `ONE_SLICE` = 20 bits have below
    their upper 18, al and bl of k bits, is added up in tables: a row of the other factor for each
    bit that is set, summed in pairs and into the post-adder::

        a = ah 2^k + al, b = bh 2^k + bl
        a b = ah bh 4^k + rest, rest = ah bl 2^k + al b

        cycle     slice                            tables
        0         A, B                             rows of ah for bl, of b for al
        1         M = ah bh                        ah bl, al b
        2         P = C(rest >> 2 k) + M           rest
        3         product = P : rest[2 k - 1:0]

    A wider word is cut into an unsigned low part of `CUT` = 17 bits and a signed high part; the
    four partial products are summed along the slices' post-adders::

        a = ah 2^17 + al, b = bh 2^17 + bl
        a b = al bl + (ah bl + al bh) 2^17 + ah bh 2^34

        cycle     slice ll          slice hl                slice lh           slice hh
        0         M = al bl         M = ah bl               A, B               A, B
        1                           P = C(ll.M >> 17) + M   M = al bh          M = ah bh
        2                                                   P = PCIN + M   ->  P = C(lh.P >> 17) + M
        3         product = hh.P : lh.P[16:0] : ll.M[16:0]

    With ``factors`` every slice registers its factors (once more) in cycle 0, and all else is a
    cycle later. With ``sums`` slice lh registers its sum, and slice hh waits for it; of one slice
    the product is registered.

    **Latency** 3 cycles, and one for each of ``factors`` and ``sums``: factors at the ports in
    cycle 0 give the product at the port in cycle 3, 4 or 5.
    """

    #: Bits of the unsigned low part of a word that four slices multiply.
    CUT = 17
    #: Bits of the widest word that one slice multiplies; each bit more takes 20 to 45 tables.
    ONE_SLICE = 20

    def __init__(self, *, word: int = 32, factors: bool = False, sums: bool = False) -> None:
        self.word = word
        self.factors = factors
        self.sums = sums
        super().__init__(
            {"en": In(1), "a": In(signed(word)), "b": In(signed(word)), "p": Out(signed(2 * word))}
        )

    def elaborate(self, platform: Any) -> Module:
        m = Module()
        (self._one_slice if self.word <= self.ONE_SLICE else self._four_slices)(m)
        return m

    def _one_slice(self, m: Module) -> None:
        """The upper 18 bits of both factors, and in tables what the others add."""
        f, low = self.factors, self.word - 18
        m.submodules.slice = dsp = DSP48A1(
            reg0=f, reg1=True, mreg=True, preg=True, z=Z.C if low else Z.ZERO
        )
        m.d.comb += [dsp.en.eq(self.en), dsp.a.eq(self.a[low:]), dsp.b.eq(self.b[low:])]
        product: Value = dsp.p
        if low:
            a, b = (
                delayed(m, x, en=self.en, names=[f"{name}_late"] if f else [])
                for name, x in (("a", self.a), ("b", self.b))
            )
            rest = Signal(signed(self.word + 2 * low))
            parts = [
                self._by_bits(m, name, factor, bits)
                for name, factor, bits in (("ah", a[low:].as_signed(), b[:low]), ("b", b, a[:low]))
            ]
            m.d.comb += [
                rest.eq((parts[0] << low) + parts[1]),
                dsp.c.eq(rest[2 * low :].as_signed()),
            ]
            last = delayed(m, rest[: 2 * low], en=self.en, names=["rest_low"])
            product = Cat(last, dsp.p)
        last = delayed(m, product, en=self.en, names=["product"] if self.sums else [])
        m.d.comb += self.p.eq(last)

    def _by_bits(self, m: Module, name: str, factor: Value, bits: Value) -> Value:
        """``factor`` times unsigned ``bits``, two enabled cycles later."""
        rows = []
        for k, bit in enumerate(bits):
            row = Signal(factor.shape(), name=f"{name}_row{k}", reset_less=True)
            with m.If(self.en):
                m.d.sync += row.eq(Mux(bit, factor, 0))
            rows.append(row << k)
        return delayed(m, sum(rows[1:], rows[0]), en=self.en, names=[f"{name}_product"])

    def _four_slices(self, m: Module) -> None:
        """Partial products, and the delays of the low bits."""
        f = self.factors
        cut = self.CUT
        late: dict[str, Any] = {"reg0": f, "reg1": True, "mreg": True}
        m.submodules.ll = ll = DSP48A1(reg1=f, mreg=True, adds=False)
        m.submodules.hl = hl = DSP48A1(reg1=f, mreg=True, preg=True, z=Z.C)
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
        low, low_next, middle = (
            Signal(cut, name=name, reset_less=True) for name in ("low", "low_next", "middle")
        )
        with m.If(self.en):
            m.d.sync += [low.eq(ll.m[:cut]), low_next.eq(low), middle.eq(lh.p[:cut])]
        low_last = delayed(m, low_next, en=self.en, names=["low_last"] if self.sums else [])
        m.d.comb += self.p.eq(Cat(low_last, middle, hh.p))
