"""The traced graph: folding, merging, intervals, conditions, refusals."""

import math
import operator
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from boresight.model import ops
from boresight.model.errors import InputError
from boresight.model.lowering.graph import Graph, Node


@pytest.fixture
def g() -> Any:
    return Graph("unit")


def leaf(g: Any, name: str = "x", low: float = -2.0, high: float = 3.0) -> Any:
    return g.leaf("input", name, low, high)


def test_constants_fold(g: Any) -> None:
    two = g.const(2.0)
    assert (two + 3.0).value == 5.0
    assert (two - 3.0).value == -1.0
    assert (two * 3.0).value == 6.0
    assert (-two).value == -2.0
    assert (two / 4.0).value == 0.5
    assert (4.0 / two).value == 2.0
    assert g.wrap(g.const(1.25)).value == -0.75
    assert g.function("sin", g.const(0.25)).value == math.sqrt(0.5)
    assert g.function("sin", g.const(1.0)).value == 0.0
    assert g.function("sin", g.const(0.0), quarter=True).value == 1.0
    assert g.function("asin", g.const(0.5)).value == 1.0 / 6.0
    assert g.function("rsqrt", g.const(0.25)).value == 2.0
    assert ops.sqrt(g.const(2.25)).value == 1.5
    assert g.bounded(g.const(1.0), -1.0, 1.0, "fits").value == 1.0
    assert g.const(-0.0).value == 0.0 and math.copysign(1.0, g.const(-0.0).value) == 1.0
    assert g.nodes and all(n.kind == "const" for n in g.nodes)


def test_structural_zeros_and_ones_disappear(g: Any) -> None:
    x = leaf(g)
    zero, one = g.const(0.0), g.const(1.0)
    assert x + 0.0 is x and 0.0 + x is x and x - 0.0 is x
    assert x * 1.0 is x and one * x is x
    assert x * 0.0 is zero and (x - x) is zero
    opposite = -x
    assert -opposite is x and opposite.high == 2.0
    assert ops.where(x < 0.0, x, x) is x
    assert ops.absolute(x * x) is x * x
    assert x + x is x * 2.0


def test_equal_expressions_are_one_node(g: Any) -> None:
    x, y = leaf(g, "x"), leaf(g, "y")
    assert x * y is y * x
    assert x + y is x + y
    assert 2.0 * (3.0 * x) is x * 6.0
    assert ops.sincos_ht(x * y)[0] is ops.sincos_ht(y * x)[0]
    assert ops.sincos_ht(x)[0] is not ops.sincos_ht(x)[1]
    assert x - y is not y - x
    count = len(g.nodes)
    ops.atan2_ht(x, y)
    grown = len(g.nodes)
    ops.atan2_ht(x, y)
    assert grown > count and len(g.nodes) == grown


def test_a_named_product_keeps_its_constant(g: Any) -> None:
    named = ops.named("double", leaf(g) * 2.0)
    assert (named * 3.0).args[0] is named and named.label == "double"
    assert ops.named("again", named).name == "double"
    assert ops.named("leaf", leaf(g)).name == "x"


def test_certain_conditions_choose_at_once(g: Any) -> None:
    x, y = leaf(g, "x", 1.0, 2.0), leaf(g, "y")
    assert ops.where(x < 0.0, y, x) is x
    assert ops.where(x > 0.0, y, x) is y
    assert ops.where(x >= 1.0, y, x) is y
    assert ops.where(~(x < 0.0), y, x) is y
    assert ops.flip(x > 0.0, y).signs == (-1,)
    assert ops.flip(x < 0.0, y) is y
    assert ops.clip(x, 0.0, 5.0) is x
    assert ops.saturated(x, 4.0) is x
    assert ops.saturated(x, 0.5).value == 0.5


def test_squares_are_not_negative(g: Any) -> None:
    x = leaf(g)
    assert (x * x).low == 0.0 and (x * x).high == 9.0
    away = leaf(g, "a", -3.0, -2.0)
    assert (away * away).low == 4.0


def test_zero_times_unbounded_is_zero(g: Any) -> None:
    root = g.function("rsqrt", leaf(g, "p", 0.0, 4.0))
    assert (root.low, root.high) == (0.5, math.inf)
    product = root * leaf(g, "n", -1.0, 0.0)
    assert (product.low, product.high) == (-math.inf, 0.0)
    scaled = product * leaf(g, "u", 0.0, 1.0)
    assert (scaled.low, scaled.high) == (-math.inf, 0.0)


# -- intervals ------------------------------------------------------------------------------------

