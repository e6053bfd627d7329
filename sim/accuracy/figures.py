"""The error of a run against truth, as figures: root mean squares over the samples that count.

One figure for each output with a truth, in its unit (`sim.compare.difference`); of outputs ``qw qx
qy qz`` the three angles of `sim.rotations.accuracy` instead.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

import numpy as np

from boresight.model.arrays import BoolArray, FloatArray
from boresight.model.declarations import EXACT_UNITS, QUATERNION
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.sim.compare.difference import Differences, Spread, turn_notes
from boresight.sim.records.feed import Feed, LongFeed
from boresight.sim.rotations.accuracy import AttitudeError, attitude_error, attitude_of
from boresight.sim.rotations.rotation import (
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_normalise,
    quaternion_to_rotation_vector,
)

#: Components of a quaternion that a constant offset may have.
ALIGNMENTS = {"none": (0,), "heading": (0, 3), "full": (0, 1, 2, 3)}

#: Figures of an attitude, in degrees.
ANGLES = AttitudeError._fields


def gives_attitude(estimator: Estimator) -> bool:
    """Whether an estimator's outputs are an attitude."""
    return {*QUATERNION} <= {o.name for o in estimator.outputs}


def units_of(estimator: Estimator, columns: Feed | LongFeed) -> dict[str, str]:
    """Units of the figures that a record's truth allows, by name; empty without any truth."""
    names = set[str]()
    for part in columns.parts():
        known = {n: part.counts & np.isfinite(truth) for n, truth in part.truth.items()}
        angles = _attitude_outputs(estimator, part)
        if angles and np.all([known[n] for n in QUATERNION], axis=0).any():
            names |= {*ANGLES}
        names |= {n for n, rows in known.items() if n not in angles and rows.any()}
    return _units(estimator, names)


def _units(estimator: Estimator, names: Collection[str]) -> dict[str, str]:
    angles = dict.fromkeys(ANGLES, "deg") if ANGLES[0] in names else {}
    declared = {o.name: "words" if o.unit in EXACT_UNITS else o.unit for o in estimator.outputs}
    return angles | {n: u for n, u in declared.items() if n in names and n not in angles}


class Errors:
    """Figures of a run's outputs, those of `units_of`: the same whatever the pieces.

    An attitude of norm zero counts as NaN. Of words that are compared exactly the figure is the
    root of the share that differs.
    """

    def __init__(self, estimator: Estimator) -> None:
        self.estimator, self._angles = estimator, Angles()
        self._others: Differences | None = None

    def add(self, columns: Feed, outputs: Mapping[str, FloatArray]) -> None:
        """The next rows, with their outputs (n,) by name."""
        attitude_names = _attitude_outputs(self.estimator, columns)
        if attitude_names:
            self._angles.add(attitude_of(outputs), attitude_of(columns.truth), columns.counts)
        names = [n for n in columns.truth if n not in attitude_names]
        if self._others is None:
            self._others = Differences(self.estimator.outputs, names, judged=False)
        rows = columns.counts
        self._others.add(*({n: x[n][rows] for n in names} for x in (outputs, columns.truth)))

    def result(self) -> dict[str, float]:
        """The figures, by name."""
        angles = self._angles.result() if self._angles.samples else {}
        others = [] if self._others is None else self._others.result()
        return angles | {d.output: d.rms for d in others if d.samples}

    @property
    def notes(self) -> list[str]:
        """Lines of warning about them."""
        return [] if self._others is None else turn_notes(self._others.result())

    @property
    def units(self) -> dict[str, str]:
        """Their units."""
        return _units(self.estimator, self.result())


def means(scores: Iterable[Mapping[str, float]]) -> dict[str, float]:
    """Mean of each figure over the logs that have it."""
    scores = [*scores]
    names = dict.fromkeys(name for of in scores for name in of)
    return {n: float(np.mean([of[n] for of in scores if n in of])) for n in names}


