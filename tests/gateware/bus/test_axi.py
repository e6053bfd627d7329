"""AXI4-Lite and AXI4-Stream at any pace."""

import random
from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from amaranth.hdl import ClockSignal, DomainRenamer, Module, Signal

from boresight.gateware.bus.axi import AxiCore, AxiLiteSlave, Response
from tests.support.bench import run_bench

# -- registers over AXI4-Lite; `sim.formal.axi` proves the protocol ------------------------

Test = Callable[[Any], Awaitable[None]]


class Bench:
    """A slave, and behind it a memory that acknowledges at random."""

    def __init__(self, patience: float = 1.0, word: int = 32) -> None:
        self.dut = AxiLiteSlave(word=word)
        self.memory: dict[int, int] = {}
        self.patience = patience

    def run(self, *tests: Test) -> None:
        dut, rng = self.dut, random.Random(3)
        top = Module()
        willing = Signal()
        top.submodules.dut = dut
        top.d.comb += dut.bus.w_ack.eq(dut.bus.w_stb & willing)

        async def target(ctx: Any) -> None:
            while True:
                ctx.set(willing, rng.random() < self.patience)
                _, _, ack, addr, data = await ctx.tick().sample(
                    dut.bus.w_ack, dut.bus.addr, dut.bus.w_data
                )
                ctx.set(dut.bus.r_data, self.memory.get(addr, 0))
                if ack:
                    self.memory[addr] = data

        run_bench(top, *tests, background=[target])

    async def _send(self, ctx: Any, channel: str, **what: int) -> None:
        for name, value in what.items():
            ctx.set(getattr(self.dut.axi, name), value)
        ctx.set(getattr(self.dut.axi, f"{channel}valid"), 1)
        await ctx.tick().until(getattr(self.dut.axi, f"{channel}ready"))
        ctx.set(getattr(self.dut.axi, f"{channel}valid"), 0)

    async def write(
        self, ctx: Any, address: int, word: int, strobes: int = 15, gap: int = 0
    ) -> int:
        """The response; the address comes ``gap`` cycles before the word, or after it."""
        if gap >= 0:
            await self._send(ctx, "aw", awaddr=address)
            for _ in range(gap):
                await ctx.tick()
        await self._send(ctx, "w", wdata=word, wstrb=strobes)
        if gap < 0:
            await ctx.tick().repeat(-gap)
            await self._send(ctx, "aw", awaddr=address)
        ctx.set(self.dut.axi.bready, 1)
        (response,) = await ctx.tick().sample(self.dut.axi.bresp).until(self.dut.axi.bvalid)
        ctx.set(self.dut.axi.bready, 0)
        return int(response)

    async def read(self, ctx: Any, address: int) -> int:
        await self._send(ctx, "ar", araddr=address)
        ctx.set(self.dut.axi.rready, 1)
        word, response = (
            await ctx.tick()
            .sample(self.dut.axi.rdata, self.dut.axi.rresp)
            .until(self.dut.axi.rvalid)
        )
        ctx.set(self.dut.axi.rready, 0)
        assert response == Response.OKAY
        return int(word)


@pytest.mark.parametrize(("patience", "word"), [(1.0, 32), (0.3, 24)])
def test_words_come_back(patience: float, word: int) -> None:
    bench, rng = Bench(patience, word), random.Random(1)
    mask = (1 << word) - 1

    async def test(ctx: Any) -> None:
        for _ in range(40):
            place, value = rng.randrange(1024), rng.getrandbits(32)
            address = 4 * place + rng.randrange(4)
            gap = rng.randrange(-2, 3)
            assert await bench.write(ctx, address, value, gap=gap) == Response.OKAY
            assert bench.memory[place] == value & mask
            assert await bench.read(ctx, 4 * place) == value & mask

    bench.run(test)


def test_latency() -> None:
    """From the cycle in which a request is taken to that of its response."""
    bench = Bench()
    axi, took = bench.dut.axi, {}

    async def test(ctx: Any) -> None:
        for signal, value in ((axi.wstrb, 15), (axi.awvalid, 1), (axi.wvalid, 1)):
            ctx.set(signal, value)
        await ctx.tick()
        ctx.set(axi.awvalid, 0)
        ctx.set(axi.wvalid, 0)
        for name, valid in (("write", axi.bvalid), ("read", axi.rvalid)):
            cycles = 1
            while not ctx.get(valid):
                cycles += 1
                await ctx.tick()
            took[name] = cycles
            ctx.set(axi.arvalid, name == "write")
            await ctx.tick()
            ctx.set(axi.arvalid, 0)

    bench.run(test)
    assert took == {"write": 3, "read": 4}


# -- packets through both streams, at any pace --------------------------------------------


class Through(AxiCore):
    """Words that come in go out, in place of a core."""

    def core(self, **ports: Any) -> Module:
        m = Module()
        m.d.comb += [
            ports["o_o__payload"].eq(ports["i_i__payload"]),
            ports["o_o__valid"].eq(ports["i_i__valid"]),
            ports["o_i__ready"].eq(ports["i_o__ready"]),
        ]
        return m


@pytest.mark.parametrize("pace", [1.0, 0.5])
@pytest.mark.parametrize("word", [18, 32])
def test_words_come_through(word: int, pace: float) -> None:
    """In order, sign-extended; without pauses a word in each cycle, the first two cycles late."""
    rng = random.Random(word)
    top = Module()
    dut = Through(word=word)
    top.submodules.dut = DomainRenamer("axi")(dut)
    top.d.comb += [dut.aclk.eq(ClockSignal()), dut.aresetn.eq(1)]
    sent = [(rng.getrandbits(32), rng.getrandbits(1)) for _ in range(60)]
    came: list[tuple[int, int]] = []
    cycles: list[int] = []

    async def send(ctx: Any) -> None:
        for data, last in sent:
            while rng.random() >= pace:
                await ctx.tick()
            ctx.set(dut.s_axis_tdata, data)
            ctx.set(dut.s_axis_tlast, last)
            ctx.set(dut.s_axis_tvalid, 1)
            await ctx.tick().until(dut.s_axis_tready)
            ctx.set(dut.s_axis_tvalid, 0)

    async def take(ctx: Any) -> None:
        for cycle in range(2000):
            ctx.set(dut.m_axis_tready, rng.random() < pace)
            _, _, valid, ready, data, last = await ctx.tick().sample(
                dut.m_axis_tvalid, dut.m_axis_tready, dut.m_axis_tdata, dut.m_axis_tlast
            )
            if valid and ready:
                came.append((data, last))
                cycles.append(cycle)
            if len(came) == len(sent):
                return

    run_bench(top, take, background=[send])

    def extended(data: int) -> int:
        low = data & ((1 << word) - 1)
        return (low - (low >> word - 1 << word)) & 0xFFFFFFFF

    assert came == [(extended(data), last) for data, last in sent]
    if pace == 1.0:
        assert cycles == list(range(2, 62))
