"""The landing-system array: what the paper shows in Figures 3 to 7, with figures of our own."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from boresight.gateware.machine import CONFIGS
from boresight.model.estimators.array_phases import ArrayPhases
from boresight.model.estimators.mls_attitude import MlsAttitude
from boresight.sim.experiments.experiment import Experiment, Result
from boresight.sim.experiments.mls.flights import (
    AXES,
    Beams,
    Case,
    Flight,
    beam_errors,
    flight_figures,
    fly,
)
from boresight.sim.experiments.mls.page import render
from boresight.sim.experiments.mls.patterns import AZIMUTHS, patterns_of
from boresight.sim.experiments.mls.targets import targets_of
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.worlds.mls_array import Array
from boresight.sim.worlds.mls_deck import SensorErrors

__all__ = ["CASES", "Mls", "phases_fixed_float"]

FEW = 10  #: most runs of cases that only illustrate.
GLIDE_DEG = 3.0
_SPREAD = SensorErrors(gyro_bias=(0.0, 0.0, 0.0), bias_spread=0.2)
_FOLLOWS = {"gyro_sd": 0.2}  # rad/s: what a bias of 0.2 deg/s leaves is small
_FREE = {"norm": "free", "innovation": "printed"}

CASES = {
    "corrected": Case("as corrected, Picard of third order", full=True),
    "prototype": Case("dense float64, begun as the core", reference="prototype", full=True),
    "picard_4": Case("Picard of fourth order, as (21)", {"picard": 4}),
    "gyro_only": Case("gyro alone", reference="gyro", full=True),
    "lag_5ms": Case("gyro 5 ms late", errors=SensorErrors(gyro_lag=5)),
    "process_18": Case("as printed (18), q' = -w q/2", {"process": "printed"}),
    "measurement_24": Case("as printed (24), h = C V", {"measurement": "printed"}),
    "innovation_28": Case("as printed (28), z - H q", {"innovation": "printed"}, full=True),
    "norm_free": Case("q never set to norm one", {"norm": "free"}),
    "norm_free_28": Case("(28), and q never set to norm one", _FREE),
    "bias": Case("gyro biases drawn, 0.2 deg/s each axis", errors=_SPREAD),
    "bias_follows": Case("the same, gyro_sd 11 deg/s", params=_FOLLOWS, errors=_SPREAD),
    "rolling": Case("ship turning by +-10 deg about each axis", motion="rolling", full=True),
    "rolling_bias": Case("the same, biases drawn, 11 deg/s", {}, _FOLLOWS, _SPREAD, "rolling"),
    **{f"sea_{n}": Case(f"carrier in sea state {n}", motion=f"sea_{n}") for n in (4, 5, 6)},
}
STEERED = ("rolling", "rolling_bias", "sea_5", "sea_6")  #: cases whose beams are looked at.
COMPARED = ("corrected", "picard_4", "bias", "rolling", "sea_5")  #: fixed with float.


def phases_fixed_float(seed: int, count: int = 4000) -> float:
    """Largest difference of the core's phases from float64 [turns], at any attitude."""
    rng = np.random.default_rng([seed, 64])
    parts = [rng.normal(size=(count, n)) for n in (4, 3)]
    u = np.concatenate([x / np.linalg.norm(x, axis=1, keepdims=True) for x in parts], axis=1)
    c, real = (make_level(n, Build(ArrayPhases())).run(u).outputs for n in ("c", "float"))
    apart = [np.abs((c[n] - real[n] + 0.5) % 1.0 - 0.5).max() for n in c if n != "status"]
    return float(max(apart))


class Mls(Experiment):
    """Landing-system array on a moving deck, Wang Ding et al. (2018)."""

    pages = ("mls.html",)

    def run(self, *, seed: int, runs: int, say: Callable[[str], None]) -> Result:
        """See `Experiment`; patterns are drawn four times as often, some cases ten times."""
        patterns, figures = {}, {"phases_fixed_float_turns": phases_fixed_float(seed)}
        for elements in (64, 16):
            say(f"patterns of {elements} elements")
            patterns[elements] = patterns_of(Array(elements), GLIDE_DEG, 4 * runs, seed)
            for name, one in patterns[elements].items():
                figures |= {f"array{elements}_{name}_{k}": v for k, v in one.figures().items()}
        shown: dict[str, Flight] = {}
        found: dict[str, dict[str, float]] = {}
        beams: dict[str, dict[str, Beams]] = {}
        for name, case in CASES.items():
            some = runs if case.full else min(runs, FEW)
            say(f"{name}: {case.meaning}, {some} runs")
            shown[name] = fly(case, range(seed, seed + some))
            found[name] = flight_figures(shown[name])
            for key, azimuth in AZIMUTHS.items() if name in STEERED else ():
                what = beam_errors(shown[name], Array(), azimuth, GLIDE_DEG)
                beams.setdefault(name, {})[key] = what
                found[name][f"beam_{key}_deg"] = float(np.sqrt(np.mean(what.after**2)))
                found[name][f"uncompensated_{key}_deg"] = float(np.sqrt(np.mean(what.before**2)))
        figures |= {f"mls_{name}_{k}": v for name, f in found.items() for k, v in f.items()}
        figures |= {f"mls_{axis}_deg": found["corrected"][f"{axis}_deg"] for axis in AXES}
        figures |= {f"mls_beam_{k}_deg": found["rolling"][f"beam_{k}_deg"] for k in AZIMUTHS}
        figures["mls_fixed_float_deg"] = max(found[n]["fixed_float_deg"] for n in COMPARED)
        for config in CONFIGS:
            parts = Build(MlsAttitude(), ArrayPhases(), config=config).core.parts
            for name, part in zip(("mls", "phases64"), parts, strict=True):
                figures[f"{name}_interval_cycles_{config}"] = float(part.schedule.interval)
        targets = targets_of(figures)
        return Result(
            figures=figures,
            targets=targets,
            details={name: case.meaning for name, case in CASES.items()},
            pages={"mls.html": render(CASES, found, shown, beams["rolling"], patterns, targets)},
        )
