"""Lines of authors: the innermost one outside of Boresight's own helpers and of libraries."""

from __future__ import annotations

import statistics
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from boresight.model.declarations import Input, Param, State
from boresight.model.errors import place_of, place_of_function

pytestmark = pytest.mark.pythons

HERE = Path(__file__)


def line_of(mark: str) -> str:
    """The line of this file that carries a mark, written apart from it here."""
    (number,) = (
        k for k, s in enumerate(HERE.read_text().splitlines(), 1) if s.endswith(f"# {mark}")
    )
    return f"test_places.py, line {number}"


def test_declarations_know_their_lines() -> None:
    declared = (Input("a", 0.0, 1.0), Param("b", 0.0, 0.0, 1.0), State("c", 0.0, 1.0))  # declared
    assert {d.line for d in declared} == {line_of("declared")}
    assert declared[0] == Input("a", 0.0, 1.0) and "line" not in repr(declared[0])


def test_the_line_of_an_error() -> None:
    for make in (
        lambda: statistics.mean([]),  # mean
        lambda: np.ones(2) @ np.ones(3),  # shapes
    ):
        with pytest.raises(ValueError) as caught:  # StatisticsError is one
            make()
        assert place_of(caught.value) == place_of_function(make)
    assert place_of(ValueError()) == ""


def test_the_line_of_a_function() -> None:
    def function(x: Any) -> Any:  # function
        return x

    assert place_of_function(function) == line_of("function")
    assert place_of_function(partial(function, 1)) == ""
