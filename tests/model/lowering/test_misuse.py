"""What a recorded value refuses: each method, with the line and a cure."""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.model.lowering.misuse import NO_CONDITION, NO_NUMBER, Refuses
from boresight.model.lowering.trace import Condition, Scalar, Tracer

pytestmark = pytest.mark.pythons


@pytest.mark.parametrize("kind, table", [(Scalar, NO_NUMBER), (Condition, NO_CONDITION)])
def test_every_method_of_a_table_is_refused(kind: Any, table: Any) -> None:
    x = Tracer("unit").leaf("input", "x", 0.0, 1.0)
    value = x if kind is Scalar else x < 0.5
    assert type(value) is kind
    for methods, (entry, cure) in table.items():
        for method in methods:
            with pytest.raises(InputError) as raised:
                getattr(kind, method)(value, *([1.0] if method != "__bool__" else []))
            said = str(raised.value)
            assert said.startswith("test_misuse.py, line ")
            assert said.endswith(f"; {cure}") and entry.split()[-1] in said


@pytest.mark.parametrize(
    "function",
    [float, int, complex, round, bool, lambda v: divmod(v, 2.0), lambda v: 7 // v,
     lambda v: 2.0**v, lambda v: ~v, lambda v: v & 1, operator.index, lambda v: 1 | v],
)  # fmt: skip
def test_how_python_asks(function: Callable[[Any], Any]) -> None:
    x = Tracer("unit").leaf("input", "x", 0.0, 1.0)
    with pytest.raises(InputError, match=r"^test_misuse\.py, line \d+: wanted operations that can"):
        function(x)


@pytest.mark.parametrize(
    "function",
    [float, bool, abs, lambda v: v + 1.0, lambda v: 2.0 * v, lambda v: v < 1.0, lambda v: -v,
     lambda v: 1.0 / v, lambda v: v**2, lambda v: not v, lambda v: np.add(v, 1.0),
     np.logical_and.reduce],
)  # fmt: skip
def test_how_python_asks_a_condition(function: Callable[[Any], Any]) -> None:
    x = Tracer("unit").leaf("input", "x", 0.0, 1.0)
    with pytest.raises(InputError, match=r"^test_misuse\.py, line \d+: wanted operations that can"):
        function(x < 0.5)


def test_a_class_refuses_what_it_names() -> None:
    class Odd(Refuses, refused={("__neg__", "__call__"): ("that", "not that")}):
        pass

    for ask in (operator.neg, lambda odd: odd(1, 2)):
        with pytest.raises(InputError, match="found that; not that$"):
            ask(Odd())
    assert Odd() is not None and bool(Odd())
