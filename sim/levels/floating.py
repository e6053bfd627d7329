"""Float64: with numpy, as the estimator is written, and compiled from C."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from boresight.firmware.floating import FloatCModel
from boresight.model.arrays import FloatArray
from boresight.model.step import Values
from boresight.sim.levels.build import Build
from boresight.sim.levels.level import Level, Run, wrapped


class NumpyFloat(Level):
    """The float reference: `Estimator.step` on numpy's float64."""

    name, tools, exact = "numpy", ("numpy",), False

    def __init__(self, build: Build, number: int = 0, tool: str | None = None) -> None:
        super().__init__(build, number, tool)
        self.estimator = build.estimators[number]
        self.estimator.record()  # Refuse a step that other levels cannot run.
        self._params = Values("parameter", build.values[number])
        self.reset()

    def reset(self) -> None:
        """Set the states to their start values."""
        self._state = {s.name: np.float64(s.initial) for s in self.estimator.states}

    def _update(self, record: FloatArray) -> list[float]:
        """One update: outputs in their order."""
        names = (i.name for i in self.estimator.inputs)
        u = Values("input", {n: np.float64(v) for n, v in zip(names, record, strict=True)})
        with np.errstate(all="ignore"):
            state, out = self.estimator.checked_step(Values("state", self._state), u, self._params)
        self._state = {name: np.float64(value) for name, value in state.items()}
        return [float(out[o.name]) for o in self.estimator.outputs]

    def run(self, records: FloatArray) -> Run:
        """Updates, one after the other."""
        outputs = self.estimator.outputs
        table = np.array([self._update(record) for record in records]).reshape(-1, len(outputs))
        return Run(wrapped({o.name: table[:, k] for k, o in enumerate(outputs)}, outputs))


class CompiledFloat(Level):
    """Float64 compiled from C: the reference within rounding, thousands of times as fast."""

    name, tools, exact = "float", ("gcc",), False

    def __init__(self, build: Build, number: int = 0, tool: str | None = None) -> None:
        super().__init__(build, number, tool)
        self._model = FloatCModel(build.estimators[number], params=build.params[number])

    def set_params(self, params: Mapping[str, float] | None) -> None:
        """Set these parameter values, and the others to their defaults."""
        self._model.set_params(params)

    def reset(self) -> None:
        """Set the states to their start values."""
        self._model.reset()

    def run(self, records: FloatArray) -> Run:
        """Updates, one after the other."""
        table = self._model.update(records).astype(np.float64)
        outputs = self.build.estimators[self.number].outputs
        return Run(wrapped({o.name: table[:, k].copy() for k, o in enumerate(outputs)}, outputs))
