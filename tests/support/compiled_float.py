"""Float runs of an estimator, compiled: the mathematics of `step`, without Python's time for it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.firmware.floating import FloatCModel
from boresight.model.estimator import Estimator, Output
from boresight.model.step import Values

FloatArray = npt.NDArray[np.float64]
Columns = dict[str, FloatArray]


class _Open(Estimator):
    """An estimator whose states after the update are outputs too."""

    def __init__(self, estimator: Estimator) -> None:
        self.estimator, self.name = estimator, f"{estimator.name}_open"
        self.inputs, self.params = estimator.inputs, estimator.params
        self.states = estimator.states
        states = (Output(f"after_{s.name}", s.unit) for s in estimator.states)
        self.outputs = (*estimator.outputs, *states)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        after, out = self.estimator.step(x, u, p)
        return after, {**out, **{f"after_{name}": value for name, value in after.items()}}


@cache
def _model(estimator: Estimator) -> FloatCModel:
    return FloatCModel(_Open(estimator))


def compiled_float(
    estimator: Estimator, inputs: FloatArray, params: Mapping[str, float] | None = None
) -> tuple[Columns, Columns]:
    """Outputs and states by name, each (steps, runs), of inputs (steps, n_inputs, runs).

    The double-precision C that is written from `step`, compiled once for an estimator object.
    `tests/model/test_recorded.py` shows that an update of every shipped estimator is what `step`
    computes, `tests/sim/levels/test_floating.py` that runs of filters of nine axes are to 1e-12.
    """
    model = _model(estimator)
    model.set_params(params)
    results = []
    for run in np.moveaxis(np.asarray(inputs), 2, 0):
        model.reset()
        results.append(model.update(run))
    columns = np.stack(results, axis=2)
    outputs = [o.name for o in estimator.outputs]
    return (
        {name: columns[:, k] for k, name in enumerate(outputs)},
        {s.name: columns[:, len(outputs) + k] for k, s in enumerate(estimator.states)},
    )


def numpy_float(
    estimator: Estimator, inputs: FloatArray, params: Mapping[str, float] | None = None
) -> Columns:
    """Outputs by name, each (steps, runs), of `step` on arrays (steps, n_inputs, runs)."""
    steps, _, runs = inputs.shape
    p = Values("parameter", estimator.param_values(params))
    x = {s.name: np.full(runs, s.initial) for s in estimator.states}
    out = {o.name: np.empty((steps, runs)) for o in estimator.outputs}
    names = [i.name for i in estimator.inputs]
    with np.errstate(all="ignore"):
        for k in range(steps):
            u = Values("input", dict(zip(names, inputs[k], strict=True)))
            x, y = estimator.checked_step(Values("state", x), u, p, arrays=True)
            for name, value in y.items():
                out[name][k] = value
    return out
