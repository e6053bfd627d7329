"""Waiting in simulated benches: a process that only waits is not woken in every cycle."""

from __future__ import annotations

from typing import Any

#: Clock period of the gateware's benches, seconds.
PERIOD_S = 1e-8


async def pause(ctx: Any, cycles: int) -> None:
    """``ctx.tick().repeat(cycles)`` of a clock of `PERIOD_S`, from just after an edge or the start.

    Until shortly before the last edge time passes for the design alone.
    """
    if cycles > 1:
        await ctx.delay((cycles - 0.75) * PERIOD_S)
    if cycles:
        await ctx.tick()
