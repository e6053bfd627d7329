"""Float64: with numpy, as the estimator is written, and compiled from C."""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace

import numpy as np
import numpy.typing as npt

from boresight.firmware.floating.build import FloatCModel
from boresight.firmware.floating.precision import DOUBLE
from boresight.model.estimator import Estimator
from boresight.sim.levels.level import Run

__all__ = ["CompiledFloat", "NumpyFloat"]

FloatArray = npt.NDArray[np.float64]


class NumpyFloat:
    """The float reference: `Estimator.step` on numpy's float64."""

    name = "numpy"

    def __init__(self, estimator: Estimator, params: Mapping[str, float] | None = None) -> None:
        self.estimator = estimator
        self._params = SimpleNamespace(**estimator.param_values(params))
        self.reset()

    def reset(self) -> None:
        """Set the states to their start values."""
        self._state = {s.name: np.float64(s.initial) for s in self.estimator.states}

    def step(self, record: FloatArray) -> dict[str, float]:
        """One update."""
        names = (i.name for i in self.estimator.inputs)
        u = SimpleNamespace(**{n: np.float64(v) for n, v in zip(names, record, strict=True)})
        with np.errstate(all="ignore"):
            state, out = self.estimator.checked_step(
                SimpleNamespace(**self._state), u, self._params
            )
        self._state = {name: np.float64(value) for name, value in state.items()}
        return {o.name: float(out[o.name]) for o in self.estimator.outputs}

    def run(self, records: FloatArray) -> Run:
        """Updates, one after the other."""
        rows = [self.step(record) for record in records]
        return Run({o.name: np.array([r[o.name] for r in rows]) for o in self.estimator.outputs})

    def close(self) -> None:
        """Nothing is held."""


class CompiledFloat:
    """Float64 compiled from C: the reference within rounding, thousands of times as fast."""

    name = "float"

    def __init__(self, estimator: Estimator, params: Mapping[str, float] | None = None) -> None:
        self.estimator = estimator
        self._model = FloatCModel(estimator, precision=DOUBLE, params=params)

    def reset(self) -> None:
        """Set the states to their start values."""
        self._model.reset()

    def step(self, record: FloatArray) -> dict[str, float]:
        """One update."""
        row = self._model.update(record[None, :])[0]
        return {o.name: float(v) for o, v in zip(self.estimator.outputs, row, strict=True)}

    def run(self, records: FloatArray) -> Run:
        """Updates, one after the other."""
        found = self._model.update(records).astype(np.float64)
        return Run({o.name: found[:, k].copy() for k, o in enumerate(self.estimator.outputs)})

    def close(self) -> None:
        """Nothing is held."""
