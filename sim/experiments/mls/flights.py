"""Runs of the filter on a deck (Figure 6), and of the beam that it steers (Figure 7)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from boresight.model.estimators.array_phases import ArrayPhases
from boresight.model.estimators.mls_attitude import ALIGN_STEPS, MlsAttitude
from boresight.sim.attitude.rotation import quaternion_conjugate, rotate
from boresight.sim.experiments.mls.prototype import prototype
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.worlds.mls_array import SCAN_DEG, Array, direction, pulse
from boresight.sim.worlds.mls_deck import Deck, SensorErrors, deck, records

__all__ = [
    *("AXES", "ENCODER_DEG", "SETTLED", "Beams", "Case", "Flight"),
    *("beam_errors", "flight_figures", "fly", "phases_of"),
]

FloatArray = npt.NDArray[np.float64]
AXES = ("roll", "pitch", "heading")
ENCODER_DEG = 360.0 / 4096.0  #: step of 1024 lines, each edge counted.
SETTLED = 3000  #: records before which nothing is judged.
SECONDS = 10.0
MOST_LAG = 20  #: ms that a lag is looked for.
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])
_P0 = (0.5 * next(p.default for p in MlsAttitude.params if p.name == "p0_sd")) ** 2


@dataclass(frozen=True)
class Case:
    """One configuration; ``full``: with all runs; ``reference``: "prototype" or "gyro", no core."""

    meaning: str
    options: Mapping[str, str | int] = field(default_factory=dict)
    params: Mapping[str, float] = field(default_factory=dict)
    errors: SensorErrors = SensorErrors()
    motion: str = "table"
    reference: str = ""
    full: bool = False


@dataclass(frozen=True, eq=False)
class Flight:
    """Decks, errors of what was told (n, runs, 3) [deg], told quaternions (n, runs, 4).

    ``norm``: the last norm of q of each run, 1 where it is set. ``fixed_float``: most and rms
    [deg]; ``saturated``: updates.
    """

    decks: Sequence[Deck]
    error: FloatArray
    q: FloatArray
    norm: FloatArray
    fixed_float: tuple[float, float]
    saturated: int


def fly(case: Case, seeds: Sequence[int], seconds: float = SECONDS) -> Flight:
    """All runs of a case on the integer C, or of its reference."""
    decks = [deck(case.motion, seconds, seed) for seed in seeds]
    rows = np.stack([records(d, s, case.errors) for d, s in zip(decks, seeds, strict=True)], axis=1)
    norm, saturated, apart = np.ones(len(seeds)), 0, np.zeros((1, 1))
    if case.reference == "gyro":
        q = prototype(rows, np.stack([d.q[0] for d in decks]), p0=0.0, r_sd=1e6)
    elif case.reference:
        after = ALIGN_STEPS
        begun = _told(MlsAttitude(), rows[:after], {})[0]
        start = np.stack([begun[f"q{a}"] for a in "wxyz"], axis=-1)
        q = np.concatenate([start, prototype(rows[after:], start[-1], p0=_P0)])
    else:
        (c, saturated), (real, _) = (
            _told(MlsAttitude(**case.options), rows, case.params, level) for level in ("c", "float")
        )
        q = np.stack([c[f"q{a}"] for a in "wxyz"], axis=-1)
        apart = 180.0 * _wrapped(np.stack([(c[n] - real[n])[SETTLED:] for n in AXES]), 2.0)
        norm = c["norm"][-1] if "norm" in c else norm
    truth = np.stack([d.euler for d in decks], axis=1)
    error = _wrapped(np.degrees(_angles(q) - truth), 360.0)
    most, rms = float(np.abs(apart).max()), float(np.sqrt(np.mean(apart**2)))
    return Flight(decks, error, q, norm, (most, rms), saturated)


def _told(
    estimator: MlsAttitude, rows: FloatArray, params: Mapping[str, float], name: str = "c"
) -> tuple[dict[str, FloatArray], int]:
    """Outputs (n, runs) of records (n, runs, inputs), and how many updates saturated."""
    level, found = make_level(name, Build(estimator, params=[params])), []
    for k in range(rows.shape[1]):
        level.reset()
        found.append(level.run(rows[:, k]))
    outputs = {n: np.stack([r.outputs[n] for r in found], axis=1) for n in found[0].outputs}
    return outputs, sum(int(r.saturated.sum()) for r in found if r.saturated is not None)


def _wrapped(x: FloatArray, period: float) -> FloatArray:
    return np.asarray((x + 0.5 * period) % period - 0.5 * period)


def _angles(q: FloatArray) -> FloatArray:
    """Roll, pitch, heading (..., 3) [rad] of Rz Ry Rx."""
    w, x, y, z = np.moveaxis(q, -1, 0)
    roll = np.arctan2(2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))
    heading = np.arctan2(2.0 * (x * y + w * z), 1.0 - 2.0 * (y * y + z * z))
    return np.stack([roll, np.arcsin(np.clip(2.0 * (w * y - x * z), -1.0, 1.0)), heading], axis=-1)


def flight_figures(flight: Flight) -> dict[str, float]:
    """Figures of a case after three seconds, over all its runs."""
    error = flight.error[SETTLED:]
    truth = np.degrees(np.stack([d.euler for d in flight.decks], axis=1))
    told, n = truth + flight.error, len(truth)
    # The delay at which truth explains best what was told, a constant error apart.
    spread = np.array(
        [
            (told[MOST_LAG:] - truth[MOST_LAG - lag : n - lag]).std(axis=0).mean(axis=0)
            for lag in range(MOST_LAG)
        ]
    )
    encoder = ENCODER_DEG * np.round(truth / ENCODER_DEG)
    rms = np.sqrt(np.mean(error**2, axis=(0, 1)))
    return {
        **{f"{axis}_deg": float(v) for axis, v in zip(AXES, rms, strict=True)},
        "worst_deg": float(rms.max()),
        "max_deg": float(np.abs(error).max()),
        "encoder_deg": float(np.sqrt(np.mean(_wrapped(told - encoder, 360.0)[SETTLED:] ** 2))),
        "lag_ms": float(spread.argmin(axis=0).max()),
        "norm": float(flight.norm.mean()),
        "fixed_float_deg": flight.fixed_float[0],
        "fixed_float_rms_deg": flight.fixed_float[1],
        "saturated": float(flight.saturated),
    }


def phases_of(array: Array, q: FloatArray, beams: FloatArray) -> FloatArray:
    """Phases (m, elements) of the core's program for attitudes and beams (m, 4), (m, 3)."""
    build = Build(ArrayPhases(array.elements), params=[{"spacing": array.spacing}])
    out = make_level("c", build).run(np.concatenate([q, beams], axis=1)).outputs
    return np.stack([out[f"phase_{k}"] for k in range(array.elements)], axis=1)


