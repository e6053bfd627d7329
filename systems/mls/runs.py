"""Runs of the filter on a deck (Figure 6), and of the beam that it steers (Figure 7)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.sim.experiments.forms import differences_of, run_forms
from boresight.sim.experiments.seeds import Runs
from boresight.sim.rotations.outputs import attitude_of
from boresight.sim.rotations.rotation import quaternion_conjugate, rotate
from boresight.sim.rotations.zyx import angles_of, wrapped
from boresight.systems.mls.cases import Case
from boresight.systems.mls.deck import Deck, deck, records
from boresight.systems.mls.estimator import ALIGN_STEPS, MlsAttitude
from boresight.systems.mls.linear_array import Array, direction, lobe
from boresight.systems.mls.phases import AXES as BODY_AXES
from boresight.systems.mls.phases import ArrayPhases
from boresight.systems.mls.prototype import prototype
from boresight.systems.mls.world import SCANS

AXES = ("roll", "pitch", "heading")
AZIMUTHS = {"m60": -60.0, "0": 0.0, "60": 60.0}  #: of receivers [deg], by name.
GLIDE_DEG = 3.0  #: elevation of receivers.
ENCODER_DEG = 360.0 / 4096.0  #: step of 1024 lines, each edge counted.
SETTLED = 3000  #: records before which nothing is judged.
SECONDS = 10.0
MOST_LAG = 20  #: ms that a lag is looked for.
LAG_CONTRAST = 1.1  #: least ratio of the spread at the largest lag to the smallest spread.
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])
_P0 = (0.5 * MlsAttitude().param_values()["p0_sd"]) ** 2
#: How runs become one figure, where it is not the root mean square.
_POOLING = {"max_deg": "max", "fixed_float_deg": "max", "norm": "mean", "saturated": "sum"}


@dataclass(frozen=True, eq=False)
class Flight:
    """Decks, errors of the estimates (n, runs, 3) [deg], estimated quaternions (n, runs, 4).

    ``level_figures``: of the levels (runs,) by name.
    """

    decks: Sequence[Deck]
    error: FloatArray
    q: FloatArray
    level_figures: Mapping[str, FloatArray]


def fly(case: Case, seeds: Sequence[int], seconds: float = SECONDS) -> Flight:
    """All runs of a case on the integer C, or of its reference."""
    decks = [deck(case.motion, seconds, seed) for seed in seeds]
    rows = np.stack([records(d, s, case.errors) for d, s in zip(decks, seeds, strict=True)], axis=1)
    figures = dict.fromkeys(
        ("fixed_float_deg", "fixed_float_rms_deg", "saturated"), 0.0 * rows[0, :, 0]
    )
    figures["norm"] = np.ones(len(seeds))
    if case.reference == "gyro":
        q = prototype(rows, np.stack([d.q[0] for d in decks]), p0=0.0, r_sd=1e6)
    elif case.reference:
        (aligned,) = run_forms(MlsAttitude(), rows[:ALIGN_STEPS].swapaxes(0, 1), levels=("c",))
        start = np.stack([attitude_of(r.outputs) for r in aligned], axis=1)
        q = np.concatenate([start, prototype(rows[ALIGN_STEPS:], start[-1], p0=_P0)])
    else:
        filter = MlsAttitude(**case.options)
        c, real = run_forms(filter, rows.swapaxes(0, 1), params=case.params)
        q = np.stack([attitude_of(r.outputs) for r in c], axis=1)
        pairs = zip(c, real, strict=True)
        difference = np.array([differences_of(r.outputs, f.outputs, AXES, 2.0) for r, f in pairs])
        error = 180.0 * difference[:, :, SETTLED:]
        figures["fixed_float_deg"] = np.abs(error).max(axis=(1, 2))
        figures["fixed_float_rms_deg"] = _rms(error, (1, 2))
        figures["saturated"] = np.array([float(r.n_saturated) for r in c])
        figures["norm"] = np.array([r.outputs.get("norm", [1.0])[-1] for r in c])
    truth = np.stack([d.euler for d in decks], axis=1)
    return Flight(decks, wrapped(np.degrees(angles_of(q) - truth), 360.0), q, figures)


def flown(case: Case, seeds: range) -> Runs:
    """Figures of a case; see `run_cases`."""
    return figures_of(fly(case, seeds), case.steered)


def figures_of(flight: Flight, steered: bool = False) -> Runs:
    """Figures of each run after three seconds, if ``steered`` of its beams too.

    Kept of each run: spread of the error for each delay (lags, 3); shown of the first: truth and
    error (n, 3) [deg], pulses by antenna and azimuth.
    """
    error, shown = flight.error[SETTLED:], {}
    truth = np.degrees(np.stack([d.euler for d in flight.decks], axis=1))
    angles, n = truth + flight.error, len(truth)
    # The delay at which the truth explains the estimate best, but for a constant error.
    delayed = (truth[MOST_LAG - lag : n - lag] for lag in range(MOST_LAG))
    spread = np.stack([(angles[MOST_LAG:] - late).std(axis=0) for late in delayed], axis=1)
    coarse = wrapped(angles - ENCODER_DEG * np.round(truth / ENCODER_DEG), 360.0)[SETTLED:]
    figures = {
        **{f"{axis}_deg": _rms(error[:, :, k], 0) for k, axis in enumerate(AXES)},
        **{"max_deg": np.abs(error).max(axis=(0, 2)), "encoder_deg": _rms(coarse, (0, 2))},
        **flight.level_figures,
    }
    for antenna, (key, azimuth) in product(SCANS, AZIMUTHS.items()) if steered else ():
        after, before, shown[antenna, key] = beam_errors(flight, antenna, azimuth)
        figures[f"{antenna}_{key}_deg"] = _rms(after, 1)
        figures[f"uncompensated_{antenna}_{key}_deg"] = _rms(before, 1)
    first = {"truth": truth[:, 0], "error": flight.error[:, 0], "pulses": shown}
    return Runs(figures, first, [*spread], {n: _POOLING.get(n, "rms") for n in figures})


def _rms(x: FloatArray, axis: int | tuple[int, ...]) -> FloatArray:
    return np.asarray(np.sqrt(np.mean(x**2, axis=axis)))


def pooled(runs: Runs) -> dict[str, float]:
    """Figures of a case; the worst axis and the lag are those of all its runs together.

    There is no ``lag_ms`` where the motion is too slow to show it, by `LAG_CONTRAST`.
    """
    figures = runs.pooled()
    figures["worst_deg"] = max(figures[f"{axis}_deg"] for axis in AXES)
    spread = np.mean(runs.each, axis=0)
    clear = bool((spread[-1] > LAG_CONTRAST * spread.min(axis=0)).all())
    return figures | ({"lag_ms": float(spread.argmin(axis=0).max())} if clear else {})


def phases_of(array: Array, q: FloatArray, beams: FloatArray) -> FloatArray:
    """Phases (m, elements) of the core's program for attitudes and beams (m, 4), (m, 3)."""
    rows, params = np.concatenate([q, beams], axis=1), {"spacing": array.spacing}
    program = ArrayPhases(array.elements, BODY_AXES[array.axis])
    ((run,),) = run_forms(program, [rows], params=params, levels=("c",))
    return np.stack([run.outputs[f"phase_{k}"] for k in range(array.elements)], axis=1)


