"""Simulated benches of Amaranth: testbenches beside each other, streams, buses, pulses.

Each access ends with a clock edge. A handshake that does not come within ``limit`` cycles fails.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from amaranth.sim import Simulator

from tests.support.clock import PERIOD_S


def run_bench(
    top: Any, *tests: Callable[..., Any], background: Iterable[Callable[..., Any]] = ()
) -> None:
    """Simulate until all tests have ended; what runs in the background need not."""
    sim = Simulator(top)
    sim.add_clock(PERIOD_S)
    for each in background:
        sim.add_testbench(each, background=True)
    for each in tests:
        sim.add_testbench(each)
    sim.run()


async def pulse(ctx: Any, signal: Any) -> None:
    """One cycle of 1."""
    ctx.set(signal, 1)
    await ctx.tick()
    ctx.set(signal, 0)


async def put(ctx: Any, port: Any, payload: Any, limit: int = 2000) -> None:
    """Send one payload of a stream."""
    ctx.set(port.payload, payload)
    ctx.set(port.valid, 1)
    await _until(ctx, port.ready, limit)
    ctx.set(port.valid, 0)


async def put_record(ctx: Any, port: Any, words: Iterable[int], **options: int) -> None:
    """Send words (``data``, of any sign) of a core's input stream, the last one with ``last``."""
    words, mask = list(words), (1 << len(port.payload.data)) - 1
    for k, word in enumerate(words):
        await put(ctx, port, {"data": word & mask, "last": k == len(words) - 1}, **options)


async def write(ctx: Any, bus: Any, address: int, word: int, limit: int = 2000) -> int:
    """Write a word, of any sign, on a register bus; cycles that it took."""
    ctx.set(bus.addr, address)
    ctx.set(bus.w_data, word & (1 << len(bus.w_data)) - 1)
    ctx.set(bus.w_stb, 1)
    cycles = await _until(ctx, bus.w_ack, limit)
    ctx.set(bus.w_stb, 0)
    return cycles


async def read(ctx: Any, bus: Any, address: int) -> int:
    """Read a word of a register bus: it comes in the cycle after the address."""
    ctx.set(bus.addr, address)
    await ctx.tick()
    return int(ctx.get(bus.r_data))


async def _until(ctx: Any, signal: Any, limit: int) -> int:
    """Cycles until the signal is seen at an edge, at least one."""
    for cycles in range(1, limit + 1):
        _, _, seen = await ctx.tick().sample(signal)
        if seen:
            return cycles
    raise AssertionError(f"no {signal.name} within {limit} cycles")
