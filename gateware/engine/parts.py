"""Parts of a lane: bit-wise look-up tables, registers in a row, shifter, leading-sign count."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from amaranth.hdl import Cat, Const, Instance, Module, Mux, Signal, Value, signed
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
