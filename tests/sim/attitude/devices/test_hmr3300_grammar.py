"""Hostile input for the compass, and the model that reads it."""

from collections import Counter

import pytest

from tests.support.attitude.devices.hmr3300_grammar import (
    BROKEN,
    PAUSE,
    Event,
    counts_sentence,
    events_of,
    heading_sentence,
)
from tests.support.attitude.devices.hmr3300_symbols import hostile_bytes, hostile_line, noise

# -- the model that the parser is measured by, on lines whose meaning is plain --------------------


def test_sentences_are_those_of_the_datasheet() -> None:
    assert heading_sentence(1234, 186, -5) == b"123.4, 18.6, -0.5\r\n"
    assert counts_sentence(1256, -234, -1894) == b"1256, -234, -1894\r\n"


@pytest.mark.parametrize(
    "symbols, wanted",
    [
        (b"\n123.4, 18.6, -0.5\r\n", [Event("heading", (1234, 186, -5))]),
        (b"\n1256, -234, -1894\r\n", [Event("counts", (1256, -234, -1894))]),
        (b"123.4, 18.6, -0.5\r\n", []),
        (b"\n1, 2, 3\r\n1, 2", [Event("counts", (1, 2, 3))]),
        (
            b"\n360.0, 0.0, 0.0\r\n#I\r\n\r\n",
            [Event("rejected"), Event("invalid"), Event("rejected")],
        ),
        ([10, *b"1, 2, ", BROKEN, *b"3\r\n"], [Event("framing"), Event("rejected")]),
        ([10, PAUSE, *b"1, 2, 3\r\n"], [Event("counts", (1, 2, 3))]),
        ([10, *b"1, 2, ", PAUSE, *b"3\r\n"], [Event("rejected")]),
        ([BROKEN, 10, BROKEN], [Event("framing"), Event("framing")]),
    ],
)
def test_events(symbols, wanted: list[Event]) -> None:
    assert list(events_of(symbols)) == wanted


def test_every_value_reads_as_it_was_written() -> None:
    for heading in range(0, 3600, 7):
        angles = heading, heading % 1801 - 900, 900 - heading % 1801
        assert list(events_of(b"\n" + heading_sentence(*angles))) == [Event("heading", angles)]


# -- hostile input is as hostile as it says -------------------------------------------------------


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
