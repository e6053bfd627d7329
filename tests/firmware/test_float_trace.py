"""Scalars that record: each expression once, what disappears and what must not."""

from __future__ import annotations

import numpy as np
import pytest

from boresight.firmware.float_trace import Tape
from boresight.model import ops


@pytest.fixture
def tape() -> Tape:
    return Tape()


def test_each_expression_once(tape: Tape) -> None:
    x, y = tape.leaf("input", "x"), tape.leaf("input", "y")
    assert x * y is x * y
    assert ops.sincos_ht(x)[0] is ops.sincos_ht(x)[0]


def test_what_disappears(tape: Tape) -> None:
    x, y = tape.leaf("input", "x"), tape.leaf("input", "y")
    assert x + 0.0 is x
    assert 1.0 * x is x
    assert (-x).args == (x,)
    assert 0.0 - (-x) is x
    assert x - (-y) is x + y
    assert (-1.0 * x).kind == "neg"
    assert ~~(x < y) is (x < y)
    assert -(x - y) is y - x
    assert (tape.const(2.0) * 3.0).number == 6.0
    assert (x / 4.0).args[0].number == 0.25
    assert x * 0.5 * 4.0 is 2.0 * x


def test_nothing_more_disappears(tape: Tape) -> None:
    x = tape.leaf("input", "x")
    assert (x * 0.0).kind == "mul"  # infinity times zero is no zero
    assert (x - x).kind == "sub"


def test_wrap_is_recognised(tape: Tape) -> None:
    x, y = tape.leaf("input", "x"), tape.leaf("input", "y")
    assert ops.wrap_ht(x).kind == "wrap_ht"
    assert ops.wrap_ht(x).args == (x,)
    assert ops.wrap_ht(x - y).args == (x - y,)
    angle = ops.atan2_ht(y, x)
    assert (angle.kind, angle.args[0].args[1].kind) == ("wrap_ht", "atan2")
    assert angle.args[0].args[1].args == (y, x)


def test_comparisons(tape: Tape) -> None:
    x, y = tape.leaf("input", "x"), tape.leaf("input", "y")
    assert (x > y) is (y < x)
    assert (x >= y) is ~(x < y)
    assert (x <= y) is ~(y < x)
    assert ((x < y) | (y < x)).kind == "or"
    assert (x > 1.0).args[1] is x
    chosen = ops.where((x < y) & ~(y < 1.0), x, 2.0)
    assert [a.kind for a in chosen.args] == ["and", "input", "const"]


def test_misuse_is_refused(tape: Tape) -> None:
    x = tape.leaf("input", "x")
    with pytest.raises(TypeError, match=r"^a traced value has no truth value: use model\.ops"):
        bool(x < 1.0)
    with pytest.raises(TypeError, match="^numpy's tanh cannot be traced$"):
        np.tanh(x)
    with pytest.raises(TypeError, match="^conditions combine with conditions, not with 1$"):
        (x < 1.0) & 1
    with pytest.raises(TypeError, match="^only numbers and traced values can be computed with"):
        x + "1"
    with pytest.raises(TypeError, match="^add: only plain calls can be traced$"):
        np.add.reduce(x)
    with pytest.raises(TypeError, match="keyword arguments cannot be traced$"):
        np.clip(x, 0.0, 1.0, out=None)
