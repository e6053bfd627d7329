"""What a simulation of the board is given: a motion, and values that no sensor gives."""

from __future__ import annotations

import pytest

from boresight.model.errors import InputError
from boresight.model.words.program import Kind, Value
from boresight.sim.attitude.system import feed_words

REGISTERS = {"wind": Value("wind", Kind.INPUT, 28, -4.0, 4.0, "declared", unit="m/s")}


def test_words_of_given_values() -> None:
    assert feed_words(REGISTERS, {"wind": -1.5}) == {"wind": -3 * 2**27}
    assert feed_words(REGISTERS, {"wind": 4.0}) == {"wind": 2**30}


@pytest.mark.parametrize(
    "registers, values, message",
    [
        (REGISTERS, {"gust": 0.0}, "feed gust: wanted an input without a sensor: wind, found"),
        ({}, {"gust": 0.0}, "feed gust: wanted an input without a sensor: none declared, "),
        (REGISTERS, {"wind": 4.25}, "feed wind: wanted -4 to 4 m/s, found 4.25; choose a value"),
        (REGISTERS, {"wind": float("nan")}, "feed wind: wanted -4 to 4 m/s, found nan; "),
        (REGISTERS, {"wind": "x"}, "feed wind: wanted -4 to 4 m/s, found 'x'; "),
    ],
)
def test_refused(registers, values, message) -> None:
    with pytest.raises(InputError) as refused:
        feed_words(registers, values)
    assert str(refused.value).startswith(message)
