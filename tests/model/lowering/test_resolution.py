"""How far each result may be off, and which words are too coarse for it."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from boresight.model import ops
from boresight.model.errors import InputError
from boresight.model.lowering.lower import lower
from boresight.model.lowering.resolution import check_resolution, limits
from boresight.model.words.program import Port, Program
from tests.support.traced import Traced


def judged(t: Traced, tolerance: float | None, unit: str = "") -> Program:
    """The program, with this tolerance of its only output."""
    return replace(t.program, ports=(Port("y", unit, tolerance),))


def test_limits() -> None:
    t = Traced(lambda x: 2.0 * x, [(-1.0, 1.0)])
    number = t.program.outputs[0]
    said = "the tolerance of output y"
    assert [*limits(judged(t, 0.25), {})] == [(number, 0.25, said)]
    for program in (judged(t, None), judged(t, 0.0), judged(t, 0.25, "flags")):
        assert [*limits(program, {})] == [(number, math.inf, said)]


@pytest.mark.parametrize(
    "function, share",
    [
        (lambda x: x + 0.5, 1.0),
        (lambda x: 8.0 * ops.clip(x, -1.0, 1.0), 8.0),
        (lambda x: ops.where(x < 0.0, 0.25, -0.3 * ops.clip(x, -1.0, 1.0)), 0.3),
    ],
)
def test_a_word_that_is_just_too_coarse(function: object, share: float) -> None:
    """The input's last bit is 2^-11, whatever the result's is."""
    t = Traced(function, [(-(2.0**20), 2.0**19)])  # type: ignore[arg-type]
    check_resolution(judged(t, share * 2.0**-11 * 1.001), {})
    with pytest.raises(InputError, match=r"a last bit of at most 0\.00048\d, for the tolerance of"):
        check_resolution(judged(t, share * 2.0**-11 * 0.999), {})


@pytest.mark.parametrize(
    "small, exact", [(2.0**-10, True), (2.0**-11, False), (2.0**-30, False), (0.3, False)]
)
def test_a_constant_that_is_too_small_for_a_sum(small: float, exact: bool) -> None:
    """A sum of chosen constants is exact, unless one of them has bits below its last, 2^-10."""

    def function(x: object) -> object:
        return ops.where(x < 0.0, 2.0**20, 0.0) + ops.where(x < 0.5, small, 0.0)

    t = Traced(function, [(-1.0, 1.0)])
    nodes = lower(t.trace, t.program.arithmetic)[1]
    if exact:
        check_resolution(judged(t, 2.0**-12), nodes)
    else:
        with pytest.raises(InputError, match="a last bit of at most"):
            check_resolution(judged(t, 2.0**-12), nodes)
