"""How far each result may be off, and which words are too coarse for it."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from boresight import Estimator, Input, Output
from boresight.model import ops
from boresight.model.errors import InputError
from boresight.model.lowering.lower import lower
from boresight.model.lowering.resolution import check_resolution, limits
from boresight.model.lowering.trace import Trace, Tracer
from boresight.model.words.fixed import Arithmetic
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
    for program in (judged(t, None), judged(t, 0.0)):
        assert [*limits(program, {})] == [(number, math.inf, said)]
    assert [*limits(judged(t, 0.25, "flags"), {})] == [(number, 1.0, "bit 0 of output y")]


def test_flags_keep_their_lowest_bit() -> None:
    class Alarms(Estimator):
        inputs = (Input("u", -1.0, 1.0),)
        outputs = (Output("alarms", "flags"),)

        def step(self, x: Any, u: Any, p: Any) -> Any:
            return {}, {"alarms": ops.where(u.u > 0.5, 1, 0) + ops.where(u.u < 0.0, 2**19, 0)}

    check_resolution(Alarms().compile(word=24), {})
    with pytest.raises(InputError, match="LSB of at most 1, for bit 0 of output alarms, found 8"):
        check_resolution(Alarms().compile(word=18), {})


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
    with pytest.raises(InputError, match=r"an LSB of at most 0\.00048\d, for the tolerance of"):
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
    with pytest.raises(InputError, match="an LSB of at most"):
        check_resolution(judged(t, 2.0**-12), {})  # what they can sum up to is not known
    if exact:
        check_resolution(judged(t, 2.0**-12), nodes)
    else:
        with pytest.raises(InputError, match="an LSB of at most"):
            check_resolution(judged(t, 2.0**-12), nodes)


def said(
    step: Callable[[Any, Any], tuple[Any, Any]], size: float, tolerance: float, fitted: bool
) -> str:
    """What is said of a step of x within ``size`` and state s in [-1, 1] to the next and output."""
    g = Tracer("test")
    x, s = g.leaf("input", "x", -size, size), g.leaf("state", "s", -1.0, 1.0)
    after, out = step(x, s)
    program, nodes = lower(Trace(g, [x], {"y": out}, states=[(s, 0.0, after)]), Arithmetic())
    if fitted:
        nodes[program.outputs[0]].fit = (-1.0, 1.0)
    try:
        check_resolution(replace(program, ports=(Port("y", "", tolerance),)), nodes)
    except InputError as error:
        return str(error)
    return ""


def held(x: Any) -> Any:
    return ops.bounded(x, -1.0, 1.0, "test")


def _root(x: Any) -> Any:
    return ops.rsqrt(ops.maximum(x, 0.5))


def _quarter(x: Any, s: Any) -> tuple[Any, Any]:
    return held(x), 0.5 * ops.named("half", 0.5 * s)


OF_STATE, OF_Y = "for a quarter of the bits of state s", "for the tolerance of output y"
NARROW = "narrow its range, or widen the tolerance"
NARROW_STATE = "narrow the range [-1, 1] of state s, or widen the tolerance"
LIMIT = "limit it, or its factors, with ops.bounded or ops.clip, or use boresight fit"


@pytest.mark.parametrize(
    "step, size, tolerance, value, wanted, found, fix",
    [
        (lambda x, s: (held(s + x), s), 2.0**24, 1.0, "", "", "", ""),
        (lambda x, s: (held(s + x), s), 2.0**25, 1.0, "x", f"0.0156, {OF_STATE}", 2**-5, NARROW),
        (_quarter, 2.0**24, 0.0040, "", "", "", ""),
        (_quarter, 2.0**24, 0.0039, "x", f"0.0156, {OF_Y}", 2**-6, NARROW),
        (lambda x, s: (s, x * s), 1.0, 4e-10, "y", f"4e-10, {OF_Y}", 2**-30, LIMIT),
        (lambda x, s: (s, ops.sincos_ht(x)[0]), 1.0, 1e-9, "", "", "", ""),
        (
            lambda x, s: (s, ops.bounded(0.3 * _root(x), 0.0, 0.1, "test")),
            1.0,
            1e-10,
            "",
            "",
            "",
            "",
        ),
        (lambda x, s: (0.5 * s + 0.25 * x,) * 2, 1.0, 4e-10, "s_next", "", 2**-31, LIMIT),
        (lambda x, s: (s + 0.25 * x,) * 2, 1.0, 4e-10, "s_next", "", 2**-30, NARROW_STATE),
    ],
)
def test_what_is_too_coarse_for_a_state_or_a_tolerance(
    step: Any, size: float, tolerance: float, value: str, wanted: str, found: Any, fix: str
) -> None:
    message = said(step, size, tolerance, False)
    place = "" if value == "x" else r"test_resolution\.py, line \d+, "
    if not value:
        assert not message
        return
    assert re.match(rf"{place}test, value {value}: ", message)
    assert f"wanted an LSB of at most {wanted}" in message
    assert f"found {found:.3g}, for the range [" in message and f"; {fix}" in message
    assert "boresight fit" not in said(step, size, tolerance, True)


def test_a_part_of_a_sum_has_the_line_of_the_sum() -> None:
    def step(x: Any, s: Any) -> tuple[Any, Any]:
        out = 0.3 * s
        return ops.clip(s + x, -1.0, 1.0), out

    line = step.__code__.co_firstlineno + 2
    assert re.match(
        rf"test_.*, line {line}, test, value \w+_part: ", said(step, 2.0**25, 1.0, False)
    )
