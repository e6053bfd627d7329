"""Compile the floating-point C of an estimator for this computer and run it."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.firmware.build import array_of, compiled_library, instance
from boresight.firmware.floating.emit import emit_float_c, float_prefix
from boresight.firmware.floating.precision import SINGLE, Precision
from boresight.firmware.names import identifier
from boresight.model.estimator import Estimator


def _host_source(estimator: Estimator, precision: Precision) -> str:
    """Entry points for many updates. The structures consist of consecutive floats."""
    name = float_prefix(estimator, precision)
    params = "".join(
        f"    self->params.{identifier(p.name)} = params[{k}];\n"
        for k, p in enumerate(estimator.params)
    )
    reads = "".join(f"        in.{identifier(i.name)} = *inputs++;\n" for i in estimator.inputs)
    writes = "".join(f"        *outputs++ = out.{identifier(o.name)};\n" for o in estimator.outputs)
    return precision.of_single(
        f'#include "{name}.c"\n\n#include <stddef.h>\n\n'
        f"size_t {name}_size(void);\n"
        f"void {name}_set_params({name}_t *self, const float *params);\n"
        f"void {name}_run({name}_t *self, size_t n, const float *inputs, float *outputs);\n\n"
        f"size_t {name}_size(void) {{\n    return sizeof({name}_t);\n}}\n\n"
        f"void {name}_set_params({name}_t *const self, const float *const params) {{\n"
        f"    (void) self;\n    (void) params;\n{params}}}\n\n"
        f"void {name}_run({name}_t *const self, const size_t n, const float *inputs,\n"
        f"    float *outputs) {{\n    {name}_in_t in;\n    {name}_out_t out;\n"
        f"    for (size_t k = 0; k < n; k++) {{\n{reads}"
        f"        {name}_update(self, &in, &out);\n{writes}    }}\n}}\n"
    )


class FloatCModel:
    """The emitted C of an estimator in floating point.

    Parameters
    ----------
    estimator : Estimator
        Estimator to run.
    precision : Precision
        `SINGLE`, or `DOUBLE` for the compiled float64 reference.
    params : mapping, optional
        Parameter values; by default those declared.
    cflags, cache
        See `firmware.build.compiled_library`.
    """

    def __init__(
        self,
        estimator: Estimator,
        *,
        precision: Precision = SINGLE,
        params: Mapping[str, float] | None = None,
        cflags: Sequence[str] | None = None,
        cache: Path | None = None,
    ) -> None:
        self.estimator, self.precision = estimator, precision
        name, numbers = float_prefix(estimator, precision), array_of(precision.numpy)
        files = {
            **emit_float_c(estimator, precision),
            f"{name}_host.c": _host_source(estimator, precision),
        }
        self.library = compiled_library(files, cflags=cflags, libraries=("-lm",), cache=cache)
        self._memory, self._call = instance(
            self.library, set_params=(numbers,), run=(ctypes.c_size_t, numbers, numbers)
        )
        self.set_params(params)

    def set_params(self, params: Mapping[str, float] | None) -> None:
        """Set these parameter values, and the others to their defaults."""
        values = list(self.estimator.param_values(params).values())
        self._call["set_params"](np.array(values, dtype=self.precision.numpy))

    @property
    def states(self) -> npt.NDArray[np.floating[Any]]:
        """Values of the states, (n_states,): the estimator's memory itself."""
        states = np.frombuffer(self._memory, self.precision.numpy)
        return states[max(1, len(self.estimator.params)) :][: len(self.estimator.states)]

    def reset(self) -> None:
        """Set the states to their start values; parameters stay as they are."""
        self._call["reset"]()

    def update(self, inputs: npt.ArrayLike) -> npt.NDArray[np.floating[Any]]:
        """Run n updates: inputs (n, n_inputs) in their units -> outputs (n, n_outputs).

        Raises
        ------
        ValueError
            The shape is wrong.
        """
        records = np.ascontiguousarray(inputs, dtype=self.precision.numpy)
        wanted = len(self.estimator.inputs)
        if records.ndim != 2 or records.shape[1] != wanted:
            raise ValueError(f"inputs must have shape (n, {wanted}), not {records.shape}")
        outputs = np.empty((len(records), len(self.estimator.outputs)), dtype=self.precision.numpy)
        self._call["run"](len(records), records, outputs)
        return outputs
