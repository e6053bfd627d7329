"""Polynomials of the squared length of a vector.

The quaternion of a turn is (w, s h) with h half the turn and w and s polynomials of |h|^2, the
series of the cosine and of the sine over the angle. So is its squared length, w^2 + s^2 |h|^2.
"""

from __future__ import annotations

import numpy as np

from boresight.sim.ranges.polynomials import Polynomial, plus, scaled, times

__all__ = ["Radial", "radial"]

#: Terms of a polynomial; components of a vector; what rounding explains.
_TERMS, _COMPONENTS, _TINY = 400, 4, 1e-12


class Radial:
    """A polynomial of the squared length of a vector.

    Attributes
    ----------
    numbers : list of int
        Of the components.
    """

    def __init__(self, numbers: list[int], coefficients: list[float]) -> None:
        self.numbers = numbers
        self._of = np.polynomial.Polynomial(coefficients)

    def ends(self, most: float) -> tuple[float, float]:
        """Least and largest value where the squared length is at most ``most``."""
        flat = np.real(self._of.deriv().roots())  # those of others are points as good as any
        values = self._of(np.clip([0.0, most, *flat], 0.0, most))
        return float(np.min(values)), float(np.max(values))


def radial(form: Polynomial) -> Radial | None:
    """A polynomial of 2 to 4 nodes as one of the sum of their squares; None: it is none."""
    numbers = sorted({n for m in form for n in m})
    if not 2 <= len(numbers) <= _COMPONENTS or any(len(m) % 2 for m in form):
        return None
    along = {len(m) // 2: c for m, c in form.items() if {*m} <= {numbers[0]}}
    total: Polynomial = {(n, n): 1.0 for n in numbers}
    power: Polynomial | None = {(): 1.0}
    rest = form
    for k in range(max(along, default=0) + 1):
        rest = plus(rest, scaled(power or {}, -along.get(k, 0.0)))
        power = times(power or {}, total, _TERMS)
    if any(abs(c) > _TINY for c in rest.values()):
        return None
    own = [along.get(k, 0.0) for k in range(max(along, default=0) + 1)]
    return Radial(numbers, [c if abs(c) > _TINY else 0.0 for c in own])
