"""Recording: each expression once, as it was written; what disappears and what must not."""

from __future__ import annotations

import math
import operator
from typing import Any

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.errors import InputError
from boresight.model.lowering.trace import Tracer

pytestmark = pytest.mark.pythons


@pytest.fixture
def tracer() -> Tracer:
    return Tracer("unit")


@pytest.fixture
def x(tracer: Tracer) -> Any:
    return tracer.leaf("input", "x", -2.0, 3.0)


@pytest.fixture
def y(tracer: Tracer) -> Any:
    return tracer.leaf("input", "y", -2.0, 3.0)


def test_powers_and_magnitudes(tracer: Tracer, x: Any) -> None:
    assert abs(x) is np.abs(x) is ops.absolute(x) and +x is x
    assert x**1 is x and (x**0).data == (1.0,) and x**2 is x * x and x**2.0 is x * x
    assert x**5 is (x * x) * (x * x) * x and x**6 is (x * x * x) * (x * x * x)
    inverse = tracer.const(1.0) / x
    assert x**-2 is inverse * inverse


def test_arrays_of_values(x: Any, y: Any) -> None:
    """numpy's sums, products and transposes are those of the values."""
    a, b = np.array([x, y]), np.array([[1.0, 2.0], [0.0, y]])
    assert np.dot(a, a) is x * x + y * y is a @ a and a.sum() is x + y is sum([x, y])
    assert list(b @ a) == [x + 2.0 * y, 0.0 * x + y * y] and b.T[1, 0] == 2.0
    assert list(2.0 * a) == [x * 2.0, y * 2.0] and list(np.ones(2) * x) == [x, x]
    assert list(a - np.array([1.0, 0.0])) == [x - 1.0, y] and list(abs(a)) == [abs(x), abs(y)]
    assert list(x * a) == [x * x, x * y] and list(x - b[0]) == [x - 1.0, x - 2.0]
    assert [c.kind for c in x < a] == [c.kind for c in (x < x, x < y)]
    assert list(np.array([1.0, 2.0]) + x) == [1.0 + x, 2.0 + x] and list(a**2) == [x * x, y * y]
    assert x.tracer.lift(np.array(3.0)) is x.tracer.const(3.0)
    with pytest.raises(InputError, match=r"found an array of shape \(1,\)"):
        x.tracer.lift(np.array([3.0]))
    with pytest.raises(InputError, match="wanted a step that computes the same"):
        Tracer("other").lift(x)
    assert x * np.array(3.0) is x * 3.0 and np.float64(2.0) - x is 2.0 - x
    assert (np.float64(1.0) <= x) is (x >= 1.0)


def test_functions_of_numpy_are_those_of_ops(x: Any, y: Any) -> None:
    angle, length = ops.atan2_ht(y, x) * math.pi, ops.sqrt(x * x + y * y)
    assert np.arctan2(y, x) is angle and np.hypot(x, y) is length
    assert np.arctan2(1.0, x) is ops.atan2_ht(1.0, x) * math.pi
    assert [*np.arctan2(np.array([y, 1.0]), x)] == [angle, ops.atan2_ht(1.0, x) * math.pi]
    a, b = np.array([y, x]), np.array([x, x])
    assert np.arctan2(a, b)[0] is angle and np.hypot(b, a)[0] is length
    assert np.maximum(x, 1.0) is np.fmax(x, 1.0) is ops.maximum(x, 1.0)
    assert np.minimum(np.float64(1.0), x) is np.fmin(1.0, x) is ops.minimum(1.0, x)
    assert np.clip(x, -1.0, 1.0) is ops.clip(x, -1.0, 1.0)
    assert np.clip(x, y, 1.0) is ops.clip(x, y, 1.0) and np.clip(1.0, x, y) is ops.clip(1.0, x, y)
    assert np.copysign(2.0, x) is ops.flip(x < 0.0, x.tracer.const(2.0))
    with pytest.raises(InputError, match=r"ops\.maximum, ops\.minimum"):
        np.maximum(a, b)
    with pytest.raises(InputError, match=r"numpy's fmod; write x % c"):
        np.fmod(x, 2.0)
    assert x % 2.0 is np.mod(x, 2.0) is 2.0 * (ops.wrap_turns(x * 0.5 - 0.5) + 0.5)
    assert list(a % 2.0) == [y % 2.0, x % 2.0] and x % np.float64(2.0) is x % 2.0
    for period in (0.0, -1.0, y):
        with pytest.raises(InputError, match="wanted a number above 0 after %, found"):
            _ = x % period
    with pytest.raises(InputError, match="found // or divmod of a traced value, or % by one"):
        _ = 2.0 % x
    with pytest.raises(AttributeError, match="no attribute 'arcsinh'"):
        _ = x.arcsinh


def test_comparisons(x: Any, y: Any) -> None:
    assert (x > y) is (y < x)
    assert (x >= y) is ~(x < y)
    assert (x <= y) is ~(y < x)
    assert ((x < y) | (y < x)).kind == "either"
    assert (x > 1.0).args[1] is x
    chosen = ops.where((x < y) & ~(y < 1.0), x, 2.0)
    assert [a.kind for a in chosen.args] == ["both", "leaf", "const"]
    assert ops.flip(x < y, 1.0).args[0] is (x < y)
    assert ((x <= y) ^ (x < 1.0)) is ~((y < x) ^ (x < 1.0)) is ((x >= 1.0) ^ (y < x))


def test_misuse_is_refused(x: Any) -> None:
    with pytest.raises(InputError, match="wanted comparisons with < > <= >=, found == or != on a"):
        bool(x == 1.0)
    same = x
    assert x == same and (x != same) is np.False_
    for combine in (operator.and_, operator.xor):
        with pytest.raises(InputError, match="conditions such as x < 1.0, found 1 in a condit"):
            combine(x < 1.0, 1)


def test_a_value_that_was_kept_from_another_run_is_refused(x: Any) -> None:
    kept = Tracer("unit").leaf("input", "kept", -2.0, 3.0)
    for mixed in (lambda: x + kept, lambda: kept + x, lambda: (x < 1.0) & (kept < 1.0)):
        with pytest.raises(InputError, match="wanted a step that computes the same whenever"):
            mixed()


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_constants_are_finite(x: Any, value: float) -> None:
    with pytest.raises(
        InputError, match=rf"^test_trace\.py, line \d+: wanted finite constants, found {value!r}; "
    ):
        x + value
