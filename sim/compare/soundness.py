"""What is refused before anything runs: no core of it could be right."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from boresight.model.lowering.resolution import check_resolution
from boresight.model.recorded import check_recorded
from boresight.sim.levels.build import Build

__all__ = ["check_sound"]


def check_sound(build: Build, inputs: Sequence[npt.NDArray[np.float64]] | None = None) -> None:
    """Refuse estimators whose record is not their step, or whose words cannot hold what is declared.

    Parameters
    ----------
    build : Build
    inputs : sequence of (rows, n_inputs), optional
        Of each estimator, in their units, for its parameters as chosen; by default all are drawn
        from the declared ranges.

    Raises
    ------
    InputError
        See `model.recorded.check_recorded` and `model.lowering.resolution.check_resolution`.
    """
    for k, estimator in enumerate(build.estimators):
        if inputs is None:
            check_recorded(estimator)
        else:
            check_recorded(estimator, inputs[k], build.params[k] or {})
        check_resolution(build.programs[k], build.nodes[k])
