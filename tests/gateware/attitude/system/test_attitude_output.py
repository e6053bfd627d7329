"""Outputs of the attitude system: words, frames, text."""

import math
import random
from collections.abc import Callable

import pytest
from amaranth.hdl import Module
from amaranth.lib import wiring
from hypothesis import given
from hypothesis import strategies as st

from boresight.gateware.attitude.bus.results import Results
from boresight.gateware.attitude.system.attitude_frame import (
    FORMATS,
    OUTPUTS,
    WORDS,
    Attitude,
    angle_text,
    attitude_of,
    parse_line,
    text_line,
)
from boresight.gateware.attitude.system.attitude_output import AttitudeOutput, OutputMode
from boresight.gateware.attitude.system.attitude_text import LINE, AngleDigits, Op
from boresight.gateware.attitude.system.interface import Place
from boresight.gateware.boards.frames import Kind
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
        self.results = Results(word=32, read_cycles=self.dut.read_cycles)
        self.bodies: list[bytes] = []
        self.raw: list[bool] = []
        self.sent = self.skipped = 0
        self.top = Module()
        self.top.submodules += [self.results, self.dut]
        wiring.connect(self.top, self.dut.port, self.results.ports[1])

    async def update(self, ctx, words: list[int], pause: int = 0) -> None:
        """Write an update, a word a cycle; ``words`` in the order of a frame."""
        results = self.results
        await pulse(ctx, results.begin)
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
                        self.raw.append(bool(payload.raw))
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
        ctx.set(bench.dut.mode, OutputMode.BINARY)
        for _ in range(12):
            words, flags = random_update(rng), rng.getrandbits(8)
            ctx.set(bench.dut.flags, flags)
            await bench.update(ctx, words, pause=300)
            wanted.append(body_of(with_flags(words, flags)))

    bench.run(test, stalls=stalls)
    assert bench.bodies == wanted and not any(bench.raw)
    assert (bench.sent, bench.skipped) == (12, 0)


@pytest.mark.parametrize("most", [8, 9, 16])
def test_frames_of_any_length(most: int) -> None:
    """As long as the update that is sent has outputs, whatever comes meanwhile."""
    bench, rng, wanted = Bench(AttitudeOutput(text=False, outputs=most)), random.Random(4), []

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


@READS
def test_lines(stalls: float, reads: int) -> None:
    bench, rng, wanted = Bench(AttitudeOutput(read_cycles=reads)), random.Random(2), []
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
    bench, rng, updates = Bench(), random.Random(3), []

    async def test(ctx):
        ctx.set(bench.dut.mode, mode)
        for k in range(120):
            words = random_update(rng)
            updates.append(words)
            await bench.update(ctx, words, pause=k % 3)
        await clock.pause(ctx, 3000)

    bench.run(test, stalls=0.8)
    as_sent = [text_line(w).encode() if mode == OutputMode.TEXT else body_of(w) for w in updates]
    places = [as_sent.index(body) for body in bench.bodies]
    assert places == sorted(set(places)) and places[0] == 0 and len(places) >= 4
    assert bench.sent == len(places) and bench.sent + bench.skipped == len(updates)


@pytest.mark.parametrize("divider, every", [(0, 1), (1, 1), (2, 2), (7, 7)])
def test_divider(divider: int, every: int) -> None:
    bench, updates = Bench(), []

    async def test(ctx):
        ctx.set(bench.dut.mode, OutputMode.BINARY)
        ctx.set(bench.dut.divider, divider)
        for k in range(30):
            updates.append([k] * PLACES)
            await bench.update(ctx, updates[-1], pause=200)

    bench.run(test)
    assert bench.bodies == [body_of(w) for w in updates[::every]]


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


# -- frames and lines in software -----------------------------------------------------------------

WORD = st.integers(-HALF, HALF - 1)


