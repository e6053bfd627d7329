"""The lane, field by field at random, against the integer semantics of `model.words.fixed`."""

import random
from dataclasses import dataclass, field

import pytest
from amaranth.hdl import Fragment
from amaranth.sim import Simulator

from boresight.gateware.engine.lane import FIELDS, Lane
from boresight.gateware.machine import Machine
from boresight.gateware.microcode.layout import lane_fields
from boresight.model.words.fixed import (
    Arithmetic,
    fraction,
    leading_sign_count,
    saturate,
    table_index,
    wrap,
)


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
        arith = self.arith
        raw = a
        if f["cap_flag"]:
            moved = signed(raw + (f["quarter"] << (arith.word - 2)), arith.word)
            self.flag = int(moved < 0)
        if f["cap_norm"]:
            self.norm = int(leading_sign_count(raw, arith))
        if f["cap_index"]:
            self.index = int(table_index(raw, arith, bool(f["quarter"])))
        a = fraction(a, arith) if f["frac_a"] else a
        b = fraction(b, arith) if f["frac_b"] else b
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


@pytest.mark.parametrize("word", [18, 24, 32])
@pytest.mark.parametrize("stalls", [0.0, 0.25])
def test_random_slots(word: int, stalls: float) -> None:
    rng = random.Random(word + int(100 * stalls))
    arith = Arithmetic(word=word)
    machine = Machine(name="test", lanes=1, arithmetic=arith)
    fields = {name: f for name, f in lane_fields(machine).items() if name in FIELDS}
    count = 900
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

    dut = Lane(machine=machine)
    mask = (1 << word) - 1

    async def bench(ctx):
        # Slot s is in stage k at cycle s + k.
        for cycle in range(count + Machine.STAGE_WRITE):
            for name, f in fields.items():
                slot = cycle - f.stage
                ctx.set(getattr(dut, name), slots[slot][2][name] if 0 <= slot < count else 0)
            reading = cycle - Machine.STAGE_READ
            if 0 <= reading < count:
                ctx.set(dut.a, slots[reading][0] & mask)
                ctx.set(dut.b, slots[reading][1] & mask)
                assert ctx.get(dut.index) == indices[reading], reading
            ctx.set(dut.en, 0)
            while rng.random() < stalls:
                await ctx.tick()
            ctx.set(dut.en, 1)
            done = cycle - Machine.STAGE_WRITE
            if done >= 0:
                got = signed(ctx.get(dut.result), word), ctx.get(dut.saturated)
                assert got == expected[done], (done, slots[done])
            await ctx.tick()

    sim = Simulator(dut)
    sim.add_clock(1e-8)
    sim.add_testbench(bench)
    sim.run()


@pytest.mark.parametrize("sources", [1, 2])
def test_outside_words_replace_any_result(sources: int) -> None:
    rng = random.Random(sources)
    machine = Machine(name="test", lanes=1)
    dut = Lane(machine=machine, sources=sources)

    async def bench(ctx):
        ctx.set(dut.en, 1)
        ctx.set(dut.when, 1)
        ctx.set(dut.sticky, 1)
        for cycle in range(300):
            ctx.set(dut.a, rng.getrandbits(32))
            ctx.set(dut.b, rng.getrandbits(32))
            ctx.set(dut.first, rng.random() < 0.2)
            words = [rng.getrandbits(32) for _ in range(sources)]
            for k, value in enumerate(words):
                ctx.set(dut.words[k], value)
            chosen = rng.randrange(sources)
            ctx.set(dut.outside, 1)
            ctx.set(dut.which, chosen)
            if cycle > 10:
                assert ctx.get(dut.result) == words[chosen]
                assert not ctx.get(dut.saturated)
            await ctx.tick()

    sim = Simulator(dut)
    sim.add_clock(1e-8)
    sim.add_testbench(bench)
    sim.run()


def test_sources_is_checked() -> None:
    with pytest.raises(ValueError, match=r"^sources must be 1 or 2, not 3$"):
        Lane(machine=Machine(name="test", lanes=1), sources=3)


@pytest.mark.parametrize("word", [18, 32])
def test_the_shifter_has_the_bits_of_a_product_and_no_more(word: int) -> None:
    """Each of them is a LUT of its own."""
    machine = Machine("test", 1, Arithmetic(word))
    m = Lane(machine=machine, sources=1).elaborate(None)
    shifter = m.submodules.shifter
    Fragment.get(m, None)
    assert (shifter.width_in, shifter.width_out) == (2 * word, machine.arithmetic.acc_width)
