"""Registers: what is written is read, what is not there does nothing."""

import random

import pytest

from boresight.gateware.bus.csr import Csr
from boresight.gateware.registers.model import Access, Register

RO, WO, RW = Access.READ_ONLY, Access.WRITE_ONLY, Access.READ_WRITE
REGISTERS = (
    Register("magic", 0x40, RO, "", width=32, reset=0xDEAD_BEEF),
    Register("state", 0x41, RO, "", width=9),
    Register("wide", 0x42, RW, "", width=32, reset=7),
    Register("small", 0x44, RW, "", width=3, reset=5),
    Register("choice", 0x45, RW, "", width=2, reset=1, names=("a", "b", "c")),
    Register("order", 0x46, WO, "", width=2),
    Register("clock", 0x47, RO, "", width=32),
)


async def write(ctx, dut: Csr, offset: int, word: int) -> None:
    ctx.set(dut.offset, offset)
    ctx.set(dut.w_data, word)
    ctx.set(dut.w_en, offset < 8)  # others' writes do not come here
    await ctx.tick()
    ctx.set(dut.w_en, 0)


async def read(ctx, dut: Csr, offset: int) -> int:
    ctx.set(dut.offset, offset)
    await ctx.tick()
    assert ctx.get(dut.known) == (0x40 + offset in {r.address for r in REGISTERS})
    return ctx.get(dut.r_data)


def test_after_power_up(simulate) -> None:
    dut = Csr(REGISTERS)

    async def bench(ctx):
        ctx.set(dut.state, 0x155)
        ctx.set(dut.clock, 0x8000_0001)
        assert [await read(ctx, dut, k) for k in range(16)] == [
            0xDEAD_BEEF,
            0x155,
            7,
            0,
            5,
            1,
            0,
            0x8000_0001,
            *[0] * 8,
        ]
        assert (ctx.get(dut.wide), ctx.get(dut.small), ctx.get(dut.choice)) == (7, 5, 1)

    simulate(dut, bench)


def test_random_accesses_against_a_model(simulate) -> None:
    dut, rng = Csr(REGISTERS), random.Random(1)
    widths = {2: ("wide", 32), 4: ("small", 3), 5: ("choice", 2)}
    model = {"wide": 7, "small": 5, "choice": 1, "state": 0, "clock": 0}

    async def bench(ctx):
        for _ in range(1500):
            offset, word = rng.randrange(16), rng.choice([rng.getrandbits(32), rng.randrange(5)])
            for name, width in (("state", 9), ("clock", 32)):
                if rng.random() < 0.3:
                    model[name] = rng.getrandbits(width)
                    ctx.set(getattr(dut, name), model[name])
            if rng.random() < 0.5:
                await write(ctx, dut, offset, word)
                if offset in widths:
                    name, width = widths[offset]
                    if name != "choice" or word & 3 < 3:
                        model[name] = word & (1 << width) - 1
            else:
                wanted = {
                    0: 0xDEAD_BEEF,
                    1: model["state"],
                    7: model["clock"],
                    **{k: model[name] for k, (name, _) in widths.items()},
                }.get(offset, 0)
                assert await read(ctx, dut, offset) == wanted
            for name, _ in widths.values():
                assert ctx.get(getattr(dut, name)) == model[name]

    simulate(dut, bench)


def test_orders_last_one_cycle(simulate) -> None:
    dut = Csr(REGISTERS)

    async def bench(ctx):
        for offset, word, wanted in ((6, 0b101, (1, 0b01)), (6, 2, (1, 2)), (4, 3, (0, 0))):
            ctx.set(dut.offset, offset)
            ctx.set(dut.w_data, word)
            assert (ctx.get(dut.order_stb), ctx.get(dut.order)) == (0, 0)
            ctx.set(dut.w_en, 1)
            _, _, strobe, order = await ctx.tick().sample(dut.order_stb, dut.order)
            assert (strobe, order) == wanted
            ctx.set(dut.w_en, 0)
            _, _, strobe, order = await ctx.tick().sample(dut.order_stb, dut.order)
            assert (strobe, order) == (0, 0)

    simulate(dut, bench)


@pytest.mark.parametrize(
    "registers, message",
    [
        ((), r"^registers must not be empty$"),
        (
            (Register("a", 1, RW, "", width=1), Register("b", 2, RW, "", width=1)),
            r"^first address must be a multiple of 2, not 1$",
        ),
        (
            (Register("a", 4, RW, "", width=1), Register("b", 4, RW, "", width=1)),
            r"^addresses must ascend, not 4 \(b\) after 4$",
        ),
        (
            (Register("a", 4, RW, "", width=2, reset=4),),
            r"^a must have 1 to 32 bits that hold its reset value, not 2 bits for 4$",
        ),
        (
            (Register("a", 4, RW, "", width=33),),
            r"^a must have 1 to 32 bits that hold its reset value, not 33 bits for 0$",
        ),
    ],
)
def test_declaration_is_checked(registers, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Csr(registers)
