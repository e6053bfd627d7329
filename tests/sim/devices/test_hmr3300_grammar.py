"""The model that the parser is measured by, on lines whose meaning is plain."""

import pytest

from tests.support.devices.hmr3300_grammar import (
    BROKEN,
    PAUSE,
    Event,
    counts_sentence,
    events_of,
    heading_sentence,
)


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