BINARY: dict[str, Callable[..., Any]] = {
    "add": operator.add,
    "sub": operator.sub,
    "mul": operator.mul,
    "min": ops.minimum,
    "max": ops.maximum,
    "pick": lambda a, b: ops.where(a < b, a, 0.5 * b),
    "flip": lambda a, b: ops.flip(a > b, b),
    "both": lambda a, b: ops.where((a < 1.0) & ~(b < 0.0), a, b),
    "over": lambda a, b: a / ops.clip(b, 0.5, 9.0),
}
UNARY: dict[str, Callable[..., Any]] = {
    "neg": operator.neg,
    "abs": ops.absolute,
    "wrap": ops.wrap_ht,
    "clip": lambda a: ops.clip(a, -0.75, 1.5),
    "sat": lambda a: ops.saturated(a, 0.5),
    "sin": lambda a: ops.sincos_ht(a)[0],
    "cos": lambda a: ops.sincos_ht(a)[1],
    "sqrt": lambda a: ops.sqrt(a * a),
    "scale": lambda a: a * -0.3,
}
LEAF_RANGES = ((-2.0, 3.0), (0.0, 1.0), (-5.0, -0.25), (0.0, 0.0625))
tree = st.recursive(
    st.sampled_from([0, 1, 2, 3, 0.0, -1.5, 2.0]).map(
        lambda v: ("leaf", v) if isinstance(v, int) else ("const", v)
    ),
    lambda sub: st.one_of(
        st.tuples(st.sampled_from(sorted(UNARY)), sub),
        st.tuples(st.sampled_from(sorted(BINARY)), sub, sub),
    ),
    max_leaves=10,
)


def evaluate(t: Any, leaves: Any, const: Any) -> Any:
    if t[0] == "leaf":
        return leaves[t[1]]
    if t[0] == "const":
        return const(t[1])
    return {**UNARY, **BINARY}[t[0]](*(evaluate(s, leaves, const) for s in t[1:]))


@settings(max_examples=300, deadline=None)
@given(tree, st.integers(0, 2**32 - 1))
def test_intervals_hold_every_value(t: Any, seed: int) -> None:
    g = Graph("unit")
    node = g.lift(
        evaluate(t, [g.leaf("input", f"x{k}", *r) for k, r in enumerate(LEAF_RANGES)], g.const)
    )
    rng = np.random.default_rng(seed)
    points = [
        np.concatenate([rng.uniform(low, high, 40), rng.choice([low, high], 24)])
        for low, high in LEAF_RANGES
    ]
    y = np.broadcast_to(evaluate(t, points, float), (64,))
    slack = 1e-9 * (1.0 + max(abs(node.low), abs(node.high)))
    assert node.low - slack <= y.min() and y.max() <= node.high + slack


# -- refusals -------------------------------------------------------------------------------------


def test_traced_values_have_no_truth(g: Any) -> None:
    x = leaf(g)
    with pytest.raises(
        TypeError,
        match=r"^a traced value has no truth value: use "
        r"model\.ops\.where instead of if$",
    ):
        bool(x)
    with pytest.raises(
        TypeError,
        match=r"^a traced condition has no truth value: use "
        r"model\.ops\.where$",
    ):
        bool(x < 1.0)
    with pytest.raises(
        TypeError,
        match=r"^traced values compare with < > <= >= only, not with == "
        r"or !=$",
    ):
        bool(x == 1.0)
    same = x
    assert x == same and len({x, same}) == 1


def test_numpy_scalars_leave_the_operators_to_the_node(g: Any) -> None:
    x = leaf(g)
    assert isinstance(np.float64(2.0) * x, Node) and np.float64(2.0) * x is x * 2.0
    assert np.float64(1.0) - x is 1.0 - x
    assert ops.where(np.float64(9.0) < x, 1.0, 2.0).value == 2.0


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_constants_are_finite(g: Any, value: Any) -> None:
    with pytest.raises(InputError, match=rf"^unit: constants must be finite, not {value!r}$"):
        leaf(g) + value


@pytest.mark.parametrize(("low", "high"), [(-1.0, 1.0), (0.0, 1.0), (-1.0, 0.0)])
def test_reciprocal_through_zero_is_refused_by_name(g: Any, low: float, high: float) -> None:
    with pytest.raises(
        InputError,
        match=rf"^test_graph\.py, line \d+: unit: reciprocal of speed: its range \[{low:g}, "
        rf"{high:g}\] must exclude 0; clip it first$",
    ):
        1.0 / leaf(g, "speed", low, high)


@pytest.mark.parametrize(("low", "high"), [(1.0, -1.0), (0.0, math.inf), (math.nan, 1.0)])
def test_bounds_are_finite_and_ordered(g: Any, low: float, high: float) -> None:
    with pytest.raises(
        InputError,
        match=r"^unit: the range of speed must be finite and ordered, "
        r"not \[.*\]$",
    ):
        ops.bounded(leaf(g, "speed"), low, high, "because")


