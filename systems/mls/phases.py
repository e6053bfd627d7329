"""Steering phases of a linear array on a moving deck: a beam that keeps its direction.

Wang Ding et al. (2018), section 1, with the array's turn put in; frames as in `mls_attitude`. The
elements stand d apart on the body's y axis (azimuth antenna), p(k) = (0, k d, 0), k from 0 (the
text's k - 1 does not fit its own sum), or on its z axis (elevation antenna). A beam along the unit
vector e of the reference axes needs the phases (8)::

    phi_k = k (d/lambda) (C^T e)_y   turns        C = C(q), body to reference; or (C^T e)_z

so the program turns e into the array's axis with the attitude of `mls_attitude`, which is in its
record, and multiplies. Phases are turns modulo one, the word read as an unsigned number: products
by integers are exact there, and phi_2k = 2 phi_k costs one slot that also lets phi_k out.

The scan is an input: e of the beam that is due, as a scan generator's table of the law holds it.

`Array` has the pattern of such an array in wavelengths, `lobe` the main lobe of a received signal.
Directions are e(azimuth, elevation), x ahead, z up; fields are over that of all elements in phase.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight import Estimator, Input, Output, Param, ops
from boresight.model.algebra.quaternion import dot, matrix
from boresight.model.algebra.quaternion_filter import status_word
from boresight.model.arrays import FloatArray
from boresight.model.errors import require, require_choice

MOST_ELEMENTS = 160  #: outputs that one core has room for.


class ArrayPhases(Estimator):
    """Phases of ``elements`` elements in a line for a beam given in reference axes.

    ``axis``: "y" for an azimuth antenna, "z" for an elevation antenna, `array_phases_z`.
    """

    name = "array_phases"
    summary = "phases of a linear array for a beam in reference axes, turned by an attitude"
    inputs = (
        *(Input(f"q{a}", -1.0, 1.0, meaning=f"attitude of the deck, part {a}") for a in "wxyz"),
        *(Input(f"beam_{a}", -1.0, 1.0, meaning=f"beam, reference axis {a}") for a in "xyz"),
    )
    status_bits = {0: "the beam is beyond the array's sector"}
    params = (
        Param("spacing", 0.5, 0.1, 1.0, "", "of the elements, in wavelengths: follows the channel"),
        Param("sector", 0.25, 0.0, 1.0, "", "least cosine between a beam and the array's normal"),
    )

    def __init__(self, elements: int = 64, axis: str = "y") -> None:
        some = isinstance(elements, int) and 2 <= elements <= MOST_ELEMENTS
        require(some, "array_phases, elements", f"2 to {MOST_ELEMENTS}", elements)
        require_choice("array_phases, axis", axis, ("y", "z"))
        self.axis = "xyz".index(axis)
        if axis == "z":
            self.name = "array_phases_z"
        self.outputs = (
            *(Output(f"phase_{k}", "turn", 2.0**-20) for k in range(elements)),
            Output("status", "bits"),
        )

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        c = matrix((u.qw, u.qx, u.qy, u.qz), unit=False)
        beam = (u.beam_x, u.beam_y, u.beam_z)
        ahead = dot(beam, [row[0] for row in c])
        along = dot([p.spacing * e for e in beam], [row[self.axis] for row in c])
        phases = [0.0, ops.wrap_turns(along)]  # phi_k = k spacing (C^T e)_y
        for k in range(2, len(self.outputs) - 1):
            half, odd = divmod(k, 2)
            phases.append(ops.wrap_turns(k * phases[1] if odd else 2.0 * phases[half]))
        status = status_word({0: ahead < p.sector})
        return {}, {**{f"phase_{k}": phi for k, phi in enumerate(phases)}, "status": status}


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
