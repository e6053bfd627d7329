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
from boresight.model.estimator import Estimator, Input, Output, State
from boresight.model.lowering.expand import expand
from boresight.model.lowering.graph import Graph, Node, declared_name
from boresight.model.lowering.trace import Scalar, Tracer
from tests.support.nodes import node_of, nodes_of

pytestmark = pytest.mark.pythons


@pytest.fixture
def g() -> Any:
    return Tracer("unit")


def leaf(g: Any, name: str = "x", low: float = -2.0, high: float = 3.0) -> Any:
    return g.leaf("input", name, low, high)


def nodes(*x: Any) -> list[Node]:
    """Nodes of numbers or recorded expressions, of one graph."""
    g = next(e.tracer for e in x if isinstance(e, Scalar))
    return nodes_of(*(g.lift(e) for e in x))


def same(*x: Any) -> bool:
    """Whether all are one node."""
    return len(set(nodes(*x))) == 1


def test_constants_fold(g: Any) -> None:
    two = g.const(2.0)
    folded = [
        (two + 3.0, 5.0),
        (two - 3.0, -1.0),
        (two * 3.0, 6.0),
        (-two, -2.0),
        (two / 4.0, 0.5),
        (4.0 / two, 2.0),
        (ops.wrap_ht(g.const(1.25)), -0.75),
        (ops.sincos_ht(g.const(0.25))[0], math.sqrt(0.5)),
        (ops.sincos_ht(g.const(1.0))[0], 0.0),
        (ops.sincos_ht(g.const(0.0))[1], 1.0),
        (ops.asin_ht(g.const(0.5)), 1.0 / 6.0),
        (ops.asin_ht(g.const(7.0)), 0.5),
        (ops.rsqrt(g.const(0.25)), 2.0),
        (ops.sqrt(g.const(2.25)), 1.5),
        (ops.bounded(g.const(1.0), -1.0, 1.0, "fits"), 1.0),
        (ops.maximum(two, 3.0), 3.0),
        (ops.minimum(two, 3.0), 2.0),
        (1.0 / ops.named("two", two), 0.5),
    ]
    result = nodes(*(number for number, _ in folded))
    assert [(n.kind, n.value) for n in result] == [("const", v) for _, v in folded]
    graph, _ = expand(g)
    assert all(n.kind == "const" for n in graph.nodes)
    (beyond,) = nodes(ops.bounded(g.const(7.0), -1.0, 1.0, "which it is not"))
    assert (beyond.kind, beyond.low, beyond.high) == ("bounded", -1.0, 1.0)
    assert math.copysign(1.0, graph.const(-0.0).value) == 1.0


def test_structural_zeros_and_ones_disappear(g: Any) -> None:
    x = leaf(g)
    zero, unit = g.const(0.0), g.const(1.0)
    assert same(
        x, x + 0.0, 0.0 + x, x - 0.0, x * 1.0, unit * x, -1.0 * (-x), ops.where(x < 0.0, x, x)
    )
    assert same(zero, x * 0.0, x - x)
    assert nodes(-x)[0].high == 2.0
    assert same(ops.absolute(x * x), x * x)
    assert same(x + x, x * 2.0)


def test_equal_expressions_are_one_node(g: Any) -> None:
    x, y = leaf(g, "x"), leaf(g, "y")
    assert same(x * y, y * x)
    assert same(2.0 * (3.0 * x), x * 6.0)
    assert same(ops.sincos_ht(x * y)[0], ops.sincos_ht(y * x)[0])
    assert not same(*ops.sincos_ht(x))
    assert not same(x - y, y - x)
    ops.atan2_ht(x, y)
    before = len(expand(g)[0].nodes)
    ops.where(y * y < x * x, y, x)  # which the arc tangent computes too
    assert len(expand(g)[0].nodes) == before


def test_a_named_product_keeps_its_constant(g: Any) -> None:
    x = leaf(g)
    named = ops.named("double", x * 2.0)
    node, product, again, plain = nodes(named, named * 3.0, ops.named("again", named), x * 2.0)
    assert product.args[0] is node is again is plain and node.label == "double"
    assert nodes(ops.named("leaf", x))[0].name == "x"


