"""Shared by all tests: no bench of Amaranth's simulator waits for ever."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import pytest
from amaranth.sim import Simulator

#: Cycles after which a bench has failed, and their length as all benches have it.
CYCLES, PERIOD_S = 200_000, 1e-8


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line(
        "markers", f"cycles(limit): cycles that a simulated bench may take, instead of {CYCLES}"
    )


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, Any, Any]:
    """``Simulator.run`` fails where a bench, and whatever it waits for, does not end.

    A fault in a component mostly shows as something that never comes; without a limit the bench
    would hang, and with it the whole run of tests.
    """
    marker = item.get_closest_marker("cycles")
    limit = marker.args[0] if marker else CYCLES
    plain = Simulator.run

    def run(simulator: Simulator) -> None:
        async def watch(ctx: Any) -> None:
            await ctx.delay(limit * PERIOD_S)
            raise TimeoutError(f"the bench has not ended after {limit} cycles")

        simulator.add_testbench(watch, background=True)
        plain(simulator)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Simulator, "run", run)
        return (yield)
