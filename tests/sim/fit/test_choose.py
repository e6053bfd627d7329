"""The rule by which ranges are chosen, and what keeps its interval."""

from __future__ import annotations

import math
from typing import Any

import pytest

from boresight.model import ops
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, Input, Output
from boresight.sim.fit.fitting import FLOOR, MOST_BITS, chosen, intervals


@pytest.mark.parametrize(
    "seen, hostile, interval, wanted",
    [
        ((-1.0, 0.5), None, (-64.0, 64.0), (-16.0, 16.0)),  # 2 bits, and 2 of the 4 that are left
        ((0.0, 1.0), None, (0.0, 64.0), (0.0, 16.0)),  # no sign where the interval has none
        ((0.0, 1.0), None, (-1.0, 64.0), (-1.0, 16.0)),
        (
            (1.0, 1.0),
            None,
            (-(2.0**40), 2.0**40),
            (-(2.0 ** (2 + MOST_BITS)), 2.0 ** (2 + MOST_BITS)),
        ),
        ((-1.0, 1.0), (-9.0, 20.0), (-640.0, 640.0), (-40.0, 40.0)),
        ((-1.0, 1.0), (-9.0, 40.0), (-640.0, 640.0), (-80.0, 80.0)),  # twice what was provoked
        ((-1.0, 1.0), None, (-math.inf, math.inf), (-16.0, 16.0)),
    ],
)
def test_margin_half_of_the_rest_and_twice_what_was_provoked(
    seen: Any, hostile: Any, interval: Any, wanted: Any
) -> None:
    assert chosen(seen, hostile, interval) == pytest.approx(wanted)


class Ratio(Estimator):
    """A quotient and a root of what no interval keeps off zero."""

    inputs = (Input("a", -8.0, 8.0), Input("b", -8.0, 8.0))
    outputs = (Output("quotient"), Output("root"), Output("product"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """One update."""
        return {}, {"quotient": u.a / u.b, "root": ops.sqrt(u.a - u.b), "product": u.a * u.b}


def ranges(**seen: tuple[float, float]) -> dict[int, tuple[float, float]]:
    """Ranges by the name of an input or the kind of an expression."""
    trace = Ratio().trace()
    names = {e.number: e.data[1] if e.kind == "leaf" else e.kind for e in trace.tracer.expressions}
    return {number: seen[name] for number, name in names.items() if name in seen}


def test_divisors_and_roots_are_held_at_a_share_of_the_least_that_was_seen() -> None:
    trace = Ratio().trace()
    number = {e.kind: e.number for e in trace.tracer.expressions}
    result, limits = intervals(trace, ranges(b=(-4.0, -2.0), sub=(0.5, 1.0)))
    assert limits[number["div"]][1] == -2.0 * FLOOR
    assert limits[number["sqrt"]][0] == 0.5 * FLOOR
    assert result[number["div"]] == (-8.0 / (2.0 * FLOOR), 8.0 / (2.0 * FLOOR))
    assert intervals(trace, ranges(b=(1.0, 2.0), sub=(0.0, 1.0)))[1][number["sqrt"]][0] == 0.0


def test_a_divisor_of_both_signs_is_refused() -> None:
    with pytest.raises(InputError, match="a divisor whose range excludes 0, found b"):
        intervals(Ratio().trace(), ranges(b=(-1.0, 2.0), sub=(0.5, 1.0)))


def test_a_divisor_that_no_word_can_span_is_held_below_what_was_seen() -> None:
    """As near to zero as its author says."""

    class Far(Ratio):
        """A divisor whose interval is wide."""

        inputs = (Input("a", -8.0, 8.0), Input("b", -1e9, 1e9))

        def step(self, x: Any, u: Any, p: Any) -> Any:
            """One update."""
            return {}, {"quotient": u.a / ops.maximum(u.b, 0.25), "root": u.a, "product": u.a}

    trace = Far().trace()
    number = {e.kind: e.number for e in trace.tracer.expressions}
    for seen, most in (((0.25, 100.0), 1600.0), ((100.0, 200.0), 3200.0)):
        _, limits = intervals(trace, {number["larger"]: seen})
        assert limits == {number["div"]: (0.25, most)}
    assert intervals(trace, {})[1] == {}
