"""The reader of the inertial sensor with the device at its pins: samples, settings, parameters."""

import itertools
import random

import pytest
from amaranth.hdl import Fragment

from boresight.gateware.attitude.sensors import adis16385
from boresight.gateware.attitude.sensors.adis16385 import Adis16385
from boresight.gateware.attitude.sensors.adis16385_frames import (
    CHECKED,
    CONFIG_FRAMES,
    IDENTITY,
    RUN_FRAMES,
    write,
)
from boresight.gateware.attitude.sensors.adis16385_setup import Timing
from boresight.gateware.attitude.sensors.spi import HALF_MIN
from boresight.gateware.verilog import to_verilog
from tests.support.attitude.devices.adis16385_bench import PERIOD, ReaderBench, scaled_reader


@pytest.fixture(scope="module")
def bench() -> ReaderBench:
    return ReaderBench()


def test_samples_are_those_of_the_log(bench: ReaderBench) -> None:
    """Every word, also the extreme ones; the temperature is as of the sample before."""
    random.seed(5)
    full = [-32768, 32767, -1, 0, *range(-3, 3)]
    log = [
        [random.choice([*full, random.randrange(-32768, 32768)]) for _ in range(6)]
        + [random.choice([-2048, 2047, -1, 0, random.randrange(-2048, 2048)]), 0]
        for _ in range(60)
    ]
    reader = bench.reader
    happened = bench.run(samples=50, log=log)
    assert happened.violations == 0 and not happened.complaints
    assert [s.line for s in happened.samples] == list(range(2, 52))
    for sample in happened.samples:
        now, before = log[sample.line - 1], log[sample.line - 2]
        assert sample.words == (*now[:6], before[6], 0)
    assert [s.number for s in happened.samples] == list(range(50))
    edges = {edge + reader.stamp_delay: edge for edge in happened.edges}
    for sample in happened.samples:
        assert sample.time - edges[sample.stamp] == reader.burst_cycles
    assert set(happened.times("sample")) == {s.time for s in happened.samples}
    assert not any(names - {"sample", "over_range"} for _, names in happened.events)
    assert len(happened.frames) == CONFIG_FRAMES + 50 * RUN_FRAMES
    assert happened.frames[-1] < happened.samples[-1].time


def test_over_range_is_exact(bench: ReaderBench) -> None:
    """From full scale on, either sign, gyro and accelerometer apart; temperature never."""
    limits = [24000] * 3 + [20000] * 3
    log, wanted = [[0] * 8], []
    for axis, limit in enumerate(limits):
        for value in (limit - 1, limit, limit + 1, 1 - limit, -limit, -limit - 1, 32767, -32768):
            log.append([value if k == axis else 0 for k in range(6)] + [2047, 0])
            wanted.append(not -limit < value < limit)
    happened = bench.run(samples=len(wanted), log=log)
    flagged = set(happened.times("over_range"))
    assert [s.time in flagged for s in happened.samples] == wanted
    assert [("over_range" in happened.flags_at(s.time)) for s in happened.samples] == wanted


@pytest.mark.parametrize("bit", range(16))
def test_bits_of_diag_stat(bench: ReaderBench, bit: int) -> None:
    """Every bit but the unused one raises the alarm; the one of the link drops the sample."""
    diag_stat = (1 << bit) - (1 << 16 if bit == 15 else 0)
    log = [[k] * 6 + [-k, diag_stat if k in (3, 4) else 0] for k in range(10)]
    happened = bench.run(samples=6, log=log)
    # The latest words: with the frame that brings them, also of samples that are dropped.
    reader, wanted = bench.reader, []
    ends = [e + reader.burst_cycles for e in happened.edges if e > happened.samples[0].stamp - 3]
    for k, end in enumerate(ends):
        temperature, before, now = -k, log[k][7], log[k + 1][7]
        wanted += [(end - 8 * reader.spi.frame_cycles, temperature, before)] if k else []
        wanted += [(end - reader.spi.frame_cycles, temperature, now)] if now != before else []
    assert happened.latest == [each for each in wanted if each[0] < happened.samples[-1].time]
    lines = [s.line for s in happened.samples]
    if bit == 3:
        assert lines == [2, 3, 6, 7, 8, 9]
        assert len(happened.times("link_error")) == 2 and not happened.times("alarm")
        assert [s.number for s in happened.samples] == [0, 1, 4, 5, 6, 7]
        return
    assert lines == [2, 3, 4, 5, 6, 7] and not happened.times("link_error")
    assert not happened.times("over_range")
    alarms = set(happened.times("alarm"))
    assert [s.line for s in happened.samples if s.time in alarms] == ([] if bit == 7 else [4, 5])
    assert [s.line for s in happened.samples if s.words[7]] == [4, 5]


