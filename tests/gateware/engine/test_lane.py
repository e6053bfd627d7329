"""The lane, and its parts by themselves."""

import random
from dataclasses import dataclass, field

import pytest
from amaranth.hdl import Module

import boresight.gateware.engine.lane as lane
from boresight.gateware.engine.lane import FIELDS, Lane
from boresight.gateware.engine.parts import Bitwise, Shifter, multiplex
from boresight.gateware.machine import Machine
from boresight.model.words.fixed import Arithmetic, leading_sign_count, saturate, wrap
from tests.support.bench import Pins, run_bench

# -- the lane, field by field at random, against the integer semantics of `model.words.fixed` -----


def signed(value: int, bits: int) -> int:
    """Two's complement reading of the low bits of ``value``."""
    return int(wrap(value, bits))


@dataclass
class Reference:
    """What one lane holds, slot after slot."""

    arith: Arithmetic
    flag: int = 0
    norm: int = 0
    index: int = 0
    acc: int = 0
    seen: set = field(default_factory=set)

    def slot(self, a: int, b: int, f: dict[str, int]) -> tuple[int, int]:
        """Execute one slot; the written word and whether it saturates."""
        arith, mask = self.arith, (1 << self.arith.fraction_bits) - 1
        raw = a
        if f["cap_flag"]:
            moved = signed(raw + (f["quarter"] << (arith.word - 2)), arith.word)
            self.flag = int(moved < 0)
        if f["cap_norm"]:
            self.norm = int(leading_sign_count(raw, arith))
        if f["cap_index"]:
            self.index = (raw + (f["quarter"] << arith.word - 2)) >> arith.fraction_bits & 127
        a = a & mask if f["frac_a"] else a
        b = b & mask if f["frac_b"] else b
        n = (0, self.norm, self.norm & ~1, self.norm >> 1)[f["scale"]]
        term = (a * b) >> max(f["shift"] - n, 0)
        if f["neg"] ^ (f["neg_flag"] & self.flag):
            term = -term
        if not f["when"] ^ (f["when_flag"] & self.flag):
            term = 0
        start = 1 << (arith.guard - 1) if f["first"] else self.acc
        self.acc = signed(start + term, arith.acc_width)
        q = self.acc >> arith.guard
        if f["wrap"]:
            return signed(q, arith.word), 0
        clamped = int(saturate(q, arith.word))
        self.seen.add((clamped > q) - (clamped < q))
        return clamped, int(clamped != q and f["sticky"])


def operand(rng: random.Random, word: int) -> int:
    """A word: often at an edge, often small."""
    half = 1 << (word - 1)
    return rng.choice(
        (
            rng.randrange(-half, half),
            rng.randrange(-half, half) >> rng.randrange(word),
            rng.choice((0, 1, -1, half - 1, -half, half >> 1, -(half >> 1))),
        )
    )


# 19, 20: products by bits beside a slice; 10, 12: more registers in the multiplier
@pytest.mark.parametrize(
    "word, depth", [(18, 7), (19, 7), (20, 7), (24, 7), (32, 7), (20, 12), (32, 10), (32, 12)]
)
def test_random_slots(word: int, depth: int) -> None:
    rng = random.Random(word)
    arith = Arithmetic(word=word)
    machine = Machine(name="test", lanes=1, arithmetic=arith, depth=depth)
    fields = {f.name[:-1]: f for f in machine.fields if f.name[:-1] in FIELDS}
    count = 600
    slots = []
    for number in range(count):
        values = {name: rng.getrandbits(f.width) for name, f in fields.items()}
        values["first"] = int(number == 0 or rng.random() < 0.3)
        values["when"] |= rng.random() < 0.5
        if number == 0:
            values.update(cap_index=1, cap_flag=1, cap_norm=1)
        slots.append((operand(rng, word), operand(rng, word), values))

    reference = Reference(arith)
    expected, indices = [], []
    for a, b, values in slots:
        expected.append(reference.slot(a, b, values))
        indices.append(reference.index)
    assert reference.seen == {-1, 0, 1}

    top, dut = Module(), Lane(machine=machine)
    top.submodules.dut = dut
    pins = Pins(top, {name: getattr(dut, name) for name in fields}, driven=True)
    mask = (1 << word) - 1

    async def bench(ctx):
        # Slot s is in stage k at cycle s + k.
        for cycle in range(count + dut.stages.write):
            at = {name: cycle - f.stage for name, f in fields.items()}
            pins.put(ctx, {name: slots[s][2][name] for name, s in at.items() if 0 <= s < count})
            reading = cycle - dut.stages.read
            if 0 <= reading < count:
                ctx.set(dut.a, slots[reading][0] & mask)
                ctx.set(dut.b, slots[reading][1] & mask)
                assert ctx.get(dut.index) == indices[reading], reading
            ctx.set(dut.en, 0)
            while rng.random() < 0.25:  # a stall
                await ctx.tick()
            ctx.set(dut.en, 1)
            done = cycle - dut.stages.write
            if done >= 0:
                got = signed(ctx.get(dut.result), word), ctx.get(dut.saturated)
                assert got == expected[done], (done, slots[done])
            await ctx.tick()

    run_bench(top, bench)


# -- shifter and bit-wise tables: primitives and behaviour agree ----------------------------------


def test_primitives_equal_behaviour(proves_equal) -> None:
    assert proves_equal(*(Shifter(width_in=40, width_out=36) for _ in range(2)))


def test_primitive_equals_behaviour(proves_equal) -> None:
    def make(function=multiplex):
        return Bitwise(function=function, inputs=6, width=3)

    assert proves_equal(make(), make())
    assert not proves_equal(make(), make(lane._result_low))