def beam_errors(
    flight: Flight, antenna: str, azimuth_deg: float, instants: int = 24
) -> tuple[FloatArray, FloatArray, tuple[tuple[FloatArray, FloatArray], ...]]:
    """Error of a receiver's angle at one of `SCANS` (runs, instants) [deg], by -3 dB gates.

    With phases turned by the filter's attitude, and with those of a level array; then scan [deg]
    and amplitude of both, level first, at the last instant of the first run.
    """
    scan = SCANS[antenna]
    array, place = Array(axis=scan.axis), {"azimuth": azimuth_deg, "elevation": GLIDE_DEG}

    def beams_at(angles: FloatArray) -> FloatArray:
        to = place | {antenna: angles}
        return direction(to["azimuth"], to["elevation"])

    at = np.linspace(SETTLED, len(flight.q) - 1, instants).astype(int)
    wide = np.linspace(scan.low, scan.high, round(10.0 * scan.half / 2.0) + 1)
    narrow = place[antenna] + np.linspace(-3.0, 3.0, 61)
    fixed = phases_of(array, np.tile(LEVEL, (len(wide), 1)), beams_at(wide))
    beams = np.tile(beams_at(narrow), (instants, 1))
    level, steered = [], []
    for run, motion in enumerate(flight.decks):
        receiver = rotate(quaternion_conjugate(motion.q[at]), direction(azimuth_deg, GLIDE_DEG))
        turned = phases_of(array, flight.q[at, run].repeat(len(narrow), axis=0), beams)
        level.append(np.abs(array.field(fixed, receiver)))
        fields = map(array.field, np.split(turned, instants), receiver)
        steered.append(np.abs(np.stack(list(fields))))
    before, after = (
        lobe(angles, np.stack(amplitudes), 2.0).centre - place[antenna]
        for angles, amplitudes in ((wide, level), (narrow, steered))
    )
    return after, before, ((wide, level[0][-1]), (narrow, steered[0][-1]))
