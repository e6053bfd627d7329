"""The shifter against Python's shift."""

import random

import pytest

from boresight.gateware.engine.shifter import Shifter


@pytest.mark.parametrize("width_in, width_out", [(64, 60), (48, 50), (36, 42)])
def test_every_amount(width_in: int, width_out: int, simulate) -> None:
    rng = random.Random(width_in)
    dut = Shifter(width_in=width_in, width_out=width_out)
    half = 1 << (width_in - 1)

    async def bench(ctx):
        for amount in range(32):
            for invert in (0, 1):
                for value in (-half, half - 1, rng.randrange(-half, half)):
                    ctx.set(dut.i, value)
                    ctx.set(dut.amount, amount)
                    ctx.set(dut.invert, invert)
                    want = (value >> amount) ^ -invert
                    mask = (1 << width_out) - 1
                    assert ctx.get(dut.o) & mask == want & mask

    simulate(dut, bench)


def test_primitives_equal_behaviour(proves_equal) -> None:
    assert proves_equal(*(Shifter(width_in=40, width_out=36) for _ in range(2)))


def test_widths_are_checked() -> None:
    with pytest.raises(ValueError, match=r"^width_in must be an integer of at least 2, not 1$"):
        Shifter(width_in=1, width_out=4)
    with pytest.raises(ValueError, match=r"^width_out must be an integer of at least 2, not '4'$"):
        Shifter(width_in=8, width_out="4")
