"""One multiply-accumulate lane: the pipeline from operands to result."""

from __future__ import annotations

from functools import reduce
from operator import or_
from typing import Any

from amaranth.hdl import Cat, Module, Mux, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.engine import parts
from boresight.gateware.machine import Machine

#: Fields of the microword for the lane itself.
FIELDS = (
    *("frac_a", "frac_b", "cap_index", "cap_flag", "cap_norm", "quarter", "neg", "neg_flag"),
    *("when", "when_flag", "shift", "scale", "first", "wrap", "sticky"),
)


class Lane(wiring.Component):
    """Sum of shifted products, ``q = sat/wrap(floor((half + sum ±floor(a b / 2^s)) / 2^G))``.

    ::

        read        A, B [W]  --mask--> multiplier, captures (flag, index, leading-sign count)
        condition   product in the making; sign and participation decided
        amount      shift amount
        shift       product [2 W] >> amount, inverted when negative, zero when not taking part -> r
        accumulate  acc [W + G + headroom] = (first ? half : acc) + r + (1 when negated)
        limit       acc[G:] clamped or cut
        write       result [W]: that, or one of the words loaded from outside

    Every microword field acts in the cycle of its stage (`gateware.machine`); the word of the ROM
    is skewed, so fields enter here undelayed; what is early for a later stage waits in registers.

    **Latency** `Stages.write` - `Stages.read` cycles from ``a``, ``b`` to ``result``. ``sources``,
    1 or 2, is the number of outside words that may replace a result.
    """

    def __init__(self, *, machine: Machine, sources: int = 1) -> None:
        self.machine = machine
        self.stages = machine.stages
        self.sources = sources
        word = machine.arithmetic.word
        widths = {f.name: f.width for f in machine.fields}
        super().__init__(
            {
                "en": In(1),  # Clock enable of every register.
                "a": In(word),
                "b": In(word),
                **{name: In(widths[f"{name}0"]) for name in FIELDS},
                # Segment index in force for an address formed in this cycle.
                "index": Out(machine.arithmetic.INDEX_BITS),
                "outside": In(1),  # At write: replace the result by an outside word,
                "which": In(1),  # this one
                "words": In(word).array(sources),  # of these.
                "result": Out(word),  # Word to write.
                # The result is marked sticky and was clamped, or overflowed modulo 2^W.
                "saturated": Out(1),
                "beyond": Out(1),
            }
        )

    def elaborate(self, platform: Any) -> Module:
        m = Module()
        flag, product = self._captures(m), self._multiply(m)
        invert, skip = self._conditions(m, flag)
        term, carry = self._shift(m, product, self._amount(m), invert, skip)
        self._write(m, self._accumulate(m, term, carry))
        return m

    def _captures(self, m: Module) -> Signal:
        """Read: sign flag and segment index of the raw ``a``, plus a quarter if requested."""
        arith = self.machine.arithmetic
        top = self.a[arith.fraction_bits :]
        # Plus 2^(W-2): the bit below the sign flips and carries into the sign.
        index = Cat(top[:-2], top[-2] ^ self.quarter)
        sign = top[-1] ^ (self.quarter & top[-2])
        flag = Signal(reset_less=True)
        held = Signal(arith.INDEX_BITS, reset_less=True)
        with m.If(self.en):
            if self.machine.has("memory"):
                m.d.sync += [
                    flag.eq(parts.next_value(flag, sign, when=self.cap_flag)),
                    held.eq(parts.next_value(held, index, when=self.cap_index)),
                ]
            else:
                with m.If(self.cap_flag):
                    m.d.sync += flag.eq(sign)
                with m.If(self.cap_index):
                    m.d.sync += held.eq(index)
        m.d.comb += self.index.eq(Mux(self.cap_index, index, held))
        return flag

    def _multiply(self, m: Module) -> Signal:
        """From read on: masks and product, which is there at shift."""
        arith = self.machine.arithmetic
        m.submodules.multiplier = multiplier = parts.Multiplier(
            word=arith.word, factors=self.machine.has("factor"), sums=self.machine.has("sum")
        )
        m.d.comb += multiplier.en.eq(self.en)
        for port, value, masked in (
            (multiplier.a, self.a, self.frac_a),
            (multiplier.b, self.b, self.frac_b),
        ):
            low, high = value[: arith.fraction_bits], value[arith.fraction_bits :]
            m.d.comb += port.eq(Cat(low, high & ~masked.replicate(len(high))))
        return multiplier.p

    def _conditions(self, m: Module, flag: Signal) -> tuple[Signal, Signal]:
        """Condition: invert and skip of the term, delayed to the last level of the shifter."""
        later = range(self.stages.condition + 1, self.stages.accumulate)
        invert = [Signal(name=f"invert{k}", reset_less=True) for k in later]
        skip = [Signal(name=f"skip{k}", reset_less=True) for k in later]
        with m.If(self.en):
            m.d.sync += [
                invert[0].eq(self.neg ^ (self.neg_flag & flag)),
                skip[0].eq(~(self.when ^ (self.when_flag & flag))),
            ]
            for k in range(1, len(later)):
                m.d.sync += [invert[k].eq(invert[k - 1]), skip[k].eq(skip[k - 1])]
        return invert[-1], skip[-1]

    def _amount(self, m: Module) -> Value:
        """Amount: the shift, not below 0; delayed to shift."""
        m.submodules.leading = leading = parts.LeadingSignCount(
            arithmetic=self.machine.arithmetic, free=self.machine.has("memory")
        )
        m.d.comb += [
            leading.en.eq(self.en),
            leading.i.eq(self.a),
            leading.capture.eq(self.cap_norm),
        ]
        n = leading.count
        less = Signal.like(n)
        with m.Switch(self.scale):
            for scale, part in enumerate((n, n & ~1, n >> 1), 1):
                with m.Case(scale):
                    m.d.comb += less.eq(part)
        difference = Signal(signed(len(n) + 1))
        amount = Signal(len(n), reset_less=True)
        m.d.comb += difference.eq(self.shift - less)
        with m.If(self.en):
            m.d.sync += amount.eq(Mux(difference < 0, 0, difference))
        later = range(self.stages.amount + 2, self.stages.shift + 1)
        return parts.delayed(m, amount, en=self.en, names=[f"amount{k}" for k in later])

    def _shift(
        self, m: Module, product: Signal, amount: Value, invert: Signal, skip: Signal
    ) -> tuple[Signal, Signal]:
        """Shift: the term, ones' complement when negated, and its carry, there at accumulate."""
        arith = self.machine.arithmetic
        m.submodules.shifter = shifter = parts.Shifter(
            width_in=2 * arith.word,
            width_out=arith.acc_width,
            registered=self.machine.has("shifter"),
        )
        m.d.comb += [shifter.i.eq(product), shifter.amount.eq(amount), shifter.invert.eq(invert)]
        if shifter.registered:
            m.d.comb += shifter.en.eq(self.en)
        term = Signal(signed(arith.acc_width), reset_less=True)
        carry = Signal(reset_less=True)
        # Masked in the table that inverts: a synchronous reset would have to wait for the enable.
        with m.If(self.en):
            m.d.sync += [
                term.eq(shifter.o & (~skip).replicate(arith.acc_width)),
                carry.eq(invert & ~skip),
            ]
        return term, carry

    def _accumulate(self, m: Module, term: Signal, carry: Signal) -> Signal:
        """Accumulate: the sum, there at limit."""
        arith = self.machine.arithmetic
        acc = Signal(signed(arith.acc_width), reset_less=True)
        half = 1 << (arith.guard - 1)
        # One look-up table per bit: sum = propagate ^ carry with propagate = start ^ term, and the
        # carry multiplexer takes the plain register ``term``.
        start = Signal(arith.acc_width)
        m.d.comb += start.eq(Mux(self.first, half, acc))
        # The carry enters through a bit below the lowest one.
        total = Cat(1, term) + Cat(carry, start)
        with m.If(self.en):
            m.d.sync += acc.eq(total[1:])
        return acc

    def _write(self, m: Module, acc: Signal) -> None:
        """Limit and write: clamp, cut or load, each bit one table behind three select lines."""
        arith = self.machine.arithmetic
        word = arith.word
        q = acc[arith.guard :]
        negative, over = q[-1], q[word - 1 : -1]
        groups = [over[k : k + 5] for k in range(0, len(over), 5)]
        differs = []
        for k, bits in enumerate(groups):
            m.submodules[f"differs{k}"] = unit = parts.Bitwise(
                function=_differs, inputs=1 + len(bits)
            )
            differs.append(unit.connect(m, negative, *bits))
        m.submodules.clamp = unit = parts.Bitwise(function=_clamps, inputs=1 + len(differs))
        clamp: Value = unit.connect(m, self.wrap, *differs)
        beyond: Value = self.wrap & Cat(differs).any()
        if self.machine.has("limit"):
            clamp, beyond, negative, q = (
                parts.delayed(m, value, en=self.en, names=[f"{name}7"])
                for value, name in (
                    (clamp, "clamp"),
                    (beyond, "beyond"),
                    (negative, "negative"),
                    (q[:word], "q"),
                )
            )
        m.d.comb += [
            self.saturated.eq(clamp & self.sticky & ~self.outside),
            self.beyond.eq(beyond & self.sticky & ~self.outside),
        ]
        # Two more lines: equal, they give the sign of acc; unequal, they select an outside word.
        line = []
        for k, decide in enumerate((_line0, _line1)):
            m.submodules[f"line{k}"] = unit = parts.Bitwise(function=decide, inputs=3)
            line.append(unit.connect(m, self.outside, self.which, negative))
        words = [self.words[k] for k in range(self.sources)]
        # Of the limit only the sign bit equals the sign.
        for name, part, function in (
            ("low", slice(0, word - 1), _result_low),
            ("sign", slice(word - 1, word), _result_sign),
        ):
            m.submodules[f"result_{name}"] = result = parts.Bitwise(
                function=function, inputs=4 + len(words), width=len(self.result[part])
            )
            output = result.connect(m, clamp, *line, q[part], *(w[part] for w in words))
            m.d.comb += self.result[part].eq(output)


