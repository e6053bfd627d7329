"""The nine-axis log: the record of a gyro, an accelerometer and a magnetometer on one body.

Columns ``t`` or ``dt`` [s]; ``gx gy gz`` [rad/s], the mean body rate of the step that ends at
``t``; ``ax ay az`` [m/s^2], the specific force, +g on the axis that points up at rest; ``mx my mz``
[uT], no value in rows where the magnetometer had nothing new; perhaps ``qw qx qy qz``, the attitude
b to n (Hamilton, scalar first, ENU), and ``mov``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from boresight.model.arrays import BoolArray, FloatArray
from boresight.model.declarations import QUATERNION
from boresight.model.errors import InputError, require
from boresight.sim.records.record import Column, Place, Record, check_norm, steps_of, truth_names

#: Columns of each sensor, and their unit.
TRIADS = {
    "gyr": (("gx", "gy", "gz"), "rad/s"),
    "acc": (("ax", "ay", "az"), "m/s^2"),
    "mag": (("mx", "my", "mz"), "uT"),
}


@dataclass(frozen=True, eq=False)
class NineAxis:
    """A nine-axis record, sensor by sensor.

    ``t`` (n,) in s; ``gyr``, ``acc``, ``mag`` (n, 3) in rad/s, m/s^2 and uT, NaN in rows of ``mag``
    without a new sample; ``q`` (n, 4) the reference attitude, NaN in rows without one; ``steps``
    (n,) the time steps in s, if not the differences of ``t``; ``mov`` (n,) the samples that count
    when errors are averaged.
    """

    name: str
    t: FloatArray
    gyr: FloatArray
    acc: FloatArray
    mag: FloatArray
    q: FloatArray | None = None
    steps: FloatArray | None = None
    mov: BoolArray | None = None

    @classmethod
    def of(cls, record: Record) -> NineAxis:
        """The sensors of a record, with converted units.

        InputError for a missing column or sample, a field or attitude that is there in part, or an
        attitude without the norm one.
        """
        wanted = "the columns t,gx,gy,gz,ax,ay,az,mx,my,mz"
        columns = partial(stacked, record, wanted=wanted, fix="add what is missing")
        triads = {k: columns(names, unit, gaps=k == "mag") for k, (names, unit) in TRIADS.items()}
        names = truth_names(record)
        q = None
        if all(n in names for n in QUATERNION):
            q = columns([names[n] for n in QUATERNION], "", gaps=True)
            check_norm(record, q)
        mov = record.numbers("mov") != 0.0 if "mov" in record.columns else None
        if "dt" not in record.columns:
            columns(["t"], "s")
        return cls(record.name, record.times(), **triads, q=q, steps=record.steps(), mov=mov)

    def record(self) -> Record:
        """Return the columns as a record."""
        columns = {"t": self.t} | ({} if self.steps is None else {"dt": self.steps})
        for key, (names, _) in TRIADS.items():
            columns |= dict(zip(names, getattr(self, key).T, strict=True))
        if self.q is not None:
            columns |= dict(zip(QUATERNION, self.q.T, strict=True))
        if self.mov is not None:
            columns["mov"] = self.mov.astype(np.float64)
        location = Place(f"log {self.name!r}")
        return Record(self.name, {n: Column(v.copy()) for n, v in columns.items()}, location)

    def __len__(self) -> int:
        return len(self.t)

    @property
    def attitude(self) -> FloatArray:
        """Reference attitude (n, 4); raises `InputError` without one."""
        if self.q is None:
            where, fix = f"log {self.name!r}", "use a log with qw,qx,qy,qz"
            raise InputError.at(where, wanted="a reference attitude", found="none", fix=fix)
        return self.q

    @property
    def counts(self) -> BoolArray:
        """Samples (n,) that count when errors are averaged."""
        return np.ones(len(self), dtype=np.bool_) if self.mov is None else self.mov

    @property
    def mag_new(self) -> BoolArray:
        """Whether the magnetometer had a new sample, (n,)."""
        return np.asarray(~np.isnan(self.mag[:, 0]))

    @property
    def dt(self) -> FloatArray:
        """Time step that ends at each sample [s], (n,)."""
        return steps_of(f"log {self.name!r}", self.t) if self.steps is None else self.steps


def stacked(
    record: Record, names: Sequence[str], unit: str, *, wanted: str, fix: str, gaps: bool = False
) -> FloatArray:
    """Columns in a unit side by side, (n, k); with ``gaps`` a row may have none of them, as NaN.

    InputError for a missing column, by ``wanted`` and ``fix``, and for a missing value.
    """
    for name in names:
        require(name in record.columns, record.where, wanted, f"no column {name}", fix)
    values = np.stack([record.values(name, unit) for name in names], axis=1)
    missing = np.isnan(values)
    if gaps:
        missing &= ~missing.all(axis=1, keepdims=True)
    if missing.any():
        row, k = divmod(int(np.argmax(missing)), missing.shape[1])
        where, fix = record.place(row, names[k]), "complete or remove the row"
        wanted = "a number" + ", or none in all of the row" * gaps
        raise InputError.at(where, wanted=wanted, found="no value", fix=fix)
    return values
