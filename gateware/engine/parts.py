"""Parts of a lane: bit-wise look-up tables, shifter, leading-sign count, signed multiplier."""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from typing import Any

from amaranth.hdl import Cat, ClockSignal, Const, Instance, Module, Mux, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from boresight.model.words.fixed import Arithmetic


def is_spartan6(platform: Any) -> bool:
    """Whether ``platform`` builds for a Spartan-6, by its ``device`` attribute."""
    return str(getattr(platform, "device", "")).lower().startswith("xc6s")


class Bitwise(wiring.Component):
    """A function of up to six words, bit by bit.

    On Spartan-6 each bit is one LUT primitive. Logic synthesis left alone makes two tables of many
    six-input functions, because it prices a LUT6 above a LUT5, and it chains tables on paths whose
    delay it does not know (from block RAM). Elsewhere it is left to synthesis.

    **Latency** none. ``function``, of as many words as ``inputs``, is made of ``~ & | ^`` only.
    """

    def __init__(self, *, function: Callable[..., Any], inputs: int, width: int = 1) -> None:
        self.function = function
        self.inputs = inputs
        self.width = width
        super().__init__({"i": In(width).array(inputs), "o": Out(width)})

    @property
    def table(self) -> int:
        """Contents of the look-up table: bit n is the function of the bits of n."""
        bits = [[n >> k & 1 for k in range(self.inputs)] for n in range(1 << self.inputs)]
        return sum((self.function(*row) & 1) << n for n, row in enumerate(bits))

    def elaborate(self, platform: Any) -> Module:
        m = Module()
        words = [self.i[k] for k in range(self.inputs)]
        if not is_spartan6(platform):
            m.d.comb += self.o.eq(self.function(*words))
            return m
        init = Const(self.table, 1 << self.inputs)
        for bit in range(self.width):
            pins = {f"i_I{k}": word[bit] for k, word in enumerate(words)}
            m.submodules[f"bit{bit}"] = Instance(
                f"LUT{self.inputs}", p_INIT=init, **pins, o_O=self.o[bit]
            )
        return m

    def connect(self, m: Module, *words: Any) -> Any:
        """Connect the inputs, one-bit values to every bit; returns the output."""
        for port, value in zip((self.i[k] for k in range(self.inputs)), words, strict=True):
            m.d.comb += port.eq(value.replicate(self.width) if len(value) == 1 else value)
        return self.o


def choose(select: Any, high: Any, low: Any) -> Any:
    """``select ? one : zero``, bit by bit."""
    return select & high | ~select & low


def next_value(register: Signal, value: Value, *, when: Value) -> Value:
    """``when ? value : register``, which synthesis does not make part of the clock enable.

    The enable comes late and needs no table more on its way to the register.
    """
    return choose(when.replicate(len(register)), value, register)


def multiplex(w0: Any, w1: Any, w2: Any, w3: Any, s0: Any, s1: Any) -> Any:
    """Four-way multiplexer, bit by bit."""
    return choose(s1, choose(s0, w3, w2), choose(s0, w1, w0))


def delayed(m: Module, value: Value, *, en: Value, names: list[str]) -> Value:
    """The value of as many enabled cycles before as there are ``names``, those of the registers."""
    for name in names:
        register = Signal(value.shape(), name=name, reset_less=True)
        with m.If(en):
            m.d.sync += register.eq(value)
        value = register
    return value


class Shifter(wiring.Component):
    """``o = (i >> amount) ^ invert``: 32 positions, sign-extended, low bits of the result.

    Three levels, each one six-input look-up table per bit: by 0, 8, 16 or 24; by 0, 2, 4 or 6; by
    0 or 1 together with the inversion.

    **Latency** none, or with a register behind the first level 1 cycle from ``i`` and ``amount``,
    whose last bits wait in here, too (``registered``).
    """

    def __init__(self, *, width_in: int, width_out: int, registered: bool = False) -> None:
        self.width_in = width_in
        self.width_out = width_out
        self.registered = registered
        super().__init__(
            {
                **({"en": In(1)} if registered else {}),
                "i": In(signed(width_in)),
                "amount": In(5),
                "invert": In(1),
                "o": Out(signed(width_out)),
            }
        )

    def elaborate(self, platform: Any) -> Module:
        m = Module()
        value, amount = self.i, self.amount
        # A level has only the bits that later levels can still reach.
        for name, low, reach in (("coarse", 3, 7), ("middle", 1, 1)):
            width = min(self.width_in, self.width_out + reach)
            m.submodules[name] = mux = Bitwise(function=multiplex, inputs=6, width=width)
            ways = [(value >> (k << low))[:width] for k in range(4)]
            output = mux.connect(m, *ways, *amount[low : low + 2])
            value = Signal(signed(width), name=f"{name}_o")
            m.d.comb += value.eq(output)
            if self.registered and name == "coarse":
                value = delayed(m, value, en=self.en, names=["coarse_out"])
                amount = delayed(m, amount[:low], en=self.en, names=["amount_out"])
        last = Mux(amount[0], value >> 1, value)
        m.d.comb += self.o.eq(last ^ self.invert.replicate(self.width_out))
        return m


class LeadingSignCount(wiring.Component):
    """Copies of the sign bit below the sign bit of a word, at most `Arithmetic.norm_max`.

    Bits are looked at in groups of four, highest first. Step one finds for every group whether it
    holds a bit unlike its upper neighbour and where the first such bit is; step two picks the
    first such group.

    **Latency** 2 cycles from ``capture`` to ``count``. With ``free`` the clock enable is free of
    ``capture``, which then chooses in front of registers.
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
        width = len(self.count)
        count: Value = Const(0, width)
        for group, (chosen, place) in enumerate(zip(choice, places, strict=True)):
            count = count | Cat(place, Const(group, width - 2)) & chosen.replicate(width)
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


class Z(IntEnum):
    """Second operand of the post-adder, OPMODE[3:2]."""

    ZERO = 0
    PCIN = 1
    C = 3


class DSP48A1(wiring.Component):
    """One DSP48A1 slice of Spartan-6, with a constant operation and one clock enable.

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
