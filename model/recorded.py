"""Comparison of an estimator's trace with what its ``step`` computes in numpy.

A step in Python can depend on things that no record contains: ``is``, ``isinstance``, the content
of a file. So both are computed on the same rows, and a different output or next state is refused.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.declarations import Input, Param, State
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.lowering.trace import Condition, Trace
from boresight.model.ops import OPERATIONS
from boresight.model.places import place_of_function, placed
from boresight.model.step import Values

#: Values of inputs, parameters and states, by kind and name, each (rows,).
Leaves = Mapping[tuple[str, str], FloatArray]

#: Rows (a prime: no array of a step has that shape). All are computed as arrays, if the step takes
#: arrays; one by one as many as have about this number of expressions together, within limits.
_ROWS, _EXPRESSIONS, _SCALAR_ROWS = 997, 40_000, (24, 401)
#: Share of a value up to which the two may differ without a second look.
_EQUAL = 1e-9
#: The second look: number of rows, how often each is computed, and the share by which each argument
#: of each operation is perturbed: far more than rounding, far less than a mistake.
_SUSPECTS, _TIMES, _NOISE = 8, 128, 1e-13


def evaluate(
    trace: Trace, leaves: Leaves, noise: Callable[[Any], Any] | None = None, *, claims: bool = False
) -> dict[int, Any]:
    """Compute every expression of one recorded update in float64, by number.

    Parameters
    ----------
    trace : Trace
    leaves : mapping of (kind, name) to (rows,)
        Inputs ("input"), parameters ("param") and states ("state").
    noise : callable, optional
        Applied to each argument that is a number.
    claims : bool
        Hold values of `ops.bounded` in their ranges, as their words do.
    """
    values: dict[int, Any] = {}
    for e in trace.needed:
        if e.kind == "leaf":
            values[e.number] = leaves[e.data[:2]]
            continue
        args = [values[a.number] for a in e.args]
        if noise is not None:
            pairs = zip(e.args, args, strict=True)
            args = [x if isinstance(a, Condition) else noise(x) for a, x in pairs]
        compute = _clipped if claims and e.kind == "bounded" else OPERATIONS[e.kind].numpy
        values[e.number] = compute(*args, *e.data)
    return values


def _clipped(x: Any, low: float, high: float, *reasons: str) -> Any:
    return np.clip(x, low, high)


def check_recorded(
    estimator: Estimator,
    inputs: FloatArray | None = None,
    params: Mapping[str, float] | None = None,
) -> None:
    """Compare one update in numpy with its record.

    Parameters
    ----------
    estimator : Estimator
    inputs : (rows, n_inputs), optional
        Inputs in their units; by default drawn from the declared ranges, as the states are.
    params : mapping, optional
        Parameter values; by default drawn, too.

    Raises
    ------
    InputError
        The step raises, cannot be recorded, or its record computes something else. Differences
        that rounding explains, and infinite values, count as equal.
    """
    with np.errstate(all="ignore"):
        _Comparison(estimator, sample(estimator, inputs, params)).refuse_differences()


class _Comparison:
    """One update of an estimator on rows of its leaves, in numpy and as recorded."""

    def __init__(self, estimator: Estimator, leaves: Leaves) -> None:
        self.estimator, self.leaves = estimator, leaves
        self.trace = estimator.record()
        self.results = [
            *((f"output {name}", e) for name, e in self.trace.outputs.items()),
            *((f"state {s.data[1]}", e) for s, _, e in self.trace.states),
        ]
        self.rows = len(next(iter(leaves.values())))
        self.expected = self._recorded(leaves, self.rows)

    def refuse_differences(self) -> None:
        """Raise InputError where the two differ."""
        array_results = self._array_results()
        count = _EXPRESSIONS * (1 if array_results is not None else 4) // len(self.trace.needed)
        rows = range(min(self.rows, max(_SCALAR_ROWS[0], min(count, _SCALAR_ROWS[1]))))
        scalar_results = np.stack([self._scalar_results(row) for row in rows], axis=1)
        for computed in (scalar_results, *([] if array_results is None else [array_results])):
            error = _difference(computed, self.expected[:, : computed.shape[1]]).max(axis=0)
            for row in np.argsort(-error, kind="stable")[:_SUSPECTS]:
                if error[row] > _EQUAL:
                    self._recheck(int(row))

    def _recheck(self, row: int) -> None:
        """Raise InputError unless rounding explains the difference in a row."""
        computed, expected = self._scalar_results(row), self.expected[:, row]
        draw = np.random.default_rng(row)
        noisy = self._recorded(
            {name: np.full(_TIMES, values[row]) for name, values in self.leaves.items()},
            _TIMES,
            lambda x: x * (1.0 + _NOISE * draw.uniform(-1.0, 1.0, _TIMES)),
        )
        spread = np.max(np.abs(noisy - expected[:, None]), axis=1)
        mismatch = (_difference(computed, expected) > _EQUAL) & (
            np.abs(computed - expected) > 2.0 * spread
        )
        for k in np.flatnonzero(mismatch):
            name, expression = self.results[k]
            line = expression.line or place_of_function(self.estimator.step)
            raise InputError.at(
                placed(line, f"{name} of {self.estimator.name}"),
                wanted=f"what step computes in numpy, {computed[k]:.6g}",
                found=f"{expected[k]:.6g} as recorded",
                fix="compute it with + - * /, comparisons and boresight.ops alone: Python's is, "
                "isinstance and the like are not recorded",
            )

    def _recorded(
        self, leaves: Leaves, rows: int, noise: Callable[[Any], Any] | None = None
    ) -> FloatArray:
        """Results (results, rows) of the record."""
        values = evaluate(self.trace, leaves, noise)
        return np.stack([np.broadcast_to(values[e.number], rows) for _, e in self.results])

    def _scalar_results(self, row: int) -> FloatArray:
        """Results (results,) of the step on one row."""
        return self._step({name: values[row] for name, values in self.leaves.items()}, ())

    def _array_results(self) -> FloatArray | None:
        """Results (results, rows) of the step on arrays; None if it takes none."""
        try:
            return self._step(self.leaves, (self.rows,))
        except (InputError, ValueError, TypeError):
            return None

    def _step(self, leaves: Mapping[tuple[str, str], Any], shape: tuple[int, ...]) -> FloatArray:
        x, u, p = (
            Values(kind, {name: v for (of, name), v in leaves.items() if of == kind[:5]})
            for kind in ("state", "input", "parameter")
        )
        after, out = self.estimator.checked_step(x, u, p, arrays=bool(shape))
        results = [*(out[o.name] for o in self.estimator.outputs)]
        results += [after[s.name] for s in self.estimator.states]
        if not shape:
            return np.array([float(r) for r in results])
        return np.stack([np.broadcast_to(np.asarray(r, np.float64), shape) for r in results])


def _difference(a: FloatArray, b: FloatArray) -> FloatArray:
    """Differences as shares of a value; 0 where one is not finite."""
    finite = np.isfinite(a) & np.isfinite(b)
    return np.where(finite, np.abs(a - b) / np.maximum(np.abs(b), 1e-250), 0.0)


def sample(
    estimator: Estimator,
    inputs: FloatArray | None = None,
    params: Mapping[str, float] | None = None,
) -> Leaves:
    """Values of all leaves, (rows,) each, by kind and name; the same at each call.

    Parameters
    ----------
    inputs : (n, n_inputs), optional
        Inputs, of which rows are taken at even distances; by default, as states always, drawn.
    params : mapping, optional
        Parameters, with defaults for those that it lacks; by default drawn.
    """
    if inputs is None or not len(inputs):
        inputs, rows = None, _ROWS
    else:
        rows = min(len(inputs), _ROWS)
    draw = np.random.default_rng(rows)
    leaves = {("state", s.name): drawn(draw, s, s.initial, rows) for s in estimator.states}
    for k, i in enumerate(estimator.inputs):
        if inputs is None:
            leaves["input", i.name] = drawn(draw, i, 0.0, rows)
        else:
            leaves["input", i.name] = inputs[np.arange(rows) * len(inputs) // rows, k]
    chosen = None if params is None else estimator.param_values(params)
    for p in estimator.params:
        values = drawn(draw, p, p.default, rows)
        leaves["param", p.name] = values if chosen is None else np.full(rows, chosen[p.name])
    return leaves


def drawn(
    draw: np.random.Generator, of: Input | Param | State, usual: float, rows: int
) -> FloatArray:
    """Values in a declared range: anywhere, its ends, the usual one, and near zero."""
    uniform = draw.uniform(of.low, of.high, rows)
    small = uniform * 2.0 ** -draw.uniform(0.0, 20.0, rows)
    kinds = [uniform, small, np.full(rows, of.low), np.full(rows, of.high), np.full(rows, usual)]
    chosen = np.choose(draw.choice(len(kinds), rows, p=(0.5, 0.2, 0.1, 0.1, 0.1)), kinds)
    return np.asarray(np.clip(chosen, of.low, of.high), dtype=np.float64)
