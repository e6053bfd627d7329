"""The SPI by itself: what its pins do in every cycle, what it makes of the answer."""

import random

import pytest
from amaranth.back import rtlil
from amaranth.hdl import ResetInserter, Signal
from amaranth.lib import wiring

from boresight.gateware.attitude.sensors.spi import SpiController, cycles_for
from tests.support.bench import pulse, run_bench

#: Half period, stall, setup (None: default).
SHAPES = [(3, 1, 97), (3, 10, 7), (4, 12, 1), (5, 200, 5), (7, 7, 30), (3, 600, None)]


class Slave:
    """Pins of a device: answers ``words`` with a delay, remembers what it heard and when."""

    def __init__(self, words: list[int], delay: int) -> None:
        self.words, self.delay = words, delay
        self.heard: list[int] = []
        self.low: list[int] = []  # lengths of all halves of sclk within frames
        self.high: list[int] = []
        self.setups: list[int] = []
        self.stalls: list[int] = []
        self.glitches = 0

    async def run(self, ctx, dut) -> None:
        """Watch the pins in each cycle; drive miso ``delay`` cycles after the falling edge."""
        cs, sclk, since_cs, since_sclk, bits, word = 1, 1, 0, 0, 0, 0
        pending: list[tuple[int, int]] = []
        answer, number, now = 0, 0, 0
        while True:
            for due, bit in list(pending):
                if due <= now:
                    ctx.set(dut.miso, bit)
                    pending.remove((due, bit))
            # What comes after the right moment must not matter: noise before each bit.
            cs_now, sclk_now = ctx.get(dut.cs_n), ctx.get(dut.sclk)
            if cs and not cs_now:
                self.stalls.append(since_cs)
                since_cs, bits, word = 0, 0, 0
                answer = self.words[number % len(self.words)]
                number += 1
                assert sclk_now and sclk
            if sclk != sclk_now:
                assert not cs_now and not cs
                if not sclk_now:
                    if bits == 0:
                        self.setups.append(since_cs)
                    else:
                        self.high.append(since_sclk)
                    ctx.set(dut.miso, random.randrange(2))
                    pending.append((now + self.delay, answer >> (15 - bits) & 1))
                else:
                    self.low.append(since_sclk)
                    word = word << 1 | ctx.get(dut.mosi)
                    bits += 1
                since_sclk = 0
            if not cs and cs_now:
                self.high.append(since_sclk)
                assert bits == 16
                self.heard.append(word)
                since_cs = 0
            cs, sclk = cs_now, sclk_now
            await ctx.tick()
            since_cs += 1
            since_sclk += 1
            now += 1


def exchange(dut, commands: list[int], slave: Slave, gaps: list[int]) -> list[tuple[int, int, int]]:
    """Frames: (cycle taken, cycle of the answer, answer)."""
    out: list[list[int]] = []
    now = 0

    async def bench(ctx):
        nonlocal now
        for word, gap in zip(commands, gaps, strict=True):
            for _ in range(gap):
                await ctx.tick()
                now += 1
            ctx.set(dut.i.payload, word)
            ctx.set(dut.i.valid, 1)
            while not ctx.get(dut.i.ready):
                assert ctx.get(dut.busy)
                await ctx.tick()
                now += 1
            taken = now
            assert not ctx.get(dut.busy)
            await ctx.tick()
            now += 1
            ctx.set(dut.i.valid, 0)
            ctx.set(dut.i.payload, random.randrange(1 << 16))
            while not ctx.get(dut.o_valid):
                assert not ctx.get(dut.cs_n)
                await ctx.tick()
                now += 1
            assert ctx.get(dut.cs_n)
            out.append((taken, now, ctx.get(dut.o_data)))
            await ctx.tick()
            now += 1
            assert not ctx.get(dut.o_valid)

    async def watch(ctx):
        await slave.run(ctx, dut)

    run_bench(dut, bench, background=[watch])
    return [tuple(each) for each in out]


@pytest.mark.parametrize("half, stall, setup", SHAPES)
@pytest.mark.parametrize("late", [False, True])
def test_words_and_timing(half: int, stall: int, setup: int | None, late: bool) -> None:
    random.seed(half * stall)
    dut = SpiController(half_cycles=half, stall_cycles=stall, setup_cycles=setup)
    count = 8
    commands = [0x8000, 0x0001, 0xFFFF, *(random.randrange(1 << 16) for _ in range(count - 3))]
    answers = [0x0001, 0x8000, 0x0000, *(random.randrange(1 << 16) for _ in range(count - 3))]
    slave = Slave(answers, dut.answer_cycles if late else 1)
    gaps = [0 if k % 2 else random.randrange(2 * dut.frame_cycles) for k in range(count)]
    frames = exchange(dut, commands, slave, gaps)
    assert slave.heard == commands
    assert [word for _, _, word in frames] == answers
    assert all(answer - taken == dut.answer_latency for taken, answer, _ in frames)
    assert set(slave.low) == set(slave.high) == {half}
    assert set(slave.setups) == {dut.setup_cycles} and dut.setup_cycles >= (setup or half)
    # The first pause is the one after power-up.
    assert min(slave.stalls[1:]) == dut.stall_cycles > stall
    errors = [b[0] - a[0] for a, b in zip(frames, frames[1:], strict=False)]
    assert min(errors) == dut.frame_cycles


