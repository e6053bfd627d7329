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
from boresight.model.words.program import Negate
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


def test_a_narrow_word_limits_a_reciprocal_that_a_wide_one_holds(trace: Any) -> None:
    """1/x of x in [2^-16, 1): an 18-bit word counts arguments below 2^-13 as that."""
    x = np.array([2.0**-16, 2.0**-14, 2.0**-10, 0.25, 0.75])
    for word, floor in ((18, 2.0**-13), (32, 0.0)):
        t = trace(lambda a: 1.0 / a, [(2.0**-16, 0.999)], word)
        fixed, _, saturated = t.run(x)
        want = 1.0 / np.maximum(x, floor)
        assert (np.abs(fixed[0] - want) < 3.0 * t.formats()[0].lsb + 2.0 ** (3 - word) * want).all()
        assert not saturated.any()


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
