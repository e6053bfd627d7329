"""A run of hours on the integer C, float64 beside it, and its figures."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.sim.accuracy.covariance import covariance_of
from boresight.sim.compare.difference import differences
from boresight.sim.experiments.seeds import Runs
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.rotations.zyx import wrapped
from boresight.sim.worlds.loop import drive
from boresight.systems.array.cases import Case
from boresight.systems.array.estimator import ArrayAttitude
from boresight.systems.array.world import ALIGNED, ANGLES, DT, ERECTED, TurningArray

ARCSEC = 180.0 * 3600.0  #: in a half turn.
EVERY = 96  #: samples between two that are judged: many phases of a turn and of a second.
_HOUR = round(3600.0 / DT) // EVERY
_LOOKED_AT = 1013  #: updates between two covariances: every phase of a second.
_COUNTED = ("saturated", "used", "refused", "records")


@dataclass(frozen=True, eq=False)
class Turned:
    """Result of a run of hours.

    Attributes
    ----------
    outputs : dict of str to float64 (n,)
        Of the last of each `EVERY` records that turn, in the outputs' units.
    error : float64 (n, 3)
        Of pitch, roll, heading there [arcsec].
    rested : float64 (3,)
        The same at the end of the rest.
    square, largest : dict of str to float
        By angle that was compared: mean square, and largest, of its difference from float64 [ht].
    least_eigenvalue : float
        Of the covariances that were looked at [LSB]; infinite if none was.
    saturated, used, refused, records : int
        Updates in which an operation was clamped; in which the index was used, refused; in all.
    """

    outputs: Mapping[str, FloatArray]
    error: FloatArray
    rested: FloatArray
    square: Mapping[str, float]
    largest: Mapping[str, float]
    least_eigenvalue: float
    saturated: int
    used: int
    refused: int
    records: int

    @property
    def hourly(self) -> FloatArray:
        """Errors (hours, 3) after each whole hour; of less than one the last."""
        samples = self.error[_HOUR - 1 :: _HOUR]
        return samples if len(samples) else self.error[-1:]


def turned(
    world: TurningArray, build: Build, *, compared: bool = False, watched: bool = False
) -> Turned:
    """Run hours on the integer C, with float64 beside it if ``compared``.

    ``watched``: eigenvalues of the covariance are looked at.
    """
    estimator, level = build.estimators[0], make_level("c", build)
    real = make_level("float", build) if compared else None
    covariance = covariance_of(estimator) if watched else None
    square, largest = dict.fromkeys(ANGLES * compared, 0.0), dict.fromkeys(ANGLES * compared, 0.0)
    counts: Counter[str] = Counter()
    smallest, errors, rested = math.inf, [], np.full(3, np.nan)
    for part in drive(world, level):
        run, n = part.run, len(part.inputs)
        if covariance is not None and run.states is not None:
            rows = sorted({*range(_LOOKED_AT - 1, n, _LOOKED_AT), n - 1})
            p = covariance.of_words(level.program, run.states[rows])
            smallest = min(smallest, float(np.linalg.eigvalsh(p).min()))
        if real is not None:
            reference = real.run(part.inputs).outputs
            for d in differences(estimator.outputs, run.outputs, {k: reference[k] for k in ANGLES}):
                square[d.output] += d.rms**2 * d.samples
                largest[d.output] = max(largest[d.output], d.largest)
        if "status" in run.outputs:
            status = np.rint(run.outputs["status"]).astype(np.int64)
            counts["refused"] += int(np.count_nonzero(status >> 3 & 1))
            counts["used"] += int(np.count_nonzero(status >> 6 & 1))
        counts["saturated"] += run.n_saturated
        last = ALIGNED - counts["records"]
        if 0 <= last < n:
            outputs = {name: values[last : last + 1] for name, values in run.outputs.items()}
            rested = errors_of(world, outputs, ALIGNED - 1, ALIGNED)[0]
        # The record after the restart is sample 0; kept are the last of each `EVERY` that turn.
        first = ERECTED + EVERY - counts["records"]
        selection = slice(first if first >= 0 else first % EVERY, None, EVERY)
        errors.append({name: values[selection].copy() for name, values in run.outputs.items()})
        counts["records"] += n
    outputs = {name: np.concatenate([part[name] for part in errors]) for name in errors[0]}
    square = {name: total / counts["records"] for name, total in square.items()}
    error = errors_of(world, outputs, ERECTED, world.samples, EVERY)
    sums = {n: counts[n] for n in _COUNTED}
    return Turned(outputs, error, rested, square, largest, smallest, **sums)


def errors_of(
    world: TurningArray, outputs: Mapping[str, FloatArray], first: int, last: int, every: int = 1
) -> FloatArray:
    """Errors of pitch, roll, heading (n, 3) [arcsec] of `World.truth` of these samples."""
    truth = world.truth(first, last, every) / math.pi
    angles = np.stack([outputs[n] for n in ANGLES], axis=1)
    return ARCSEC * wrapped(angles - truth, 2.0)


def calibration(world: TurningArray) -> dict[str, float]:
    """Registers of instruments that are known exactly."""
    registers: dict[str, float] = {}
    for name, (bias, matrix) in zip(("gyro", "force"), world.constant, strict=True):
        inverse = np.linalg.inv(matrix)
        registers |= {
            f"{name}_{r}{c}": inverse[i, k]
            for i, r in enumerate("xyz")
            for k, c in enumerate("xyz")
        }
        registers |= dict(zip((f"{name}_bias_{a}" for a in "xyz"), inverse @ bias, strict=True))
    return registers


def run_array(case: Case, seeds: range) -> Runs:
    """Figures of a case; see `figures_of`."""
    runs = []
    for seed in seeds:
        world = TurningArray(case.deg_s, seed, hours=case.hours, truths=False, **case.world)
        registers = calibration(world) if case.calibrated else None
        build = Build(ArrayAttitude(**case.options), params=[registers])
        runs.append(turned(world, build, compared=case.compared, watched=True))
    return figures_of(runs, case.deg_s)


def figures_of(runs: Sequence[Turned], deg_s: float) -> Runs:
    """Figures of each run while it turns, in arcsec; kept of each: `Turned`.

    ``later``: from a second after the first turn on.
    """
    later = math.ceil((360.0 / deg_s + 1.0) / DT / EVERY)
    figures: dict[str, list[float]] = defaultdict(list)
    for result in runs:
        hourly = statistics(result.hourly)
        for k, axis in enumerate(ANGLES):
            figures[f"{axis}_rms"].append(math.sqrt(np.mean(result.error[:, k] ** 2)))
            figures[f"{axis}_max"].append(np.abs(result.error[:, k]).max())
            figures[f"{axis}_later_rms"].append(math.sqrt(np.mean(result.error[later:, k] ** 2)))
            figures[f"{axis}_later_max"].append(np.abs(result.error[later:, k]).max())
            figures[f"{axis}_rested_rms"].append(abs(result.rested[k]))
            figures[f"{axis}_sigma"].append(hourly["sigma"][k])
        figures["fixed_float_rms"].append(
            ARCSEC * math.sqrt(max(result.square.values(), default=0))
        )
        figures["fixed_float_max"].append(ARCSEC * max(result.largest.values(), default=0.0))
        figures["eigenvalue_min"].append(result.least_eigenvalue)
        for name in ("saturated", "used", "refused"):
            figures[f"{name}_sum"].append(getattr(result, name))
        figures["scale_up_ppm"].append(1e6 * result.outputs["scale_up"][-1])
    arrays = {n: np.array(v, dtype=np.float64) for n, v in figures.items()}
    return Runs(arrays, {}, list(runs), {f"{axis}_sigma": "rms" for axis in ANGLES})


def statistics(hourly: FloatArray) -> dict[str, FloatArray]:
    """Deviation from their mean (n - 1), rms and most of hourly errors (hours, 3); (3,) each."""
    return {
        "sigma": hourly.std(axis=0, ddof=1) if len(hourly) > 1 else np.zeros(3),
        "rms": np.sqrt(np.mean(hourly**2, axis=0)),
        "max": np.abs(hourly).max(axis=0),
    }
