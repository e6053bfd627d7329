"""Models drawn at random: what is derived equals the textbook, and fixed point equals C and RTL."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import boresight
from boresight.kalman import Textbook
from tests.support.compiled_float import numpy_float
from tests.support.random_kalman import Drawn, inputs_of


def check_textbook(seed: int, updates: int) -> None:
    filter = Drawn(seed)
    inputs = inputs_of(filter, updates)
    book = Textbook(filter, floor=True).run(inputs).outputs
    outcome = numpy_float(filter, inputs[:, :, None])
    for name, values in book.items():
        assert np.abs(outcome[name][:, 0] - values).max() <= 1e-9 * max(
            1.0, np.abs(values).max()
        ), seed


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_the_derivation_is_the_textbook(seed: int) -> None:
    check_textbook(seed, 12)


@pytest.mark.soak
@pytest.mark.parametrize("part", range(10))
def test_the_derivation_of_500_models_is_the_textbook(part: int) -> None:
    for seed in range(50 * part, 50 * (part + 1)):
        check_textbook(seed, 60)


def check_exact(seed: int, levels: tuple[str, ...]) -> None:
    filter = Drawn(seed)
    values = inputs_of(filter, 60)
    columns = {i.name: values[:, k] for k, i in enumerate(filter.inputs)}
    (result,) = boresight.check(filter, columns, levels=levels, config="small-1024")["results"]
    assert result.exact, (seed, result.lines())


@pytest.mark.parametrize("seed", range(3))
def test_fixed_point_is_the_c(seed: int) -> None:
    check_exact(seed, ("fixed", "c"))


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(20))
def test_fixed_point_is_the_c_and_the_rtl(seed: int) -> None:
    check_exact(seed, ("fixed", "c", "rtl"))
