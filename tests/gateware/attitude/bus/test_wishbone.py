"""Wishbone cycles, those that are given up too."""

import random

import pytest
from amaranth.hdl import Module, Signal

from boresight.gateware.attitude.bus.wishbone import WishboneSlave
from tests.support.bench import run_bench


class Bench:
    """A slave and a bus with memory behind it that is granted and acknowledges at random."""

    def __init__(self, patience: float, read_cycles: int = 1) -> None:
        self.dut, self.memory = WishboneSlave(read_cycles=read_cycles), {}
        self.words = [0] * read_cycles  # on their way
        self.writes: list[tuple[int, int]] = []
        self.patience = patience

    def run(self, test) -> None:
        dut, rng = self.dut, random.Random(3)
        top = Module()
        top.submodules.dut = dut

        willing = Signal()
        top.d.comb += [
            dut.grant.eq(dut.request & willing),
            dut.bus.w_ack.eq(dut.grant & dut.bus.w_stb),
        ]

        async def target(ctx):
            while True:
                ctx.set(willing, rng.random() < self.patience)
                _, _, ack, addr, data = await ctx.tick().sample(
                    dut.bus.w_ack, dut.bus.addr, dut.bus.w_data
                )
                self.words = [*self.words[1:], self.memory.get(addr, 0)]
                ctx.set(dut.bus.r_data, self.words[0])
                if ack:
                    self.memory[addr] = data
                    self.writes.append((addr, data))

        run_bench(top, test, background=[target])

    async def transfer(
        self, ctx, address: int, word: int | None = None, limit: int = 100
    ) -> tuple[int | None, int]:
        """Word that came, or None if given up; cycles."""
        wb = self.dut.wb
        ctx.set(wb.cyc, 1)
        ctx.set(wb.stb, 1)
        ctx.set(wb.we, word is not None)
        ctx.set(wb.adr, address)
        ctx.set(wb.dat_w, word or 0)
        got = None
        for cycles in range(limit):  # noqa: B007
            _, _, ack, data = await ctx.tick().sample(wb.ack, wb.dat_r)
            if ack:
                got = data
                break
        ctx.set(wb.cyc, 0)
        ctx.set(wb.stb, 0)
        if got is None:
            await ctx.tick()  # a slave has to see that a transfer is given up
        return got, cycles


@pytest.mark.parametrize("read_cycles", [1, 2])
@pytest.mark.parametrize("patience", [1.0, 0.3])
def test_words_come_back(patience: float, read_cycles: int) -> None:
    bench, rng = Bench(patience, read_cycles), random.Random(1)

    async def test(ctx):
        for _ in range(100):
            address, word = rng.randrange(4096), rng.getrandbits(32)
            got, cycles = await bench.transfer(ctx, address, word)
            assert got is not None and (patience < 1 or cycles <= 3)
            got, cycles = await bench.transfer(ctx, address)
            assert got == word and (patience < 1 or cycles == 2 + read_cycles)
            if rng.random() < 0.5:
                await ctx.tick()
        assert len(bench.writes) == 100

    bench.run(test)


def test_transfers_that_are_given_up() -> None:
    """No acknowledgement reaches the next transfer, and every write is done once or never begun."""
    bench, rng = Bench(0.15), random.Random(2)
    given_up = []

    async def test(ctx):
        for n in range(150):
            address, word = rng.randrange(64), n + 1
            got, _ = await bench.transfer(ctx, address, word, limit=rng.randrange(1, 8))
            if got is None:
                given_up.append((address, word))
            await bench.transfer(ctx, address, limit=rng.randrange(1, 8))
            got, _ = await bench.transfer(ctx, 64 + n)
            assert got == 0  # of its own address, not what the one before would have got
            got, _ = await bench.transfer(ctx, address, 1000 + n)
            assert got is not None
            got, _ = await bench.transfer(ctx, address)
            assert got == 1000 + n

    bench.run(test)
    assert len(given_up) > 50
    assert len(bench.writes) == len(set(bench.writes))


def test_nothing_without_a_strobe(simulate) -> None:
    dut = WishboneSlave()

    async def bench(ctx):
        for cyc, stb in ((0, 0), (1, 0), (0, 1)):
            ctx.set(dut.wb.cyc, cyc)
            ctx.set(dut.wb.stb, stb)
            ctx.set(dut.wb.we, 1)
            for _ in range(5):
                await ctx.tick()
                assert not ctx.get(dut.request) and not ctx.get(dut.wb.ack)

    simulate(dut, bench)
