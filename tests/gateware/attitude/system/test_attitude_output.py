"""Outputs of the attitude system: words and frames."""

import random
from collections.abc import Callable

import pytest
from amaranth.hdl import Module
from amaranth.lib import wiring

from boresight.gateware.attitude.system.attitude_output import AttitudeOutput
from boresight.gateware.attitude.system.csr import Results
from boresight.gateware.attitude.system.interface import (
    ANGLES,
    FORMATS,
    OUTPUTS,
    Place,
    Sensed,
    sensed_of,
    update_of,
)
from boresight.gateware.boards.frames import Decoder, Kind, encode
from boresight.model.attitude import FILTERS, estimator
from tests.support import clock
from tests.support.bench import at_edges, pulse, run_bench

# -- what is sent is bit by bit what the software makes of one update, and never of two -----------

#: Words of an attitude's frame.
PLACES = 2 + len(OUTPUTS)
HALF = 1 << 31


class Bench:
    """Results that are written, an output, and who takes its bytes."""

    def __init__(self, dut: AttitudeOutput | None = None) -> None:
        self.dut = dut or AttitudeOutput()
        self.results = Results(read_cycles=self.dut.read_cycles)
        self.bodies: list[bytes] = []
        self.sent = self.skipped = 0
        self.top = Module()
        self.top.submodules += [self.results, self.dut]
        wiring.connect(self.top, self.dut.port, self.results.ports[1])

    async def update(self, ctx, words: list[int], pause: int = 0) -> None:
        """Write an update, a word a cycle; ``words`` in the order of a frame."""
        results = self.results
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
        ctx.set(self.dut.last_output, len(words) - 3)
        await pulse(ctx, self.dut.updated)
        if pause:
            await clock.pause(ctx, pause)

    def run(self, test: Callable, *, stalls: float = 0.0) -> None:
        rng, body = random.Random(7), bytearray()

        async def take(ctx):
            while True:
                ready = rng.random() >= stalls
                ctx.set(self.dut.o.ready, ready)
                if not ctx.get(self.dut.o.valid):
                    await ctx.posedge(self.dut.o.valid)
                _, _, valid, payload = await ctx.tick().sample(self.dut.o.valid, self.dut.o.payload)
                if valid and ready:
                    body.append(payload.data)
                    if payload.last:
                        self.bodies.append(bytes(body))
                        body.clear()

        def count(events: int) -> None:
            self.sent += events & 1
            self.skipped += events >> 1

        async def watch(ctx):
            await at_edges(ctx, count, self.dut.events)

        run_bench(self.top, test, background=[take, watch])
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


READS = pytest.mark.parametrize("stalls, reads", [(0.0, 1), (0.5, 1), (0.0, 2)])


@READS
def test_frames(stalls: float, reads: int) -> None:
    bench, rng, wanted = Bench(AttitudeOutput(read_cycles=reads)), random.Random(1), []

    async def test(ctx):
        ctx.set(bench.dut.on, 1)
        for _ in range(12):
            words, flags = random_update(rng), rng.getrandbits(8)
            ctx.set(bench.dut.flags, flags)
            await bench.update(ctx, words, pause=300)
            wanted.append(body_of(with_flags(words, flags)))

    bench.run(test, stalls=stalls)
    assert bench.bodies == wanted
    assert (bench.sent, bench.skipped) == (12, 0)


@pytest.mark.parametrize("outputs", [1, 8, 16])
def test_frames_with_the_counts_of_the_sensors(outputs: int) -> None:
    """Of a count its sign, 15 bits and 8 of the fraction; of the line whole numbers."""
    bench, rng = Bench(AttitudeOutput()), random.Random(5)
    counts = [rng.randrange(-(1 << 23), 1 << 23) for _ in range(6)]
    line = [rng.randrange(-(1 << 15), 1 << 15) for _ in range(3)]
    words = random_update(rng, 2 + outputs)

    async def test(ctx):
        ctx.set(bench.dut.on, 1)
        ctx.set(bench.dut.record, 1)
        raws = [(Place.RAWS + k, c << 8) for k, c in enumerate(counts)]
        raws += [(Place.LINE + k, n << 16) for k, n in enumerate(line)]
        ctx.set(bench.results.w_en, 1)
        for place, word in raws:
            ctx.set(bench.results.w_index, place)
            ctx.set(bench.results.w_data, word & 0xFFFF_FFFF)
            await ctx.tick()
        await bench.update(ctx, words, pause=600)

    bench.run(test)
    (body,) = bench.bodies
    ((kind, sent),) = Decoder(word=32).feed(encode(body[0], words_in(body), word=32))
    assert kind is Kind.SENSED and len(sent) == 2 + outputs + 6
    assert sent[: 2 + outputs] == with_flags(words, 0)
    assert sensed_of(sent) == Sensed(
        outputs=tuple(words[2:]), counts=tuple(c / 256 for c in counts), line=tuple(line)
    )