def test_an_answer_that_is_too_late_is_not_heard() -> None:
    random.seed(1)
    dut = SpiController(half_cycles=4, stall_cycles=4)
    words = [random.randrange(1 << 16) for _ in range(8)]
    slave = Slave(words, dut.answer_cycles + 1)
    frames = exchange(dut, words, slave, [0] * 8)
    assert [word for _, _, word in frames] != words


@pytest.mark.parametrize("half, stall", [(3, 1), (3, 40), (5, 17)])
def test_reset_keeps_the_stall(half: int, stall: int) -> None:
    """A reset at any moment of a frame: the next frame is whole, the pause before it too."""
    spi = SpiController(half_cycles=half, stall_cycles=stall)
    reset = Signal()
    dut = ResetInserter(reset)(spi)
    random.seed(stall)

    async def bench(ctx):
        ctx.set(spi.i.valid, 1)
        for _ in range(25):
            for _ in range(random.randrange(1, spi.frame_cycles)):
                await ctx.tick()
            await pulse(ctx, reset)
            assert ctx.get(spi.cs_n) and ctx.get(spi.sclk)
            pause = 0
            while ctx.get(spi.cs_n):
                assert ctx.get(spi.sclk)
                await ctx.tick()
                pause += 1
            assert pause == spi.stall_cycles > stall
            length = edges = 0
            before = 1
            while not ctx.get(spi.cs_n):
                edges += before != ctx.get(spi.sclk)
                before = ctx.get(spi.sclk)
                await ctx.tick()
                length += 1
            assert edges == 32 and length == spi.answer_latency - 1

    run_bench(dut, bench)


@pytest.mark.parametrize(
    "stall, setup, bits", [(1, 1, 7), (63, 32, 7), (64, 32, 8), (1, 33, 8), (127, 1, 8)]
)
def test_the_counter_is_no_wider_than_a_frame_needs(stall: int, setup: int, bits: int) -> None:
    """Above its highest bit the half periods of the setup and 32, below it those of the stall."""
    dut = SpiController(half_cycles=3, stall_cycles=3 * stall, setup_cycles=3 * setup)
    assert f"wire width {bits} \\left\n" in rtlil.convert(dut)


def test_is_a_component() -> None:
    dut = SpiController(half_cycles=50, stall_cycles=1600)
    assert isinstance(dut, wiring.Component)
    assert (dut.setup_cycles, dut.stall_cycles, dut.frame_cycles) == (50, 1601, 3251)


@pytest.mark.parametrize(
    "options, message",
    [
        ({"half_cycles": 2}, r"^half_cycles must be an integer from 3 on, not 2$"),
        ({"half_cycles": True}, r"^half_cycles must be an integer from 3 on, not True$"),
        ({"stall_cycles": 0}, r"^stall_cycles must be an integer from 1 on, not 0$"),
        ({"stall_cycles": 1.5}, r"^stall_cycles must be an integer from 1 on, not 1\.5$"),
        ({"setup_cycles": 0}, r"^setup_cycles must be an integer from 1 on, not 0$"),
    ],
)
def test_parameters_are_checked(options, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        SpiController(**{"half_cycles": 3, "stall_cycles": 1, **options})


@pytest.mark.parametrize(
    "clock, seconds, cycles",
    [
        (100e6, 16e-6, 1600),
        (100e6, 9e-6, 900),
        (50e6, 0.5e-6, 25),
        (3e6, 1e-6, 3),
        (100e6, 1.001e-8, 2),
        (1e6, 1e-9, 1),
    ],
)
def test_cycles(clock: float, seconds: float, cycles: int) -> None:
    assert cycles_for(clock_hz=clock, seconds=seconds) == cycles


@pytest.mark.parametrize(
    "options",
    [
        {"clock_hz": 0, "seconds": 1},
        {"clock_hz": 1, "seconds": -1},
        {"clock_hz": "1", "seconds": 1},
        {"clock_hz": float("inf"), "seconds": 1},
        {"clock_hz": 1, "seconds": float("nan")},
        {"clock_hz": True, "seconds": 1},
    ],
)
def test_cycles_are_checked(options) -> None:
    with pytest.raises(ValueError, match=r"^(clock_hz|seconds) must be a positive number, not "):
        cycles_for(**options)
