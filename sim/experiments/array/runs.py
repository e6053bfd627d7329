"""A run of hours on the integer C, float64 beside it, and its figures."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from boresight.firmware.build import CModel
from boresight.model.estimators.array.attitude import ArrayAttitude
from boresight.sim.accuracy.covariance import covariance_of
from boresight.sim.attitude.zyx import wrapped
from boresight.sim.experiments.array.cases import Case
from boresight.sim.experiments.array.printed import statistics
from boresight.sim.experiments.seeds import Runs
from boresight.sim.levels.build import Build
from boresight.sim.levels.integer import words_of
from boresight.sim.levels.level import outputs_of
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
#: Samples between two covariances that are looked at: every phase of the filter's second.
_LOOKED_AT = 1013


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

    @property
    def hourly(self) -> FloatArray:
        """Errors (hours, 3) after each whole hour; of less than one the last."""
        found = self.error[_HOUR - 1 :: _HOUR]
        return found if len(found) else self.error[-1:]


def told_of(world: TurningArray, build: Build, *, compared: bool = False) -> Told:
    """Run a world on the integer C; ``compared``: and on float64."""
    estimator, program = build.estimators[0], build.programs[0]
    model, covariance = CModel(program), covariance_of(estimator)
    reference = make_level("float", build) if compared else None
    stream = fed(estimator, world.pieces(truth=False), world.name)
    restart = next(stream)
    model.update(words_of(program, restart))
    if reference is not None:
        reference.run(restart)
    kept, apart, least, used, refused, saturated, done = [], [], np.inf, 0, 0, 0, 0
    for inputs in stream:
        words = words_of(program, inputs)
        parts, states = [], []
        for first in range(0, len(words), _LOOKED_AT):
            some = words[first : first + _LOOKED_AT]
            begun, last = model.update(some[:-1]), model.trajectory(some[-1:])
            states.append(last[2])
            parts += [begun, last[:2]]
        p = covariance.of_words(program, np.concatenate(states))
        least = min(least, float(np.linalg.eigvalsh(p).min()))
        found, clamped = (np.concatenate(part) for part in zip(*parts, strict=True))
        outputs = outputs_of(program, found)
        angles = np.stack([outputs[n] for n in ANGLES], axis=1)
        if reference is not None:
            beside = reference.run(inputs).outputs
            off = wrapped(angles - np.stack([beside[n] for n in ANGLES], axis=1), 2.0)
            apart.append([(off**2).sum(axis=0), np.abs(off).max(axis=0)])
        bits = np.rint(outputs["status"]).astype(np.int64)
        used, refused = used + int((bits >> 6 & 1).sum()), refused + int((bits >> 3 & 1).sum())
        saturated += int(clamped.sum())
        kept.append(angles[(ERECTED - 1 - done) % EVERY :: EVERY])
        done += len(inputs)
    truth = world.truth(ERECTED, world.samples, EVERY) / np.pi
    error = ARCSEC * wrapped(np.concatenate(kept)[-len(truth) :] - truth, 2.0)
    square, most = np.array(apart or np.zeros((1, 2, 3))).transpose(1, 0, 2)
    off = ARCSEC * np.stack([np.sqrt(square.sum(axis=0) / done), most.max(axis=0)])
    scale_up = float(outputs["scale_up"][-1])
    return Told(error, off, saturated, used, refused, least, scale_up)


def run_array(case: Case, seeds: range) -> Runs:
    """Figures of a case; see `figures_of`."""
    build = Build(ArrayAttitude(**case.options))
    worlds = (TurningArray(case.deg_s, s, hours=case.hours, **case.world) for s in seeds)
    return figures_of([told_of(world, build, compared=case.compared) for world in worlds])


def figures_of(told: Sequence[Told]) -> Runs:
    """Figures of each run while it turns, in arcsec; kept of each: `Told`."""
    figures: dict[str, list[float]] = defaultdict(list)
    for one in told:
        hourly = statistics(one.hourly)
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