def test_settings_are_written_and_kept(bench: ReaderBench) -> None:
    """Other settings come with a restart, and only with it."""
    settings = (0x0006, 0x0201, 0x0104)
    happened = bench.run(samples=12, settings=settings)
    assert happened.violations == 0
    assert not any(names - {"sample"} for _, names in happened.events)
    errors = [
        b.stamp - a.stamp for a, b in zip(happened.samples, happened.samples[1:], strict=False)
    ]
    assert set(errors) == {4 * PERIOD}  # decimation by 2**2


#: Waits of a few ticks of 256 cycles.
QUICK = {"startup_s": 1e-4, "reset_s": 1e-5, "period_s": 1.3e-3, "timeout_periods": 1}


async def answer_identity(ctx, dut: Adis16385, count: int) -> list[int]:
    """So many frames, bit by bit at the pins, of a device that answers each with its identity."""
    frames: list[int] = []
    bits, falls, before, cycle = "", 0, 1, 0
    while len(frames) < count:
        clock, idle = ctx.get(dut.sclk), ctx.get(dut.cs_n)
        if idle:
            frames += [int(word, 2) for word in [bits] if word]
            bits, falls = "", 0
        elif clock and not before:
            bits += str(ctx.get(dut.mosi))
        elif before and not clock:
            ctx.set(dut.miso, IDENTITY >> 15 - falls & 1)
            falls += 1
        before = clock
        cycle += 1
        ctx.set(dut.time, cycle)
        await ctx.tick()
    return frames


@pytest.mark.parametrize(
    "settings, driven",
    [
        ((0xFFFF, 0xFFFF, 0xFFFF), True),
        ((0x8001, 0x4002, 0x2004), False),
        ((0x1234, 0xA5C3, 0x8402), True),
    ],
)
def test_every_bit_of_the_settings_reaches_the_device(settings, driven: bool, simulate) -> None:
    """The frames that write them; those of the parameters while the members are not driven."""
    words = dict(zip(CHECKED[1:], settings, strict=True))
    ports = {name.lower(): word for name, word in words.items()}
    dut = scaled_reader(**QUICK, **({} if driven else ports))
    frames: list[int] = []

    async def bench(ctx):
        for name, word in ports.items() if driven else ():
            ctx.set(getattr(dut, name), word)
        frames.extend(await answer_identity(ctx, dut, 8))

    simulate(dut, bench)
    wanted = [
        write(name, byte, word >> 8 * byte & 0xFF)
        for name, word in words.items()
        for byte in (0, 1)
    ]
    assert frames[2:8] == wanted


def test_numbers_have_16_bits(simulate, monkeypatch) -> None:
    """The count of edges is set, since to count so many takes too long."""
    made, registers = [], adis16385._Registers
    monkeypatch.setattr(
        adis16385, "_Registers", lambda reader: made.append(registers(reader)) or made[0]
    )
    dut = scaled_reader(**QUICK, msc_ctrl=IDENTITY, smpl_prd=IDENTITY, sens_avg=IDENTITY)

    async def bench(ctx):
        await answer_identity(ctx, dut, CONFIG_FRAMES)
        await ctx.tick().repeat(dut.spi.stall_cycles)
        ctx.set(made[0].edges, 0xFFFF)
        ctx.set(dut.data_ready, 1)
        await ctx.tick().repeat(dut.stamp_delay + 1)
        assert ctx.get(dut.number) == 0xFFFF

    simulate(dut, bench)


def test_restart_while_the_device_starts_begins_with_a_reset(bench: ReaderBench) -> None:
    reader, at = bench.reader, 5000
    happened = bench.run(cycles=30_000, restart=at)
    assert len(happened.resets) == 3 and at < happened.resets[1] < at + 4
    assert 0 <= happened.samples[0].time - at - reader.start_cycles <= PERIOD + reader.burst_cycles


def test_restart_starts_over(bench: ReaderBench) -> None:
    at = 30_000
    reader = bench.reader
    happened = bench.run(cycles=60_000, restart=at)
    assert happened.times("restart") == [at + 1]
    assert len(happened.resets) == 3 and at < happened.resets[1] < at + 4
    # Each pulse ends with a tick; the first one begins with `time` at 0.
    first, low, high = happened.resets
    assert first - (reader.reset_ticks + 1) * reader.tick_cycles in range(4)
    assert 0 <= high - low - reader.reset_ticks * reader.tick_cycles <= reader.tick_cycles + 2
    again = next(s for s in happened.samples if s.time > at)
    assert "running" not in happened.flags_at(at + 2)
    running = next(t for t, names in happened.flags if t > at + 2 and "running" in names)
    assert running - at <= reader.start_cycles
    assert again.time <= running + PERIOD + reader.burst_cycles
    # Numbers go on: edges are counted while the reader runs.
    numbers = [s.number for s in happened.samples]
    assert numbers == sorted(set(numbers))


