"""The operations, from trace through fixed point against float64.

Bounds are in units of the result's last bit; where the argument's own rounding dominates, they
carry its term.
"""

import math
from typing import Any

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.errors import InputError
from boresight.model.lowering.trace import Tracer
from boresight.model.words.fixed import Arithmetic
from tests.support.nodes import node_of

pytestmark = pytest.mark.pythons

WIDTHS = (18, 20, 23, 24, 27, 28, 31, 32)


def turns_apart(a: Any, b: Any) -> Any:
    """|a - b| of angles in half turns."""
    return np.abs((a - b + 1.0) % 2.0 - 1.0)


def sincos_of_any(x: Any) -> Any:
    """Beyond one turn, and of a full turn that is no binary angle."""
    return (*ops.sincos_ht(4.0 * x), *ops.sincos_ht(ops.flip(x < 0.0, x)))


def inverse_root(x: Any) -> Any:
    return ops.bounded(ops.rsqrt(x), 0.0, 64.0, "x >= 2^-12")


@pytest.mark.parametrize("word", WIDTHS)
@pytest.mark.parametrize(
    ("function", "ranges", "most"),
    [
        (ops.sincos_ht, [(-1.0, 1.0)], 1.5),
        (sincos_of_any, [(-1.0, 1.0)], 1.5),
        (ops.atan2_ht, [(-1.0, 1.0)] * 2, 4.0),
        (ops.atan2_ht, [(-1000.0, 1000.0), (-1.0, 1.0)], 4.0),
        (lambda x: (1.0 / x, 0.3 / x), [(1.0 / 64.0, 1.0)], 2.2),
        (lambda x: (1.0 / x, 0.3 / x), [(-1.0, -1.0 / 64.0)], 2.2),
        (lambda x, y: x / y, [(-3.0, 3.0), (0.5, 4.0)], 3.0),
        (lambda x, y: x / y, [(-3.0, 3.0), (-4.0, -0.5)], 3.0),
        (inverse_root, [(2.0**-12, 0.999)], 2.0),
    ],
)
def test_errors_in_last_bits(
    trace: Any, function: Any, ranges: list[tuple[float, float]], most: float, word: int
) -> None:
    """Of the result alone: no term for the arguments, of any magnitude."""
    t, rng = trace(function, ranges, word), np.random.default_rng(word)
    columns = []
    for low, high in ranges:
        x = max(-low, high) * 2.0 ** rng.uniform(1 - word, 0.0, 20_000)
        x *= rng.choice([-1.0, 1.0], 20_000)
        columns.append(np.where((low <= x) & (x <= high), x, rng.uniform(low, high, 20_000)))
    fixed, floats, saturated = t.run(*columns)
    assert not saturated.any()
    if function is inverse_root and word > 30:
        most += 1.0  # its cubic is exact to 2^-28
    for y, want, fmt in zip(fixed, floats, t.formats(), strict=True):
        error = np.abs(y - want) if function is not ops.atan2_ht else turns_apart(y, want)
        assert error.max() < most * fmt.lsb


@pytest.mark.parametrize("word", WIDTHS)
def test_sincos_of_quadrants(trace: Any, word: int) -> None:
    t = trace(ops.sincos_ht, [(-1.0, 1.0)], word, "ht")
    (sine, cosine), _, _ = t.run([-1.0, -0.5, 0.0, 0.5])
    lsb = 2.0 ** (2 - word)
    assert np.abs(sine - [0, -1, 0, 1]).max() <= lsb
    assert np.abs(cosine - [-1, 0, 1, 0]).max() <= lsb


@pytest.mark.parametrize("word", WIDTHS)
def test_atan2_on_the_axes_and_diagonals(trace: Any, word: int) -> None:
    t = trace(lambda y, x: ops.atan2_ht(y, x), [(-1.0, 1.0)] * 2, word)
    y = [0.0, 0.5, 0.0, -0.5, 0.5, 0.5, -0.5, -0.5, 0.0]
    x = [0.5, 0.0, -0.5, 0.0, 0.5, -0.5, 0.5, -0.5, 0.0]
    (angle,), floats, _ = t.run(y, x)
    want = [0.0, 0.5, -1.0, -0.5, 0.25, 0.75, -0.25, -0.75, 0.0]
    assert turns_apart(floats[0], want).max() <= 4e-16  # numpy's last bits are its own
    assert turns_apart(angle, want).max() <= 2.0 * 2.0 ** (1 - word)
    assert np.array_equal(angle[[0, 2, 8]], [0.0, -1.0, 0.0])