def test_certain_conditions_choose_at_once(g: Any) -> None:
    x, y = leaf(g, "x", 1.0, 2.0), leaf(g, "y")
    assert same(x, ops.where(x < 0.0, y, x), ops.where(x > 0.0, x, y), ops.where(x >= 1.0, x, y))
    assert same(x, ops.where(~(x < 0.0), x, y), ops.clip(x, 0.0, 5.0), ops.saturated(x, 4.0))
    for z, yes, no in ((x, y, x), (leaf(g, "zero", 0.0, 2.0), y, x), (-x, x, y)):
        plain = ops.where(y < 0.0, yes, no)
        both = (z < 0.0) ^ (y < 0.0), (y < 0.0) ^ (z < 0.0)
        assert same(plain, *(ops.where(c, y, x) for c in both))
    assert nodes(ops.flip(x > 0.0, y))[0].signs == (-1,)
    assert same(ops.flip(x < 0.0, y), ops.flip(leaf(g, "zero", 0.0, 2.0) < 0.0, y), y)
    (turned,) = nodes(ops.flip(y >= 0.0, x))
    assert turned.signs == (-1,) and same(ops.flip(y < 0.0, x), -ops.flip(y >= 0.0, x))
    assert nodes(ops.absolute(leaf(g, "negative", -2.0, 0.0)))[0].signs == (-1,)
    assert nodes(ops.saturated(x, 0.5))[0].value == 0.5


@pytest.mark.parametrize(
    ("low", "high", "wanted"),
    [(-4.0, 1.0, (-4.0, 4.0 * (1.0 - 2.0**-17))), (-1.0, 4.0, (-4.0, 4.0))],
)
def test_of_two_conditions_that_differ(g: Any, low: float, high: float, wanted: Any) -> None:
    """One node, of as many integer bits as the word whose sign it takes or turns."""
    x, y = leaf(g, "x"), leaf(g, "y", low, high)
    ops.where((x < 0.0) ^ (y < 0.0), 1.0, 0.0)
    found = [n for n in expand(g)[0].nodes if n.kind == "complement"]
    assert [(n.low, n.high) for n in found] == [wanted]
    assert [a.name for a in found[0].args] == ["x", "y"]


def test_squares_are_not_negative(g: Any) -> None:
    x, away = leaf(g), leaf(g, "a", -3.0, -2.0)
    square, far = nodes(x * x, away * away)
    assert (square.low, square.high, far.low) == (0.0, 9.0, 4.0)


def test_zero_times_unbounded_is_zero(g: Any) -> None:
    root = ops.rsqrt(leaf(g, "p", 0.0, 4.0))
    product = root * leaf(g, "n", -1.0, 0.0)
    scaled = product * leaf(g, "u", 0.0, 1.0)
    results = [(n.low, n.high) for n in nodes(root, product, scaled)]
    assert results == [(0.5, math.inf), (-math.inf, 0.0), (-math.inf, 0.0)]


def test_the_larger_and_the_smaller_are_as_narrow_as_they_can_be(g: Any) -> None:
    x, y = leaf(g, "x", -2.0, 3.0), leaf(g, "y", 0.5, 1.0)
    result = nodes(ops.maximum(x, y), ops.minimum(x, y), ops.maximum(x, 0.25), ops.minimum(7.0, x))
    assert [(n.low, n.high) for n in result] == [(0.5, 3.0), (-2.0, 1.0), (0.25, 3.0), (-2.0, 3.0)]
    assert result[3].kind == "input"


def test_a_larger_number_is_a_divisor(trace: Any) -> None:
    """Of what may be negative or zero, limited from below."""
    t = trace(lambda x: (1.0 / ops.maximum(x, 0.25), 1.0 / ops.minimum(x, -0.5)), [(-8.0, 8.0)])
    x = np.concatenate([np.linspace(-8.0, 8.0, 257), [0.25, 0.25 - 2.0**-20, -0.5, 0.0]])
    fixed, floats, saturated = t.run(x)
    for y, want, fmt in zip(fixed, floats, t.formats(), strict=True):
        assert np.abs(y - want).max() < 2.0 * fmt.lsb
    assert not saturated.any() and [f.frac for f in t.formats()] == [28, 30]


# -- intervals ------------------------------------------------------------------------------------


def inverse(condition: Any) -> Any:
    """``~``, which of a Python bool is another number."""
    return not condition if isinstance(condition, bool) else ~condition


