"""What fuses into one group, and where a function's argument must lie."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, Input, Output, State
from boresight.model.lowering.lower import lower
from boresight.model.lowering.trace import Trace, Tracer
from boresight.model.words.fixed import Arithmetic, Format
from boresight.model.words.program import Negate, Overflow
from tests.support.traced import Traced


def test_products_fuse_into_their_sum(trace: Any) -> None:
    t = trace(lambda a, b: a * b - 0.5 * b + ops.absolute(a) + 0.25, [(-1.0, 1.0)] * 2)
    (op,) = t.program.ops
    assert len(op.terms) == 4 and op.flag == t.program.inputs[0]
    assert [term.negate for term in op.terms] == [Negate.NO, Negate.YES, Negate.IF, Negate.NO]


def test_two_flags_do_not_fuse(trace: Any) -> None:
    t = trace(lambda a, b: ops.absolute(a) + ops.absolute(b), [(-1.0, 0.9)] * 2)
    assert len(t.program.ops) == 2
    fixed, floats, _ = t.run([-0.5, 0.5, -0.5], [-0.25, 0.25, 0.25])
    assert np.array_equal(fixed[0], floats[0])


def test_a_moved_binary_point_is_shared(trace: Any) -> None:
    """[0, 1] needs an odd binary point for the root: one copy serves all its users."""
    t = trace(
        lambda a, b: (b * ops.rsqrt(a + 0.0), ops.sqrt(a), ops.rsqrt(a) * (a * b)),
        [(0.01, 1.0), (-1.0, 1.0)],
    )
    assert [v.name for v in t.program.values].count("x0_aligned") == 1
    assert not any(v.name == "x0_aligned_2" for v in t.program.values)


def test_a_root_of_a_fresh_sum_has_an_even_exponent(trace: Any) -> None:
    t = trace(
        lambda a, b: ops.bounded(ops.rsqrt(a + b), 1.0, 8.0, "sum >= 1/50"), [(0.01, 0.5)] * 2
    )
    fixed, floats, saturated = t.run([0.01, 0.4, 0.5], [0.01, 0.5, 0.5])
    assert np.abs(fixed[0] / floats[0] - 1.0).max() < 2.0**-26
    assert not saturated.any()


@pytest.mark.parametrize("high", [0.2, 0.3, 0.5, 0.9, 1.8, 3.6])
def test_a_fresh_sum_has_its_roots_binary_point(trace: Any, high: float) -> None:
    """It is chosen once: nothing is moved afterwards, and no finer one is left unused."""
    t = trace(
        lambda a, b: ops.bounded(ops.rsqrt(a + b), 0.3, 8.0, "sum >= 1/50"), [(0.01, high)] * 2
    )
    assert not any("aligned" in v.name for v in t.program.values)
    total = t.program.values[t.program.ops[0].dest]
    finest = Format.for_range(32, 0.02, 2 * high).frac
    assert total.frac == finest - (finest + 1) % 2


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


def test_a_product_that_is_a_word_is_read_as_it_is(trace: Any) -> None:
    def both(a: Any, b: Any) -> Any:
        half = 0.5 * a
        return half, half * b

    t = trace(both, [(-1.0, 1.0)] * 2)
    assert t.program.outputs[0] in t.program.ops[1].operands()


def test_what_is_wrapped_and_read_besides_is_computed_once(trace: Any) -> None:
    def both(a: Any, b: Any) -> Any:
        inner = ops.wrap_ht(3.0 * a)
        return ops.wrap_ht(inner + b), inner

    t = trace(both, [(-1.0, 1.0)] * 2)
    assert t.program.outputs[1] in t.program.ops[1].operands()


@pytest.mark.parametrize("low", [-2.0, 0.5])
def test_a_quotient_has_its_divisors_sign(trace: Any, low: float) -> None:
    """The reciprocal's sign is a flag of the product that it is part of."""
    t = trace(lambda a, b: a * (1.0 / b), [(-1.0, 1.0), (low, low + 1.5)])
    a, b = np.meshgrid(np.linspace(-1.0, 0.99, 9), np.linspace(low, low + 1.5, 9))
    (fixed,), (wanted,), saturated = t.run(a.ravel(), b.ravel())
    assert np.abs(fixed - wanted).max() < 1e-8 and not saturated.any()


def test_a_quotient_of_a_magnitude(trace: Any) -> None:
    """The product has one flag: that of the magnitude's sign or that of the divisor's."""
    t = trace(lambda a, b: ops.absolute(a) * (1.0 / b), [(-1.0, 1.0), (-2.0, -0.5)])
    a, b = np.meshgrid(np.linspace(-1.0, 0.99, 9), np.linspace(-2.0, -0.5, 9))
    (fixed,), (wanted,), saturated = t.run(a.ravel(), b.ravel())
    assert np.abs(fixed - wanted).max() < 1e-8 and not saturated.any()


