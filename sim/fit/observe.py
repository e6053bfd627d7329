"""What every expression of a step reaches in float64.

The states before each update are known from a run; from them all updates are computed at once, as
they are recorded.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from boresight.firmware.floating.build import FloatCModel
from boresight.firmware.floating.precision import DOUBLE
from boresight.model import ops
from boresight.model.arrays import FloatArray
from boresight.model.declarations import Output
from boresight.model.estimator import Estimator
from boresight.model.lowering.profile import Range
from boresight.model.lowering.trace import Expression, Trace
from boresight.model.recorded import evaluate

__all__ = ["Inputs", "Observer", "Reached", "joined", "pieces_of"]

#: Smallest and largest value by the number of an expression; of a comparison of the difference.
Reached = Mapping[int, Range]

#: Inputs (n, n_inputs) of a record, or what gives them in pieces, as often as wanted.
Inputs = FloatArray | Callable[[], Iterable[FloatArray]]

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


class Observer:
    """What every expression reaches in float64 in updates, piece by piece from a reset on.

    States are limited to their declared ranges: where hostile inputs take them there, words stay.
    Values that are no finite numbers do not count.

    Attributes
    ----------
    updates : int
        So far.
    """

    def __init__(
        self, trace: Trace, estimator: Estimator, params: Mapping[str, float] | None = None
    ) -> None:
        self.trace, self.estimator, self.updates = trace, estimator, 0
        self._params = estimator.param_values(params)
        self._before = np.array([[s.initial for s in estimator.states]])
        self._low = np.full(len(trace.tracer.expressions), np.inf)
        self._high = -self._low
        self._model = (
            FloatCModel(_States(estimator), precision=DOUBLE, params=params)
            if estimator.states
            else None
        )

    def add(self, inputs: FloatArray) -> FloatArray:
        """The next updates of inputs (n, n_inputs): states (n, n_states) after each."""
        after = np.zeros((len(inputs), 0)) if self._model is None else self._model.update(inputs)
        after = after.astype(np.float64)
        low, high = self._low, self._high
        with np.errstate(all="ignore"):
            for leaves in self._leaves(inputs, np.concatenate([self._before, after[:-1]])):
                values = evaluate(self.trace, leaves, claims=True)
                for e in self.trace.needed:
                    seen = _seen(e, values)
                    if seen is not None:
                        low[e.number] = min(low[e.number], seen[0])
                        high[e.number] = max(high[e.number], seen[1])
        self._before, self.updates = after[-1:], self.updates + len(inputs)
        return after

    def _leaves(
        self, inputs: FloatArray, before: FloatArray
    ) -> Iterator[dict[tuple[str, str], FloatArray]]:
        """Leaves of all updates, by kind and name, in chunks."""
        declared = self.estimator
        for start in range(0, len(inputs), CHUNK):
            some = slice(start, start + CHUNK)
            rows = len(inputs[some])
            leaves = {("input", i.name): inputs[some, k] for k, i in enumerate(declared.inputs)}
            leaves |= {("state", s.name): before[some, k] for k, s in enumerate(declared.states)}
            yield leaves | {("param", n): np.full(rows, v) for n, v in self._params.items()}

    @property
    def reached(self) -> Reached:
        """By the number of an expression."""
        ends = enumerate(zip(self._low, self._high, strict=True))
        return {k: (float(a), float(b)) for k, (a, b) in ends if a <= b}


def pieces_of(inputs: Inputs) -> Iterable[FloatArray]:
    """The inputs of a record in pieces, of an array as one."""
    return [inputs] if isinstance(inputs, np.ndarray) else inputs()


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
