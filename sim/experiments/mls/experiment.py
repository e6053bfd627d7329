"""The landing-system array: what the paper shows in Figures 3 to 7, with figures of our own."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from boresight.gateware.core import build_core
from boresight.gateware.machine import CONFIGS
from boresight.model.estimators.array_phases import ArrayPhases
from boresight.model.estimators.mls_attitude import MlsAttitude
from boresight.sim.experiments.experiment import Experiment, Result, Target
from boresight.sim.experiments.mls.flights import (
    AXES,
    Case,
    Flight,
    beam_errors,
    flight_figures,
    fly,
    phases_of,
)
from boresight.sim.experiments.mls.page import render
from boresight.sim.experiments.mls.patterns import AZIMUTHS, Trial, mean_gain, scan_phases, trial
from boresight.sim.experiments.mls.targets import targets_of
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.worlds.mls_array import Array, direction
from boresight.sim.worlds.mls_deck import SensorErrors

__all__ = ["CASES", "Mls", "patterns_of", "phases_fixed_float"]

FEW = 10  #: most runs of cases that only illustrate.
GLIDE_DEG = 3.0
NAMES = {-60.0: "m60", 0.0: "0", 60.0: "60"}
_SPREAD = SensorErrors(gyro_bias=(0.0, 0.0, 0.0), bias_spread=0.2)
_FOLLOWS = {"gyro_sd": 0.2}  # rad/s: what a bias of 0.2 deg/s leaves is small

CASES = {
    "corrected": Case("as corrected, Picard of third order", full=True),
    "prototype": Case("prototype: dense float64, from where the core has aligned", reference="prototype"),
    "picard_4": Case("Picard of fourth order, as (21)", {"picard": 4}),
    "gyro_only": Case("gyro alone", reference="gyro"),
    "lag_5ms": Case("gyro 5 ms late", errors=SensorErrors(gyro_lag=5)),
    "process_18": Case("as printed (18), q' = -w q/2", {"process": "printed"}),
    "measurement_24": Case("as printed (24), h = C V", {"measurement": "printed"}),
    "innovation_28": Case("as printed (28), z - H q", {"innovation": "printed"}),
    "norm_free": Case("q never set to norm one", {"norm": "free"}),
    "norm_free_28": Case(
        "(28) and q never set to norm one", {"norm": "free", "innovation": "printed"}
    ),
    "bias": Case("gyro biases drawn, 0.2 deg/s each axis", errors=_SPREAD),
    "bias_follows": Case("the same, gyro_sd 11 deg/s", params=_FOLLOWS, errors=_SPREAD),
    "rolling": Case("ship turning by +-10 deg about each axis", motion="rolling", full=True),
    "rolling_bias": Case("the same, biases drawn, gyro_sd 11 deg/s", {}, _FOLLOWS, _SPREAD, "rolling"),
    **{f"sea_{n}": Case(f"carrier in sea state {n}", motion=f"sea_{n}") for n in (4, 5, 6)},
}
STEERED = ("rolling", "rolling_bias", "sea_5", "sea_6")  #: cases whose beams are looked at.


def patterns_of(elements: int, draws: int, seed: int) -> dict[str, tuple[Trial, float]]:
    """Trials by name (``x_05_m60``), each with the closed form of its mean gain."""
    array, found = Array(elements), {}
    for elevation in (GLIDE_DEG, 20.0, 30.0):
        scanned = scan_phases(array, elevation)
        for axis, b in ((0, 0.1), (0, 0.5), (1, 0.1), (1, 0.5), (2, 0.1), (2, 0.5)):
            for azimuth in AZIMUTHS:
                high = elevation != GLIDE_DEG
                if high and (axis, b, azimuth) != (2, 0.5, 0.0):
                    continue
                name = f"{'xyz'[axis]}_0{round(10 * b)}_{NAMES[azimuth]}"
                name += f"_at_{elevation:.0f}" if high else ""
                closed = mean_gain(array, axis, b, direction(azimuth, elevation))
                one = trial(array, scanned, axis, b, azimuth, elevation, draws, seed)
                found[name] = (one, closed)
    return found


def phases_fixed_float(seed: int, count: int = 4000) -> float:
    """Largest difference of the core's phases from float64 [turns], at any attitude."""
    rng = np.random.default_rng([seed, 64])
    u = np.concatenate([rng.normal(size=(count, 4)), rng.normal(size=(count, 3))], axis=1)
    u[:, :4] /= np.linalg.norm(u[:, :4], axis=1, keepdims=True)
    u[:, 4:] /= np.linalg.norm(u[:, 4:], axis=1, keepdims=True)
    c, real = (make_level(n, Build(ArrayPhases())).run(u).outputs for n in ("c", "float"))
    names = [n for n in c if n != "status"]
    return max(float(np.abs((c[n] - real[n] + 0.5) % 1.0 - 0.5).max()) for n in names)


class Mls(Experiment):
    """Landing-system array on a moving deck, Wang Ding et al. (2018)."""

    pages = ("mls.html",)

    def run(self, *, seed: int, runs: int, say: Callable[[str], None]) -> Result:
        """See `Experiment`; cases that only illustrate have at most ten runs, patterns four times."""
        figures: dict[str, float] = {}
        patterns = {}
        for elements in (64, 16):
            say(f"patterns of {elements} elements")
            patterns[elements] = patterns_of(elements, 4 * runs, seed)
            for name, (one, closed) in patterns[elements].items():
                values = {k: v for k, v in vars(one).items() if k != "shown"} | {"closed": closed}
                figures |= {f"array{elements}_{name}_{k}": v for k, v in values.items()}
        shown: dict[str, Flight] = {}
        beams: dict[str, Any] = {}
        found: dict[str, dict[str, float]] = {}
        for name, case in CASES.items():
            some = runs if case.full else min(runs, FEW)
            say(f"{name}: {case.meaning}, {some} runs")
            shown[name] = fly(case, range(seed, seed + some))
            found[name] = flight_figures(shown[name])
            if name in STEERED:
                beams[name] = {a: beam_errors(shown[name], Array(), a, GLIDE_DEG) for a in AZIMUTHS}
                for a, what in beams[name].items():
                    for key, error in (("beam", what.after), ("uncompensated", what.before)):
                        rms = float(np.sqrt(np.mean(error**2)))
                        found[name][f"{key}_{NAMES[a]}_deg"] = rms
        figures |= {f"mls_{name}_{k}": v for name, f in found.items() for k, v in f.items()}
        for axis in AXES:
            figures[f"mls_{axis}_deg"] = found["corrected"][f"{axis}_deg"]
        for azimuth in AZIMUTHS:
            figures[f"mls_beam_{NAMES[azimuth]}_deg"] = found["rolling"][f"beam_{NAMES[azimuth]}_deg"]
        figures["mls_fixed_float_deg"] = max(
            found[n]["fixed_float_deg"] for n in ("corrected", "picard_4", "bias", "rolling", "sea_5")
        )
        figures["phases_fixed_float_turns"] = phases_fixed_float(seed)
        for config in CONFIGS:
            for name, program in (("mls", MlsAttitude().compile()), ("phases64", ArrayPhases().compile())):
                interval = build_core(program, config).schedule.interval
                figures[f"{name}_interval_cycles_{config}"] = float(interval)
        targets = targets_of(figures)
        return Result(
            figures=figures,
            targets=targets,
            details={name: case.meaning for name, case in CASES.items()},
            pages={"mls.html": render(CASES, found, shown, beams, patterns, targets)},
        )