def test_a_root_has_no_sign(trace: Any) -> None:
    """By itself and as a factor, of what may be 0: no flag is read for it."""
    for function in (ops.rsqrt, lambda a: 3.0 * ops.rsqrt(a), ops.sqrt):
        t = trace(lambda a, f=function: ops.bounded(f(a), 0.0, 9.0, "test"), [(0.0, 4.0)])
        assert all(op.flag is None for op in t.program.ops)


def _twice(a: Any, b: Any, c: Any) -> Any:
    root = ops.rsqrt(c)
    return a * root + b, 0.25 * root, ops.bounded(root, 0.5, 2.0, "range of c")


def _halves(a: Any, b: Any, c: Any) -> Any:
    size = ops.absolute(a)
    return 0.5 * size + b, 0.25 * size - c


@pytest.mark.parametrize(
    ("function", "operations"),
    [
        # What a flag chooses or turns: another flag's or a count's value is one by itself.
        (lambda a, b, c: ops.where(a < 0.0, 0.5 * b, b - c), 1),
        (lambda a, b, c: ops.where(a < 0.0, b + 0.25, 0.75), 1),
        (lambda a, b, c: ops.where(a < 0.0, ops.absolute(b), c), 2),
        (lambda a, b, c: ops.where(a < 0.0, c, ops.flip(c < 0.75, b)), 3),
        (lambda a, b, c: ops.where(a < 0.0, b * ops.rsqrt(c), b), 7),
        (lambda a, b, c: ops.flip(a < 0.0, b - 0.5 * c), 1),
        (lambda a, b, c: ops.flip(a < 0.0, b + 0.25), 1),
        (lambda a, b, c: c - ops.flip(a < 0.0, ops.absolute(b)), 2),
        (lambda a, b, c: ops.flip(a < 0.0, b * ops.rsqrt(c)), 7),
        # Powers of two are taken out of products.
        (lambda a, b, c: (0.25 * a) * (-0.5 * b) + c, 1),
        (lambda a, b, c: 0.125 * (b + 0.25), 1),
        (lambda a, b, c: 0.5 * ops.absolute(a - c), 2),
        (lambda a, b, c: 0.5 * ops.named("half", 0.5 * a) * b, 2),
        (lambda a, b, c: (3.0 * a) * b, 2),
        # One count in a product; of a root that is read several times, too.
        (lambda a, b, c: b * (ops.rsqrt(c) * ops.rsqrt(b + 2.0)), 14),
        (lambda a, b, c: ops.rsqrt(c) * (1.0 / (b + 2.0)), 13),
        (_twice, 9),
        # Of two products that a prescribed format does not hold, the coarser one stands apart.
        (lambda a, b, c: ops.saturated(b * ops.rsqrt(c) + 0.3 * a, 2.0**-7), 7),
        # One flag.
        (_halves, 2),
        (lambda a, b, c: ops.absolute(a) * ops.absolute(b), 2),
        (lambda a, b, c: ops.absolute(a) * ops.absolute(a), 2),
    ],
)
def test_what_a_group_holds(trace: Any, function: Any, operations: int) -> None:
    low, high = (-1.0, -1.0, 0.5), (1.0, 1.0, 0.99)
    t = trace(function, [*zip(low, high, strict=True)])
    fixed, floats, saturated = t.run(*np.random.default_rng(7).uniform(low, high, (200, 3)).T)
    assert not saturated.any()
    for y, want in zip(fixed, floats, strict=True):
        assert np.abs(y - want).max() < 1e-8
    assert len(t.program.ops) == operations


def test_the_inverse_root_of_zero_is_refused_by_name(trace: Any) -> None:
    with pytest.raises(
        InputError, match=r"^test_fuse\.py, line \d+: wanted a finite range, found .* \[-inf, inf\]"
    ):
        trace(lambda x: ops.rsqrt(x * 0.0) * x, [(-1.0, 1.0)])


def test_what_has_a_name_stays_a_value(trace: Any) -> None:
    for around in (lambda x: ops.bounded(x, -0.5, 0.5, "test"), lambda x: ops.saturated(x, 0.25)):
        t = trace(lambda a, b, f=around: 0.5 * f(ops.named("rate", a * b)) + a, [(-1.0, 1.0)] * 2)
        assert "rate" in [t.program.values[n].name for n in t.op_values()]


def test_the_root_of_a_negative_constant_is_refused_by_name(trace: Any) -> None:
    with pytest.raises(
        InputError,
        match=r"^test_fuse\.py, line \d+: wanted a root of 0 or more, found .* in \[-1, ",
    ):
        trace(lambda x: ops.sqrt(x - x - 1.0), [(0.0, 1.0)])


