"""A run of hours on the integer C, float64 beside it, and its figures."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from boresight.sim.accuracy.endurance import Endurance, endurance
from boresight.sim.attitude.zyx import wrapped
from boresight.sim.experiments.seeds import Runs
from boresight.sim.levels.build import Build
from boresight.systems.array.cases import Case
from boresight.systems.array.estimator import ArrayAttitude
from boresight.systems.array.printed import statistics
from boresight.systems.array.world import ANGLES, DT, ERECTED, TurningArray

__all__ = ["EVERY", "Told", "errors_of", "figures_of", "run_array"]

FloatArray = npt.NDArray[np.float64]
ARCSEC = 180.0 * 3600.0  #: in a half turn.
EVERY = 96  #: samples between two that are judged: many phases of a turn and of a second.
_HOUR = round(3600.0 / DT) // EVERY
_LOOKED_AT = 1013  #: updates between two covariances: every phase of a second.


@dataclass(frozen=True, eq=False)
class Told:
    """What a run gave; ``error`` (n, 3) of pitch, roll, heading [arcsec], each `EVERY` samples."""

    error: FloatArray
    long: Endurance

    @property
    def hourly(self) -> FloatArray:
        """Errors (hours, 3) after each whole hour; of less than one the last."""
        found = self.error[_HOUR - 1 :: _HOUR]
        return found if len(found) else self.error[-1:]


def errors_of(world: TurningArray, long: Endurance) -> FloatArray:
    """Told less true pitch, roll, heading (n, 3) [arcsec] of a run that kept each `EVERY` sample.

    The record after the restart is sample 0; kept are the last of each `EVERY` that turn.
    """
    truth = world.truth(ERECTED, world.samples, EVERY) / math.pi
    told = np.stack([long.outputs[n] for n in ANGLES], axis=1)
    return ARCSEC * wrapped(told - truth, 2.0)


def run_array(case: Case, seeds: range) -> Runs:
    """Figures of a case; see `figures_of`."""
    build = Build(ArrayAttitude(**case.options))
    told = []
    for seed in seeds:
        world = TurningArray(case.deg_s, seed, hours=case.hours, **case.world)
        long = endurance(
            build,
            world.pieces(truth=False),
            first=ERECTED + EVERY,
            every=EVERY,
            compared=ANGLES if case.compared else (),
            watched=_LOOKED_AT,
        )
        told.append(Told(errors_of(world, long), long))
    return figures_of(told)


def figures_of(told: Sequence[Told]) -> Runs:
    """Figures of each run while it turns, in arcsec; kept of each: `Told`."""
    figures: dict[str, list[float]] = defaultdict(list)
    for one in told:
        hourly, long = statistics(one.hourly), one.long
        for k, axis in enumerate(ANGLES):
            figures[f"{axis}_rms"].append(math.sqrt(np.mean(one.error[:, k] ** 2)))
            figures[f"{axis}_max"].append(np.abs(one.error[:, k]).max())
            figures[f"{axis}_sigma"].append(hourly["sigma"][k])
        figures["fixed_float_rms"].append(ARCSEC * math.sqrt(max(long.square.values(), default=0)))
        figures["fixed_float_max"].append(ARCSEC * max(long.most.values(), default=0.0))
        figures["eigenvalue_min"].append(long.least_eigenvalue)
        figures["saturated_sum"].append(long.saturated)
        for name, bit in (("used", 6), ("refused", 3)):
            figures[f"{name}_sum"].append(int(long.counts["status"][bit]))
        figures["scale_up_ppm"].append(1e6 * long.outputs["scale_up"][-1])
    arrays = {n: np.array(v, dtype=np.float64) for n, v in figures.items()}
    return Runs(arrays, {}, list(told), {f"{axis}_sigma": "rms" for axis in ANGLES})