def words_in(body: bytes) -> list[int]:
    return [int.from_bytes(body[k : k + 4], "little", signed=True) for k in range(1, len(body), 4)]


def test_a_slow_line_never_mixes_updates() -> None:
    """Updates come without a pause, the line takes few bytes: whole ones, the rest skipped."""
    bench, rng, updates = Bench(), random.Random(3), []

    async def test(ctx):
        ctx.set(bench.dut.on, 1)
        for k in range(120):
            words = random_update(rng)
            updates.append(words)
            await bench.update(ctx, words, pause=k % 3)
        await clock.pause(ctx, 3000)

    bench.run(test, stalls=0.8)
    as_sent = [body_of(w) for w in updates]
    places = [as_sent.index(body) for body in bench.bodies]
    assert places == sorted(set(places)) and places[0] == 0 and len(places) >= 4
    assert bench.sent == len(places) and bench.sent + bench.skipped == len(updates)


@pytest.mark.parametrize("divider, every", [(0, 1), (1, 1), (2, 2), (7, 7)])
def test_divider(divider: int, every: int) -> None:
    bench, updates = Bench(), []

    async def test(ctx):
        ctx.set(bench.dut.on, 1)
        ctx.set(bench.dut.divider, divider)
        for k in range(16):
            updates.append([k] * PLACES)
            await bench.update(ctx, updates[-1], pause=200)

    bench.run(test)
    assert bench.bodies == [body_of(w) for w in updates[::every]]


@pytest.mark.parametrize("divider", [513, 1023])
def test_a_large_divider(divider: int) -> None:
    """An update every cycle: the frame is gone long before the next one is due."""
    bench = Bench(AttitudeOutput())

    async def test(ctx):
        ctx.set(bench.dut.on, 1)
        ctx.set(bench.dut.divider, divider)
        for updates, sent in ((divider, 1), (1, 2)):
            ctx.set(bench.dut.updated, 1)
            await ctx.tick().repeat(updates)
            ctx.set(bench.dut.updated, 0)
            await ctx.tick().repeat(60)
            assert (bench.sent, bench.skipped) == (sent, 0)

    bench.run(test)


def test_off_in_the_middle_of_a_frame() -> None:
    bench = Bench()
    words = [1, *range(2, 11)]

    async def test(ctx):
        await bench.update(ctx, words, pause=200)
        assert not bench.bodies
        ctx.set(bench.dut.on, 1)
        await bench.update(ctx, words, pause=20)
        ctx.set(bench.dut.on, 0)
        ctx.set(bench.dut.flags, 0xFF)
        await ctx.tick().repeat(300)
        await bench.update(ctx, words, pause=200)

    bench.run(test)
    assert bench.bodies == [body_of(words)]


# -- frames in software ---------------------------------------------------------------------------


def test_attitude_of_words() -> None:
    words = [
        0x8128_FFFE - 2**32,
        -1,
        HALF // 2,
        -HALF // 4,
        -HALF,
        1 << 29,
        0,
        -(1 << 28),
        1,
        5 << 23,
    ]
    got = update_of(words, FORMATS[0])
    assert (got.number, got.flags, got.stamp, got.filter) == (0xFFFE, 0x8128, 0xFFFF_FFFF, 0)
    angles = {"heading_deg": -180.0, "pitch_deg": 90.0, "roll_deg": -45.0}
    quaternion = {"qw": 1.0, "qx": 0.0, "qy": -0.5, "qz": 2.0**-29}
    assert got.values == angles | quaternion | {"status": 5}
    assert update_of(words, ANGLES).values == angles
    assert got.flag_names == ("field_used", "restart", "inertial_fault", "beyond")


def test_formats_are_those_of_the_filters() -> None:
    for number, name in enumerate(FILTERS):
        program = estimator(name).compile()
        frac = {
            n: program.values[k].frac
            for n, k in zip(program.output_names, program.outputs, strict=True)
        }
        assert tuple(frac) == OUTPUTS and frac == FORMATS[number]
    assert len(FORMATS) == len(FILTERS)
