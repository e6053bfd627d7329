"""Pulses of an array whose elements are out of place (Figures 3 to 5)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.systems.mls.linear_array import Array, direction, lobe
from boresight.systems.mls.runs import AZIMUTHS, LEVEL, phases_of
from boresight.systems.mls.world import SCANS

STEP_DEG = 0.05  #: between beams of a scan.
_SCAN = SCANS["azimuth"]
_HIGH = (20.0, 30.0)  #: elevations at which Z is looked at as well.


class Trial(NamedTuple):
    """What becomes of the pulse of a receiver, over many draws; amplitudes of one draw.

    ``gain`` of the field where it is, and ``closed``, the mean gain in closed form; ``peak`` of the
    pulse; ``width`` of the -3 dB gate and ``sd`` of the angle found [deg] of pulses at the right
    place; ``wrong``, the share of those elsewhere; median ``sidelobe_db`` beyond the first ones;
    ``merged``, the share whose pulses to and fro would be one, never 3 dB lower in between, if the
    beam turned without a pause. Shown are the scan [deg] and the amplitudes.
    """

    figures: dict[str, float]
    shown: tuple[FloatArray, FloatArray]


def patterns_of(array: Array, elevation_deg: float, draws: int, seed: int) -> dict[str, Trial]:
    """Trials by axis, b and azimuth (``x_05_m60``), at higher elevations ``z_05_0_at_30``.

    The phases are those of the core for beams every `STEP_DEG`, the deck level.
    """
    scan = np.linspace(_SCAN.low, _SCAN.high, round(2.0 * _SCAN.half / STEP_DEG) + 1)
    trials = {}
    for elevation in (elevation_deg, *_HIGH):
        phases = phases_of(array, np.tile(LEVEL, (len(scan), 1)), direction(scan, elevation))
        for axis, b in np.ndindex(3, 2):
            for key, azimuth in AZIMUTHS.items():
                name, e = f"{'xyz'[axis]}_0{1 + 4 * b}_{key}", direction(azimuth, elevation)
                if elevation == elevation_deg or name == "z_05_0":
                    rng = np.random.default_rng([seed, axis, b, round(azimuth) % 360])
                    q = array.displacements(axis, (0.1, 0.5)[b], draws, rng)
                    # 2 pi b d/lambda c, c the direction's cosine along the axis
                    turn = 2.0 * math.pi * (0.1, 0.5)[b] * array.spacing * float(e[axis])
                    amplitude = np.abs(array.field(phases, e, q))
                    end = "" if elevation == elevation_deg else f"_at_{elevation:.0f}"
                    trials[name + end] = _trial(array, scan, amplitude, azimuth, turn)
    return trials


def _trial(
    array: Array, scan: FloatArray, amplitude: FloatArray, azimuth: float, turn: float
) -> Trial:
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
    figures = {name: float(value) for name, value in figures.items()}
    return Trial(figures, (scan, amplitude[0]))