class Angles:
    """Figures of attitudes, piece by piece."""

    def __init__(self) -> None:
        self._spreads = {name: Spread() for name in ANGLES}

    def add(self, q: FloatArray, reference: FloatArray, counts: BoolArray) -> None:
        """The next rows, (n, 4)."""
        rows = counts & np.isfinite(reference).all(axis=1)
        estimates = q[rows]
        estimates[~estimates.any(axis=1)] = np.nan
        angles = attitude_error(estimates, reference[rows])
        for spread, error in zip(self._spreads.values(), angles, strict=True):
            spread.add(error, np.ones(len(error), dtype=np.bool_), 0)

    @property
    def samples(self) -> int:
        """Rows that count."""
        return self._spreads[ANGLES[0]].samples

    def result(self) -> dict[str, float]:
        """The figures; raises InputError of no row."""
        if not self.samples:
            raise InputError("no sample counts: mov and a reference attitude never come together")
        return {name: spread.rms for name, spread in self._spreads.items()}


def attitude_errors(q: FloatArray, reference: FloatArray, counts: BoolArray) -> dict[str, float]:
    """The figures of attitudes (n, 4)."""
    angles = Angles()
    angles.add(q, reference, counts)
    return angles.result()


class Alignment:
    """Turn in navigation axes that takes references nearest to estimates, piece by piece.

    The quaternion ``o`` of norm one with the components of `ALIGNMENTS` that maximises the sum of
    ``(o . e)^2`` over the errors ``e = q_est q_ref*`` (F. L. Markley et al., "Averaging
    Quaternions", J. Guidance 30(4), 2007): of their outer products the dominant eigenvector.
    """

    def __init__(self, align: str) -> None:
        self._free = list(ALIGNMENTS[align])
        self._products = np.zeros((len(self._free), len(self._free)))

    def add(self, q_est: FloatArray, q_ref: FloatArray, counts: BoolArray) -> None:
        """The next rows, (n, 4): those that count and have both attitudes."""
        rows = counts & np.isfinite(q_ref).all(axis=1) & np.isfinite(q_est).all(axis=1)
        rows &= q_est.any(axis=1)
        q, reference = (quaternion_normalise(x[rows]) for x in (q_est, q_ref))
        error = quaternion_multiply(q, quaternion_conjugate(reference))[:, self._free]
        self._products += error.T @ error

    def result(self) -> FloatArray | None:
        """The quaternion (4,); None of no row, or of nothing to turn."""
        if len(self._free) == 1 or not self._products.any():
            return None
        offset = np.zeros(4)
        offset[self._free] = np.linalg.eigh(self._products)[1][:, -1]
        return offset * (-1.0 if offset[0] < 0.0 else 1.0) + 0.0

    def turned(self, q: FloatArray) -> FloatArray:
        """Attitudes (n, 4) without it."""
        offset = self.result()
        return q if offset is None else quaternion_multiply(quaternion_conjugate(offset), q)

    @property
    def offset_deg(self) -> tuple[float, ...]:
        """The offset as a rotation vector (3,) about east, north and up; of none: empty."""
        offset = self.result()
        of = () if offset is None else quaternion_to_rotation_vector(offset)
        return tuple(np.degrees(of).tolist())

    def add_outputs(self, columns: Feed, outputs: Mapping[str, FloatArray]) -> None:
        """The next rows of a run; of one without attitude, or without its truth, nothing."""
        if {*QUATERNION} <= columns.truth.keys() & outputs.keys():
            self.add(attitude_of(outputs), attitude_of(columns.truth), columns.counts)

    def turned_outputs(self, outputs: Mapping[str, FloatArray]) -> Mapping[str, FloatArray]:
        """Outputs of a run without it."""
        if self.result() is None:
            return outputs
        q = self.turned(attitude_of(outputs))
        return {**outputs, **dict(zip(QUATERNION, np.moveaxis(q, -1, 0), strict=True))}


def _attitude_outputs(estimator: Estimator, columns: Feed) -> tuple[str, ...]:
    """Outputs without figures of their own, since the angles stand for them."""
    is_complete = gives_attitude(estimator) and all(n in columns.truth for n in QUATERNION)
    return (*QUATERNION, *ANGLES) if is_complete else ()
