"""Hostile input is as hostile as it says."""

from collections import Counter

from tests.support.devices.hmr3300_grammar import BROKEN, PAUSE, events_of
from tests.support.devices.hmr3300_symbols import hostile_bytes, hostile_line, noise


def test_bytes_reach_every_kind_of_line() -> None:
    symbols = hostile_bytes(20_000, seed=3, broken=0.01, pauses=0.01)
    assert len(symbols) == 20_000 and symbols[0] == symbols[-1] == 10
    kinds = Counter(event.kind for event in events_of(symbols))
    assert min(kinds[k] for k in ("heading", "counts", "rejected", "framing")) > 50
    assert kinds["invalid"] > 3
    assert set(symbols) == {*range(256), BROKEN, PAUSE}
    assert symbols == hostile_bytes(20_000, seed=3, broken=0.01, pauses=0.01)
    assert symbols != hostile_bytes(20_000, seed=4, broken=0.01, pauses=0.01)


def test_limits_are_reached_from_both_sides() -> None:
    values = {
        event.values[0]
        for event in events_of(hostile_bytes(200_000, seed=1))
        if event.kind == "counts"
    }
    assert {32_767, -32_767} <= values
    values = {
        v
        for event in events_of(hostile_bytes(50_000, seed=1))
        if event.kind == "heading"
        for v in event.values[1:]
    }
    assert {900, -900} <= values


def test_line_without_faults_says_its_bytes() -> None:
    levels = hostile_line([0x55], divisor=100, glitch=0, seed=1)
    assert sum(cycles for _, cycles in levels) > 1000
    assert all(0 <= a[0] <= 1 and a[0] != b[0] for a, b in zip(levels, levels[1:], strict=False))


def test_glitches_are_short() -> None:
    short = [
        cycles
        for _, cycles in hostile_line([0x55] * 300, divisor=100, glitch=5, seed=1)
        if cycles <= 5
    ]
    assert len(short) > 100


def test_noise_lasts_as_long_as_asked() -> None:
    levels = noise(10_000, seed=1, longest=50)
    assert sum(cycles for _, cycles in levels) == 10_000
    assert max(cycles for _, cycles in levels) <= 50