def _differs(sign: Any, *bits: Any) -> Any:
    """Some bit above the word is unlike the sign."""
    every, some = bits[0], bits[0]
    for bit in bits[1:]:
        every, some = every & bit, some | bit
    return parts.choose(sign, ~every, some)


def _clamps(wrap: Any, *differs: Any) -> Any:
    """The sum does not fit the word, which is not modulo 2^W."""
    return ~wrap & reduce(or_, differs)


def _line0(outside: Any, which: Any, negative: Any) -> Any:
    return parts.choose(outside, ~which, negative)


def _line1(outside: Any, which: Any, negative: Any) -> Any:
    return parts.choose(outside, which, negative)


def _result_low(clamp: Any, line0: Any, line1: Any, q: Any, *words: Any) -> Any:
    """A bit of the result: of the limit, of the accumulator, or of an outside word."""
    return _outside(parts.choose(clamp, ~line0, q), line0, line1, words)


def _result_sign(clamp: Any, line0: Any, line1: Any, q: Any, *words: Any) -> Any:
    return _outside(parts.choose(clamp, line0, q), line0, line1, words)


def _outside(result: Any, line0: Any, line1: Any, words: tuple[Any, ...]) -> Any:
    """A bit of the lane's result, or of the outside word that the lines select."""
    out = parts.choose(line0 & ~line1, words[0], result)
    return parts.choose(line1 & ~line0, words[1], out) if len(words) > 1 else out
