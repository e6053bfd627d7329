"""Between a nine-axis log with attitude and a record."""

from __future__ import annotations

from typing import Any

import numpy as np

from boresight.sim.attitude.log import Log
from boresight.sim.records.record import Column, Record, index_place

__all__ = ["record_of"]


def record_of(log: Any) -> Record:
    """The record of a log, or of what `Record.of` takes.

    A nine-axis log gives the columns ``t dt gx .. az mx .. mz``, and ``qw .. qz`` and ``mov`` if it
    has them: a field that is not new is NaN, a restart is a time step of `RESTART_S`.
    """
    if not isinstance(log, Log):
        return Record.of(log)
    columns = {"t": log.t, "dt": log.dt}
    for letter, triple in (("g", log.gyr), ("a", log.acc), ("m", log.mag)):
        columns |= {f"{letter}{axis}": triple[:, k] for k, axis in enumerate("xyz")}
    if log.q is not None:
        columns |= {f"q{axis}": log.q[:, k] for k, axis in enumerate("wxyz")}
    if log.mov is not None:
        columns["mov"] = log.mov.astype(np.float64)
    return Record(
        log.name, {n: Column(v) for n, v in columns.items()}, index_place(f"log {log.name!r}")
    )
