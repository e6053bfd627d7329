"""The DSP48A1: primitive and behaviour proved equal, behaviour against arithmetic."""

import random

import pytest

from boresight.gateware.engine.dsp48a1 import DSP48A1, X, Z
from boresight.gateware.engine.multiplier import Multiplier

ALL = {
    "a0reg": True,
    "a1reg": True,
    "b0reg": True,
    "b1reg": True,
    "creg": True,
    "mreg": True,
    "preg": True,
}
USES = [
    {"mreg": True, "x": X.ZERO},
    {**ALL, "z": Z.C, "subtract": True},
    {"a0reg": True, "mreg": True, "preg": True, "z": Z.P},
    {"preg": True, "creg": True, "x": X.P, "z": Z.C},
]


@pytest.mark.parametrize("use", USES)
def test_primitive_equals_behaviour(use, proves_equal) -> None:
    assert proves_equal(DSP48A1(**use), DSP48A1(**use), multipliers=1)


@pytest.mark.parametrize("word, multipliers", [(18, 1), (20, 1), (32, 4)])
def test_multiplier_of_primitives_equals_behaviour(word, multipliers, proves_equal) -> None:
    assert proves_equal(Multiplier(word=word), Multiplier(word=word), multipliers=multipliers)


@pytest.mark.parametrize("change", [{"subtract": False}, {"b0reg": False}, {"z": Z.PCIN}])
def test_the_proof_can_fail(change, proves_equal) -> None:
    assert not proves_equal(DSP48A1(**USES[1]), DSP48A1(**{**USES[1], **change}), multipliers=2)


@pytest.mark.parametrize("z, subtract", [(z, s) for z in (Z.ZERO, Z.PCIN, Z.C) for s in (0, 1)])
def test_sum_of_product(z: Z, subtract: bool, simulate) -> None:
    rng = random.Random(1)
    dut = DSP48A1(z=z, subtract=bool(subtract))

    async def bench(ctx):
        for _ in range(50):
            a, b = (rng.choice((-1 << 17, rng.randrange(-1 << 17, 1 << 17))) for _ in range(2))
            c, pcin = (rng.randrange(-1 << 45, 1 << 45) for _ in range(2))
            for port, value in ((dut.a, a), (dut.b, b), (dut.c, c), (dut.pcin, pcin)):
                ctx.set(port, value)
            addend = {Z.ZERO: 0, Z.PCIN: pcin, Z.C: c}[z]
            assert ctx.get(dut.m) == a * b
            assert ctx.get(dut.p) == addend + (-a * b if subtract else a * b)

    simulate(dut, bench)