@dataclass(frozen=True, eq=False)
class Beams:
    """Where a receiver finds itself less where it is (runs, instants) [deg], by -3 dB gates.

    ``before`` with the phases of a level array, ``after`` with those turned by the filter's
    attitude. ``shown``: scan [deg] and amplitude of one instant, before and after.
    """

    after: FloatArray
    before: FloatArray
    shown: tuple[tuple[FloatArray, FloatArray], ...]


def beam_errors(
    flight: Flight, array: Array, azimuth_deg: float, elevation_deg: float, instants: int = 24
) -> Beams:
    """What a receiver makes of the core's phases while the deck moves."""
    at = np.linspace(SETTLED, len(flight.q) - 1, instants).astype(int)
    whole = np.linspace(-SCAN_DEG, SCAN_DEG, 621)
    near = azimuth_deg + np.linspace(-3.0, 3.0, 61)
    fixed = phases_of(array, np.tile(LEVEL, (len(whole), 1)), direction(whole, elevation_deg))
    beams = np.tile(direction(near, elevation_deg), (instants, 1))
    level, steered = [], []
    for run, what in enumerate(flight.decks):
        seen = rotate(quaternion_conjugate(what.q[at]), direction(azimuth_deg, elevation_deg))
        turned = phases_of(array, flight.q[at, run].repeat(len(near), axis=0), beams)
        level.append(np.abs(array.field(fixed, seen)))
        fields = map(array.field, np.split(turned, instants), seen)
        steered.append(np.abs(np.stack(list(fields))))
    before, after = (
        pulse(scan, np.stack(found), 2.0).centre - azimuth_deg
        for scan, found in ((whole, level), (near, steered))
    )
    return Beams(after, before, ((whole, level[0][-1]), (near, steered[0][-1])))