@pytest.mark.parametrize(("word", "furthest"), [(18, 12), (24, 16), (32, 22)])
def test_atan2_of_components_too_far_apart_is_refused(trace: Any, word: int, furthest: int) -> None:
    """At the limit itself the angle is right."""
    ranges = [(-0.9 * 2.0**furthest, 0.9 * 2.0**furthest), (-0.9, 0.9)]
    t, rng = trace(ops.atan2_ht, ranges, word), np.random.default_rng(0)
    y, x = (high * 2.0 ** rng.uniform(-word, 0.0, 5_000) for _, high in ranges)
    fixed, floats, _ = t.run(y, -x)
    assert turns_apart(fixed[0], floats[0]).max() < 4.0 * 2.0 ** (1 - word)
    ranges[0] = (-(2.0**furthest), 2.0**furthest)
    message = rf"whose ranges differ by at most 2.{furthest}, found x1 in"
    with pytest.raises(InputError, match=message):
        trace(ops.atan2_ht, ranges, word)


def test_float_atan2_of_negative_zeros_is_zero() -> None:
    zeros = np.array([0.0, -0.0, 0.0, -0.0])
    assert np.array_equal(ops.atan2_ht(zeros, zeros[::-1]), np.zeros(4))


@pytest.mark.parametrize("word", WIDTHS)
def test_sqrt(trace: Any, word: int) -> None:
    t = trace(ops.sqrt, [(0.0, 0.999)], word)
    arith = Arithmetic(word=word)
    x = np.concatenate([2.0 ** np.random.default_rng(2).uniform(-2 - arith.norm_max, 0, 4000), [0]])
    x = np.minimum(x, 0.999)
    fixed, floats, saturated = t.run(x)
    assert not saturated.any()
    # cubic 2^-28 relative, the table's word and the mantissa's, the result's rounding
    units = np.abs(fixed[0] - floats[0]) / t.formats()[0].lsb
    inside = x >= 2.0**-arith.norm_max
    assert units[inside].max() < 2.5 + (6.5 if word > 30 else 0.0)
    assert fixed[0][-1] == 0.0
    # below, the argument counts as the smallest that can be normalised: off by up to the root
    assert np.all(fixed[0][~inside] <= floats[0][~inside] + t.formats()[0].lsb)


@pytest.mark.parametrize("word", [18, 32])
def test_wrap_is_exact_everywhere(trace: Any, word: int) -> None:
    """Sums of binary angles wrap as integers do: no error at +-1, none anywhere."""
    t = trace(
        lambda a, b: (
            ops.wrap_ht(a + b),
            ops.wrap_ht(a - b),
            ops.wrap_ht(2.0 * a),
            ops.wrap_ht(a + 1.0),
            ops.wrap_ht(ops.wrap_ht(a + b) - 0.5),
        ),
        [(-1.0, 1.0)] * 2,
        word,
        "ht",
    )
    unit = 2.0 ** (1 - word)
    edge = np.array([-1.0, -1.0 + unit, -unit, 0.0, unit, 0.5, 1.0 - 2 * unit, 1.0 - unit])
    a, b = (v.ravel() for v in np.meshgrid(edge, edge))
    fixed, floats, saturated = t.run(a, b)
    for y, want in zip(fixed, floats, strict=True):
        assert np.array_equal(y, want)
    assert not saturated.any()


@pytest.mark.parametrize("word", [18, 32])
def test_turns_wrap_modulo_one(trace: Any, word: int) -> None:
    """Exactly; inside of turns a wrap of half turns is free, but not the other way round."""
    t = trace(
        lambda a, b: (
            ops.wrap_turns(a + b),
            ops.wrap_turns(3.0 * a),
            ops.wrap_turns(ops.wrap_ht(a - b) + b),
            ops.wrap_ht(ops.wrap_turns(b - a) + b),
            ops.wrap_turns(ops.wrap_turns(2.0 * a + b) - 0.25),
        ),
        [(-1.0, 1.0)] * 2,
        word,
        "ht",
    )
    unit = 2.0 ** (1 - word)
    edge = np.array([-1.0, -0.75, -0.5 - unit, -0.5, -unit, 0.0, 0.25, 0.5 - unit, 0.5, 1.0 - unit])
    a, b = (v.ravel() for v in np.meshgrid(edge, edge))
    fixed, floats, saturated = t.run(a, b)
    for y, want in zip(fixed, floats, strict=True):
        assert np.array_equal(y, want)
    assert [f.frac for f in t.formats()] == [word, word, word, word - 1, word]
    assert floats[0].min() == -0.5 and floats[0].max() < 0.5 and not saturated.any()
    assert np.array_equal(floats[0], (a + b + 0.5) % 1.0 - 0.5)


