"""The reader of the inertial sensor with the device at its pins: samples, settings, parameters."""

import random

import numpy as np
import pytest

from boresight.gateware.attitude.sensors.adis16385 import (
    CONFIG_FRAMES,
    RUN_FRAMES,
    TEST_BITS,
    Adis16385,
    Timing,
)
from boresight.gateware.attitude.sensors.spi import HALF_MIN
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
    edges = {edge + 2: edge for edge in happened.edges}
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
        # Bits of a self-test are those read after one.
        before, now = (0 if bit in TEST_BITS else row[7] for row in log[k : k + 2])
        temperature = -k
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


@pytest.mark.parametrize("sens_avg, scale", [(0x0402, 1), (0x0202, 2), (0x0102, 4), (0x0302, 1)])
def test_rates_have_one_unit_in_every_range(bench: ReaderBench, sens_avg: int, scale: int) -> None:
    """Full scale is 24000 counts of the device in each range; the accelerometer has one range."""
    counts = [24000, -23999, 1, -1, 20000, 32767, 2047, 0]
    happened = bench.run(samples=4, log=[counts] * 9, settings=(0x0006, 0x0001, sens_avg))
    wanted = (*(count / scale for count in counts[:3]), *counts[3:])
    assert [s.words for s in happened.samples] == [wanted] * 4
    assert "over_range" in happened.flags[-1][1]


@pytest.mark.parametrize("offset", range(0, PERIOD, 390))
def test_a_command_is_sent_after_a_sample(bench: ReaderBench, offset: int) -> None:
    """Whole, at any time; no sample is lost, and temperatures stay those of the sample before."""
    log = [[k, 0, 0, 0, 0, 0, k, 0] for k in range(60)]
    at, offset_register = 30_000 + offset, 0x9A12
    happened = bench.run(samples=20, log=log, command=(at, offset_register))
    assert happened.violations == 0 and {n for _, names in happened.events for n in names} == {
        "sample"
    }
    assert [s.number for s in happened.samples] == list(range(20))
    assert all(s.words[6] == s.words[0] - 1 for s in happened.samples)
    assert len(happened.frames) == CONFIG_FRAMES + 20 * RUN_FRAMES + 2
    wrong_setting = bench.run(cycles=at + 6 * PERIOD, command=(at, 0xB803))
    assert at < wrong_setting.times("config_error")[0] <= at + 5 * PERIOD
    reset = bench.run(cycles=at + 20 * PERIOD, command=(at, 0xBE80), settings=(6, 1, 0x0405))
    assert at < reset.times("config_error")[0] and reset.samples[-1].time > at + 18 * PERIOD


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


@pytest.mark.parametrize("failing", [0, 1 << 5 | 1 << 12, 0xFC20])
def test_self_test_at_the_first_start_and_on_request(failing: int) -> None:
    """What of it fails is told; the sensor is used. A start after a fault has none."""
    bench, at = ReaderBench(scaled_reader(self_test_s=2e-3)), 60_000
    happened = bench.run(cycles=120_000, restart=at, self_test=failing, faults=[(8, 26, "absent")])
    mask = sum(1 << bit for bit in TEST_BITS)
    told = [(time, diag & mask) for time, _, diag in happened.latest]
    first = happened.samples[0].time
    assert {bits for time, bits in told if first < time < 30_000} <= {failing}
    assert told[0][1] == failing if failing else True
    assert len(happened.times("restart")) == 2  # of the fault, and the one asked for
    frames = [t for t in happened.frames if at < t < at + 20_000]
    assert np.diff(frames).max() >= 2000  # the wait of the second self-test
    assert told[-1][1] == failing
    assert happened.violations == 0 and happened.samples[-1].time > 118_000 - PERIOD


def test_slow_device_with_a_clock_of_its_own() -> None:
    """Answers as late as is allowed, samples 2 % faster than they should be; five may be bad."""
    reader = scaled_reader(bad_limit=5)
    # The model's bit is on the pin one cycle later than it says.
    delay = 2 * reader.spi.half_cycles - HALF_MIN - 1
    bench = ReaderBench(reader, parameters={"DOUT_DELAY": delay, "PPM": 20_000})
    missing = bench.run(cycles=150_000, fault=("no_data_ready", 20_000, 1 << 30))
    assert missing.times("no_data_ready")[4::5] == missing.times("restart") != []
    happened = bench.run(samples=20)
    assert len(happened.samples) == 20 and not happened.times("restart")
    stamps = [s.stamp for s in happened.samples]
    assert (stamps[-1] - stamps[0]) / 19 == pytest.approx(PERIOD / 1.02, abs=1)


def test_figures_at_full_speed() -> None:
    """9 frames of 32.5 us each; the stall after the last one is not waited for."""
    reader = Adis16385(clock_hz=100e6)
    assert reader.burst_cycles == 3 + 9 * 3251 - 1600 + 2
    assert reader.spi.half_cycles == 50 and reader.spi.stall_cycles == 1601
    assert 4 / 1024 < reader.timeout_ticks * reader.tick_cycles / 100e6 < 5 / 1024
    assert reader.startup_ticks * reader.tick_cycles >= 30e6
    with pytest.raises(ValueError, match=r"^period_s must be longer than a burst \(0.000"):
        Adis16385(clock_hz=100e6, timing=Timing(period_s=2e-4))
