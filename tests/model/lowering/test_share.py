"""Products that are too fine for their sums."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.lowering import share
from boresight.model.lowering.lower import lower
from boresight.model.lowering.trace import Trace, Tracer
from boresight.model.words.fixed import Arithmetic

FINE = 2.0**-6
COUNT = 6


def sums(gain: Any, *x: Any) -> tuple[Any, ...]:
    """A fine gain times fine values, each added to something coarse."""
    return tuple(a - gain * b for a, b in zip(x[:COUNT], x[COUNT:], strict=True))


RANGES = [(0.0, FINE), *[(-64.0, 64.0)] * COUNT, *[(-FINE, FINE)] * COUNT]


@pytest.mark.parametrize("word", [24, 32])
def test_one_coarser_factor_serves_all(
    trace: Any, word: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    shared = trace(sums, RANGES, word)
    monkeypatch.setattr(share, "FEWEST", COUNT + 1)
    apart = trace(sums, RANGES, word)
    assert [len(t.program.ops) for t in (shared, apart)] == [COUNT + 1, 2 * COUNT]
    draw = np.random.default_rng(5)
    for t in (shared, apart):
        fixed, floats, saturated = t.run(*[draw.uniform(*ends, 500) for ends in RANGES])
        assert not saturated.any()
        for y, want, form in zip(fixed, floats, t.formats(), strict=True):
            assert np.abs(y - want).max() < 0.52 * form.lsb


def test_a_constant_factor_is_made_coarser(trace: Any) -> None:
    t = trace(lambda a, b: a + 3e-6 * b, [(-64.0, 64.0), (-FINE, FINE)])
    assert len(t.program.ops) == 1
    fixed, floats, _ = t.run(*np.random.default_rng(5).uniform([[-60.0], [-FINE]], FINE, (2, 500)))
    assert np.abs(fixed[0] - floats[0]).max() < 0.51 * t.formats()[0].lsb


@pytest.mark.parametrize(("count", "operations"), [(3, 6), (4, 5)])
def test_a_copy_serves_four_at_least(trace: Any, count: int, operations: int) -> None:
    def last(*x: Any) -> tuple[Any, ...]:
        """The gain comes last: it is the second factor."""
        return tuple(a + b * x[-1] for a, b in zip(x[:count], x[count:-1], strict=True))

    ranges = [*[(-64.0, 64.0)] * count, *[(-FINE, FINE)] * (count + 1)]
    t = trace(last, ranges)
    assert len(t.program.ops) == operations
    fixed, floats, _ = t.run(*[np.random.default_rng(5).uniform(*ends, 500) for ends in ranges])
    for y, want, form in zip(fixed, floats, t.formats(), strict=True):
        assert np.abs(y - want).max() < 0.52 * form.lsb


def test_one_more_bit_than_needed_serves_more(trace: Any) -> None:
    """Of factors whose sizes differ by 2: an odd number of bits is rounded up to an even one."""
    counts = []
    for fine in (FINE, 0.5 * FINE):
        half = COUNT // 2
        small = [*[(-fine, fine)] * half, *[(-0.5 * fine, 0.5 * fine)] * half]
        counts.append(len(trace(sums, [*RANGES[: COUNT + 1], *small]).program.ops))
    assert sorted(counts) == [COUNT + 1, 2 * COUNT]


def test_conditions_stay_with_what_is_taken_back(trace: Any) -> None:
    def chosen(gain: Any, *x: Any) -> tuple[Any, ...]:
        return tuple(
            y
            for a, b in zip(x[:COUNT], x[COUNT:], strict=True)
            for y in (a + ops.flip(a < 0.0, gain * b), a + ops.where(a < 0.0, 0.5, gain * b))
        )

    t = trace(chosen, RANGES)
    assert len(t.program.ops) == 2 * COUNT + 1
    fixed, floats, _ = t.run(*[np.random.default_rng(5).uniform(*ends, 500) for ends in RANGES])
    for y, want, form in zip(fixed, floats, t.formats(), strict=True):
        assert np.abs(y - want).max() < 0.52 * form.lsb


def test_a_single_bit_too_many_is_shared_as_well(trace: Any) -> None:
    """Finer and finer: the products stand in their sums, then a copy brings them there."""
    counts = []
    for k in range(20):
        ranges = [(0.0, 64.0), *RANGES[1 : COUNT + 1], *[(-(0.5**k), 0.5**k)] * COUNT]
        counts.append(len(trace(sums, ranges).program.ops))
    assert counts == sorted(counts) and set(counts) == {COUNT, COUNT + 1}


def test_what_stands_apart_may_be_too_small_at_last(trace: Any) -> None:
    """A range that is wrong: the sum is coarser than it says, so that nobody reads the product."""
    fine = (-(2.0**-15), 2.0**-15)
    t = trace(
        lambda a, b, c: ops.bounded(a * b + c, -1.0, 1.0, "wrong"), [fine, fine, (-1e12, 1e12)]
    )
    assert [len(op.terms) for op in t.program.ops] == [1]


def test_a_linked_input_that_is_finer_than_its_sum_stands_apart() -> None:
    """It has no second factor to share."""
    g = Tracer("linked")
    u, c = g.leaf("input", "u", -1.0, 1.0), g.leaf("input", "c", -1e9, 1e9)
    program = lower(Trace(g, [u, c], {"y": c + u}, fracs={"u": 45}), Arithmetic())[0]
    assert [len(op.terms) for op in program.ops] == [1, 2]
