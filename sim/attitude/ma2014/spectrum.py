"""Amplitude spectra of an error, and where its energy lies."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from boresight.model.arrays import FloatArray
from boresight.model.errors import InputError

__all__ = ["Spectrum", "line_amplitude", "share", "spectrum"]


class Spectrum(NamedTuple):
    """One-sided: ``frequency`` [Hz] (m,), ``amplitude`` (m, ...) in the unit of the signal."""

    frequency: FloatArray
    amplitude: FloatArray


def spectrum(signal: npt.ArrayLike, rate_hz: float) -> Spectrum:
    """One-sided amplitude spectrum along the first axis, mean removed, no window.

    A sine of amplitude A that fits whole periods into the record stands as one line of height A.
    The last line of an even number of samples (half the rate) is left out.

    Raises
    ------
    InputError
        Fewer than 4 samples, or values that are not finite.
    """
    x = np.asarray(signal, dtype=np.float64)
    n = len(x)
    if n < 4 or not np.isfinite(x).all():
        raise InputError(f"signal must have 4 finite samples or more, not {n}")
    lines = np.fft.rfft(x - x.mean(axis=0), axis=0)[: (n + 1) // 2]
    return Spectrum(np.arange(len(lines)) * rate_hz / n, 2.0 * np.abs(lines) / n)


def share(s: Spectrum, low: float, high: float) -> FloatArray:
    """Share of the energy at ``low <= f < high`` [Hz], 0 to 1."""
    inside = (s.frequency >= low) & (s.frequency < high)
    energy = np.square(s.amplitude)
    return np.asarray(energy[inside].sum(axis=0) / energy.sum(axis=0))


def line_amplitude(s: Spectrum, frequency: float) -> FloatArray:
    """Amplitude of the line nearest to a frequency [Hz]."""
    return np.asarray(s.amplitude[int(np.argmin(np.abs(s.frequency - frequency)))])
