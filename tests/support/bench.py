"""Simulated benches of Amaranth: testbenches beside each other, streams, buses, pulses.

Each access ends with a clock edge. A handshake that does not come within ``limit`` cycles fails.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from amaranth.hdl import Cat, Module, Signal, Value
from amaranth.sim import Simulator

from boresight.model.words.fixed import wrap
from tests.support.clock import PERIOD_S

#: Testbenches of one run at most: those in the background, and those whose end ends it.
BACKGROUND, TESTS = 6, 6


class Simulation:
    """A design that is prepared for simulation once and simulated any number of times.

    Each run begins with the initial values of all signals and memories.
    """

    def __init__(self, top: Any) -> None:
        self._simulator = Simulator(top)
        self._simulator.add_clock(PERIOD_S)
        self._used = False
        self._parts: list[Callable[..., Any] | None] = [None] * (BACKGROUND + TESTS + 1)
        for k in range(BACKGROUND + TESTS):
            self._simulator.add_testbench(self._role(k), background=k < BACKGROUND)
        self._simulator.add_process(self._role(BACKGROUND + TESTS))

    def _role(self, k: int) -> Callable[..., Any]:
        async def play(ctx: Any) -> None:
            part = self._parts[k]
            if part is not None:
                await part(ctx)

        return play

    def run(
        self,
        *tests: Callable[..., Any],
        background: Iterable[Callable[..., Any]] = (),
        process: Callable[..., Any] | None = None,
    ) -> None:
        """Simulate until all tests have ended; what runs in the background need not."""
        behind = [*background]
        assert len(behind) <= BACKGROUND and len(tests) <= TESTS
        idle = [None] * BACKGROUND
        self._parts = [*(behind + idle)[:BACKGROUND], *([*tests] + idle)[:TESTS], process]
        if self._used:
            self._simulator.reset()
        self._used = True
        self._simulator.run()


def run_bench(
    top: Any, *tests: Callable[..., Any], background: Iterable[Callable[..., Any]] = ()
) -> None:
    """`Simulation.run` of a design that is simulated once."""
    Simulation(top).run(*tests, background=background)


class Pins:
    """Signals of a design as one word: the simulator settles or evaluates them once, not each.

    Either all are driven by the word or all are shown in it.
    """

    def __init__(self, top: Module, signals: Mapping[Any, Any], *, driven: bool = False) -> None:
        self.shapes = {name: Value.cast(signal).shape() for name, signal in signals.items()}
        together = Cat(*signals.values())
        self.word = Signal(len(together))
        top.d.comb += together.eq(self.word) if driven else self.word.eq(together)

    def put(self, ctx: Any, values: Mapping[Any, int]) -> None:
        """Drive the signals; 0 where there is no value."""
        word = at = 0
        for name, shape in self.shapes.items():
            word |= (values.get(name, 0) & (1 << shape.width) - 1) << at
            at += shape.width
        ctx.set(self.word, word)

    def get(self, ctx: Any) -> dict[Any, int]:
        """Values of the signals."""
        return self.parts(ctx.get(self.word))

    def parts(self, word: int) -> dict[Any, int]:
        """Values in a word that was sampled."""
        out = {}
        for name, shape in self.shapes.items():
            part = word & (1 << shape.width) - 1
            out[name] = wrap(part, shape.width) if shape.signed else part
            word >>= shape.width
        return out


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


async def at_edges(
    ctx: Any, do: Callable[..., None], *signals: Any, also: Iterable[Any] = ()
) -> None:
    """Call ``do`` with signals, and others, for ever at each edge at which one of them is not 0.

    Between these edges it sleeps.
    """
    others = [*also]
    while True:
        if not any(ctx.get(signal) for signal in signals):
            await ctx.changed(*signals)
        _, _, *values = await ctx.tick().sample(*signals, *others)
        if any(values[: len(signals)]):
            do(*values)


async def _until(ctx: Any, signal: Any, limit: int) -> int:
    """Cycles until the signal is seen at an edge, at least one."""
    for cycles in range(1, limit + 1):
        _, _, seen = await ctx.tick().sample(signal)
        if seen:
            return cycles
    raise AssertionError(f"no {signal.name} within {limit} cycles")
