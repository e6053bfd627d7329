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
from boresight.model.errors import InputError, place_of_function, placed
from boresight.model.estimator import Estimator
from boresight.model.lowering.trace import Condition, Trace
from boresight.model.ops import OPERATIONS
from boresight.model.step import Values

#: Values of inputs, parameters and states, by kind and name, each (rows,).
Leaves = Mapping[tuple[str, str], FloatArray]

#: Rows (a prime: no array of a step has that shape). All are computed as arrays, if the step takes
#: arrays; one by one as many as have about this number of expressions together, within limits.
_ROWS, _EXPRESSIONS, _FEWEST, _MOST = 997, 40_000, 24, 401
#: Share of a value up to which the two may differ without a second look.
_EQUAL = 1e-9
#: The second look: number of rows, how often each is computed, and the share by which each argument
#: of each operation is perturbed: far more than rounding, far less than a mistake.
_SUSPECTS, _TIMES, _NOISE = 8, 128, 1e-13


def evaluate(
    trace: Trace, leaves: Leaves, noise: Callable[[Any], Any] | None = None, *, claims: bool = False
) -> dict[int, Any]:
    """Compute every expression of one recorded update in float64, by number.

    ``leaves``: inputs, parameters and states by ("input", NAME) and so on, (rows,) each; ``noise``
    is applied to each argument that is a number; with ``claims`` values of `ops.bounded` are held
    in their ranges, as their words are.
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
        if claims and e.kind == "bounded":
            values[e.number] = np.clip(*args, *e.data[:2])
        else:
            values[e.number] = OPERATIONS[e.kind].numpy(*args, *e.data)
    return values


def check_recorded(
    estimator: Estimator,
    inputs: FloatArray | None = None,
    params: Mapping[str, float] | None = None,
) -> None:
    """Compare one update in numpy with its record, of ``inputs`` (rows, n_inputs) and ``params``.

    Without them they are drawn from the declared ranges, as the states are. InputError: the step
    raises, cannot be recorded, or its record computes something else. Differences that rounding
    explains, and infinite values, count as equal.
    """
    leaves, trace = sample(estimator, inputs, params), estimator.record()
    results = [(f"output {name}", e) for name, e in trace.outputs.items()]
    results += [(f"state {s.data[1]}", e) for s, _, e in trace.states]

    def recorded(leaves: Leaves, noise: Callable[[Any], Any] | None = None) -> FloatArray:
        """Results (results, rows) of the record."""
        values, rows = evaluate(trace, leaves, noise), len(next(iter(leaves.values())))
        return np.stack([np.broadcast_to(values[e.number], rows) for _, e in results])

    def recheck(row: int) -> None:
        """Raise InputError unless rounding explains the difference in a row."""
        of_row, draw = {n: values[row] for n, values in leaves.items()}, np.random.default_rng(row)
        computed, wanted = _stepped(estimator, of_row, ()), expected[:, row]
        repeated = {name: np.full(_TIMES, value) for name, value in of_row.items()}
        noisy = recorded(repeated, lambda x: x * (1.0 + _NOISE * draw.uniform(-1.0, 1.0, _TIMES)))
        spread = 2.0 * np.max(np.abs(noisy - wanted[:, None]), axis=1)
        far = (_difference(computed, wanted) > _EQUAL) & (np.abs(computed - wanted) > spread)
        for k in np.flatnonzero(far).tolist():
            name, e = results[k]
            raise InputError.at(
                placed(e.line or place_of_function(estimator.step), f"{name} of {estimator.name}"),
                wanted=f"what step computes in numpy, {computed[k]:.6g}",
                found=f"{wanted[k]:.6g} as recorded",
                fix="compute it with + - * /, comparisons and boresight.ops alone: Python's is, "
                "isinstance and the like are not recorded",
            )

    with np.errstate(all="ignore"):
        expected = recorded(leaves)
        try:
            arrays = [_stepped(estimator, leaves, expected.shape[1:])]
        except (InputError, ValueError, TypeError):  # the step takes none
            arrays = []
        count = _EXPRESSIONS * (1 if arrays else 4) // len(trace.needed)
        rows = range(min(expected.shape[1], max(_FEWEST, min(count, _MOST))))
        scalars = [_stepped(estimator, {n: v[k] for n, v in leaves.items()}, ()) for k in rows]
        for computed in (np.stack(scalars, axis=1), *arrays):
            error = _difference(computed, expected[:, : computed.shape[1]]).max(axis=0)
            for row in np.argsort(-error, kind="stable")[:_SUSPECTS]:
                if error[row] > _EQUAL:
                    recheck(int(row))


def _stepped(estimator: Estimator, leaves: Mapping[Any, Any], shape: tuple[int, ...]) -> FloatArray:
    """Results of the step: (results,) of one row, (results, rows) of arrays."""
    x, u, p = (
        Values(kind, {name: v for (of, name), v in leaves.items() if of == kind[:5]})
        for kind in ("state", "input", "parameter")
    )
    after, out = estimator.checked_step(x, u, p, arrays=bool(shape))
    results = [out[o.name] for o in estimator.outputs] + [after[s.name] for s in estimator.states]
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

    Rows of ``inputs`` are taken at even distances; without, they are drawn, as states always are,
    and parameters where ``params`` is None.
    """
    inputs = None if inputs is None or not len(inputs) else inputs
    rows = _ROWS if inputs is None else min(len(inputs), _ROWS)
    draw = np.random.default_rng(rows)
    leaves = {("state", s.name): drawn(draw, s, s.initial, rows) for s in estimator.states}
    for k, i in enumerate(estimator.inputs):
        if inputs is None:
            leaves["input", i.name] = drawn(draw, i, 0.0, rows)
        else:
            leaves["input", i.name] = inputs[np.arange(rows) * len(inputs) // rows, k]
    leaves |= {("param", p.name): drawn(draw, p, p.default, rows) for p in estimator.params}
    if params is not None:
        chosen = estimator.param_values(params)
        leaves |= {("param", name): np.full(rows, value) for name, value in chosen.items()}
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
