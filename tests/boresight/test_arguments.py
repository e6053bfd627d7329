"""`boresight.arguments`: what is let through, to the last number, and how the rest is refused."""

from __future__ import annotations

import numpy as np
import pytest

from boresight.arguments import check_machine, check_number, check_optional, check_word
from boresight.model.errors import InputError

pytestmark = pytest.mark.pythons


@pytest.mark.parametrize("value", [1, 1024, np.int64(7), True])
def test_numbers_of_the_range(value) -> None:
    check_number("jobs", value, 1, 1024)
    check_number("jobs", value, 1)


@pytest.mark.parametrize("value", [0, 1025, -1, 1.0, "1", None])
def test_numbers_outside_it(value) -> None:
    with pytest.raises(InputError, match=f"^jobs: wanted 1 to 1,024, found {value}; choose an"):
        check_number("jobs", value, 1, 1024)


def test_a_range_may_have_no_end() -> None:
    check_number("steps", 10**12, 1)
    with pytest.raises(InputError, match="^steps: wanted 1,000 or more, found 999; choose another"):
        check_number("steps", 999, 1000)


def test_a_number_may_be_left_out() -> None:
    check_optional("steps", None, 1)
    with pytest.raises(InputError, match="^steps: wanted 1 or more, found 0; choose another"):
        check_optional("steps", 0, 1)


@pytest.mark.parametrize("word", [17, 33, "32", 20.0])
def test_words_outside_18_to_32_bits(word) -> None:
    with pytest.raises(InputError, match=f"^word: wanted 18 to 32 bits, found {word}; choose a"):
        check_word(word)


def test_machines() -> None:
    for config, word in (("small", 18), ("fast", 32)):
        check_machine(config, word)
    with pytest.raises(InputError, match="^config: wanted one of small, fast, .*found 'huge'"):
        check_machine("huge", 17)
    with pytest.raises(InputError, match="^word: wanted 18 to 32 bits"):
        check_machine("small", 17)
