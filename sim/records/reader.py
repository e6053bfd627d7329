"""The input reader: columns become the inputs of one estimator, by one set of rules."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from boresight.model.arrays import BoolArray, FloatArray
from boresight.model.declarations import Input
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.sim.records.record import RESTART_S


class InputReader:
    """Converts samples to inputs, in one or more calls: missing samples, flags, ranges.

    A log is one call, a closed loop one call for each record, a stream one call for each piece.
    Held values of missing samples are preserved between calls.

    ``place`` (row, run, column) names a value in messages; rows count over all calls. ``runs`` are
    side by side. ``fix`` is the remedy in messages, by default one for logs. ``clamped`` are by
    name the samples beyond the range of inputs that are declared to be clamped, ``rows`` all read.
    """

    def __init__(
        self,
        estimator: Estimator,
        place: Callable[[int, int, str], str],
        *,
        runs: int = 1,
        fix: str = "",
    ) -> None:
        self.estimator, self.place, self.runs, self.fix = estimator, place, runs, fix
        self.clamped: dict[str, int] = {}
        self.rows = 0
        inputs = estimator.inputs
        column = {i.name: k for k, i in enumerate(inputs)}
        self._flags = {k: [column[n] for n in i.flags] for k, i in enumerate(inputs) if i.flags}
        self._columns = {k: i.name for k, i in enumerate(inputs) if k not in self._flags}
        self._low, self._high = (np.full(len(inputs), limit) for limit in (-np.inf, np.inf))
        for k in self._columns:
            self._low[k], self._high[k] = inputs[k].low, inputs[k].high
        self._last = np.full((runs, len(inputs)), np.nan)

    def take(self, columns: Mapping[str, Any], n: int = 1) -> tuple[FloatArray, BoolArray]:
        """Read ``n`` rows: inputs, and which samples were new, both (n, runs, n_inputs).

        ``columns`` are values by input name, in the inputs' units, each broadcast to (n, runs); NaN
        where there is no new sample. Others are ignored. Raises InputError for an input that has no
        column, is no finite number, is missing without ``missing``, or is out of its range.
        """
        # Each input's values side by side in memory: most of what follows is input by input.
        values = np.zeros((len(self.estimator.inputs), n, self.runs)).transpose(1, 2, 0)
        for k, name in self._columns.items():
            if name not in columns:
                wanted = f"a value for every input of {self.estimator.name}"
                raise self._error(0, 0, name, wanted, "none")
            values[:, :, k] = self._numbers(name, columns[name], (n, self.runs))
        new = ~np.isnan(values)
        if not new.all():
            self._fill(values, new)
        self._last = values[-1].copy()
        inputs = np.maximum(values, self._low)
        np.minimum(inputs, self._high, out=inputs)
        if (is_outside := inputs != values).any():
            self._check_range(values, is_outside)
        for k, sources in self._flags.items():
            declared = self.estimator.inputs[k]
            new[:, :, k] = new[:, :, sources].all(axis=2)
            inputs[:, :, k] = np.clip(new[:, :, k], declared.low, declared.high)
        self.rows += n
        return inputs, new

    def number(self, name: str, value: object, n: int = 1) -> FloatArray:
        """Values (n, runs) of another column of the next rows, NaN where a value is missing."""
        numbers = np.empty((n, self.runs))
        numbers[:] = self._numbers(name, value, (n, self.runs))
        if np.isinf(numbers).any():
            self._refuse_infinite(name, numbers)
        return numbers

    def _numbers(self, name: str, value: object, shape: tuple[int, int]) -> FloatArray:
        """A column as numbers that can be broadcast to a shape."""
        try:
            if value is not None:
                numbers = np.asarray(value, dtype=np.float64)
                if numbers.shape != shape[2 - numbers.ndim :]:  # else an assignment broadcasts
                    numbers = np.broadcast_to(numbers, shape)
                return numbers
        except (TypeError, ValueError, OverflowError):
            pass
        raise self._error(0, 0, name, "a number", type(value).__name__)

    def _fill(self, values: FloatArray, new: BoolArray) -> None:
        """Replace missing samples (NaN) as declared."""
        for k in np.flatnonzero(~new.all(axis=(0, 1))).tolist():
            declared, column = self.estimator.inputs[k], values[:, :, k]
            if declared.missing == "hold":
                samples = np.concatenate([self._last[None, :, k], column])
                rows = np.arange(len(samples))[:, None]
                last = np.maximum.accumulate(np.where(np.isnan(samples), 0, rows), axis=0)
                column[:] = np.take_along_axis(samples, last, axis=0)[1:]
            elif declared.missing is not None:
                column[~new[:, :, k]] = float(declared.missing)
            if (gap := np.isnan(column)).any():
                where = "" if declared.missing is None else " in the first row"
                advice = f", or declare Input({declared.name!r}, ..., missing=...)"
                if declared.missing:
                    advice = ", or declare missing=NUMBER, which needs no sample before it"
                fix = f"complete the log{advice}"
                raise self._error(*_first(gap), declared.name, f"a number{where}", "no value", fix)

    def _check_range(self, values: FloatArray, is_outside: BoolArray) -> None:
        """Count samples that are clamped; refuse those that must not be."""
        for k in np.flatnonzero(is_outside.any(axis=(0, 1))).tolist():
            declared, outside = self.estimator.inputs[k], is_outside[:, :, k]
            count = int(np.count_nonzero(outside))
            if np.isinf(values[:, :, k]).any():
                self._refuse_infinite(declared.name, values[:, :, k])
            if not declared.clamp:
                row, run = _first(outside)
                raise self._error(
                    row,
                    run,
                    declared.name,
                    "a time step dt of " * (declared.name == "dt")
                    + f"{declared.low:g} to {declared.high:g} {declared.unit}".rstrip()
                    + ", the declared range",
                    f"{values[row, run, k]:.6g}"
                    + (f", and {count - 1} more beyond it" if count > 1 else ""),
                    self._remedy(declared),
                )
            self.clamped[declared.name] = self.clamped.get(declared.name, 0) + count

    def _remedy(self, declared: Input) -> str:
        """What helps against values beyond the range."""
        text = "correct the unit in the header, or the range; "
        if declared.name == "dt":
            if self.estimator.restarts and declared.low <= RESTART_S:
                return f"{text}if it is a gap, --gaps restart restarts the filter there"
            text += "if it is a gap, run the rows before and after it by --to and --from; "
            return f"{text}clamp=True would clamp dt"
        return f"{text}clamp=True would clamp it"

    def _refuse_infinite(self, name: str, column: FloatArray) -> None:
        row, run = _first(np.isinf(column))
        raise self._error(row, run, name, "a finite number", "an infinite one")

    def _error(
        self, row: int, run: int, name: str, wanted: str, found: str, fix: str = "correct it"
    ) -> InputError:
        where = self.place(self.rows + row, run, name)
        return InputError.at(where, wanted=wanted, found=found, fix=self.fix or fix)


def _first(rows: BoolArray) -> tuple[int, int]:
    """Row and run of the first True of (n, runs)."""
    return divmod(int(np.argmax(rows)), int(rows.shape[1]))
