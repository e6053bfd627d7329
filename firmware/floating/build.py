"""Compile the floating-point C of an estimator for this computer and run it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.firmware.build import HostModel, compiled_library
from boresight.firmware.floating.emit import emit_float_c, float_prefix
from boresight.firmware.floating.precision import SINGLE, Precision
from boresight.firmware.host import host_source
from boresight.model.estimator import Estimator


class FloatCModel(HostModel):
    """The emitted C of an estimator in floating point.

    Parameters
    ----------
    precision : Precision
        `SINGLE`, or `DOUBLE` for the compiled float64 reference.
    params : mapping, optional
        Parameter values; by default those declared.
    """

    def __init__(
        self,
        estimator: Estimator,
        *,
        precision: Precision = SINGLE,
        params: Mapping[str, float] | None = None,
    ) -> None:
        self.estimator = estimator
        name, states = float_prefix(estimator, precision), len(estimator.states)
        host = host_source(name, states, number=precision.type)
        files = {**emit_float_c(estimator, precision), f"{name}_host.c": host}
        library = compiled_library(files, libraries=("-lm",))
        super().__init__(library, precision.numpy, len(estimator.params), states)
        self.set_params(params)

    def set_params(self, params: Mapping[str, float] | None) -> None:
        """Set these parameter values, and the others to their defaults."""
        self.params[:] = list(self.estimator.param_values(params).values())

    def update(self, inputs: npt.ArrayLike) -> npt.NDArray[np.floating[Any]]:
        """Run n updates: inputs (n, n_inputs) in their units -> outputs (n, n_outputs).

        Raises
        ------
        ValueError
            The shape is wrong.
        """
        records = np.ascontiguousarray(inputs, dtype=self.params.dtype)
        wanted = len(self.estimator.inputs)
        if records.ndim != 2 or records.shape[1] != wanted:
            raise ValueError(f"inputs must have shape (n, {wanted}), not {records.shape}")
        return self.run(records[:, None], len(self.estimator.outputs))[0][:, 0]