def test_constants_wrap_too() -> None:
    assert ops.wrap_turns(0.75) == -0.25 and ops.wrap_turns(-0.5) == -0.5


@pytest.mark.parametrize("span", [3.0, 1e3, 2.0**24])
def test_wrap_of_large_values(trace: Any, span: float) -> None:
    """Many turns, also so many that the value needs a format far coarser than the angle's."""
    t = trace(ops.wrap_ht, [(-span, span)])
    x = np.random.default_rng(6).uniform(-span, span, 2000)
    fixed, floats, saturated = t.run(x)
    assert np.array_equal(fixed[0], floats[0])
    assert not saturated.any()


def test_wrap_keeps_the_fine_part_of_a_large_sum(trace: Any) -> None:
    """Whole turns fall away before the format is chosen, not after."""
    t = trace(lambda a, b: ops.wrap_ht(2.0**24 * a + b), [(-0.999, 0.999)] * 2)
    fixed, floats, _ = t.run(*np.random.default_rng(8).uniform(-0.99, 0.99, (2, 2000)))
    assert turns_apart(fixed[0], floats[0]).max() < 2.0**-26


@pytest.mark.parametrize("word", [18, 25, 32])
def test_selections_and_limits_are_exact(trace: Any, word: int) -> None:
    """Choosing words does not change them, so long as the format is the same."""

    def function(a: Any, b: Any) -> Any:
        return (
            ops.minimum(a, b),
            ops.maximum(a, b),
            ops.absolute(a),
            ops.flip(a < 0.0, b),
            ops.flip(a >= b, b),
            ops.where(a <= b, a, b),
            ops.where(a > b, a, 0.25),
            ops.clip(a, -1.5, 2.5),
            ops.saturated(a, 2.0),
            ops.clip(a, -4.0, 4.0),
        )

    t = trace(function, [(-3.0, 3.0)] * 2, word)
    rng = np.random.default_rng(7)
    a, b = rng.uniform(-3, 3, (2, 2000))
    a[:4], b[:4] = [-3.0, 3.0, 0.0, 1.0], [3.0, -3.0, 0.0, 1.0]
    fixed, floats, saturated = t.run(a, b)
    assert not saturated.any()
    for k, (y, want) in enumerate(zip(fixed, floats, strict=True)):
        tolerance = t.formats()[k].lsb if k == 8 else 0.0  # +limit is one bit out of reach
        assert np.abs(y - want).max() <= tolerance, k


@pytest.mark.parametrize("word", [18, 24, 32])
def test_clip_is_exact_at_its_limits_and_between(trace: Any, word: int) -> None:
    """Limits that are words, on one side or both, of a word and of a sum."""
    limits = [(-0.75, 1.5), (0.25, 4.0), (-2.5, -0.5), (-1.0, 1.0), (-9.0, 0.5), (0.125, 9.0)]

    def function(a: Any, b: Any) -> Any:
        return tuple(
            y for low, high in limits for y in (ops.clip(a, low, high), ops.clip(a + b, low, high))
        )

    t = trace(function, [(-4.0, 3.9)] * 2, word)
    fine = 2.0 ** (word - 7)
    a, b = np.random.default_rng(11).integers(-3.9 * fine, 3.9 * fine, (2, 2000)) / fine
    fixed, floats, saturated = t.run(a, b)
    assert not saturated.any()
    for y, want in zip(fixed, floats, strict=True):
        assert np.array_equal(y, want)


@pytest.mark.parametrize("word", [18, 32])
def test_clip_of_far_more_than_its_limits_hold(trace: Any, word: int) -> None:
    """No more is lost than the last bit of what is limited."""
    t = trace(
        lambda a, b: (ops.clip(1e9 * a * b, -0.5, 0.75), ops.clip(a, 0.9, 0.9 + 1e-6)),
        [(-1.0, 1.0)] * 2,
        word,
    )
    fixed, floats, saturated = t.run([0.0, 1.0, 0.5, -1.0, 0.0], [0.5, 1.0, -0.25, 1e-2, 0.0])
    assert not saturated.any() and np.array_equal(fixed[0], floats[0])
    assert np.abs(fixed[1] - floats[1]).max() <= t.formats()[1].lsb


