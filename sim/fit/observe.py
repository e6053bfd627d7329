"""Range of every expression of a step in float64, on records and on hostile inputs.

The states before each update are known from a run; from them all updates of the trace are computed
at once. Hostile inputs stay within the declared ranges.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from boresight.firmware.floating import FloatCModel
from boresight.model import ops
from boresight.model.arrays import FloatArray
from boresight.model.declarations import Output
from boresight.model.estimator import Estimator
from boresight.model.lowering.profile import Range
from boresight.model.lowering.trace import Trace
from boresight.model.recorded import evaluate

#: Smallest and largest value by the number of an expression; for a comparison, of the difference.
Reached = dict[int, Range]

#: Inputs (n, n_inputs) of a record, or a function that gives them in pieces at each call, each with
#: whether it begins from the initial states.
Inputs = FloatArray | Callable[[], Iterable[tuple[FloatArray, bool]]]

CHUNK = 1024  #: Updates that are computed at a time.


class _States(Estimator):
    """An estimator whose outputs are its next states, in their declared ranges as in words."""

    def __init__(self, inner: Estimator) -> None:
        self.inner, self.name = inner, f"{inner.name}_states"
        self.inputs, self.params, self.states = inner.inputs, inner.params, inner.states
        self.outputs = tuple(Output(s.name, s.unit) for s in inner.states)

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        next_states, _ = self.inner.step(x, u, p)
        next_states = {s.name: ops.clip(next_states[s.name], s.low, s.high) for s in self.states}
        return next_states, next_states


class Observer:
    """Ranges of all expressions in float64, piece by piece from a reset on.

    States are clipped to their declared ranges, as words are under hostile inputs. Values that are
    not finite do not count.
    """

    claims = True  #: Whether values of `ops.bounded` are clipped to their ranges, too.

    def __init__(
        self, trace: Trace, estimator: Estimator, params: Mapping[str, float] | None = None
    ) -> None:
        self.trace, self.estimator = trace, estimator
        self._params = estimator.param_values(params)
        self._low = np.full(len(trace.tracer.expressions), np.inf)
        self._high = -self._low
        self._model = None
        if estimator.states:
            self._model = FloatCModel(_States(estimator), params=params)
        self.reset()

    def reset(self) -> None:
        self._last_states = np.array([[s.initial for s in self.estimator.states]])
        if self._model is not None:
            self._model.reset()

    def add(self, inputs: FloatArray) -> FloatArray:
        """Run the next updates, inputs (n, n_inputs); return states (n, n_states) after each."""
        states = np.zeros((len(inputs), 0)) if self._model is None else self._model.update(inputs)
        states = states.astype(np.float64)
        low, high = self._low, self._high
        with np.errstate(all="ignore"):
            before = np.concatenate([self._last_states, states[:-1]])
            for start in range(0, len(inputs), CHUNK):
                rows = slice(start, start + CHUNK)
                leaves = self._leaves(inputs[rows], before[rows])
                values = evaluate(self.trace, leaves, claims=self.claims)
                for e in self.trace.needed:
                    if e.kind in ("invert", "both", "either", "differs"):  # no number
                        continue
                    x = values[e.number]
                    if e.kind == "less":
                        x = values[e.args[0].number] - values[e.args[1].number]
                    finite = np.asarray(x)[np.isfinite(x)]
                    low[e.number] = finite.min(initial=low[e.number])
                    high[e.number] = finite.max(initial=high[e.number])
        self._last_states = states[-1:]
        return states

    def _leaves(self, inputs: FloatArray, states: FloatArray) -> dict[tuple[str, str], FloatArray]:
        """Leaves of updates, by kind and name."""
        of = self.estimator
        leaves = {("input", i.name): inputs[:, k] for k, i in enumerate(of.inputs)}
        leaves |= {("state", s.name): states[:, k] for k, s in enumerate(of.states)}
        return leaves | {("param", n): np.full(len(inputs), v) for n, v in self._params.items()}

    @property
    def reached(self) -> Reached:
        ends = enumerate(zip(self._low, self._high, strict=True))
        return {k: (float(a), float(b)) for k, (a, b) in ends if a <= b}


def pieces_of(inputs: Inputs) -> Iterable[tuple[FloatArray, bool]]:
    """The inputs of a record in pieces, of an array as one."""
    return [(inputs, True)] if isinstance(inputs, np.ndarray) else inputs()


def joined(*seen: Reached) -> Reached:
    """Union of ranges, by expression."""
    out: dict[int, Range] = {}
    for ranges in seen:
        for number, (low, high) in ranges.items():
            a, b = out.get(number, (low, high))
            out[number] = (min(a, low), max(b, high))
    return out


#: Stimuli that `within` makes.
WITHIN = ("still", "noise", "slow", "jumps", "ends", "gaps")


def hostile(estimator: Estimator, steps: int, rng: np.random.Generator) -> dict[str, FloatArray]:
    """Inputs (steps, n_inputs) within the declared ranges, by the name of the stimulus."""
    return {name: within(estimator, name, steps, rng) for name in WITHIN}


def within(estimator: Estimator, name: str, steps: int, rng: np.random.Generator) -> FloatArray:
    """Inputs (steps, n_inputs) in the middle, all over, in slow waves, in steps, or at the ends.

    "gaps" are noise in which three quarters of the samples are missing, of inputs that may.
    """
    low, high = np.transpose([(i.low, i.high) for i in estimator.inputs])
    n = len(low)
    share = rng.random((steps, n))
    if name == "still":
        share[:] = 0.5
    elif name == "slow":
        turn = 2.0 * np.pi * rng.uniform(0.5, 20.0, n) / steps
        share = 0.5 + 0.5 * np.sin(turn * np.arange(steps)[:, None] + rng.uniform(0.0, 6.28, n))
    elif name == "jumps":
        share = np.repeat(share[::50], 50, axis=0)[:steps]
    elif name == "ends":
        share = np.round(share)
    new = rng.random((steps, n)) < (0.25 if name == "gaps" else 1.0)
    values = low + share * (high - low)
    place = {i.name: k for k, i in enumerate(estimator.inputs)}
    for k, declared in enumerate(estimator.inputs):
        if declared.missing == "hold":
            new[0, k] = True
            last = np.maximum.accumulate(np.where(new[:, k], np.arange(steps), 0))
            values[:, k] = values[last, k]
        elif declared.missing is not None:
            values[~new[:, k], k] = float(declared.missing)
        else:
            new[:, k] = True
    for k, declared in enumerate(estimator.inputs):
        if declared.flags:
            valid = new[:, [place[f] for f in declared.flags]].all(axis=1)
            values[:, k] = np.clip(valid.astype(np.float64), declared.low, declared.high)
    return np.asarray(values)
