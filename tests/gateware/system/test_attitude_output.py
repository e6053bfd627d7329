"""What is sent is bit by bit what the software makes of one update, and never of two."""

import random
from collections.abc import Callable

import pytest
from amaranth.hdl import Module
from amaranth.lib import wiring
from amaranth.sim import Simulator

from boresight.gateware.boards.frames import Kind
from boresight.gateware.bus.results import Results
from boresight.gateware.system.attitude_frame import OUTPUTS, text_line
from boresight.gateware.system.attitude_output import AttitudeOutput, OutputMode
from boresight.gateware.system.interface import Place

#: Words of an attitude's frame.
PLACES = 2 + len(OUTPUTS)
HALF = 1 << 31


class Bench:
    """Results that are written, an output, and who takes its bytes."""

    def __init__(self, dut: AttitudeOutput | None = None) -> None:
        self.results, self.dut = Results(word=32), dut or AttitudeOutput()
        self.bodies: list[bytes] = []
        self.raw: list[bool] = []
        self.sent = self.skipped = 0
        self.top = Module()
        self.top.submodules += [self.results, self.dut]
        wiring.connect(self.top, self.dut.port, self.results.ports[1])

    async def update(self, ctx, words: list[int], pause: int = 0) -> None:
        """Write an update, a word a cycle; ``words`` in the order of a frame."""
        results = self.results
        ctx.set(results.begin, 1)
        await ctx.tick()
        ctx.set(results.begin, 0)
        first = Place.OUTPUTS
        places = (Place.HEADER, Place.STAMP, *range(first, first - 2 + len(words)))
        for k, (place, word) in enumerate(zip(places, words, strict=True)):
            ctx.set(results.w_en, 1)
            ctx.set(results.w_index, place)
            ctx.set(results.w_data, word & 0xFFFF_FFFF)
            ctx.set(results.complete, k == len(words) - 1)
            await ctx.tick()
        ctx.set(results.w_en, 0)
        ctx.set(results.complete, 0)
        ctx.set(self.dut.updated, 1)
        await ctx.tick()
        ctx.set(self.dut.updated, 0)
        if pause:
            await ctx.tick().repeat(pause)

    def run(self, test: Callable, *, stalls: float = 0.0) -> None:
        rng, body = random.Random(7), bytearray()

        async def take(ctx):
            while True:
                ready = rng.random() >= stalls
                ctx.set(self.dut.o.ready, ready)
                _, _, valid, payload = await ctx.tick().sample(self.dut.o.valid, self.dut.o.payload)
                if valid and ready:
                    body.append(payload.data)
                    if payload.last:
                        self.bodies.append(bytes(body))
                        self.raw.append(bool(payload.raw))
                        body.clear()

        async def count(ctx):
            async for _, _, events in ctx.tick().sample(self.dut.events):
                self.sent += events & 1
                self.skipped += events >> 1

        sim = Simulator(self.top)
        sim.add_clock(1e-8)
        sim.add_testbench(take, background=True)
        sim.add_testbench(count, background=True)
        sim.add_testbench(test)
        sim.run()
        assert not body


def with_flags(words: list[int], flags: int) -> list[int]:
    return [words[0] & 0xFF_FFFF | flags << 24, *words[1:]]


def body_of(words: list[int]) -> bytes:
    return bytes([Kind.ATTITUDE]) + b"".join((w & 0xFFFF_FFFF).to_bytes(4, "little") for w in words)


def random_update(rng: random.Random, words_of_it: int = PLACES) -> list[int]:
    words = [
        rng.choice([rng.randrange(-HALF, HALF), rng.choice([-HALF, HALF - 1, 0, -1, 1])])
        for _ in range(words_of_it)
    ]
    return [words[0] & 0x7F_FFFF, *words[1:]]


@pytest.mark.parametrize("stalls", [0.0, 0.5])
def test_frames(stalls: float) -> None:
    bench, rng, wanted = Bench(), random.Random(1), []

    async def test(ctx):
        ctx.set(bench.dut.mode, OutputMode.BINARY)
        for _ in range(12):
            words, flags = random_update(rng), rng.getrandbits(8)
            ctx.set(bench.dut.flags, flags)
            await bench.update(ctx, words, pause=300)
            wanted.append(body_of(with_flags(words, flags)))

    bench.run(test, stalls=stalls)
    assert bench.bodies == wanted and not any(bench.raw)
    assert (bench.sent, bench.skipped) == (12, 0)