def test_limits_that_vary(trace: Any) -> None:
    t = trace(lambda x, most: ops.clip(x, -most, most), [(-4.0, 4.0), (0.0, 3.0)])
    fixed, floats, saturated = t.run(
        *np.random.default_rng(13).uniform([[-4.0], [0.0]], 3.0, (2, 500))
    )
    assert np.array_equal(fixed[0], floats[0]) and not saturated.any()


@pytest.mark.parametrize("word", [18, 32])
def test_a_clamp_inside_a_wider_bound_still_clamps(trace: Any, word: int) -> None:
    t = trace(
        lambda a: ops.bounded(ops.saturated(8.0 * a, 1.0), -4.0, 4.0, "wider"), [(-1.0, 1.0)], word
    )
    fixed, floats, saturated = t.run([-1.0, -0.06, 0.06, 1.0])
    assert np.abs(fixed[0] - floats[0]).max() <= 2 * t.formats()[0].lsb
    assert not saturated.any()


@pytest.mark.parametrize("limit", [2.0**-10, 2.0**-20])
def test_a_clamp_far_below_the_range(trace: Any, limit: float) -> None:
    """The result's binary point lies beyond one shift: raised step by step."""
    t = trace(lambda a: ops.saturated(a, limit), [(-1e6, 1e6)])
    fixed, floats, saturated = t.run([-1e6, -1.0, -0.25 * limit, 0.0, 0.25 * limit, 1.0, 1e6])
    assert np.abs(fixed[0] - floats[0]).max() <= t.formats()[0].lsb
    assert not saturated.any()
    assert t.formats()[0].max < limit


def test_a_wrong_bound_raises_the_sticky_flag(trace: Any) -> None:
    t = trace(lambda a: ops.bounded(2.0 * a, -1.0, 0.999, "wrong on purpose"), [(-1.0, 0.999)])
    fixed, _, saturated = t.run([0.25, 0.75, -0.75])
    assert np.array_equal(saturated, [False, True, True])
    assert np.abs(fixed[0] - [0.5, 1.0, -1.0]).max() < 2.0**-30


def test_functions_of_selected_and_limited_numbers_are_correctly_rounded() -> None:
    v = 0.02171951248383798  # numpy's last bit of its sine is another
    wanted = ops.sincos_ht(v)[0]
    for x in (
        ops.absolute(-v),
        ops.clip(v, -1.0, 1.0),
        ops.where(v < 1.0, v, 0.0),
        ops.maximum(v, 0.0),
        ops.minimum(v, 1.0),
        ops.flip(v < 0.0, v),
        ops.saturated(v, 1.0),
    ):
        assert type(x) is float and ops.sincos_ht(x)[0] == wanted


def test_plain_numbers_and_arrays_agree() -> None:
    for x in np.linspace(-1.0, 1.0, 41):
        array = np.array([x])
        for function in (ops.sincos_ht, ops.asin_ht, lambda v: ops.rsqrt(v * v + 0.1)):
            assert np.allclose(
                function(float(x)), np.ravel(function(array)), rtol=4e-16, atol=4e-16
            )
        y = ops.atan2_ht(0.3, float(x))
        assert type(y) is float and abs(y - ops.atan2_ht(0.3, array)[0]) < 4e-16


@pytest.mark.parametrize(
    "low, high, root_low, root_high", [(0.25, 4.0, 0.5, 2.0), (0.0, 0.25, 0.0, 0.5)]
)
def test_range_of_a_root(low: float, high: float, root_low: float, root_high: float) -> None:
    x = Tracer("root").leaf("input", "x", low, high)
    for root in (ops.sqrt(x), x * ops.rsqrt(x)):
        node = node_of(root)
        assert (node.low, node.high) == (root_low, root_high)


@pytest.mark.parametrize(("low", "high"), [(1.0, -1.0), (0.0, math.inf), (math.nan, 1.0)])
def test_bounds_are_finite_and_ordered(low: float, high: float) -> None:
    for x in (0.5, Tracer("unit").leaf("input", "x", 0.0, 1.0)):
        with pytest.raises(
            InputError, match=r": wanted a range that is finite and ordered, found \("
        ):
            ops.bounded(x, low, high, "because")


