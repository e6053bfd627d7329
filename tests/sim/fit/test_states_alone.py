"""What of an error comes from the words of states, which no profile changes.

`pytest -m soak tests/sim/fit/test_states_alone.py -s` prints the figures of docs/learn/ranges.md.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import Any

import pytest

from boresight.firmware.floating.build import FloatCModel
from boresight.firmware.floating.precision import DOUBLE
from boresight.model.estimator import Estimator
from boresight.model.resolve import estimator_of
from boresight.model.words.fixed import Format
from boresight.sim.compare.difference import Differences
from boresight.sim.records.bundled import bundled
from boresight.sim.records.feed import feed
from boresight.sim.records.files import read_record

WORD, STEPS = 24, 8000


class Rounded(Estimator):
    """An estimator in float64, of which some states are rounded to their words in each update."""

    def __init__(self, inner: Estimator, names: Collection[str]) -> None:
        self.inner, self.name, self.rounded = inner, f"{inner.name}_rounded", names
        self.inputs, self.params, self.states = inner.inputs, inner.params, inner.states
        self.outputs = inner.outputs

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """One update; float64 itself rounds a number that this one is added to."""
        after, out = self.inner.step(x, u, p)
        after = dict(after)
        for s in self.states:
            if s.name in self.rounded:
                frac = Format.declared(WORD, s.low, s.high, s.unit).frac
                large = math.ldexp(1.5, 52 - frac)
                after[s.name] = (after[s.name] + large) - large
        return after, out


def attitude_error(name: str, *states: str) -> float:
    """Largest, in degrees, with these states (none named: all) in words."""
    estimator = estimator_of(name)
    inputs = feed(estimator, read_record(bundled("ximu_walk"))).inputs[:STEPS]
    names = states or tuple(s.name for s in estimator.states)
    outputs = [o.name for o in estimator.outputs]
    runs = [
        dict(
            zip(
                outputs,
                FloatCModel(Rounded(estimator, some), precision=DOUBLE).update(inputs).T,
                strict=True,
            )
        )
        for some in (names, ())
    ]
    beside = Differences(estimator.outputs, outputs)
    beside.add(*runs)
    (largest,) = (d.largest for d in beside.result() if d.output == "attitude")
    print(f"{name}, {', '.join(states) or 'all states'}: {largest:.3g} deg")
    return largest


@pytest.mark.soak
def test_what_the_words_of_states_cost() -> None:
    assert attitude_error("mekf", "youth") > 0.9 * attitude_error("mekf") > 2.0
    assert attitude_error("ekf_quaternion") < 0.03
    assert attitude_error("vqf(rate_hz=256)") < 0.03