@pytest.mark.parametrize("most", [8, 16])
def test_frames_of_any_length(most: int) -> None:
    """As long as the update that is sent has outputs, whatever comes meanwhile."""
    bench, rng, wanted = Bench(AttitudeOutput(text=False, most=most)), random.Random(4), []

    async def test(ctx):
        ctx.set(bench.dut.mode, OutputMode.BINARY)
        for outputs in (1, 2, most // 2, most // 2 + 1, most - 1, most, 1):
            words = random_update(rng, 2 + outputs)
            ctx.set(bench.dut.last_output, outputs - 1)
            await bench.update(ctx, words, pause=1)
            ctx.set(bench.dut.last_output, rng.randrange(most))
            await ctx.tick().repeat(6 + 16 * (2 + outputs))
            wanted.append(body_of(with_flags(words, 0)))

    bench.run(test)
    assert bench.bodies == wanted and not any(bench.raw)


@pytest.mark.parametrize("stalls", [0.0, 0.5])
def test_lines(stalls: float) -> None:
    bench, rng, wanted = Bench(), random.Random(2), []
    edges = [0, 1, -1, HALF - 1, -HALF, 59_652, 59_653, -59_653]

    async def test(ctx):
        ctx.set(bench.dut.mode, OutputMode.TEXT)
        for k in range(12):
            words, flags = random_update(rng), rng.getrandbits(8)
            if k < len(edges):
                words[2:5] = [edges[k], edges[-k], edges[k - 1]]
            ctx.set(bench.dut.flags, flags)
            await bench.update(ctx, words, pause=900)
            wanted.append(text_line(with_flags(words, flags)))

    bench.run(test, stalls=stalls)
    assert [b.decode() for b in bench.bodies] == wanted and all(bench.raw)
    assert (bench.sent, bench.skipped) == (12, 0)


@pytest.mark.parametrize("mode", [OutputMode.BINARY, OutputMode.TEXT])
def test_a_slow_line_never_mixes_updates(mode: OutputMode) -> None:
    """Updates come without a pause, the line takes few bytes: whole ones, the rest skipped."""
    bench, rng, given = Bench(), random.Random(3), []

    async def test(ctx):
        ctx.set(bench.dut.mode, mode)
        for k in range(120):
            words = random_update(rng)
            given.append(words)
            await bench.update(ctx, words, pause=k % 3)
        await ctx.tick().repeat(3000)

    bench.run(test, stalls=0.8)
    as_sent = [text_line(w).encode() if mode == OutputMode.TEXT else body_of(w) for w in given]
    places = [as_sent.index(body) for body in bench.bodies]
    assert places == sorted(set(places)) and places[0] == 0 and len(places) >= 4
    assert bench.sent == len(places) and bench.sent + bench.skipped == len(given)


@pytest.mark.parametrize("divider, every", [(0, 1), (1, 1), (2, 2), (7, 7)])
def test_divider(divider: int, every: int) -> None:
    bench, given = Bench(), []

    async def test(ctx):
        ctx.set(bench.dut.mode, OutputMode.BINARY)
        ctx.set(bench.dut.divider, divider)
        for k in range(30):
            given.append([k] * PLACES)
            await bench.update(ctx, given[-1], pause=200)

    bench.run(test)
    assert bench.bodies == [body_of(w) for w in given[::every]]


@pytest.mark.parametrize("divider", [513, 1023])
def test_a_large_divider(divider: int) -> None:
    """An update every cycle: the frame is gone long before the next one is due."""
    bench = Bench(AttitudeOutput(text=False))

    async def test(ctx):
        ctx.set(bench.dut.mode, OutputMode.BINARY)
        ctx.set(bench.dut.divider, divider)
        for updates, sent in ((divider, 1), (1, 2)):
            ctx.set(bench.dut.updated, 1)
            await ctx.tick().repeat(updates)
            ctx.set(bench.dut.updated, 0)
            await ctx.tick().repeat(60)
            assert (bench.sent, bench.skipped) == (sent, 0)

    bench.run(test)


def test_off_and_changes_on_the_way() -> None:
    bench = Bench()
    words = [1, *range(2, 11)]

    async def test(ctx):
        await bench.update(ctx, words, pause=200)
        ctx.set(bench.dut.mode, 3)
        await bench.update(ctx, words, pause=200)
        assert not bench.bodies
        ctx.set(bench.dut.mode, OutputMode.BINARY)
        await bench.update(ctx, words, pause=20)
        ctx.set(bench.dut.mode, OutputMode.TEXT)
        ctx.set(bench.dut.flags, 0xFF)
        await ctx.tick().repeat(200)
        await bench.update(ctx, words, pause=20)
        ctx.set(bench.dut.mode, OutputMode.OFF)
        await ctx.tick().repeat(900)

    bench.run(test)
    assert bench.bodies == [body_of(words), text_line(with_flags(words, 0xFF)).encode()]
    assert bench.raw == [False, True]