BINARY: dict[str, Callable[..., Any]] = {
    "add": operator.add,
    "sub": operator.sub,
    "mul": operator.mul,
    "min": ops.minimum,
    "max": ops.maximum,
    "pick": lambda a, b: ops.where(a < b, a, 0.5 * b),
    "flip": lambda a, b: ops.flip(a > b, b),
    "both": lambda a, b: ops.where((a < 1.0) & inverse(b < 0.0), a, b),
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


@settings(max_examples=300)
@given(tree, st.integers(0, 2**32 - 1))
def test_intervals_hold_every_value(t: Any, seed: int) -> None:
    g = Tracer("unit")
    leaves = [g.leaf("input", f"x{k}", *r) for k, r in enumerate(LEAF_RANGES)]
    node = node_of(evaluate(t, leaves, g.const))
    rng = np.random.default_rng(seed)
    points = [
        np.concatenate([rng.uniform(low, high, 40), rng.choice([low, high], 24)])
        for low, high in LEAF_RANGES
    ]
    y = np.broadcast_to(evaluate(t, points, float), (64,))
    slack = 1e-9 * (1.0 + max(abs(node.low), abs(node.high)))
    assert node.low - slack <= y.min() and y.max() <= node.high + slack


# -- refusals -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("low", "high"), [(-1.0, 1.0), (0.0, 1.0), (-1.0, 0.0), (0.0, 1e5), (-1e5, 0.0)]
)
def test_reciprocal_through_zero_is_refused_by_name(g: Any, low: float, high: float) -> None:
    with pytest.raises(
        InputError,
        match=r"^test_graph\.py, line \d+: wanted a divisor whose range excludes 0, found speed in "
        rf"\[{low:g}, {high:g}\]; divide by ops\.{'maximum' if high - low < 3.0 else 'clip'}\(",
    ):
        nodes(1.0 / leaf(g, "speed", low, high))


def test_nodes_have_labels(g: Any) -> None:
    assert [n.label for n in nodes(leaf(g, "speed"), leaf(g) * leaf(g, "y"))] == ["speed", "mul_3"]


def test_a_state_that_bears_the_name_of_an_input() -> None:
    """Its author's name is told; the program has another one for it."""

    class Same(Estimator):
        inputs = (Input("y", -1.0, 1.0),)
        states = (State("y", -1.0, 1.0),)
        outputs = (Output("z"),)

        def step(self, x: Any, u: Any, p: Any) -> Any:
            return {"y": 0.5 * (x.y + u.y)}, {"z": ops.named("w", 0.25 * x.y)}

    program, nodes = Same().compile_traced()
    (state, after), (output,) = program.states[0], program.outputs
    assert program.values[state].name != "y"
    said = [declared_name(program, nodes, n) for n in (program.inputs[0], state, output)]
    assert said == ["y", "y", "w"] and declared_name(program, {}, after) == "y_next"


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
        if not isinstance(x0, Scalar):
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


