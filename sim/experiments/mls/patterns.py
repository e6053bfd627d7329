"""Pulses of an array whose elements are out of place (Figures 3 to 5)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from boresight.sim.experiments.mls.flights import phases_of
from boresight.sim.worlds.mls_array import SCAN_DEG, Array, angle_of, direction, pulse, scan_times

__all__ = ["AZIMUTHS", "STEP_DEG", "Trial", "mean_gain", "scan_phases", "trial"]

FloatArray = npt.NDArray[np.float64]
AZIMUTHS = (-60.0, 0.0, 60.0)
STEP_DEG = 0.05


@dataclass(frozen=True)
class Trial:
    """What becomes of the pulse at an azimuth, over many draws.

    ``gain`` of the field where the receiver is, ``peak`` of the pulse; ``width`` of the -3 dB gate
    and ``sd`` of the angle found [deg] of pulses at the right place; ``wrong``, the share of those
    that are elsewhere; median ``sidelobe_db`` beyond the first
    ones. ``shown``: amplitudes over the scan of one draw.
    """

    gain: float
    peak: float
    width: float
    sd: float
    wrong: float
    sidelobe_db: float
    shown: FloatArray


def scan_phases(array: Array, elevation_deg: float) -> tuple[FloatArray, FloatArray]:
    """Angles of a scan [deg], and the phases of the core for them, the deck level."""
    scan = np.linspace(-SCAN_DEG, SCAN_DEG, round(2.0 * SCAN_DEG / STEP_DEG) + 1)
    level = np.tile([1.0, 0.0, 0.0, 0.0], (len(scan), 1))
    return scan, phases_of(array, level, direction(scan, elevation_deg))


def mean_gain(array: Array, axis: int, b: float, e: FloatArray) -> float:
    """exp(-(2 pi b d/lambda c)^2 / 2), c the direction's cosine along the axis."""
    return math.exp(-((2.0 * math.pi * b * array.spacing * e[axis]) ** 2) / 2.0)


def trial(
    array: Array,
    scanned: tuple[FloatArray, FloatArray],
    axis: int,
    b: float,
    azimuth_deg: float,
    elevation_deg: float,
    draws: int,
    seed: int,
) -> Trial:
    """Elements displaced by (14) along an axis, ``draws`` times."""
    scan, phases = scanned
    rng = np.random.default_rng([seed, axis, round(10 * b), round(azimuth_deg) % 360])
    e = direction(azimuth_deg, elevation_deg)
    amplitude = np.abs(array.field(phases, e, array.displacements(axis, b, draws, rng)))
    tilt = math.cos(math.radians(azimuth_deg))
    # To the second null, so that the first side lobes are part of it.
    main = math.degrees(2.0 / (array.elements * array.spacing * tilt))
    found = pulse(scan, amplitude, main)
    error = angle_of(*scan_times(found.centre)) - azimuth_deg
    right = np.abs(error) < main
    return Trial(
        gain=float(amplitude[:, np.abs(scan - azimuth_deg).argmin()].mean()),
        peak=float(found.peak.mean()),
        width=float(np.median(found.width[right])),
        sd=float(error[right].std()),
        wrong=float(1.0 - right.mean()),
        sidelobe_db=float(np.median(found.sidelobe_db)),
        shown=amplitude[0],
    )