@pytest.mark.parametrize(
    "value, text",
    [
        (0, "+000.00"),
        (HALF - 1, "+180.00"),
        (-HALF, "-180.00"),
        (-1, "-000.00"),
        (HALF // 2, "+090.00"),
        (-HALF // 180, "-001.00"),
        # half a hundredth is 59652.3 words
        (59_652, "+000.00"),
        (59_653, "+000.01"),
        (-59_652, "-000.00"),
        (-59_653, "-000.01"),
    ],
)
def test_known_angles(value: int, text: str) -> None:
    assert angle_text(value) == text


@given(WORD)
def test_angles_are_rounded_to_the_nearest(value: int) -> None:
    exact = value * 180 / HALF
    assert abs(float(angle_text(value)) - exact) <= 0.005 + 1e-12


def test_halves_go_away_from_zero() -> None:
    # 36000 n / 2^32 = k + 1/2 at n = 2^26 (2 m + 1) / 1125 only if 1125 divides 2 m + 1
    half = 2**26 * 1125 // 1125
    assert half * 36_000 % 2**32 == 2**31
    assert (angle_text(half), angle_text(-half)) == ("+005.63", "-005.63")  # 5.625


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
    got = attitude_of(words)
    assert got == Attitude(
        number=0xFFFE,
        flags=0x8128,
        stamp=0xFFFF_FFFF,
        pitch=90.0,
        roll=-45.0,
        heading=-180.0,
        quaternion=(1.0, 0.0, -0.5, 2.0**-29),
        status=5,
    )
    assert attitude_of(words, {0: (30, 22)}).status == 10
    assert attitude_of(words, {1: (30, 22)}).status is attitude_of(words, {}).quaternion is None
    assert got.filter == 0
    assert got.flag_names == ("field_used", "restart", "inertial_fault")
    with pytest.raises(ValueError, match=r"^words must be 10, not 9$"):
        attitude_of(words[:-1])


@given(st.lists(WORD, min_size=len(WORDS), max_size=len(WORDS)))
def test_lines_come_back(words: list[int]) -> None:
    line = text_line(words)
    assert len(line) == 39 and line.endswith("\r\n")
    got, exact = parse_line(line), attitude_of(words)
    assert (got.number, got.flags) == (exact.number, exact.flags)
    if got.filter in FORMATS:
        bits = FORMATS[got.filter][1]
        assert got.status == exact.status & (1 << 32 - bits) - 1
    else:
        assert got.status is None
    for name in ("heading", "pitch", "roll"):
        assert math.isclose(getattr(got, name), getattr(exact, name), abs_tol=0.005_000_1)


@pytest.mark.parametrize(
    "line",
    [
        "",
        "+001.00 +002.00 +003.00 0001 0000",
        "+001.00 +002.00 +003.00 0001 0000 00G",
        "001.00 +002.00 +003.00 0001 0000 000",
        "+001,00 +002.00 +003.00 0001 0000 000",
        "+001.00 +002.00 +003.00 0001 0000 000 ",
        "+001.00  +002.00 +003.00 0001 0000 000",
        "+0a1.00 +002.00 +003.00 0001 0000 000",
        "+001.00 +002.00 +003.00 0001 0000 00a",
    ],
)
def test_other_lines_are_none(line: str) -> None:
    assert parse_line(line) is None
    assert parse_line("+001.00 -002.00 +003.00 0001 0000 00A") == Attitude(
        number=1, heading=1.0, pitch=-2.0, roll=3.0, flags=0, status=1
    )


def test_formats_are_those_of_the_filters() -> None:
    for number, name in enumerate(FILTERS):
        program = estimator(name).compile()
        frac = {
            n: program.values[k].frac
            for n, k in zip(program.output_names, program.outputs, strict=True)
        }
        assert tuple(frac) == OUTPUTS
        assert {frac[n] for n in ("pitch", "roll", "heading")} == {31}
        assert {frac[n] for n in ("qw", "qx", "qy", "qz")} == {FORMATS[number][0]}
        assert frac["status"] == FORMATS[number][1] >= 20
    assert len(FORMATS) == len(FILTERS)


# --------------------------------------------------------------------------------------------------
# digits of an angle against whole-number arithmetic; the places of the line are the software's

#: Words around which digits, signs and roundings change, besides random ones.
EDGES = (0, 1, -1, HALF - 1, -HALF, 1 - HALF, HALF // 2, -HALF // 2, 59_652, 59_653, -59_653)


async def shift(ctx, dut: AngleDigits, word: int) -> None:
    """Start, then the 32 bits."""
    await pulse(ctx, dut.start)
    ctx.set(dut.negative, word < 0)
    ctx.set(dut.shift, 1)
    for k in range(32):
        ctx.set(dut.bit, word >> k & 1)
        ctx.set(dut.last, k == 31)
        await ctx.tick()
    ctx.set(dut.shift, 0)


async def digits_of(ctx, dut: AngleDigits, word: int) -> str:
    """Then each power of ten as often as it can be taken away, and once more."""
    await shift(ctx, dut, word)
    text = ""
    for power in range(5):
        ctx.set(dut.power, power)
        await ctx.tick()  # not asked to take it away
        ctx.set(dut.subtract, 1)
        digit, possible = 0, True
        while possible:
            _, _, possible = await ctx.tick().sample(dut.possible)
            digit += possible
            assert digit < 10
        ctx.set(dut.subtract, 0)
        text += str(digit)
    return text


def test_digits(simulate) -> None:
    dut, rng = AngleDigits(), random.Random(1)

    async def bench(ctx):
        for word in (*EDGES, *(rng.randrange(-HALF, HALF) for _ in range(150))):
            digits = await digits_of(ctx, dut, word)
            sign = "-" if word < 0 else "+"
            assert f"{sign}{digits[:3]}.{digits[3:]}" == angle_text(word), word

    simulate(dut, bench)


def test_an_angle_forgets_the_one_before(simulate) -> None:
    """What was left of it would make a whole hundredth of one that lacks almost nothing."""
    dut = AngleDigits()
    word = pow(36_000 // 32, -1, 1 << 27) * (HALF // 32 - 1) % (1 << 27)
    assert (word * 36_000 + HALF) % (1 << 32) == (1 << 32) - 32

    async def bench(ctx):
        for before in (HALF - 1, -1 << 30):
            await shift(ctx, dut, before)
            digits = await digits_of(ctx, dut, word)
            assert f"+{digits[:3]}.{digits[3:]}" == angle_text(word)

    simulate(dut, bench)


def test_places_of_the_line() -> None:
    kinds = {Op.HEX: "x", Op.SIGN: "s", Op.DIGIT: "d"}
    shape = "".join(kinds.get(place.op) or chr(place.code) for place in LINE)
    assert shape == "sddd.dd sddd.dd sddd.dd xxxx xxxx xxx\r\n"