class Still(Estimator):
    """A state that becomes a constant, in a format that others chose."""

    inputs = (Input("u", -1.0, 1.0),)
    states = (State("s", -100.0, 100.0),)
    outputs = (Output("y"),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """Forgets all."""
        return {"s": 0.3}, {"y": x.s + u.u}


@pytest.mark.parametrize("word", [18, 32])
def test_a_constant_has_its_states_format(word: int) -> None:
    program = Still().compile(word=word)
    ((state, after),) = program.states
    frac = program.values[state].frac
    assert program.values[after].frac == frac == word - 8
    assert program.values[after].initial == round(0.3 * 2**frac)


class Leaves(Estimator):
    """A state whose next value can leave its range at one end."""

    inputs = (Input("u", 0.0, 100.0),)
    states = (State("s", -1.0, 1.0),)
    outputs = (Output("y", ""),)

    def __init__(self, sign: float) -> None:
        self.sign = sign

    def step(self, x, u, p):
        after = 0.5 * x.s + self.sign * u.u
        return {"s": after}, {"y": 0.25 * after}


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_next_value_beyond_its_state_has_the_states_format(sign: float) -> None:
    program = Leaves(sign).compile()
    after, state = (program.values[program.find(name)] for name in ("s_next", "s"))
    assert after.frac == state.frac == 30
    assert (after.low, after.high) == ((-0.5, 1.0) if sign > 0.0 else (-1.0, 0.5))


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_a_next_value_of_states_has_the_format_of_the_widest(order: tuple[int, int]) -> None:
    """Of two of one format, the range of the first."""
    g = Tracer("three")
    u = g.leaf("input", "u", -99.0, 99.0)
    both = [g.leaf("state", "narrow", -1.0, 1.0), g.leaf("state", "wide", -4.0, 4.0)]
    after = ops.named("after", both[0] + u)
    states = [(both[k], 0.0, after) for k in order]
    states.append((g.leaf("state", "last", -5.0, 5.0), 0.0, after))
    program = lower(Trace(g, [u], {"y": 0.5 * after}, states=states), Arithmetic())[0]
    said = program.values[program.find("after")]
    assert (said.frac, said.low, said.high) == (28, -4.0, 4.0)
    assert {program.values[n].name: program.values[m].frac for n, m in program.states} == {
        "narrow": 30,
        "wide": 28,
        "last": 28,
    }


@pytest.mark.parametrize(
    ("limit", "unit", "after"),
    [
        (0.75, "", lambda s, u: 0.5 * s + 0.5 * u),  # of a wider range
        (1.0, "ht", lambda s, u: ops.wrap_ht(s + u)),
    ],
)
def test_a_next_value_as_fine_as_its_state_needs_no_copy(
    limit: float, unit: str, after: Callable[[Any, Any], Any]
) -> None:
    """It is an output besides."""
    g = Tracer("same")
    u, s = g.leaf("input", "u", -0.99, 0.99), g.leaf("state", "s", -limit, limit, unit)
    y = after(s, u)
    program = lower(Trace(g, [u], {"y": y}, states=[(s, 0.0, y)]), Arithmetic())[0]
    assert len(program.ops) == 1 and program.outputs[0] == program.states[0][1]
    assert program.values[program.outputs[0]].high > 0.75


def test_a_next_value_that_is_clamped_keeps_its_own_limit() -> None:
    """It is 4 for who reads it besides, though its state ends at 1."""
    g = Tracer("clamped")
    u, s = g.leaf("input", "u", -1.0, 1.0), g.leaf("state", "s", -1.0, 1.0)
    after = ops.saturated(8.0 * u, 4.0)
    program = lower(Trace(g, [u], {"y": 0.25 * after}, states=[(s, 0.0, after)]), Arithmetic())[0]
    clamped, *_ = program.ops
    assert clamped.overflow is Overflow.CLIP and program.values[clamped.dest].frac == 29


def test_an_input_has_the_binary_point_that_it_comes_with() -> None:
    g = Tracer("linked")
    u = g.leaf("input", "u", -1.0, 1.0)
    program = lower(Trace(g, [u], {"y": u + 0.5}, fracs={"u": 20}), Arithmetic())[0]
    assert program.values[program.inputs[0]].frac == 20


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


def test_a_difference_of_conditions_is_one_operation() -> None:
    def chosen(x: Any, y: Any) -> Any:
        return ops.where((x < 0.0) != (y < 0.0), x, y)

    assert len(Traced(chosen, 2 * [(-1.0, 1.0)]).op_values()) == 2
    same = Traced(lambda x, y: ops.where((x - y < 0.0) == (x < y), x, y), 2 * [(-1.0, 1.0)])
    assert same.op_values() == [] and same.program.outputs == same.program.inputs[:1]
