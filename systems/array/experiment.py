"""The array's attitude over eight hours: the paper's tables beside ours, and what limits them."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.errors import require
from boresight.sim.accuracy.covariance import covariance_of
from boresight.sim.compare.difference import differences
from boresight.sim.experiments.cases import Case, CasesExperiment
from boresight.sim.experiments.seeds import Runs
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.rotations.zyx import wrapped
from boresight.sim.worlds.loop import drive
from boresight.systems.array.estimator import ArrayAttitude
from boresight.systems.array.world import ALIGNED, ANGLES, DT, ERECTED, TurningArray

ARCSEC = 180.0 * 3600.0  #: in a half turn.
EVERY = 96  #: samples between two that are judged: many phases of a turn and of a second.
_HOUR = round(3600.0 / DT) // EVERY
_LOOKED_AT = 1013  #: updates between two covariances: every phase of a second.

_NOISE, _FAULTS = {"noise": 1.0}, {"missed": 0.1, "doubled": 0.1, "wrong": 0.05}
#: Name: meaning, options of the world, of the filter, most runs; at both rates.
_BOTH: dict[str, tuple[str, dict[str, Any], dict[str, Any], int]] = {
    "index": ("with index", {}, {}, 1000),
    "none": ("no index", {"index": "none"}, {}, 1000),
    "literal": ("index read literally: H = [I 0]", {}, {"reading": "literal"}, 4),
    "noise": ("fibre-optic noise", _NOISE, {}, 2),
    "tilt": ("any start, fibre-optic noise", {**_NOISE, "tilt_deg": 5.0}, {}, 4),
}
#: Compared with float64.
_COMPARED = tuple(f"{key}_{name}" for key in "ab" for name in ("index", "noise", "tilt"))


def calibration(world: TurningArray) -> dict[str, float]:
    """Registers of instruments that are known exactly."""
    registers: dict[str, float] = {}
    for name, (bias, matrix) in zip(("gyro", "force"), world.constant, strict=True):
        inverse = np.linalg.inv(matrix)
        for i, r in enumerate("xyz"):
            registers |= {f"{name}_{r}{c}": inverse[i, k] for k, c in enumerate("xyz")}
            registers[f"{name}_bias_{r}"] = (inverse @ bias)[i]
    return registers


class Array(CasesExperiment):
    """Attitude of a radar array that turns for eight hours, Wang Wenzhe et al. (2016).

    ``hours``: how long it turns, 1 to 24; ``jobs``: see `Experiment`. `InputError`: other hours.
    """

    runs, at_once = 8, 1
    estimator, step_s = ArrayAttitude, EVERY * DT
    cases = {
        f"{key}_{name}": Case(f"{deg_s:g} deg/s, {meaning}", {"deg_s": deg_s, **world}, {}, options)
        for name, (meaning, world, options, _) in _BOTH.items()
        for key, deg_s in (("a", 0.35), ("b", 36.0))
    } | {
        "b_calibrated": Case("36 deg/s, calibrated", {"deg_s": 36.0}),
        "b_faults": Case("36 deg/s, pulses missed, doubled, wrong", {"deg_s": 36.0, **_FAULTS}),
    }
    most_runs = {f"{key}_{name}": row[3] for name, row in _BOTH.items() for key in "ab"} | {
        **{"b_calibrated": 2, "b_faults": 2}
    }
    intro = """
        The array of Wang Wenzhe et al. (2016) rests for 300 s, is erected to a pitch of
        66 deg, and turned about the vertical for hours. The integer program of the core runs
        through every sample, in C. Sensor errors are the paper's, their signs drawn in every
        run; there is no noise, unless a case says so. Errors, in arcsec, count while it turns;
        later: from the second turn on.
    """
    columns = {
        **{f"{a}, {kind}": f"{a}_{kind}" for a in ANGLES for kind in ("rms", "max")},
        **{"heading after the rest": "heading_rested_rms"},
        **{"heading later, max": "heading_later_max", "scale of the up gyro, ppm": "scale_up_ppm"},
        **{"indices used": "used_sum", "refused": "refused_sum"},
        "less float64, max": "fixed_float_max",
    }
    shown = ("a_index", "a_none", "b_index", "b_none")
    shown_text = "Errors of the first run; those of the first turns are beyond the axes."

    def __init__(self, hours: float = 8.0, jobs: int | None = None) -> None:
        super().__init__(jobs)
        require(1.0 <= hours <= 24.0, "experiment array, hours", "1 to 24", hours)
        self.hours, self.counts = hours, {"hours": hours}

    def run_case(self, name: str, seeds: range) -> Runs:
        """Figures of each run while it turns, in arcsec."""
        results = [self._turned(name, seed) for seed in seeds]
        figures = {n: np.array([run[n] for run, _ in results]) for n in results[0][0]}
        error = results[0][1]
        return Runs(figures, {f"{a}, arcsec": {"": error[:, k]} for k, a in enumerate(ANGLES)})

    def _turned(self, name: str, seed: int) -> tuple[dict[str, float], FloatArray]:
        """Figures of a run of hours on the integer C, and its errors (n, 3) [arcsec].

        Of pitch, roll and heading, at the last of each `EVERY` records that turn.
        """
        case = self.cases[name]
        world = TurningArray(seed=seed, hours=self.hours, truths=False, **case.world)
        registers = calibration(world) if name == "b_calibrated" else None
        build = Build(ArrayAttitude(**case.options), params=[registers])
        estimator, level = build.estimators[0], make_level("c", build)
        real = make_level("float", build) if name in _COMPARED else None
        covariance, records, counts = covariance_of(estimator), 0, Counter[str]()
        square, largest = np.zeros(3), np.zeros(3)
        eigenvalue, kept, rested = math.inf, [], np.zeros(3)
        for part in drive(world, level):
            run, n = part.run, len(part.inputs)
            assert run.states is not None
            rows = sorted({*range(_LOOKED_AT - 1, n, _LOOKED_AT), n - 1})
            p = covariance.of_words(level.program, run.states[rows])
            eigenvalue = min(eigenvalue, float(np.linalg.eigvalsh(p).min()))
            if real is not None:
                reference = real.run(part.inputs).outputs
                angles = {k: reference[k] for k in ANGLES}
                found = differences(estimator.outputs, run.outputs, angles)
                square += [d.rms**2 * d.samples for d in found]
                largest = np.maximum(largest, [d.largest for d in found])
            status = np.rint(run.outputs["status"]).astype(np.int64)
            counts["refused"] += int(np.count_nonzero(status >> 3 & 1))
            counts["used"] += int(np.count_nonzero(status >> 6 & 1))
            counts["saturated"] += run.n_saturated
            outputs = {k: run.outputs[k] for k in (*ANGLES, "scale_up")}
            if 0 <= ALIGNED - records < n:
                last = {k: values[ALIGNED - records :][:1] for k, values in outputs.items()}
                rested = errors_of(world, last, ALIGNED - 1, ALIGNED)[0]
            # The record after the restart is sample 0; kept are the last of each `EVERY` that turn.
            first = ERECTED + EVERY - records
            selection = slice(first if first >= 0 else first % EVERY, None, EVERY)
            kept.append({k: values[selection].copy() for k, values in outputs.items()})
            records += n
        outputs = {k: np.concatenate([part[k] for part in kept]) for k in kept[0]}
        error = errors_of(world, outputs, ERECTED, world.samples, EVERY)
        figures = {f"{key}_sum": float(n) for key, n in counts.items()}
        figures |= {"eigenvalue_min": eigenvalue, "scale_up_ppm": 1e6 * outputs["scale_up"][-1]}
        if real is not None:
            figures["fixed_float_rms"] = ARCSEC * math.sqrt(square.max() / records)
            figures["fixed_float_max"] = ARCSEC * largest.max()
        # A second after the first turn.
        later = error[math.ceil((360.0 / world.deg_s + 1.0) / DT / EVERY) :]
        hourly = error[_HOUR - 1 :: _HOUR]
        for k, axis in enumerate(ANGLES):
            for kind, errors in (("", error), ("later_", later)):
                figures[f"{axis}_{kind}rms"] = float(np.sqrt(np.mean(errors[:, k] ** 2)))
                figures[f"{axis}_{kind}max"] = float(np.abs(errors[:, k]).max())
            figures[f"{axis}_rested_rms"] = abs(rested[k])
            # Of one hour there is no spread.
            figures[f"{axis}_sigma"] = float(hourly[:, k].std(ddof=1)) if len(hourly) > 1 else 0.0
        return figures, error

    def further(
        self, outcomes: Mapping[str, Runs], *, seed: int, runs: int, say: Callable[[str], None]
    ) -> dict[str, float]:
        """Worst figures of all cases; heading without an index over that with it."""
        pooled = {name: case_runs.pooled() for name, case_runs in outcomes.items()}

        def values(figure: str) -> list[float]:
            return [figures[figure] for figures in pooled.values() if figure in figures]

        figures = {
            f"array_fixed_float_arcsec_{k}": max(values(f"fixed_float_{k}")) for k in ("rms", "max")
        }
        figures["array_least_eigenvalue_lsb"] = min(values("eigenvalue_min"))
        figures["array_saturated"] = sum(values("saturated_sum"))
        for key, end in (("a", "_slow"), ("b", "")):
            without, aided = (pooled[f"{key}_{n}"]["heading_rms"] for n in ("none", "index"))
            figures[f"array_index_gain{end}"] = without / aided
        return figures


def errors_of(
    world: TurningArray, outputs: Mapping[str, FloatArray], first: int, last: int, every: int = 1
) -> FloatArray:
    """Errors of pitch, roll, heading (n, 3) [arcsec] of `World.truth` of these samples."""
    truth = world.truth(first, last, every) / math.pi
    angles = np.stack([outputs[n] for n in ANGLES], axis=1)
    return ARCSEC * wrapped(angles - truth, 2.0)
