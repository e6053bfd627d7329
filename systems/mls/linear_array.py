"""A linear array of antennas: pattern, elements out of place, main lobe of a received signal.

The elements stand on the y or z axis, k = 0 the first; directions are e(azimuth, elevation), x
ahead, z up; the azimuth 0 is ahead. Fields are over that of all elements in phase; (n) are the
equations of Wang Ding et al. (2018), sections 1 and 2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from boresight.model.arrays import FloatArray
from boresight.model.errors import require


def direction(azimuth_deg: npt.ArrayLike, elevation_deg: npt.ArrayLike) -> FloatArray:
    """Unit vectors (..., 3): (cos phi cos theta, cos phi sin theta, sin phi)."""
    theta, phi = np.radians(azimuth_deg), np.radians(elevation_deg)
    parts = np.cos(phi) * np.cos(theta), np.cos(phi) * np.sin(theta), np.sin(phi)
    return np.stack(np.broadcast_arrays(*parts), axis=-1)


@dataclass(frozen=True)
class Array:
    """``elements`` in a line, ``spacing`` apart, in wavelengths, on ``axis``: 1 is y, 2 is z.

    `InputError`: fewer than two elements, a spacing that is not above zero.
    """

    elements: int = 64
    spacing: float = 0.5
    axis: int = 1

    def __post_init__(self) -> None:
        require(self.elements >= 2, "array, elements", "2 or more", self.elements)
        above = 0.0 < self.spacing < np.inf
        require(above, "array, spacing", "wavelengths above 0", self.spacing)

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
        place[:, self.axis] = self.spacing * np.arange(n)
        path = np.einsum("...kv,...v->...k", place + displaced, e)
        return np.asarray(np.exp(2j * np.pi * path) @ np.exp(-2j * np.pi * phases.T) / n)


@dataclass(frozen=True)
class Lobe:
    """The main lobe: ``centre`` and ``width`` [deg] between its -3 dB points.

    ``peak`` of the amplitude, and how far below it the highest one outside the main lobe is.
    """

    centre: FloatArray
    width: FloatArray
    peak: FloatArray
    sidelobe_db: FloatArray


def lobe(angle_deg: FloatArray, amplitude: FloatArray, main_deg: float) -> Lobe:
    """Main lobes of amplitudes (..., m) over angles (m,), interpolated between them.

    ``main_deg``: half width of what counts as main lobe.
    """
    shape, m = amplitude.shape[:-1], amplitude.shape[-1]
    flat = amplitude.reshape(-1, m)
    top, rows = flat.argmax(axis=1), np.arange(len(flat))
    peak = flat[rows, top]
    edges = []
    for step in (-1, 1):
        order = np.arange(m)[::step]
        outside = (flat[:, order] < peak[:, None] * np.sqrt(0.5)) & (
            (order - top[:, None]) * step > 0
        )
        crossed = outside.any(axis=1)
        k = np.where(crossed, order[outside.argmax(axis=1)], order[-1])
        inside = np.clip(k - step, 0, m - 1)
        a, b = flat[rows, k], flat[rows, inside]
        share = np.where(crossed, (b - peak * np.sqrt(0.5)) / np.where(crossed, b - a, 1.0), 1.0)
        edges.append(angle_deg[inside] + share * (angle_deg[k] - angle_deg[inside]))
    sidelobes = np.abs(angle_deg - angle_deg[top][:, None]) > main_deg
    side = np.where(sidelobes, flat, 1e-9).max(axis=1)
    figures = ((edges[0] + edges[1]) / 2.0, edges[1] - edges[0], peak, 20.0 * np.log10(side / peak))
    return Lobe(*(np.asarray(x).reshape(shape) for x in figures))