@pytest.mark.parametrize("limit", [3.0, 0.0, 0.75])
def test_saturation_limits_are_powers_of_two(limit: float) -> None:
    for x in (0.5, Tracer("unit").leaf("input", "x", 0.0, 1.0)):
        with pytest.raises(
            InputError, match=rf": wanted a power of two as limit, found {limit!r}; "
        ):
            ops.saturated(x, limit)


def test_limits_on_arrays() -> None:
    x = np.array([-2.0, 0.25, 3.0])
    assert ops.maximum(x, 0.5).tolist() == [0.5, 0.5, 3.0]
    assert ops.minimum(0.5, x).tolist() == [-2.0, 0.25, 0.5]
    assert ops.clip(x, -1.0, 1.0).tolist() == ops.saturated(x, 1.0).tolist() == [-1.0, 0.25, 1.0]
    assert ops.bounded(x, -1.0, 1.0, "not on floats") is x and ops.named("x", x) is x
    traced = np.array([Tracer("unit").leaf("input", "x", -4.0, 4.0)] * 2)
    for limited in (
        ops.maximum(traced, 0.0),
        ops.clip(traced, 0, 1),
        ops.bounded(traced, 0, 4, ""),
    ):
        assert [node_of(x).low for x in limited] == [0.0, 0.0]


def test_an_angle_of_another_unit_is_refused_also_in_a_sum() -> None:
    """A chain of sums is looked into so far that it takes no time."""
    g = Tracer("unit")
    angle, number = g.leaf("input", "a", -1.0, 1.0, "deg"), g.leaf("input", "n", -1.0, 1.0)
    for function in (ops.wrap_ht, ops.sincos_ht):
        with pytest.raises(InputError, match="an angle in half turns, found 'deg'; write x / 180"):
            function(0.5 - ops.absolute(angle + 0.25))
    with pytest.raises(InputError, match="an angle in half turns, found 'rad'; write x / math.pi"):
        ops.sincos_ht(np.arctan2(number, 2.0))
    assert ops.unit_of(57.29578 * np.arctan2(number, 2.0))[0] == "deg"
    for unit, turns in (("ht", r"x"), ("deg", r"x / 180\.0")):
        fix = rf"an angle in rad, found '{unit}'; write ops\.sincos_ht\({turns}\)"
        with pytest.raises(InputError, match=fix):
            np.cos(g.leaf("input", "b", -1.0, 1.0, unit) + 0.5)
    np.cos(np.pi * g.leaf("input", "b", -1.0, 1.0, "ht"))
    for _ in range(60):
        number = number + number
    ops.wrap_ht(number)


def test_a_number_is_no_condition() -> None:
    x = Tracer("unit").leaf("input", "x", -1.0, 1.0)
    assert (ops.where(1, 2.0, 3.0), ops.where(0, 2.0, 3.0)) == (2.0, 3.0)
    for wrong, found in ((x, "a traced leaf; compare"), (-2, "-2; compare")):
        with pytest.raises(InputError, match=f"wanted a condition such as x > 0.5, found {found}"):
            ops.where(wrong, 2.0, 3.0)


def test_limits_of_a_clip_are_in_order_or_vary() -> None:
    x = Tracer("unit").leaf("input", "x", -1.0, 1.0)
    assert [ops.clip(0.5, *limits).kind for limits in ((x, 2.0), (-2.0, x))] == ["larger"] * 2
    with pytest.raises(InputError, match="limits of ops.clip in order"):
        ops.clip(x, 1.0, -1.0)
    for limits in ((-math.inf, 3.0), (-3.0, math.inf)):
        with pytest.raises(InputError, match="finite limits.*write ops.maximum or ops.minimum"):
            ops.clip(x, *limits)


def test_a_clip_whose_varying_limits_cross_is_the_same_on_all_levels(trace: Any) -> None:
    """The lower limit holds then, in numpy as in words."""
    t = trace(lambda x, low: ops.clip(x, low, 1.0), [(-4.0, 4.0), (-4.0, 4.0)])
    (fixed,), (floats,), _ = t.run([0.5, 0.5, 3.0, 3.0], [-2.0, 2.0, 0.5, 2.0])
    assert floats.tolist() == [0.5, 2.0, 1.0, 2.0]
    assert fixed.tolist() == floats.tolist()


@pytest.mark.parametrize(("name", "near"), [("cos", "sincos_ht"), ("max", "maximum")])
def test_a_function_of_another_name_is_named(name: str, near: str) -> None:
    with pytest.raises(AttributeError, match=f"ops has no {name}: try {near};"):
        getattr(ops, name)
