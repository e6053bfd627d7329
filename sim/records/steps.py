"""Time steps of a record."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.model.errors import InputError

__all__ = ["RESTART_S", "steps_of"]

RESTART_S = -0.25  #: s, a time step that restarts the attitude filters.


def steps_of(where: str, t: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
    """Step that ends at each sample, (n,); the first one is the median of the others.

    Raises
    ------
    InputError
        There is only one sample.
    """
    if len(t) < 2:
        raise InputError.at(
            where,
            wanted="two rows or more, for a time step",
            found="one",
            fix="use a longer log, or give a column dt",
        )
    steps = np.diff(np.asarray(t, dtype=np.float64))
    return np.concatenate([[np.median(steps)], steps])
