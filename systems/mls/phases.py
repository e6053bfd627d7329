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
"""

from __future__ import annotations

from typing import Any

from boresight import Estimator, Input, Output, Param, ops
from boresight.model.algebra.quaternion import dot, matrix
from boresight.model.algebra.quaternion_filter import status_word
from boresight.model.errors import require, require_choice

AXES = ("x", "y", "z")  #: of the body; elements stand on the last two.

MOST_ELEMENTS = 160  #: outputs that one core has room for.

#: Bits of the output ``status``.
STATUS_BITS = {0: "the beam is beyond the array's sector"}


class ArrayPhases(Estimator):
    """Phases of ``elements`` elements in a line for a beam given in reference axes.

    ``axis``: "y" for an azimuth antenna, "z" for an elevation antenna, `array_phases_z`.
    """

    name = "array_phases"
    summary = "phases of a linear array for a beam in reference axes, turned by an attitude"
    inputs = (
        *(
            Input(f"q{a}", -1.0, 1.0, meaning=f"attitude of the deck, component {a}")
            for a in "wxyz"
        ),
        *(
            Input(f"beam_{a}", -1.0, 1.0, meaning=f"direction of the beam, reference axis {a}")
            for a in "xyz"
        ),
    )
    status_bits = STATUS_BITS
    params = (
        Param("spacing", 0.5, 0.1, 1.0, "", "of the elements, in wavelengths: follows the channel"),
        Param("sector", 0.25, 0.0, 1.0, "", "least cosine between a beam and the array's normal"),
    )

    def __init__(self, elements: int = 64, axis: str = "y") -> None:
        some = isinstance(elements, int) and 2 <= elements <= MOST_ELEMENTS
        require(some, "array_phases, elements", f"2 to {MOST_ELEMENTS}", elements)
        require_choice("array_phases, axis", axis, AXES[1:])
        self.axis = AXES.index(axis)
        if axis == "z":
            self.name = "array_phases_z"
        self.outputs = (
            *(Output(f"phase_{k}", "turn", 2.0**-20) for k in range(elements)),
            Output("status", "bits"),
        )

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """One beam: see the module docstring."""
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
