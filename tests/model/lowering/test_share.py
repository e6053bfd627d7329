"""Products that are too fine for their sums."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from boresight.model.lowering import share

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
