"""Pulses of an array whose elements are out of place (Figures 3 to 5)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.sim.experiments.forms import run_forms
from boresight.sim.plotting import COLOUR, Section, figure_and_axes, settings, svg
from boresight.systems.mls.linear_array import Array, direction, lobe
from boresight.systems.mls.phases import AXES, ArrayPhases
from boresight.systems.mls.world import SCANS

AZIMUTHS = {"m60": -60.0, "0": 0.0, "60": 60.0}  #: of receivers [deg], by name.
GLIDE_DEG = 3.0  #: elevation of receivers.
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])
STEP_DEG = 0.05  #: between beams of a scan.
_SCAN = SCANS["azimuth"]
_HIGH = (20.0, 30.0)  #: elevations at which Z is looked at as well.
_PULSES = (
    "Elements displaced along {} by b d N(0, 1), 64 elements, one draw: what receivers at -60, 0 "
    "and 60 deg get over time, a pulse while the beam goes to 62 deg and one while it comes back "
    "(bars), with a pause of 0.6 ms between. "
)
_AXES = {
    "x": "At b = 0.5 only the ends of the scan are usable, as the paper says; at 0.1 the pulse is "
    "lower, but as wide as before.",
    "y": "In the centre a displacement along the array does not change the path.",
    "z": "Along Z it counts with the sine of the elevation: on a glide path of 3 deg there is "
    "nothing to see, at 30 deg (table) there is.",
}
_COLUMNS = (
    *("elements, axis, b, azimuth, elevation", "gain", "gain, closed form", "peak", "width, deg"),
    *("sd, deg", "wrong peaks", "side lobe, dB", "merged"),
)


class Trial(NamedTuple):
    """What becomes of the pulse of a receiver, over many draws; amplitudes of one draw.

    ``gain`` of the field where it is, and ``closed``, the mean gain in closed form; ``peak`` of the
    pulse; ``width`` of the -3 dB gate and ``sd`` of the angle found [deg] of pulses at the right
    place; ``wrong``, the share of those elsewhere; median ``sidelobe_db`` beyond the first ones;
    ``merged``, the share whose pulses to and fro would be one, never 3 dB lower in between, if the
    beam turned without a pause. Shown are the scan [deg] and the amplitudes.
    """

    meaning: str
    figures: dict[str, float]
    shown: tuple[FloatArray, FloatArray]


def phases_of(array: Array, q: FloatArray, beams: FloatArray) -> FloatArray:
    """Phases (m, elements) of the core's program for attitudes and beams (m, 4), (m, 3)."""
    rows, params = np.concatenate([q, beams], axis=1), {"spacing": array.spacing}
    program = ArrayPhases(array.elements, AXES[array.axis])
    ((run,),) = run_forms(program, [rows], params=params, levels=("c",))
    return np.stack([run.outputs[f"phase_{k}"] for k in range(array.elements)], axis=1)


def patterns_of(array: Array, draws: int, seed: int) -> dict[str, Trial]:
    """Trials by axis, b and azimuth (``x_05_m60``), at higher elevations ``z_05_0_at_30``.

    The phases are those of the core for beams every `STEP_DEG`, the deck level.
    """
    scan = np.linspace(_SCAN.low, _SCAN.high, round(2.0 * _SCAN.half / STEP_DEG) + 1)
    trials = {}
    for elevation in (GLIDE_DEG, *_HIGH):
        phases = phases_of(array, np.tile(LEVEL, (len(scan), 1)), direction(scan, elevation))
        for axis, (k, b) in ((a, kb) for a in range(3) for kb in enumerate((0.1, 0.5))):
            for key, azimuth in AZIMUTHS.items():
                name, e = f"{'xyz'[axis]}_0{10 * b:.0f}_{key}", direction(azimuth, elevation)
                if elevation != GLIDE_DEG and name != "z_05_0":
                    continue
                rng = np.random.default_rng([seed, axis, k, round(azimuth) % 360])
                q = array.displacements(axis, b, draws, rng)
                amplitude = np.abs(array.field(phases, e, q))
                # 2 pi b d/lambda c, c the direction's cosine along the axis
                turn = 2.0 * math.pi * b * array.spacing * float(e[axis])
                figures = _figures(array, scan, amplitude, azimuth, turn)
                name += "" if elevation == GLIDE_DEG else f"_at_{elevation:.0f}"
                meaning = (
                    f"{array.elements}, {'XYZ'[axis]}, {b}, {azimuth:g} deg, {elevation:g} deg"
                )
                trials[name] = Trial(meaning, figures, (scan, amplitude[0]))
    return trials


def _figures(
    array: Array, scan: FloatArray, amplitude: FloatArray, azimuth: float, turn: float
) -> dict[str, float]:
    """Figures of amplitudes (draws, m); see `Trial`."""
    # To the second null, so that the first side lobes are part of it.
    tilt = math.cos(math.radians(azimuth))
    main = math.degrees(2.0 / (array.elements * array.spacing * tilt))
    main_lobe = lobe(scan, amplitude, main)
    error = _SCAN.angle(*_SCAN.times(main_lobe.centre)) - azimuth
    right = np.abs(error) < main
    between = np.where(scan >= azimuth, amplitude, np.inf).min(axis=1)
    figures = {
        "gain": amplitude[:, np.abs(scan - azimuth).argmin()].mean(),
        **{"closed": math.exp(-(turn**2) / 2.0), "peak": main_lobe.peak.mean()},
        **{"width": np.median(main_lobe.width[right]), "sd": error[right].std()},
        **{"wrong": 1.0 - right.mean(), "sidelobe_db": np.median(main_lobe.sidelobe_db)},
        "merged": (between > np.sqrt(0.5) * main_lobe.peak).mean(),
    }
    return {name: float(value) for name, value in figures.items()}


def sections_of(patterns: Mapping[int, Mapping[str, Trial]]) -> Iterator[Section]:
    """Figures 3 to 5, and the table of all trials, by number of elements."""
    pulses = [(_PULSES.format(a.upper()) + _AXES[a], _pulses(patterns[64], a)) for a in "xyz"]
    yield Section(title="Figures 3 to 5: elements out of place", figures=pulses)
    trials = [trial for by_name in patterns.values() for trial in by_name.values()]
    rows: list[list[str | float]] = [[trial.meaning, *trial.figures.values()] for trial in trials]
    yield Section(title="The same in numbers", columns=_COLUMNS, rows=rows)


def _pulses(patterns: Mapping[str, Trial], axis: str) -> str:
    """Figures 3 to 5: what receivers at three azimuths get over time."""
    with settings():
        figure, grid = figure_and_axes(3.4, 2, 3, sharex=True, sharey=True)
        for row, b in zip(grid, (1, 5), strict=True):
            row[0].set_ylabel("amplitude")
            for axes, (key, azimuth) in zip(row, AZIMUTHS.items(), strict=True):
                time, amplitude = _SCAN.waveform(*patterns[f"{axis}_0{b}_{key}"].shown)
                for at in _SCAN.times(azimuth):
                    axes.axvline(1e3 * at, color=COLOUR["amber"], linewidth=2.5, alpha=0.5)
                axes.plot(1e3 * time, amplitude, color=COLOUR["heading"], linewidth=0.8)
                axes.set_title(f"{azimuth:g} deg, b = 0.{b}", fontsize=9)
                axes.set_ylim(0.0, 1.05)
        for axes in grid[1]:
            axes.set_xlabel("time, ms")
        return svg(figure, f"pulses-{axis}")
