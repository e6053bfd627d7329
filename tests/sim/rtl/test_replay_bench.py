"""The bench's own steps, in order, on a design that is played; test_rtl.py has a simulator."""

from __future__ import annotations

import asyncio
from types import SimpleNamespace

import pytest

from boresight.sim.rtl import replay_bench


def test_reset_for_four_cycles_then_wait_for_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    steps: list[object] = []

    class Reset:
        def __setattr__(self, name: str, value: int) -> None:
            steps.append(("rst", value))

    async def done(name: str, *arguments: object) -> None:
        steps.append((name, *arguments))

    class Clock:
        def __init__(self, signal: str, period: int, *, unit: str) -> None:
            steps.append(("clock", signal, period, unit))

        def start(self) -> None:
            steps.append("start")

    async def with_timeout(trigger: object, limit: int, unit: str) -> None:
        steps.append(("limit", limit, unit))
        await trigger  # type: ignore[misc]

    for name in ("ClockCycles", "FallingEdge", "RisingEdge"):
        monkeypatch.setattr(replay_bench, name, lambda *a, name=name: done(name, *a))
    monkeypatch.setattr(replay_bench, "Clock", Clock)
    monkeypatch.setattr(replay_bench, "with_timeout", with_timeout)
    monkeypatch.setenv("REPLAY_MAX_CYCLES", "123")
    design = SimpleNamespace(clk="clk", rst=Reset(), done="done")
    asyncio.run(replay_bench.replay.func(design))
    assert steps == [
        ("clock", "clk", 10, "ns"),
        "start",
        ("rst", 1),
        ("ClockCycles", "clk", 4),
        ("FallingEdge", "clk"),
        ("rst", 0),
        ("limit", 1230, "ns"),
        ("RisingEdge", "done"),
    ]
