"""What every expression of a step reaches in float64.

The states before each update are known from a run; from them all updates are computed at once, as
they are recorded.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.firmware.floating.build import FloatCModel
from boresight.firmware.floating.precision import DOUBLE
from boresight.model import ops
from boresight.model.declarations import Output
from boresight.model.estimator import Estimator
from boresight.model.lowering.profile import Range
from boresight.model.lowering.trace import Expression, Trace
from boresight.model.recorded import evaluate

__all__ = ["Reached", "joined", "reached", "rows_of", "states_of"]

FloatArray = npt.NDArray[np.float64]
#: Smallest and largest value by the number of an expression; of a comparison of the difference.
Reached = Mapping[int, Range]

#: Updates that are computed at a time.
CHUNK = 1024


class _States(Estimator):
    """An estimator whose outputs are its next states, in their declared ranges as in words."""

    def __init__(self, inner: Estimator) -> None:
        self.inner, self.name = inner, f"{inner.name}_states"
        self.inputs, self.params, self.states = inner.inputs, inner.params, inner.states
        self.outputs = tuple(Output(s.name, s.unit) for s in inner.states)

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """One update."""
        after, _ = self.inner.step(x, u, p)
        after = {s.name: ops.clip(after[s.name], s.low, s.high) for s in self.states}
        return after, after


def states_of(
    estimator: Estimator, inputs: FloatArray, params: Mapping[str, float] | None
) -> FloatArray:
    """States (n, n_states) after each update of inputs (n, n_inputs).

    In float64, each limited to its declared range: where hostile inputs take it there, words stay.
    """
    if not estimator.states:
        return np.zeros((len(inputs), 0))
    model = FloatCModel(_States(estimator), precision=DOUBLE, params=params)
    return model.update(inputs).astype(np.float64)


def rows_of(
    estimator: Estimator, inputs: FloatArray, after: FloatArray, params: Mapping[str, float] | None
) -> Iterator[dict[tuple[str, str], FloatArray]]:
    """Leaves of all updates, by kind and name, in chunks.

    Parameters
    ----------
    inputs : (n, n_inputs)
    after : (n, n_states)
        States after each update.
    """
    first = np.array([[s.initial for s in estimator.states]])
    before = np.concatenate([first, after[:-1]])
    values = estimator.param_values(params)
    for start in range(0, len(inputs), CHUNK):
        some = slice(start, start + CHUNK)
        rows = len(inputs[some])
        leaves = {("input", i.name): inputs[some, k] for k, i in enumerate(estimator.inputs)}
        leaves |= {("state", s.name): before[some, k] for k, s in enumerate(estimator.states)}
        yield leaves | {("param", name): np.full(rows, v) for name, v in values.items()}


def reached(
    trace: Trace,
    estimator: Estimator,
    inputs: FloatArray,
    after: FloatArray,
    params: Mapping[str, float] | None = None,
) -> Reached:
    """What every expression reaches in updates whose states are known; see `rows_of`.

    Values that are no finite numbers do not count.
    """
    low = np.full(len(trace.tracer.expressions), np.inf)
    high = -low
    with np.errstate(all="ignore"):
        for leaves in rows_of(estimator, inputs, after, params):
            values = evaluate(trace, leaves, claims=True)
            for e in trace.needed:
                seen = _seen(e, values)
                if seen is not None:
                    low[e.number] = min(low[e.number], seen[0])
                    high[e.number] = max(high[e.number], seen[1])
    return {
        k: (float(a), float(b)) for k, (a, b) in enumerate(zip(low, high, strict=True)) if a <= b
    }


def _seen(e: Expression, values: Mapping[int, Any]) -> Range | None:
    """Smallest and largest finite value; None of what is no number."""
    if e.kind == "less":
        observed = values[e.args[0].number] - values[e.args[1].number]
    elif e.kind in ("invert", "both", "either", "differs"):
        return None
    else:
        observed = values[e.number]
    finite = np.asarray(observed)[np.isfinite(observed)]
    return (finite.min(), finite.max()) if finite.size else None


def joined(*seen: Reached) -> Reached:
    """What all of them reach together."""
    out: dict[int, Range] = {}
    for ranges in seen:
        for number, (low, high) in ranges.items():
            a, b = out.get(number, (low, high))
            out[number] = (min(a, low), max(b, high))
    return out
