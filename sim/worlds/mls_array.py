"""A scanning linear array: pattern, elements out of place, what a receiver gets, angle from times.

Wang Ding et al. (2018), sections 1 and 2; what its text leaves open is taken from the ICAO scheme.
The elements stand on the y axis, k = 0 the first; directions are e(azimuth, elevation), x ahead,
z up; the azimuth 0 is ahead. Fields are over that of all elements in phase.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from boresight.model.errors import InputError

__all__ = [
    "SCAN_DEG",
    "SCAN_DEG_S",
    "Array",
    "Pulse",
    "angle_of",
    "direction",
    "pulse",
    "scan_times",
]

FloatArray = npt.NDArray[np.float64]
SCAN_DEG_S = 20_000.0  #: speed of the scan, to and fro.
SCAN_DEG = 62.0  #: it goes from minus this to this, and back.
_PAUSE_S = 0.002  #: between to and fro.


def direction(azimuth_deg: npt.ArrayLike, elevation_deg: npt.ArrayLike) -> FloatArray:
    """Unit vectors (..., 3): (cos phi cos theta, cos phi sin theta, sin phi)."""
    theta, phi = np.radians(azimuth_deg), np.radians(elevation_deg)
    parts = np.cos(phi) * np.cos(theta), np.cos(phi) * np.sin(theta), np.sin(phi)
    return np.stack(np.broadcast_arrays(*parts), axis=-1)


@dataclass(frozen=True)
class Array:
    """``elements`` in a line, ``spacing`` apart, in wavelengths.

    Raises
    ------
    InputError
        Fewer than two elements; a spacing that is not above zero.
    """

    elements: int = 64
    spacing: float = 0.5

    def __post_init__(self) -> None:
        for good, where, wanted, found in (
            (self.elements >= 2, "elements", "2 or more", self.elements),
            (0.0 < self.spacing < np.inf, "spacing", "wavelengths above 0", self.spacing),
        ):
            if not good:
                raise InputError.at(
                    f"array, {where}", wanted=wanted, found=repr(found), fix="correct it"
                )

    def closed_form(self, sine: npt.ArrayLike, of: float = 0.0) -> FloatArray:
        """(5), (6): |sin(N u/2) / (N sin(u/2))|, u = 2 pi d/lambda (sine - ``of``)."""
        half = np.pi * self.spacing * (np.asarray(sine, dtype=np.float64) - of)
        near = np.abs(np.sin(half)) < 1e-12
        below = np.where(near, 1.0, self.elements * np.sin(half))
        return np.where(near, 1.0, np.abs(np.sin(self.elements * half) / below))

    def displacements(
        self, axis: int, b: float, draws: int, rng: np.random.Generator
    ) -> FloatArray:
        """(14): elements out of place by b d N(0, 1) along an axis: (draws, elements, 3)."""
        q = np.zeros((draws, self.elements, 3))
        q[:, :, axis] = b * self.spacing * rng.normal(size=(draws, self.elements))
        return q

    def field(
        self, phases: FloatArray, e: FloatArray, displaced: FloatArray | float = 0.0
    ) -> npt.NDArray[np.complex128]:
        """(13): sum_k exp(-j phi_k) exp(j 2 pi/lambda e . (p(k) + q(k))) / N, far away along e.

        Phases (m, elements) of each beam [turns], unit vectors (..., 3) in the array's axes, q(k)
        (..., elements, 3) in wavelengths; gives (..., m).
        """
        n = len(phases[0])
        place = np.zeros((n, 3))
        place[:, 1] = self.spacing * np.arange(n)
        path = np.einsum("...kv,...v->...k", place + displaced, e)
        return np.asarray(np.exp(2j * np.pi * path) @ np.exp(-2j * np.pi * phases.T) / n)


@dataclass(frozen=True)
class Pulse:
    """What passes a receiver: ``centre`` and ``width`` of its -3 dB gate, in deg of the scan.

    ``peak`` of the amplitude, and how far below it the highest one outside the main lobe is.
    """

    centre: FloatArray
    width: FloatArray
    peak: FloatArray
    sidelobe_db: FloatArray


def pulse(scan_deg: FloatArray, amplitude: FloatArray, main_deg: float) -> Pulse:
    """Gate pulses: amplitudes (..., m) over the scan (m,), interpolated between its beams.

    ``main_deg``: half width of what counts as main lobe.
    """
    shape, m = amplitude.shape[:-1], amplitude.shape[-1]
    flat = amplitude.reshape(-1, m)
    top, rows = flat.argmax(axis=1), np.arange(len(flat))
    peak = flat[rows, top]
    edges = []
    for step in (-1, 1):
        order = np.arange(m)[::step]
        beyond = (flat[:, order] < peak[:, None] * np.sqrt(0.5)) & (
            (order - top[:, None]) * step > 0
        )
        some = beyond.any(axis=1)
        k = np.where(some, order[beyond.argmax(axis=1)], order[-1])
        inside = np.clip(k - step, 0, m - 1)
        a, b = flat[rows, k], flat[rows, inside]
        share = np.where(some, (b - peak * np.sqrt(0.5)) / np.where(some, b - a, 1.0), 1.0)
        edges.append(scan_deg[inside] + share * (scan_deg[k] - scan_deg[inside]))
    away = np.abs(scan_deg - scan_deg[top][:, None]) > main_deg
    side = np.where(away, flat, 1e-9).max(axis=1)
    found = ((edges[0] + edges[1]) / 2.0, edges[1] - edges[0], peak, 20.0 * np.log10(side / peak))
    return Pulse(*(np.asarray(x).reshape(shape) for x in found))


def scan_times(scan_deg: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    """When a beam passes an angle on its way to and fro [s]."""
    to = (np.asarray(scan_deg) + SCAN_DEG) / SCAN_DEG_S
    return to, 4.0 * SCAN_DEG / SCAN_DEG_S + _PAUSE_S - to


def angle_of(to: npt.ArrayLike, fro: npt.ArrayLike) -> FloatArray:
    """(T0 - t) V/2 of the time t between both pulses [deg]; T0 is that of the angle 0."""
    at_zero = 2.0 * SCAN_DEG / SCAN_DEG_S + _PAUSE_S
    return np.asarray((at_zero - (np.asarray(fro) - np.asarray(to))) * SCAN_DEG_S / 2.0)
