"""Time steps of a record."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.model.errors import InputError

__all__ = ["MEDIAN_OF", "RESTART_S", "steps_of"]

MEDIAN_OF = 1000  #: steps of which the first one is the median: a long log is read in pieces.
RESTART_S = -0.25  #: s, a time step that restarts the attitude filters.


def steps_of(where: str, t: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
    """Step that ends at each sample, (n,); the first one is the median of the next 1,000.

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
    return np.concatenate([[np.median(steps[:MEDIAN_OF])], steps])
