"""A record as one estimator's inputs: columns found by name, converted and checked once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from boresight.model.declarations import EXACT_UNITS, QUATERNION, Input
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, input_words
from boresight.model.words.program import Program
from boresight.sim.records.plausible import warnings_of
from boresight.sim.records.record import TRUTH, Column, Record
from boresight.sim.records.steps import steps_of
from boresight.sim.records.units import UnitError, linear

__all__ = ["Feed", "feed"]

FloatArray = npt.NDArray[np.float64]

#: A reference quaternion may be off norm one by this much: it was rounded to be written down.
_NORM_TOLERANCE = 0.01
BoolArray = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Feed:
    """What an estimator reads.

    Attributes
    ----------
    record : Record
        Where it is from.
    t : float64 (n,) or None
        Times in seconds, if it has any.
    inputs : float64 (n, n_inputs)
        In the declared units, clamped to the declared ranges.
    new : bool (n, n_inputs)
        Whether the record had a new sample there.
    clamped : dict of str to int
        Samples beyond the range of inputs that are declared to be clamped.
    truth : dict of str to float64 (n,)
        By output name, in its unit; NaN where the record has none.
    warnings : tuple of str
        What cannot be what its unit says, in words.
    """

    record: Record
    t: FloatArray | None
    inputs: FloatArray
    new: BoolArray
    clamped: dict[str, int]
    truth: dict[str, FloatArray]
    warnings: tuple[str, ...]

    def __len__(self) -> int:
        """Count the samples."""
        return len(self.inputs)

    def words(self, program: Program) -> npt.NDArray[np.int64]:
        """Input words (n, n_inputs)."""
        return input_words(program, self.inputs[:, :, None])[:, :, 0]


def feed(estimator: Estimator, record: Record) -> Feed:
    """Find, convert and check an estimator's inputs.

    Raises
    ------
    InputError
        No column for an input, a unit that is not known or of another dimension, a missing sample
        where none may be missing, a value outside the declared range of an input that does not
        clamp.
    """
    n = len(record)
    inputs = np.empty((n, len(estimator.inputs)))
    new = np.ones((n, len(estimator.inputs)), dtype=np.bool_)
    clamped: dict[str, int] = {}
    place = {i.name: k for k, i in enumerate(estimator.inputs)}
    for k, declared in enumerate(estimator.inputs):
        if declared.flags:
            continue
        values = _values(estimator, record, declared)
        new[:, k] = ~np.isnan(values)
        values = _filled(record, declared, values)
        inside = np.clip(values, declared.low, declared.high)
        if (beyond := int(np.count_nonzero(inside != values))) and not declared.clamp:
            _refuse_range(record, declared, values, beyond)
        elif beyond:
            clamped[declared.name] = beyond
        inputs[:, k] = inside
    for k, declared in enumerate(estimator.inputs):
        if declared.flags:
            new[:, k] = new[:, [place[name] for name in declared.flags]].all(axis=1)
            inputs[:, k] = np.clip(new[:, k].astype(np.float64), declared.low, declared.high)
    t = _converted(record, "t", record.columns["t"], "s") if "t" in record.columns else None
    return Feed(
        record,
        t,
        inputs,
        new,
        clamped,
        _truth(estimator, record),
        warnings_of(estimator, inputs, new),
    )


def _values(estimator: Estimator, record: Record, declared: Input) -> FloatArray:
    """Values of an input's column in its unit, NaN where there is no new sample."""
    if declared.name not in record.columns:
        if declared.name == "dt" and "t" in record.columns:
            t = _converted(record, "t", record.columns["t"], "s")
            return steps_of(record.where, t)
        raise InputError.at(
            record.where,
            wanted=f"a column {declared.name} [{declared.unit}], an input of {estimator.name}",
            found=f"columns {', '.join(list(record.columns)[:12])}"
            + (", ..." if len(record.columns) > 12 else ""),
            fix="add it, or rename the one that holds it",
        )
    return _converted(record, declared.name, record.columns[declared.name], declared.unit)


def _converted(record: Record, name: str, column: Column, unit: str) -> FloatArray:
    if column.unit is None or column.unit == unit or unit in EXACT_UNITS:
        return column.values
    try:
        factor, offset = linear(column.unit, unit)
    except UnitError as error:
        raise InputError.at(
            f"{record.where}, column {name}",
            wanted=f"a unit that converts to {unit or 'a plain number'}",
            found=f"{column.unit} ({error})",
            fix="correct the unit in the header",
        ) from None
    return column.values * factor + offset


def _filled(record: Record, declared: Input, values: FloatArray) -> FloatArray:
    gap = np.isnan(values)
    if not gap.any():
        return values
    first = int(np.argmax(gap))
    if declared.missing is None or (declared.missing == "hold" and first == 0):
        raise InputError.at(
            record.place(first, declared.name),
            wanted="a number" + ("" if declared.missing is None else " in the first row"),
            found="no value",
            fix="complete the log"
            if declared.missing
            else f"complete the log, or declare Input({declared.name!r}, ..., missing=...)",
        )
    if declared.missing == "hold":
        last = np.maximum.accumulate(np.where(gap, 0, np.arange(len(values))))
        return values[last]
    return np.where(gap, float(declared.missing), values)


def _refuse_range(record: Record, declared: Input, values: FloatArray, count: int) -> None:
    outside = (values < declared.low) | (values > declared.high)
    row = int(np.argmax(outside))
    raise InputError.at(
        record.place(row, declared.name),
        wanted=f"{declared.low:g} to {declared.high:g} {declared.unit}".rstrip()
        + ", the declared range",
        found=f"{values[row]:.6g}" + (f", and {count - 1} more beyond it" if count > 1 else ""),
        fix="correct the unit in the header, or the range; clamp=True would clamp it",
    )


def _truth(estimator: Estimator, record: Record) -> dict[str, FloatArray]:
    """Truth of the outputs: columns ``NAME_true``, or NAME itself where it is no input."""
    inputs = {i.name for i in estimator.inputs}
    found = {}
    for output in estimator.outputs:
        for name in (f"{output.name}{TRUTH}", output.name):
            if name in record.columns and name not in inputs:
                column = record.columns[name]
                found[output.name] = _converted(record, name, column, output.unit)
                break
    if all(name in found for name in QUATERNION):
        _refuse_norm(record, np.stack([found[name] for name in QUATERNION], axis=1))
    return found


def _refuse_norm(record: Record, q: FloatArray) -> None:
    """Refuse a reference that is no attitude."""
    with np.errstate(over="ignore"):
        norm = np.sqrt((q * q).sum(axis=1))
    off = np.abs(norm - 1.0) > _NORM_TOLERANCE
    if off.any():
        row = int(np.argmax(off))
        raise InputError.at(
            record.place(row, QUATERNION[0]),
            wanted="a quaternion of norm 1",
            found=f"norm {norm[row]:.6g}",
            fix="correct it, or leave the whole quaternion out",
        )