@pytest.mark.parametrize("decimation", [0, 1, 3])
def test_time_out_follows_the_rate(bench: ReaderBench, decimation: int) -> None:
    happened = bench.run(samples=6, settings=(6, decimation << 8 | 1, 0x402))
    assert not happened.times("no_data_ready") and not happened.times("restart")


@pytest.mark.parametrize("decimation", [0, 1, 2, 4, 8])
def test_time_out_to_the_tick(bench: ReaderBench, decimation: int) -> None:
    """Of a device that gives no sample at all: after the start's last frame, and then again."""
    reader = bench.reader
    least, most = (
        reader.timeout_ticks * reader.tick_cycles << decimation,
        reader.timeout_cycles(decimation),
    )
    happened = bench.run(
        cycles=reader.start_cycles + 2 * most,
        settings=(6, decimation << 8 | 1, 0x402),
        fault=("no_data_ready", 0, 1 << 30),
    )
    begin = [happened.frames[-1], *happened.times("no_data_ready")]
    assert len(begin) == 3
    assert all(least <= b - a <= most for a, b in itertools.pairwise(begin))


def test_slow_device_with_a_clock_of_its_own() -> None:
    """Answers as late as is allowed, samples 2 % faster than they should be; five may be bad."""
    reader = scaled_reader(bad_limit=5)
    # The model's bit is on the pin one cycle later than it says.
    bench = ReaderBench(
        reader, parameters={"DOUT_DELAY": reader.spi.answer_cycles - 1, "PPM": 20_000}
    )
    missing = bench.run(cycles=150_000, fault=("no_data_ready", 20_000, 1 << 30))
    assert missing.times("no_data_ready")[4::5] == missing.times("restart") != []
    happened = bench.run(samples=20)
    assert len(happened.samples) == 20 and not happened.times("restart")
    stamps = [s.stamp for s in happened.samples]
    assert (stamps[-1] - stamps[0]) / 19 == pytest.approx(PERIOD / 1.02, abs=1)


def test_figures_at_full_speed() -> None:
    """9 frames of 32.5 us each: a third of a period; the stall after the last one is not waited
    for."""
    reader = Adis16385(clock_hz=100e6)
    assert reader.hold_cycles == 1599
    assert reader.burst_cycles == 3 + 9 * 3251 - 1600 + 2
    assert reader.burst_cycles < 0.3 * 100e6 / 1024
    assert reader.spi.half_cycles == 50 and reader.spi.stall_cycles == 1601
    assert reader.timeout_ticks * reader.tick_cycles / 100e6 > 4 / 1024
    assert reader.timeout_cycles() / 100e6 < 5 / 1024
    assert reader.startup_ticks * reader.tick_cycles >= 30e6


@pytest.mark.parametrize("period", [1999, 2047, 2048, 2500])
def test_a_tick_is_a_quarter_of_the_time_out_or_up_to_half_of_that(period: int) -> None:
    reader = scaled_reader(period_s=period * 1e-6, timeout_periods=4)
    assert period / 2 < reader.tick_cycles <= period


def test_half_periods_are_no_shorter_than_the_controller_takes() -> None:
    assert scaled_reader(sclk_hz=1e6).spi.half_cycles == HALF_MIN


def test_a_period_is_longer_than_a_burst_and_a_stall() -> None:
    reader = scaled_reader()
    burst = reader.burst_cycles + reader.spi.stall_cycles
    scaled_reader(period_s=(burst + 1) * 1e-6)
    with pytest.raises(ValueError, match=r"^period_s must be longer than a burst "):
        scaled_reader(period_s=burst * 1e-6)


def test_no_wait_is_longer_than_the_time_tells() -> None:
    """Ticks are changes of bits of ``time``: beyond the highest there are no rarer ones."""
    reader = Adis16385(clock_hz=100e6, timing=Timing(period_s=0.1))
    assert reader.tick_bit + 12 > 31
    Fragment.get(reader, None)


def test_same_component_same_verilog() -> None:
    texts = [to_verilog(scaled_reader(), "adis16385", instances=False) for _ in range(2)]
    assert texts[0] == texts[1]


@pytest.mark.parametrize(
    "options, message",
    [
        ({"stall_s": 0}, r"^seconds must be a positive number, not 0$"),
        (
            {"period_s": 1e-3},
            r"^period_s must be longer than a burst \(0\.00114\d s "
            r"and a stall\), not 0\.001$",
        ),
    ],
)
def test_parameters_are_checked(options, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        scaled_reader(**options)
