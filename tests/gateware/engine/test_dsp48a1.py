"""The DSP48A1: primitive and behaviour proved equal, behaviour against arithmetic."""

import random

import pytest

from boresight.gateware.engine.parts import DSP48A1, Multiplier, Z

USES = [
    {"mreg": True, "adds": False},
    {"reg0": True, "reg1": True, "mreg": True, "preg": True, "z": Z.C},
    {"reg1": True, "mreg": True, "z": Z.PCIN},
    {"reg0": True, "preg": True},
]


@pytest.mark.parametrize("use", USES)
def test_primitive_equals_behaviour(use, proves_equal) -> None:
    assert proves_equal(DSP48A1(**use), DSP48A1(**use), multipliers=1)


@pytest.mark.parametrize("word, multipliers", [(18, 1), (20, 1), (32, 4)])
def test_multiplier_of_primitives_equals_behaviour(word, multipliers, proves_equal) -> None:
    assert proves_equal(Multiplier(word=word), Multiplier(word=word), multipliers=multipliers)


@pytest.mark.parametrize("change", [{"adds": False}, {"reg0": False}, {"z": Z.PCIN}])
def test_the_proof_can_fail(change, proves_equal) -> None:
    assert not proves_equal(DSP48A1(**USES[1]), DSP48A1(**{**USES[1], **change}), multipliers=2)


@pytest.mark.parametrize("z", Z)
@pytest.mark.parametrize("adds", [True, False])
def test_sum_of_product(z: Z, adds: bool, simulate) -> None:
    rng = random.Random(1)
    dut = DSP48A1(z=z, adds=adds)

    async def bench(ctx):
        for _ in range(50):
            a, b = (rng.choice((-1 << 17, rng.randrange(-1 << 17, 1 << 17))) for _ in range(2))
            c, pcin = (rng.randrange(-1 << 45, 1 << 45) for _ in range(2))
            for port, value in ((dut.a, a), (dut.b, b), (dut.c, c), (dut.pcin, pcin)):
                ctx.set(port, value)
            addend = {Z.ZERO: 0, Z.PCIN: pcin, Z.C: c}[z]
            assert ctx.get(dut.m) == a * b
            assert ctx.get(dut.p) == addend + a * b * adds

    simulate(dut, bench)
