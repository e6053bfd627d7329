"""Interpolation in a table, against numpy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from boresight.model.blocks.table import interpolated
from boresight.model.errors import InputError

TABLES = {
    "two": ((-1.0, 3.0), (5.0, 4.0)),
    "uneven": ((0.0, 1.0, 2.0, 4.0), (0.0, 1.0, 0.5, 3.0)),
    "waves": (np.linspace(-1.0, 1.0, 17), np.sin(9.0 * np.linspace(-1.0, 1.0, 17))),
    "up to the last word": ((0.0, 1.65), (-0.9, 1.0 - 2.0**-31)),
    "steep": ((-2.0, -1.999, 1.3), (5.0, -5.0, 100.0)),
}


@pytest.mark.parametrize("word", [18, 32])
@pytest.mark.parametrize("name", TABLES)
def test_as_numpy_interpolates(trace: Any, name: str, word: int) -> None:
    points, values = TABLES[name]
    low, high = points[0] - 1.0, points[-1] + 0.5
    t = trace(lambda x: interpolated(x, points, values), [(low, high)], word)
    x = np.concatenate([np.random.default_rng(word).uniform(low, high, 2000), points])
    fixed, floats, saturated = t.run(x)
    seen = t.program.format(t.program.inputs[0])
    wanted = np.interp(seen.real(seen.quantise(x)), points, values)
    assert np.allclose(floats[0], wanted, rtol=0.0, atol=1e-10) and not saturated.any()
    steepest = np.abs(np.diff(values) / np.diff(points)).max()
    assert np.abs(fixed[0] - wanted).max() < 2.0 * t.formats()[0].lsb + 3.0 * steepest * seen.lsb
    assert (t.nodes[0].kind, t.nodes[0].data[2]) == ("bounded", "values of the table")


def test_points_above_the_range_cost_nothing(trace: Any) -> None:
    points, values = TABLES["waves"]
    costs = [
        len(trace(lambda x: interpolated(x, points, values), [r]).program.ops)
        for r in ((-1.0, 1.0), (-1.0, -0.9))
    ]
    assert costs[0] > 25 and costs[1] <= 3


@pytest.mark.parametrize(
    "points, values, found",
    [
        ((0.0, 1.0), (1.0,), r"as many values as points, found \(2, 1\)"),
        ((0.0,), (1.0,), r"as many values as points, found \(1, 1\)"),
        ((0.0, 1.0, 1.0), (1.0, 2.0, 3.0), "finite points that rise, found "),
        ((0.0, 1.0), (1.0, np.nan), "finite points that rise, found "),
    ],
)
def test_tables_that_are_none(points: Any, values: Any, found: str) -> None:
    with pytest.raises(InputError, match=rf"^test_table\.py, line \d+: wanted {found}"):
        interpolated(0.5, points, values)
