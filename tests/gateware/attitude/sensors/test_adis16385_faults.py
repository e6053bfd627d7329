"""The reader of the inertial sensor and every fault of the device: seen in time, survived."""

import random

import pytest

from boresight.gateware.attitude.sensors.adis16385 import CHECKED
from tests.support.attitude.devices.adis16385_bench import (
    PERIOD,
    Happened,
    ReaderBench,
    scaled_reader,
)

#: Settings other than the device's defaults, so that forgetting them shows.
SETTINGS = (0x0006, 0x0001, 0x0102)
FROM, TO = 30_500, 110_700
READER = scaled_reader()
#: Most cycles until a fault that spoils replies has spoilt a check; without an edge until it is
#: missing; from a good sample to a restart; from the end of a fault to the next good sample.
CHECK = PERIOD + READER.burst_cycles
TIMEOUT = (READER.timeout_ticks + 1) * READER.tick_cycles + 1
DETECTION = READER.burst_cycles + READER.bad_limit * TIMEOUT + 8
RECOVERY = (
    2 * (READER.start_cycles + READER.burst_cycles)
    + READER.bad_limit * max(TIMEOUT, PERIOD)
    + (len(CHECKED) + 1) * PERIOD
)
#: Fault: its event, its flag, most cycles from its begin to the event.
FAULTS = {
    "wrong_identity": ("identity_error", "identity_error", CHECK + (len(CHECKED) - 1) * PERIOD),
    "absent": ("no_data_ready", "no_data_ready", TIMEOUT + READER.burst_cycles),
    "stuck_low": ("config_error", "config_error", CHECK),
    "stuck_high": ("config_error", "config_error", CHECK),
    "no_data_ready": ("no_data_ready", "no_data_ready", TIMEOUT + READER.burst_cycles),
    "fast_data_ready": ("overrun", "overrun", PERIOD),
    "alarm": ("alarm", "alarm", CHECK),
    "over_range": ("over_range", "over_range", CHECK),
    "bit_flips": ("config_error", "config_error", CHECK),
    "lost_settings": ("config_error", "config_error", CHECK + (len(CHECKED) - 1) * PERIOD),
    "link_failure": ("link_error", "link_error", CHECK),
}
#: Faults with which samples count.
HARMLESS = {"fast_data_ready", "alarm", "over_range"}
#: Faults that lead to a new start.
RESTARTS = set(FAULTS) - HARMLESS


@pytest.fixture(scope="module")
def bench() -> ReaderBench:
    return ReaderBench(READER)


def well_again(happened: Happened, since: int) -> None:
    """From some time on, at most `RECOVERY` later, all is as if nothing had been."""
    wrong = [t for t, names in happened.events if names - {"sample"}]
    assert max(wrong) <= since + RECOVERY
    good = [s for s in happened.samples if s.time > max(wrong) + PERIOD]
    assert len(good) >= 3, "the run is too short to tell"
    assert good[0].time <= since + RECOVERY + PERIOD
    assert [s.number - good[0].number for s in good] == list(range(len(good)))
    assert happened.flags[-1][1] == {"running"}
    assert not happened.violations, happened.complaints


def true(happened: Happened) -> bool:
    """Every sample's words are those of the log's line; rates of +-75 deg/s are quarters."""
    return all(
        s.words[:6] == tuple((100 * s.line + n) / (4 if n < 3 else 1) for n in range(6))
        for s in happened.samples
    )


@pytest.mark.parametrize("name", FAULTS)
def test_seen_and_survived(bench: ReaderBench, name: str) -> None:
    event, flag, bound = FAULTS[name]
    happened = bench.run(cycles=TO + 110_000, fault=(name, FROM, TO), settings=SETTINGS)
    seen = min(t for t in happened.times(event) if t >= FROM)
    assert seen - FROM <= bound
    # The overrun belongs to the sample that it happened to.
    assert flag in happened.flags_at(seen + (READER.burst_cycles if flag == "overrun" else 0))
    restarts = [t for t in happened.times("restart") if t >= FROM]
    assert bool(restarts) == (name in RESTARTS)
    if name in RESTARTS:
        assert restarts[0] <= FROM + max(bound + READER.bad_limit * PERIOD, DETECTION)
        assert true(happened)
        # While the fault lasts the reader tries again and again; in vain.
        errors = [b - a for a, b in zip(restarts, restarts[1:], strict=False) if b < TO]
        assert max(errors, default=0) <= READER.start_cycles + DETECTION
    else:
        assert sum(FROM < s.time < TO for s in happened.samples) >= (TO - FROM) // PERIOD
    well_again(happened, TO)


def test_so_many_bad_samples_in_a_row_are_a_new_start(bench: ReaderBench) -> None:
    limit = READER.bad_limit
    happened = bench.run(cycles=TO, fault=("link_failure", FROM, TO), settings=SETTINGS)
    assert happened.times("sample")[-1] < FROM + PERIOD, "good samples came before"
    first = next(t for t in happened.times("restart") if t >= FROM)
    bad = [t for t in happened.times("link_error") if FROM <= t <= first]
    assert len(bad) == limit and first - bad[-1] < PERIOD


def test_writes_without_effect(bench: ReaderBench) -> None:
    """Settings that do not stay: no sample, and a start again and again, until they do."""
    happened = bench.run(cycles=180_000, fault=("ignore_writes", 0, 70_000), settings=SETTINGS)
    assert len(happened.times("config_error")) == len(happened.times("restart")) >= 5
    assert min(s.time for s in happened.samples) > 70_000
    well_again(happened, 70_000)


@pytest.mark.parametrize("name", ["stuck_low", "stuck_high", "absent"])
def test_no_wrong_sample_wherever_a_fault_begins_and_ends(bench: ReaderBench, name: str) -> None:
    """A fault that is there at one check at least lets no wrong word through."""
    random.seed(name)
    for _ in range(25):
        begin = random.randrange(30_000, 34_000)
        end = begin + random.randrange(PERIOD, 5 * PERIOD)
        happened = bench.run(cycles=end + 3 * PERIOD, fault=(name, begin, end), settings=SETTINGS)
        assert true(happened)


def test_a_single_wrong_check_costs_two_samples_and_no_start(bench: ReaderBench) -> None:
    happened = bench.run(samples=30, faults=[(14, 14, "stuck_low")], settings=SETTINGS)
    assert not happened.times("restart")
    assert len(happened.times("config_error")) + len(happened.times("identity_error")) == 1
    assert len(happened.times("link_error")) == 1
    numbers = [s.number for s in happened.samples]
    assert numbers[-1] + 1 - len(numbers) == 2


def test_overrun_marks_the_sample_it_belongs_to(bench: ReaderBench) -> None:
    happened = bench.run(samples=30, faults=[(10, 12, "fast_data_ready")])
    marked = [s.number for s in happened.samples if "overrun" in happened.flags_at(s.time)]
    assert marked and not happened.times("restart")
    steps = {
        b.number: b.number - a.number
        for a, b in zip(happened.samples, happened.samples[1:], strict=False)
    }
    # Whoever comes after a skipped edge is marked or follows a marked one.
    assert all(
        number in marked or number - steps[number] in marked
        for number, step in steps.items()
        if step > 1
    )
    assert (
        happened.samples[-1].number
        == len(
            [
                e
                for e in happened.edges
                if happened.samples[0].stamp - 3 < e < happened.samples[-1].stamp
            ]
        )
        - 1
    )
