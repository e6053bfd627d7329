"""From a log to an estimator's input records, and from output records to attitude."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Program
from boresight.sim.attitude.log import Log

__all__ = ["attitude_of", "euler_deg_of", "inputs_of", "named_outputs", "status_of"]

FloatArray = npt.NDArray[np.float64]


def inputs_of(estimator: Estimator, log: Log) -> FloatArray:
    """Input records (n, n_inputs) of a log.

    Inputs are found by name: ``dt`` [s], ``gx gy gz`` [rad/s], ``ax ay az`` [m/s^2], ``mx my mz``
    [uT]. A magnetometer sample that is not new is passed on as the zero vector, which no estimator
    takes for a field.
    """
    mag = np.where(log.mag_new[:, None], log.mag, 0.0)
    columns: dict[str, FloatArray] = {"dt": log.dt}
    for k, axis in enumerate("xyz"):
        columns[f"g{axis}"] = log.gyr[:, k]
        columns[f"a{axis}"] = log.acc[:, k]
        columns[f"m{axis}"] = mag[:, k]
    missing = [i.name for i in estimator.inputs if i.name not in columns]
    if missing:
        raise InputError.at(
            f"log {log.name!r}",
            wanted=f"inputs {', '.join(missing)}",
            found="none of that name",
            fix=f"{estimator.name} needs another log",
        )
    return np.stack([columns[i.name] for i in estimator.inputs], axis=1)


def named_outputs(program: Program, words: IntArray) -> dict[str, FloatArray]:
    """Output words (n, n_outputs) as real values (n,) by name."""
    return {
        name: program.format(value).real(words[:, k])
        for k, (name, value) in enumerate(zip(program.output_names, program.outputs, strict=True))
    }


def attitude_of(outputs: Mapping[str, FloatArray]) -> FloatArray:
    """Quaternions (..., 4) of output records by name."""
    return np.stack([outputs[name] for name in ("qw", "qx", "qy", "qz")], axis=-1)


def euler_deg_of(outputs: Mapping[str, FloatArray]) -> FloatArray:
    """Euler angles (..., 3) [deg]: heading, pitch, roll, from the outputs in half turns."""
    return 180.0 * np.stack([outputs[name] for name in ("heading", "pitch", "roll")], axis=-1)


def status_of(outputs: Mapping[str, FloatArray]) -> npt.NDArray[np.int64]:
    """Status flags (...,) as the integer whose bits the estimator documents."""
    return np.rint(outputs["status"]).astype(np.int64)
