"""A run of hours on the integer C, float64 beside it, and its figures."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from boresight.model.estimators.array.attitude import ArrayAttitude

from boresight.sim.accuracy.covariance import covariance_of
from boresight.sim.attitude.zyx import wrapped
from boresight.sim.experiments.array.cases import Case
from boresight.sim.experiments.array.printed import statistics
from boresight.sim.experiments.seeds import Runs
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.levels.stream import fed
from boresight.sim.worlds.array.world import ANGLES, DT, ERECTED, TurningArray

__all__ = ["EVERY", "Told", "figures_of", "run_array", "told_of"]

FloatArray = npt.NDArray[np.float64]
ARCSEC = 180.0 * 3600.0  #: in a half turn.
EVERY = (
    96  #: samples between two that are judged: every phase of a turn and of the filter's second.
)
_HOUR = round(3600.0 / DT) // EVERY
_SECOND = round(1.0 / DT)


@dataclass(eq=False)
class Told:
    """What a run gave.

    Attributes
    ----------
    error : float64 (n, 3)
        Of pitch, roll, heading [arcsec] while it turns, each `EVERY` samples.
    apart : float64 (2, 3)
        Integers less float64 [arcsec]: root of the mean square, most, of every sample.
    saturated, used, refused : int
        Updates with a clamped word; indices used, and beyond the gate or too soon.
    eigenvalue : float
        Least of the covariance, in LSB of its words.
    scale_up : float
        Last scale factor of the gyro that points up.
    """

    error: FloatArray
    apart: FloatArray
    saturated: int
    used: int
    refused: int
    eigenvalue: float
    scale_up: float


def told_of(world: TurningArray, build: Build, *, compared: bool = False) -> Told:
    """Run a world on the integer C; ``compared``: and on float64."""
    estimator, program, size = build.estimators[0], build.programs[0], len(ANGLES)
    levels = [make_level(n, build) for n in ("c", *(["float"] if compared else []))]
    covariance = covariance_of(estimator)
    stream = fed(estimator, world.pieces(truth=False), world.name)
    restart = next(stream)
    for level in levels:
        level.run(restart)
    kept, least, bits = [], np.inf, np.zeros(0, dtype=np.int64)
    square, most, done, saturated = np.zeros(size), np.zeros(size), 0, 0
    for inputs in stream:
        runs = [level.run(inputs) for level in levels]
        angles = [np.stack([r.outputs[n] for n in ANGLES], axis=1) for r in runs]
        off = wrapped(angles[0] - angles[-1], 2.0)
        square, most = square + (off**2).sum(axis=0), np.maximum(most, np.abs(off).max(axis=0))
        words = runs[0]
        assert words.saturated is not None and words.states is not None
        saturated += int(words.saturated.sum())
        p = covariance.of_words(program, words.states[_SECOND - 1 :: _SECOND])
        least = min(least, float(np.linalg.eigvalsh(p).min()))
        bits = np.concatenate([bits, np.rint(words.outputs["status"]).astype(np.int64)])
        kept.append(angles[0][(ERECTED - 1 - done) % EVERY :: EVERY])
        done += len(inputs)
    truth = world.truth(ERECTED, world.samples, EVERY) / np.pi
    told = np.concatenate(kept)[-len(truth) :]
    return Told(
        ARCSEC * wrapped(told - truth, 2.0),
        ARCSEC * np.stack([np.sqrt(square / done), most]),
        saturated,
        *(int((bits >> bit & 1).sum()) for bit in (6, 3)),
        least,
        float(words.outputs["scale_up"][-1]),
    )


def run_array(case: Case, seeds: range, hours: float) -> Runs:
    """Figures of a case; see `figures_of`."""
    build = Build(ArrayAttitude(**case.options))
    worlds = (TurningArray(case.deg_s, s, hours=hours, **case.world) for s in seeds)
    return figures_of([told_of(world, build, compared=case.compared) for world in worlds])


def figures_of(told: Sequence[Told]) -> Runs:
    """Figures of each run while it turns, in arcsec; kept of each: `Told`."""
    figures: dict[str, list[float]] = defaultdict(list)
    for one in told:
        hourly = statistics(one.error[_HOUR - 1 :: _HOUR])
        for k, axis in enumerate(ANGLES):
            error = one.error[:, k]
            figures[f"{axis}_rms"].append(math.sqrt(np.mean(error**2)))
            figures[f"{axis}_max"].append(np.abs(error).max())
            figures[f"{axis}_sigma"].append(hourly["sigma"][k])
            figures[f"{axis}_hourly_max"].append(hourly["most"][k])
        figures["fixed_float_rms"].append(one.apart[0].max())
        figures["fixed_float_max"].append(one.apart[1].max())
        for name in ("saturated", "used", "refused"):
            figures[f"{name}_sum"].append(getattr(one, name))
        figures["eigenvalue_min"].append(one.eigenvalue)
        figures["scale_up_ppm"].append(1e6 * one.scale_up)
    arrays = {n: np.array(v, dtype=np.float64) for n, v in figures.items()}
    pooling = {f"{axis}_sigma": "rms" for axis in ANGLES}
    return Runs(arrays, {}, list(told), pooling)