@pytest.mark.parametrize("limit", [3.0, 0.0, 0.75])
def test_saturation_limits_are_powers_of_two(g: Any, limit: float) -> None:
    with pytest.raises(ValueError, match=rf"^limit must be a power of two, not {limit!r}$"):
        ops.saturated(leaf(g), limit)


def test_unknown_function(g: Any) -> None:
    with pytest.raises(ValueError, match=r"^unknown function 'tan'$"):
        g.function("tan", leaf(g))


def test_nodes_describe_themselves(g: Any) -> None:
    assert repr(leaf(g, "speed")) == "<speed input [-2, 3]>"
    assert repr(leaf(g) * leaf(g, "y")) == "<mul_3 mul [-6, 9]>"


# -- conditions, through fixed point --------------------------------------------------------------


def compare(kind: Any, a: Any, b: Any) -> Any:
    return {"<": lambda: a < b, ">": lambda: a > b, "<=": lambda: a <= b, ">=": lambda: a >= b}[
        kind
    ]()


def invert(c: Any, yes: Any) -> Any:
    """Logical not of a traced condition or an array, if asked for."""
    return ~c if yes else c


@pytest.mark.parametrize("word", [18, 25, 32])
@pytest.mark.parametrize("kinds", [("<", ">"), (">=", "<"), ("<=", ">="), (">", "<=")])
def test_conditions_are_boolean_logic(trace: Any, word: int, kinds: Any) -> None:
    """Every inversion of & and |, on integers, so that no comparison is near."""
    cases = [
        (p, q, r, f)
        for p in (0, 1)
        for q in (0, 1)
        for r in (0, 1)
        for f in (operator.and_, operator.or_)
    ]

    def function(x0: Any, x1: Any) -> Any:
        out = []
        for p, q, r, combine in cases:
            c = combine(
                invert(compare(kinds[0], x0, 1.0), p), invert(compare(kinds[1], x1, -2.0), q)
            )
            c = combine(invert(c, r), x0 < x1)
            out.append(ops.where(c, 1.0, 0.0))
        return tuple(out)

    a, b = (v.ravel() for v in np.meshgrid(np.arange(-4.0, 5.0), np.arange(-4.0, 5.0)))
    fixed, floats, saturated = trace(function, [(-4.0, 4.0), (-4.0, 4.0)], word).run(a, b)
    assert not saturated.any()
    for case, y, want in zip(cases, fixed, floats, strict=True):
        assert np.array_equal(y, want), case


@pytest.mark.parametrize("word", [18, 32])
@pytest.mark.parametrize("span", [1e-3, 4.0, 3e5])
def test_conditions_of_unlike_size_combine(trace: Any, word: int, span: float) -> None:
    """A condition on a coarse value & one on a fine value, each decided well outside its LSB."""

    def function(x0: Any, x1: Any) -> Any:
        big, small = x0 < 0.25 * span, x1 < 0.25e-6 * span
        return tuple(
            ops.where(c, 1.0, 0.0)
            for c in (
                big & small,
                big & ~small,
                ~big & small,
                ~big & ~small,
                big | small,
                big | ~small,
                ~big | small,
                ~big | ~small,
                small & big,
                small | ~big,
                ~small & ~big,
            )
        )

    a, b = (v.ravel() for v in np.meshgrid(*2 * [np.linspace(-1.0, 1.0, 8)]))
    fixed, floats, _ = trace(function, [(-span, span), (-1e-6 * span, 1e-6 * span)], word).run(
        a * span, b * 1e-6 * span
    )
    for y, want in zip(fixed, floats, strict=True):
        assert np.array_equal(y, want)


def test_a_condition_on_a_constant_combines(trace: Any) -> None:
    def function(x0: Any) -> Any:
        zero = x0 - x0
        never, always = zero < 0.0, ~(zero < 0.0)
        if not isinstance(x0, Node):
            never, always = np.zeros(len(x0), bool), np.ones(len(x0), bool)
        return tuple(
            ops.where(c, 1.0, 0.0)
            for c in (
                (x0 < 0.0) & always,
                (x0 < 0.0) & never,
                (x0 < 0.0) | always,
                (x0 < 0.0) | never,
                always & (x0 < 0.0),
                never | (x0 < 0.0),
            )
        )

    fixed, floats, _ = trace(function, [(-1.0, 1.0)]).run(np.array([-0.5, 0.5]))
    for y, want in zip(fixed, floats, strict=True):
        assert np.array_equal(y, want)
