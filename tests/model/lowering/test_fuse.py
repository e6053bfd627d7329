"""What fuses into one group, and where a function's argument must lie."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.errors import InputError
from boresight.model.lowering.lower import lower
from boresight.model.lowering.trace import Trace, Tracer
from boresight.model.words.fixed import Arithmetic
from tests.support.traced import Traced


@pytest.mark.parametrize("word", [18, 32])
def test_a_reciprocals_range_may_not_pass_what_can_be_normalised(trace: Any, word: int) -> None:
    most = Arithmetic(word=32).norm_max
    trace(lambda a: 1.0 / a, [(2.0 ** (1 - most), 1.0)], word)
    for low, high in ((2.0 ** (-2 - most), 1.0), (-1.0, -(2.0 ** (-2 - most)))):
        with pytest.raises(
            InputError,
            match=r"^test_fuse\.py, line \d+: wanted a divisor whose range, and word, span at "
            rf"most 2\^{most}, found x0 in \[.*\]; divide by ops\.clip",
        ):
            trace(lambda a: 1.0 / a, [(low, high)], word)


@pytest.mark.parametrize(("function", "low"), [(lambda a: 1.0 / a, 1.0), (ops.rsqrt, 2.0**-20)])
def test_a_root_or_a_quotient_in_a_range_that_is_far_too_wide(
    trace: Any, function: Any, low: float
) -> None:
    """By itself: its only factor, the mantissa, loses the bits that no shift can."""
    t = trace(
        lambda a: ops.bounded(function(a), 0.0, 2.0**20 / low, "wide"), [(low, 2.0**20 * low)]
    )
    (fixed,), (wanted,), _ = t.run(low * 2.0 ** np.linspace(0.0, 20.0, 200))
    assert np.abs(fixed - wanted).max() <= 0.51 * t.formats()[0].lsb


def test_a_reciprocal_is_refused_at_its_own_line(trace: Any) -> None:
    def function(a: Any) -> Any:
        quotient = 1.0 / a
        return 0.5 * quotient + a

    line = function.__code__.co_firstlineno + 1
    with pytest.raises(InputError, match=rf"^test_fuse\.py, line {line}: wanted a divisor"):
        trace(function, [(2.0**-30, 1.0)])


def test_a_divisor_that_can_just_be_normalised_needs_no_limit(trace: Any) -> None:
    counts = [len(trace(lambda a: 1.0 / a, [(low, 1.0)]).program.ops) for low in (2.0**-22, 0.5)]
    assert counts[0] == counts[1]


def test_a_narrow_word_limits_a_reciprocal_that_a_wide_one_holds(trace: Any) -> None:
    """1/x of x in [2^-16, 1): an 18-bit word counts arguments below 2^-13 as that."""
    x = np.array([2.0**-16, 2.0**-14, 2.0**-10, 0.25, 0.75])
    for word, floor in ((18, 2.0**-13), (32, 0.0)):
        t = trace(lambda a: 1.0 / a, [(2.0**-16, 0.999)], word)
        fixed, _, saturated = t.run(x)
        want = 1.0 / np.maximum(x, floor)
        assert (np.abs(fixed[0] - want) < 3.0 * t.formats()[0].lsb + 2.0 ** (3 - word) * want).all()
        assert not saturated.any()


@pytest.mark.parametrize(
    ("function", "operations"),
    [
        (lambda a, b: ops.wrap_ht(ops.wrap_ht(3.0 * a) + b), 1),
        (lambda a, b: ops.wrap_turns(ops.wrap_ht(3.0 * a) + b), 1),
        (lambda a, b: ops.wrap_ht(ops.wrap_turns(3.0 * a) + b), 2),
        (lambda a, b: 0.5 * ops.wrap_ht(3.0 * a) + b, 2),
        (lambda a, b: 0.5 * ops.wrap_turns(3.0 * a), 2),
    ],
)
def test_only_whole_periods_are_left_to_a_wrap_around_them(
    trace: Any, function: Any, operations: int
) -> None:
    t = trace(function, [(-1.0, 1.0)] * 2)
    a, b = np.meshgrid(np.linspace(-0.97, 0.96, 9), np.linspace(-0.94, 0.93, 9))
    (fixed,), (wanted,), _ = t.run(a.ravel(), b.ravel())
    assert np.abs(fixed - wanted).max() < 1e-8 and len(t.program.ops) == operations


def test_wraps_say_what_their_unit_is(trace: Any) -> None:
    t = trace(lambda a: (ops.wrap_ht(a), ops.wrap_turns(a)), [(-9.0, 9.0)])
    sources = [t.program.values[n].range_source for n in t.program.outputs]
    assert sources == ["half turns", "turns"]


@pytest.mark.parametrize("word", [18, 32])
@pytest.mark.parametrize("power", [16, 20, 24])
def test_prescribed_formats_are_met_from_afar(word: int, power: int) -> None:
    g = Tracer("far")
    x = g.leaf("input", "x", -(2.0**power), 2.0**power)
    s = g.leaf("state", "s", -1.0, 1.0)
    outputs = {"wrap": ops.wrap_ht(x), "clamp": ops.saturated(x, 1.0)}
    program = lower(Trace(g, [x], outputs, states=[(s, 0.0, x)]), Arithmetic(word))[0]
    formats = [program.values[n].frac for n in (*program.outputs, program.states[0][1])]
    assert formats == [word - 1, word - 1, word - 2]


def test_numbers_that_no_word_is_are_refused() -> None:
    """What only intervals show to be a constant; what shifts cannot bring to its format."""
    g = Tracer("far")
    x = g.leaf("input", "x", 1.0, 2.0)
    s = g.leaf("state", "s", -2.0, 2.0)
    fixed = ops.maximum(ops.minimum(x, 1.0), 1e9)  # 1e9, whatever x is
    with pytest.raises(
        InputError, match=r"wanted numbers of a size .*, found s_next in \[1e\+09, "
    ):
        lower(Trace(g, [x], {"y": x}, states=[(s, 0.0, fixed)]), Arithmetic())
    far = 1e300 * x
    with pytest.raises(
        InputError, match=r"^test_fuse\.py, line \d+: wanted numbers of a size .* y "
    ):
        lower(Trace(g, [x], {"y": ops.wrap_ht(far)}), Arithmetic())


CONDITIONS: list[Callable[[Any, Any, Any], Any]] = [
    lambda a, b, c: a ^ b,
    lambda a, b, c: ~a == b,
    lambda a, b, c: (a != ~b) == c,
    lambda a, b, c: (a ^ b) & c,
    lambda a, b, c: c | (a == b),
    lambda a, b, c: ~((a & b) ^ ~(b & c)) & (a | c),
    lambda a, b, c: ((a & b) == (b | c)) & a,
    lambda a, b, c: (a == a) & (b ^ ~b) & (c != c) | (a ^ a),
    lambda a, b, c: (~a == ~a) ^ (c == True),  # noqa: E712
    lambda a, b, c: (np.True_ ^ a) & (b == np.False_) | (c != False) & (np.True_ | a),  # noqa: E712
    lambda a, b, c: b & (c ^ (b & a)),
    lambda a, b, c: np.logical_not(np.logical_xor(a, b)) | np.logical_and(a, c),
]


@pytest.mark.parametrize("word", [18, 32])
@pytest.mark.parametrize("function", CONDITIONS)
def test_conditions_of_conditions(function: Callable[..., Any], word: int) -> None:
    """Ties too, and comparisons that ranges decide; a difference of two is one operation."""
    points = np.array(np.meshgrid(*3 * [[-1.0, -0.25, 0.0, 0.25, 1.0]])).reshape(3, -1)
    for first in (
        lambda x, y: x < y,
        lambda x, y: x < 2.0,
        lambda x, y: y < -2.0,
        lambda x, y: x >= x,
    ):

        def chosen(x: Any, y: Any, z: Any, first: Callable[..., Any] = first) -> Any:
            parts = (first(x, y), y >= z, z < 0.0)
            return tuple(
                ops.where(function(*order), 1.0, 0.0)
                for order in ((parts[0], parts[1], parts[2]), (parts[1], parts[2], parts[0]))
            )

        fixed, exact, saturated = Traced(chosen, 3 * [(-1.0, 1.0)], word=word).run(*points)
        assert not saturated.any()
        for a, b in zip(fixed, exact, strict=True):
            assert np.array_equal(a, b)
