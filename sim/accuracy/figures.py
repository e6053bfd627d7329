"""The error of a run against truth, as figures: root mean squares over the samples that count.

One figure for each output with a truth, in its unit (`sim.compare.difference`); of outputs ``qw qx
qy qz`` the three angles of `sim.attitude.accuracy` instead.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from boresight.model.declarations import EXACT_UNITS, QUATERNION
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.sim.attitude.accuracy import (
    NO_SAMPLE,
    AttitudeRmse,
    attitude_error,
    constant_offset,
    pieces,
)
from boresight.sim.attitude.outputs import attitude_of
from boresight.sim.attitude.rotation import (
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_rotation_vector,
)
from boresight.sim.compare.difference import Differences, Spread
from boresight.sim.records.feed import Feed

__all__ = [
    "ANGLES",
    "Angles",
    "aligned",
    "aligned_outputs",
    "attitude_errors",
    "errors",
    "gives_attitude",
    "units_of",
]

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

#: Figures of an attitude, in degrees.
ANGLES = AttitudeRmse._fields


def gives_attitude(estimator: Estimator) -> bool:
    """Whether an estimator's outputs are an attitude."""
    return {*QUATERNION} <= {o.name for o in estimator.outputs}


def units_of(estimator: Estimator, columns: Feed) -> dict[str, str]:
    """Units of the figures that a record's truth allows, by name; empty without any truth."""
    units, judged = {}, _apart(estimator, columns)
    if judged and _rows(columns, QUATERNION).any():
        units = dict.fromkeys(ANGLES, "deg")
    for o in estimator.outputs:
        if o.name in columns.truth and o.name not in judged and _rows(columns, (o.name,)).any():
            units[o.name] = "words" if o.unit in EXACT_UNITS else o.unit
    return units


def errors(
    estimator: Estimator, columns: Feed, outputs: Mapping[str, FloatArray]
) -> dict[str, float]:
    """Figures of a run's outputs (n,), by name; those of `units_of`.

    An attitude of norm zero counts as NaN. Of words that are compared exactly the figure is the
    root of the share that differs.
    """
    metrics: dict[str, float] = {}
    units, judged = units_of(estimator, columns), _apart(estimator, columns)
    if judged and ANGLES[0] in units:
        angles = Angles()
        for some in pieces(len(columns.counts)):
            q, reference = (
                attitude_of({n: x[n][some] for n in QUATERNION}) for x in (outputs, columns.truth)
            )
            angles.add(q, reference, columns.counts[some])
        metrics = angles.result()
    names = [n for n in units if n not in metrics]
    made = Differences(estimator.outputs, names, judged=False)
    for some in pieces(len(columns.counts)):
        rows = columns.counts[some]
        made.add(*({n: x[n][some][rows] for n in names} for x in (outputs, columns.truth)))
    return metrics | {d.output: d.rms for d in made.result()}


def attitude_errors(q: FloatArray, reference: FloatArray, counts: BoolArray) -> dict[str, float]:
    """The figures of attitudes (n, 4)."""
    angles = Angles()
    for some in pieces(len(q)):
        angles.add(q[some], reference[some], counts[some])
    return angles.result()


class Angles:
    """Figures of attitudes, piece by piece."""

    def __init__(self) -> None:
        self._spreads = {name: Spread() for name in ANGLES}

    def add(self, q: FloatArray, reference: FloatArray, counts: BoolArray) -> None:
        """The next rows, (n, 4)."""
        rows = counts & np.isfinite(reference).all(axis=1)
        seen = q[rows]
        seen[~seen.any(axis=1)] = np.nan
        angles = attitude_error(seen, reference[rows])
        for spread, error in zip(self._spreads.values(), angles, strict=True):
            spread.add(error, np.ones(len(error), dtype=np.bool_), 0)

    @property
    def samples(self) -> int:
        """Rows that count."""
        return self._spreads[ANGLES[0]].samples

    def result(self) -> dict[str, float]:
        """The figures; raises InputError of no row."""
        if not self.samples:
            raise InputError(NO_SAMPLE)
        return {name: spread.rms for name, spread in self._spreads.items()}


def aligned(
    q: FloatArray, reference: FloatArray, counts: BoolArray, align: str
) -> tuple[FloatArray, tuple[float, ...]]:
    """Attitudes (n, 4) without their constant offset from a reference, over samples that count.

    Returns
    -------
    q : float64 (n, 4)
    offset_deg : tuple of 3 float
        The offset as a rotation vector about east, north and up [deg]; none taken out: empty.
    """
    rows = counts & np.isfinite(reference).all(axis=1) & np.isfinite(q).all(axis=1) & q.any(axis=1)
    if align == "none" or not rows.any():
        return q, ()
    offset = constant_offset(q[rows], reference[rows], align)
    turned = quaternion_multiply(quaternion_conjugate(offset), q)
    return turned, tuple(np.degrees(quaternion_to_rotation_vector(offset)).tolist())


def aligned_outputs(
    estimator: Estimator, columns: Feed, outputs: Mapping[str, FloatArray], align: str
) -> tuple[Mapping[str, FloatArray], tuple[float, ...]]:
    """`aligned` of a run's outputs: of those ``qw qx qy qz``, where the record has their truth."""
    if align == "none" or not _apart(estimator, columns):
        return outputs, ()
    q, offset = aligned(attitude_of(outputs), attitude_of(columns.truth), columns.counts, align)
    return {**outputs, **dict(zip(QUATERNION, q.T, strict=True))}, offset


def _apart(estimator: Estimator, columns: Feed) -> tuple[str, ...]:
    """Outputs that have no figure of their own, since the angles say it."""
    whole = gives_attitude(estimator) and all(n in columns.truth for n in QUATERNION)
    return (*QUATERNION, *ANGLES) if whole else ()


def _rows(columns: Feed, names: tuple[str, ...]) -> BoolArray:
    """Samples that count and have a truth."""
    rows = columns.counts.copy()
    for name in names:
        rows &= np.isfinite(columns.truth[name])
    return rows