def test_conditions_of_which_one_holds_alone(trace: Any) -> None:
    """Of one that may hold, one that holds, one that does not, and those that just may not."""
    ranges = [(-4.0, 4.0), (-2.0, -1.0), (1.0, 2.0), (0.0, 1.0), (-1.0, 0.0)]

    def function(*x: Any) -> Any:
        conditions = [v < 0.0 for v in x] + [~(v < 0.0) for v in x] + [x[4] < -0.5 * x[3]]
        pairs = [(a, b) for a in conditions for b in conditions]
        return tuple(ops.where(c, 1.0, 0.0) for a, b in pairs for c in (a ^ b, a & b, a | b))

    rng = np.random.default_rng(5)
    columns = [rng.choice([low, high, 0.5 * (low + high)], 60) for low, high in ranges]
    fixed, floats, saturated = trace(function, ranges).run(*columns)
    assert not saturated.any() and len(fixed) == 363
    for k, (y, want) in enumerate(zip(fixed, floats, strict=True)):
        assert np.array_equal(y, want), divmod(k // 3, 11)


@pytest.mark.parametrize(("line", "where"), [("", "unit: "), ("f.py, line 3", "f.py, line 3: ")])
def test_a_constant_that_is_no_number_is_refused_where_it_is_made(line: str, where: str) -> None:
    graph = Graph("unit")
    graph.line = line
    with pytest.raises(InputError, match=f"^{where}wanted finite constants"):
        graph.const(math.inf)


@pytest.mark.parametrize(
    "edges, limits",
    [
        ((0.0, 2.0**30), (0.25, 1.0)),
        ((-(2.0**30), 0.0), (-1.0, -0.25)),
        ((-(2.0**30), 2.0**30), (-1.0, 0.25)),
    ],
)
def test_a_clip_of_a_range_that_is_far_wider(trace: Any, edges: Any, limits: Any) -> None:
    x = np.concatenate([np.linspace(*edges, 65), np.arange(max(edges[0], -4.0), 0.0)])
    fixed, floats, saturated = trace(lambda v: ops.clip(v, *limits), [edges]).run(x)
    assert np.array_equal(fixed[0], floats[0]) and not saturated.any()


@pytest.mark.parametrize(
    "edges", [(99.0, 101.0), (99.0, 100.0 + 2.0**-12), (100.0 + 2.0**-12, 101.0)]
)
def test_a_clip_of_a_narrow_range_far_from_zero(trace: Any, edges: Any) -> None:
    limits = (100.0, 100.0 + 2.0**-11)
    x = np.concatenate([np.linspace(*edges, 65), np.clip(np.linspace(*limits, 33), *edges)])
    fixed, floats, saturated = trace(lambda v: ops.clip(v, *limits), [edges]).run(x)
    assert np.abs(fixed[0] - floats[0]).max() <= 2.0**-23 and not saturated.any()
    assert fixed[0].min() >= limits[0] and fixed[0].max() <= limits[1]


@pytest.mark.parametrize("limits", [(-1.0, 1.0), (100.0, 100.0 + 2.0**-11)])
@pytest.mark.parametrize("far", [(0.0, 0.0), (9.0, 0.0), (0.0, 9.0), (9.0, 9.0)])
def test_a_clip_has_a_clamp_or_a_choice_for_each_limit_that_is_passed(
    g: Any, limits: tuple[float, float], far: tuple[float, float]
) -> None:
    ops.clip(leaf(g, "x", limits[0] - far[0], limits[1] + far[1]), *limits)
    kinds = [n.kind for n in expand(g)[0].nodes]
    assert kinds.count("saturated") + kinds.count("select") == sum(map(bool, far))


@pytest.mark.parametrize(
    ("ends", "limits", "kinds"),
    [
        ((-(2.0**16), 2.0**16), (-1.0, 1.0), (2, 0)),
        ((-(2.0**18), 2.0**18), (-1.0, 1.0), (3, 0)),  # first by a word, in reach of the limits
        ((0.0, 40000.0), (32767.5, 32768.0), (2, 0)),
        ((0.0, 40000.0), (32768.0, 32768.5), (0, 2)),  # too far from 0 to be moved there
    ],
)
def test_a_clip_moves_as_far_as_an_accumulator_holds(
    g: Any, ends: tuple[float, float], limits: tuple[float, float], kinds: tuple[int, int]
) -> None:
    ops.clip(leaf(g, "x", *ends), *limits)
    made = [n.kind for n in expand(g)[0].nodes]
    assert (made.count("saturated"), made.count("select")) == kinds


@pytest.mark.parametrize("limits", [(1.0, 2.0), (-3.0, 1.0), (0.5, 0.5)])
def test_a_clip_to_one_number_is_that_number(g: Any, limits: tuple[float, float]) -> None:
    x = leaf(g, "x", *((-1.0, 1.0) if limits[0] > 0.0 else (1.0, 4.0)))
    (node,) = nodes(ops.clip(x, *limits))
    assert node.kind == "const" and node.value in limits


@pytest.mark.parametrize("limit", [0.25, 100.0])
def test_a_clip_of_no_finite_range_has_room_for_its_limits(g: Any, limit: float) -> None:
    x = leaf(g, "x", 0.0, 4.0)
    node = node_of(ops.clip(x * ops.rsqrt(leaf(g, "y", 0.0, 4.0)), 0.0, limit))
    assert (node.low, node.high) == (0.0, limit)
    inside = node
    while inside.kind != "saturated":
        inside = next(a for a in inside.args if a.kind != "const")
    assert limit < 2.0 * inside.value <= 4.0 * limit


@pytest.mark.parametrize(
    ("ends", "held", "wanted"),
    [
        ((-1.0, 4.0), (0.5, 3.0), (0.5, 4.0)),
        ((-1.0, 4.0), (-3.0, -0.5), (-1.0, -0.5)),
        ((-1e6, 1e6), (0.125, 4.0), (0.125, 8.0)),  # more than the word of a divisor spans
        ((-1e6, 1e6), (-4.0, -0.125), (-8.0, -0.125)),
        ((-5.0, 1e6), (-4.0, -0.125), (-5.0, -0.125)),
        ((-8192.0, 8192.0), (0.125, 4.0), (0.125, 8192.0)),  # just as much
        ((-32.0, 32.0), (2.0**-13, 31.0), (2.0**-13, 32.0)),  # no further than the limit
        ((-1e6, 1e6), (0.0, 4.0), (0.0, 1e6)),
        ((-math.inf, math.inf), (0.5, 3.0), (0.5, 4.0)),
        ((0.25, math.inf), (0.5, 3.0), (0.5, 4.0)),
        ((-math.inf, math.inf), (-3.0, -0.5), (-4.0, -0.5)),
    ],
)
def test_what_is_held_off_zero(ends: Any, held: Any, wanted: Any) -> None:
    """A divisor between the limits that runs came to; the other end is its own, or a word's."""
    graph = Graph("unit")
    node = graph.limited(graph.leaf("input", "x", *ends, ""), *held)
    assert (node.low, node.high) == wanted
