"""Groups by themselves: constants, ranges of shifts."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.lowering.forms import Form, Product
from boresight.model.lowering.groups import Groups, Target
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import Kind, Overflow, Scale, Value

WORDS = pytest.mark.parametrize("word", [18, 24, 32])


@WORDS
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("part, rounded", [(0.25, 0), (0.49, 0), (0.51, 1), (0.75, 1)])
def test_a_constant_is_the_nearest_word(word: int, sign: int, part: float, rounded: int) -> None:
    groups = Groups("test", Arithmetic(word))
    for whole in (0, 1, 5, 1000):
        number = groups.constant(sign * (whole + part) / 2**9, 9)
        assert groups.values[number].initial == sign * (whole + rounded)
        assert groups.frac(number) == 9 and groups.values[number].kind is Kind.CONST


def test_equal_constants_are_one_value() -> None:
    groups = Groups("test", Arithmetic())
    assert groups.constant(0.5, 10) == groups.constant(0.5, 10) == groups.constant(0.5001, 10)
    assert groups.constant(0.5, 10) != groups.constant(0.5, 11)


def test_names_are_made_unique() -> None:
    groups = Groups("test", Arithmetic())
    numbers = [groups.value(Value("x", Kind.INPUT, 9, -1.0, 1.0, "test")) for _ in range(3)]
    assert [groups.values[n].name for n in numbers] == ["x", "x_2", "x_3"]


def counted(scale: Scale, n: int) -> int:
    """Bits that a normalisation count n takes off a shift (`model.words.program.Scale`)."""
    return {Scale.NONE: 0, Scale.FULL: n, Scale.EVEN: n - n % 2, Scale.HALF: n // 2}[scale]


@WORDS
@pytest.mark.parametrize("scale", list(Scale))
def test_no_shift_turns_round_whatever_is_normalised(word: int, scale: Scale) -> None:
    """The finest binary point for which every count leaves a shift of 0 or more, and no coarser."""
    arith = Arithmetic(word)
    most = max(counted(scale, n) for n in range(arith.norm_max + 1))
    for shift in range(arith.shift_max + 1):
        groups = Groups("test", arith)
        # A constant of few bits: the accumulator holds the product at any shift.
        a = groups.value(
            Value("a", Kind.CONST, word - 1 + arith.guard + shift, 1.0, 1.0, "test", initial=3)
        )
        b = groups.value(Value("b", Kind.INPUT, 0, -1.0, 1.0, "test"))
        form = Form([Product(a, b, scale=scale)], norm=None if scale is Scale.NONE else b)
        number = groups.group(form, Target("y", -1.0, 0.9, "test"))
        (term,) = groups.ops[-1].terms
        assert term.shift == max(shift, most)
        assert groups.frac(number) == word - 1 - max(0, most - shift)


@WORDS
@pytest.mark.parametrize("overflow", [Overflow.WRAP, Overflow.SAT])
def test_far_below_the_binary_point_it_is_raised_step_by_step(
    word: int, overflow: Overflow
) -> None:
    """First as fine as can be, then by as many bits as the accumulator holds above any word."""
    arith = Arithmetic(word)
    step = min(arith.norm_max, arith.headroom - 1)

    def fracs(frac: int, magnitude: float) -> list[int]:
        """Binary points above that of the factor, which has ``frac`` bits less than the result."""
        groups = Groups("test", arith)
        own = word - 1 - frac
        a = groups.value(Value("a", Kind.INPUT, own, -magnitude, magnitude, "test"))
        target = Target("y", -1.0, 1.0, "test", overflow=overflow)
        groups.group(Form([Product(a)]), target, frac=word - 1, exact=True)
        assert all(op.overflow is overflow for op in groups.ops)
        assert all(len(op.terms) == 1 for op in groups.ops)
        return [groups.frac(op.dest) - own for op in groups.ops]

    assert fracs(step, 0.9) == [step]
    assert fracs(step + 1, 0.9) == [step, step + 1]
    assert fracs(2 * step, 0.9) == [step, 2 * step]
    assert fracs(2 * step + 1, 0.9) == [step, 2 * step, 2 * step + 1]
    # What wraps may be cut off above, what is clamped may not: its range counts.
    parts = [step] if overflow is Overflow.WRAP else [1, 1 + step]
    assert fracs(step + 2, 1.1 * 2.0**step) == [*parts, step + 2]


@WORDS
def test_constants_under_a_flag_still_add_up(trace: Any, word: int) -> None:
    """Seven quarters of the last bit are two of it: what a flag chooses has guard bits too."""
    lsb = 2.0 ** (1 - word)

    def seven(a: Any) -> Any:
        negative = a < 0.0
        # Not quite the same, or they would be one value.
        parts = [ops.where(negative, (0.25 + k / 1000) * lsb, a) for k in range(7)]
        return sum(parts, start=0.0)

    t = trace(lambda a: ops.bounded(seven(a), -1.0, 0.9, "small arguments"), [(-1.0, 0.9)], word)
    fixed, _, saturated = t.run(np.array([-1.0, -0.5, 0.125]))
    assert t.formats()[0].lsb == lsb and not saturated.any()
    assert fixed[0].tolist() == [2 * lsb, 2 * lsb, 0.875]


def test_a_small_factor_of_a_large_one_counts(trace: Any) -> None:
    """It alone is below the last guard bit of the sum, 2^-18; their product is 8 last bits."""
    t = trace(
        lambda a, b, c: a * b + c,
        [(-(2.0**-21), 2.0**-21), (-(2.0**14), 2.0**14), (-(2**20), 2**20)],
    )
    (fixed,), (wanted,), _ = t.run(
        np.array([2.0**-22, -(2.0**-22)]), np.array([2.0**14, 2.0**13]), np.array([1000.0, -5.0])
    )
    assert np.abs(fixed - wanted).max() <= 0.5 * t.formats()[0].lsb == 2.0**-11


def leaf(groups: Groups, name: str, frac: int) -> int:
    return groups.value(Value(name, Kind.INPUT, frac, -1.0, 1.0, "test"))


@WORDS
def test_a_word_is_moved_down_by_as_many_bits_as_a_shift_has(word: int) -> None:
    """Times 1, as finest, in one operation; a bit more takes another."""
    arith = Arithmetic(word)
    for more in (0, 1):
        groups = Groups("test", arith)
        a = leaf(groups, "a", arith.guard + arith.shift_max + more)
        groups.group(Form([Product(a)]), Target("y", -1.0, 1.0, "test"), frac=0)
        assert len(groups.ops) == 1 + more
        assert groups.ops[0].terms[0].shift == arith.shift_max


@pytest.mark.parametrize("more", [0, 1])
def test_the_accumulator_is_filled_to_its_last_word(more: int) -> None:
    """Half a bit for rounding counts; one more than its largest, and the result is coarser."""
    arith = Arithmetic(32)
    groups = Groups("test", arith)
    a, one = leaf(groups, "a", 4), groups.constant(2.0**-4, 4)
    factor = (1 << arith.guard + arith.headroom) - 1  # of 2^31: that much is left
    left = (1 << 31) - (1 << arith.guard - 1) - 1 + more
    numbers = [groups.constant(word * 2.0**-4, 4) for word in (factor, left)]
    form = Form([Product(a, numbers[0]), Product(numbers[1], one)])
    result = groups.group(form, Target("y", -1.0, 1.0, "test"), frac=8 - arith.guard)
    assert groups.frac(result) == 8 - arith.guard - more


def test_only_what_is_normalised_stays_inside_a_word() -> None:
    """A value that one term normalises comes as it is in another, with all its bits above."""
    arith = Arithmetic(32)
    groups = Groups("test", arith)
    a, c = leaf(groups, "a", 0), groups.constant(2.0**-12, 20)
    form = Form([Product(c, c, scale=Scale.HALF), Product(a)], norm=a)
    result = groups.group(form, Target("y", -1.0, 1.0, "test"), frac=22)
    assert groups.frac(result) == arith.headroom - 1


def test_what_reaches_the_accumulators_last_bit_is_added() -> None:
    arith = Arithmetic()
    groups = Groups("test", arith)
    numbers = [
        groups.value(Value(name, Kind.INPUT, 20, low, high, "test"))
        for name, low, high in (("whole", -1.0, 0.0), ("less", -0.99, 0.99))
    ]
    form = Form([Product(number) for number in numbers])
    groups.group(form, Target("y", -1.0, 1.0, "test"), frac=-arith.guard)
    assert [term.a for term in groups.ops[-1].terms] == numbers[:1]


def test_a_product_apart_has_the_range_of_its_factors(trace: Any) -> None:
    """Its interval, not its largest magnitude on both sides."""
    fine = 2.0**-13
    t = trace(lambda a, b, c: a * b + c, [(-fine, 0.75 * fine), (0.0, 0.5), (-64.0, 64.0)])
    (part,) = [v for v in t.program.values if v.name.endswith("_part")]
    assert (part.low, part.high) == (-0.5 * fine, 0.375 * fine)
