"""Shared by the tests of the system: accesses to a register bus."""

from collections.abc import Callable

import pytest


@pytest.fixture
def bus_write() -> Callable:
    """Write a word by a bus's rules; returns the cycles it took."""

    async def write(ctx, bus, address: int, word: int) -> int:
        ctx.set(bus.addr, address)
        ctx.set(bus.w_data, word)
        ctx.set(bus.w_stb, 1)
        cycles = 0
        while True:
            _, _, done = await ctx.tick().sample(bus.w_ack)
            cycles += 1
            if done:
                break
        ctx.set(bus.w_stb, 0)
        return cycles

    return write


@pytest.fixture
def bus_read() -> Callable:
    """Read a word: it comes in the cycle after the address."""

    async def read(ctx, bus, address: int) -> int:
        ctx.set(bus.addr, address)
        await ctx.tick()
        return ctx.get(bus.r_data)

    return read
