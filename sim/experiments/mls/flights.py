"""Runs of the filter on a deck (Figure 6), and of the beam that it steers (Figure 7)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from boresight.model.estimators.array_phases import ArrayPhases
from boresight.model.estimators.mls_attitude import ALIGN_STEPS, MlsAttitude
from boresight.sim.attitude.rotation import quaternion_conjugate, rotate
from boresight.sim.experiments.mls.prototype import integrated, prototype
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.worlds.mls_array import Array, direction, pulse
from boresight.sim.worlds.mls_deck import Deck, SensorErrors, deck, records

__all__ = ["AXES", "Beams", "Case", "Flight", "beam_errors", "flight_figures", "fly", "phases_of"]

FloatArray = npt.NDArray[np.float64]
AXES = ("roll", "pitch", "heading")
ENCODER_DEG = 360.0 / 4096.0  #: step of 1024 lines, each edge counted.
SETTLED = 3000  #: records before which nothing is judged.
SECONDS = 10.0
MOST_LAG = 20  #: ms that a lag is looked for.
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
    """Decks, records (n, runs, 10), errors (n, runs, 3) [deg], told quaternions (n, runs, 4).

    ``norm``: the last norm of q of each run, where it is free. ``fixed_float``: most and rms [deg];
    ``saturated``: updates.
    """

    decks: Sequence[Deck]
    rows: FloatArray
    error: FloatArray
    q: FloatArray
    norm: FloatArray
    fixed_float: tuple[float, float]
    saturated: int


@dataclass(frozen=True, eq=False)
class Beams:
    """Where a receiver finds itself less where it is (runs, instants) [deg].

    ``shown``: scans [deg] and amplitudes, before and after, of one instant.
    """

    after: FloatArray
    before: FloatArray
    shown: tuple[tuple[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]


def fly(case: Case, seeds: Sequence[int], seconds: float = SECONDS) -> Flight:
    """All runs of a case on the integer C, or of its reference."""
    decks = [deck(case.motion, seconds, seed) for seed in seeds]
    rows = np.stack([records(d, s, case.errors) for d, s in zip(decks, seeds, strict=True)], axis=1)
    norm, saturated, apart = np.ones(len(seeds)), 0, np.zeros((1, 1))
    truth = np.stack([d.euler for d in decks], axis=1)
    if case.reference == "gyro":
        q = integrated(rows, np.stack([d.q[0] for d in decks]))
    elif case.reference:
        aligned = make_level("c", Build(MlsAttitude()))
        q = np.empty((len(rows), len(decks), 4))
        for k in range(len(decks)):
            aligned.reset()
            out = aligned.run(rows[: ALIGN_STEPS + 2, k]).outputs
            q[: ALIGN_STEPS + 2, k] = np.stack([out[f"q{a}"] for a in "wxyz"], axis=1)
        after = slice(ALIGN_STEPS + 2, None)
        q[after] = prototype(rows[after], q[ALIGN_STEPS + 1], p0=_P0)
    else:
        build = Build(MlsAttitude(**case.options), params=[case.params])  # type: ignore[arg-type]
        levels = [make_level(name, build) for name in ("c", "float")]
        told, far = [], []
        for k in range(len(seeds)):
            for level in levels:
                level.reset()
            c, real = (level.run(rows[:, k]) for level in levels)
            told.append(np.stack([c.outputs[f"q{a}"] for a in "wxyz"], axis=1))
            far.append([180.0 * _wrapped(c.outputs[n] - real.outputs[n], 2.0) for n in AXES])
            norm[k] = c.outputs["norm"][-1] if "norm" in c.outputs else 1.0
            saturated += int(np.sum(c.saturated))
        q, apart = np.stack(told, axis=1), np.array(far)[:, :, SETTLED:]
    error = _wrapped(np.degrees(_angles(q) - truth), 360.0)
    most, rms = float(np.abs(apart).max()), float(np.sqrt(np.mean(apart**2)))
    return Flight(decks, rows, error, q, norm, (most, rms), saturated)


def _wrapped(x: FloatArray, period: float) -> FloatArray:
    return np.asarray((x + 0.5 * period) % period - 0.5 * period)


def _angles(q: FloatArray) -> FloatArray:
    """Roll, pitch, heading (..., 3) [rad] of Rz Ry Rx."""
    w, x, y, z = np.moveaxis(q, -1, 0)
    pitch = np.arcsin(np.clip(2.0 * (w * y - x * z), -1.0, 1.0))
    roll = np.arctan2(2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))
    return np.stack([roll, pitch, np.arctan2(2.0 * (x * y + w * z), 1.0 - 2.0 * (y * y + z * z))], -1)


def flight_figures(flight: Flight) -> dict[str, float]:
    """Figures of a case after three seconds, over all its runs."""
    error = flight.error[SETTLED:]
    truth = np.degrees(np.stack([d.euler for d in flight.decks], axis=1))
    told = truth + flight.error
    # The delay at which truth explains best what was told, a constant error apart.
    spread = [
        (told[MOST_LAG:] - truth[MOST_LAG - lag : len(truth) - lag]).std(axis=0).mean(axis=0)
        for lag in range(MOST_LAG)
    ]
    lags = np.argmin(np.array(spread), axis=0)
    encoder = ENCODER_DEG * np.round(truth / ENCODER_DEG)
    rms = np.sqrt(np.mean(error**2, axis=(0, 1)))
    return {
        **{f"{axis}_deg": float(v) for axis, v in zip(AXES, rms, strict=True)},
        "worst_deg": float(rms.max()),
        "max_deg": float(np.abs(error).max()),
        "encoder_deg": float(np.sqrt(np.mean(_wrapped(told - encoder, 360.0)[SETTLED:] ** 2))),
        "lag_ms": float(lags.max()),
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


def beam_errors(
    flight: Flight, array: Array, azimuth_deg: float, elevation_deg: float, instants: int = 24
) -> Beams:
    """What a receiver makes of the core's phases, with and without compensation, by -3 dB gates."""
    level = np.array([1.0, 0.0, 0.0, 0.0])
    at = np.linspace(SETTLED, len(flight.q) - 1, instants).astype(int)
    whole, near = np.arange(-62.0, 62.01, 0.2), azimuth_deg + np.arange(-3.0, 3.01, 0.1)
    main = math.degrees(1.2 / (array.elements * array.spacing * math.cos(math.radians(azimuth_deg))))
    fixed = phases_of(array, np.tile(level, (len(whole), 1)), direction(whole, elevation_deg))
    target = direction(azimuth_deg, elevation_deg)
    after, before = [], []
    for run, what in enumerate(flight.decks):
        seen = rotate(quaternion_conjugate(what.q[at]), target)
        beams = np.tile(direction(near, elevation_deg), (instants, 1))
        steered = phases_of(array, flight.q[at, run].repeat(len(near), axis=0), beams)
        got = [
            np.abs(array.field(phases, e))
            for phases, e in zip(np.split(steered, instants), seen, strict=True)
        ]
        after.append(pulse(near, np.array(got), main).centre - azimuth_deg)
        plain = np.abs(array.field(fixed, seen))
        before.append(pulse(whole, plain, main).centre - azimuth_deg)
        if run == 0:
            shown = (whole, plain[-1]), (near, got[-1])
    return Beams(np.array(after), np.array(before), shown)
