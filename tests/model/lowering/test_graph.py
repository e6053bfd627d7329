"""The traced graph: folding, merging, intervals, conditions, refusals."""

from typing import Any

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.errors import InputError
from boresight.model.lowering.graph import Node
from boresight.model.lowering.trace import Scalar, Tracer
from tests.support.nodes import nodes_of

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


def test_a_larger_number_is_a_divisor(trace: Any) -> None:
    """Of what may be negative or zero, limited from below."""
    t = trace(lambda x: (1.0 / ops.maximum(x, 0.25), 1.0 / ops.minimum(x, -0.5)), [(-8.0, 8.0)])
    x = np.concatenate([np.linspace(-8.0, 8.0, 257), [0.25, 0.25 - 2.0**-20, -0.5, 0.0]])
    fixed, floats, saturated = t.run(x)
    for y, want, fmt in zip(fixed, floats, t.formats(), strict=True):
        assert np.abs(y - want).max() < 2.0 * fmt.lsb
    assert not saturated.any() and [f.frac for f in t.formats()] == [28, 30]


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
