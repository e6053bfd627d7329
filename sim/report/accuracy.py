"""Outputs over a record and their errors: fixed point against float64, both against truth.

Every error is one of `sim.compare.difference`: nothing is computed a second time. Half turns are
shown in degrees.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.declarations import QUATERNION
from boresight.sim.compare.difference import Difference, Differences, differences
from boresight.sim.compare.results import CheckResult, Part, claim_lines
from boresight.sim.records.feed import Feed
from boresight.sim.rotations.accuracy import attitude_of
from boresight.sim.rotations.rotation import quaternion_to_euler

#: Outputs that are Euler angles, with their columns in `quaternion_to_euler`.
ANGLES = {"heading": 2, "pitch": 0, "roll": 1}
#: Points of a curve, at most.
BINS = 1000


def _number(x: float, digits: int = 6) -> float | None:
    return float(f"{x:.{digits}g}") if math.isfinite(x) else None


class _Bins:
    """A column of n rows, piece by piece, in at most `BINS` runs of equal length.

    Of each run its first, least and greatest finite value; NaN, later None, of one without any.
    """

    def __init__(self, n: int) -> None:
        self.size, self._rows = -(-n // BINS), 0
        self.first, self.low, self.high = (np.full(-(-n // self.size), np.nan) for _ in range(3))

    def add(self, x: FloatArray) -> None:
        """The next rows."""
        bins, finite = (self._rows + np.arange(len(x))) // self.size, np.isfinite(x)
        self._rows += len(x)
        bins, x = bins[finite], x[finite]
        held, where = np.unique(bins, return_index=True)
        self.first[held] = np.where(np.isnan(self.first[held]), x[where], self.first[held])
        np.fmin.at(self.low, bins, x)
        np.fmax.at(self.high, bins, x)


def _numbers(values: FloatArray) -> list[float | None]:
    return [_number(float(v), 5) for v in values]


def worst_output(outputs: Sequence[Mapping[str, Any]]) -> Mapping[str, Any]:
    """The output that uses most of its tolerance; those without one come last."""

    def tolerance_share(o: Mapping[str, Any]) -> tuple[bool, float]:
        largest = math.inf if o["max"] is None else float(o["max"])
        if o["tolerance"] is None:
            return False, largest
        return True, largest / o["tolerance"] if o["tolerance"] else largest * 1e300

    return max(outputs, key=tolerance_share)


def accuracy_section(checks: Sequence[CheckResult], warn: Callable[[str], None]) -> dict[str, Any]:
    """Figures of each check's record in ``logs``, with its curves; ``worst`` output of all.

    ``verdict`` of a record has the differences to float64 by output, ``truth`` those of both to the
    record's truths, which may be a comparison (``reference``).
    """
    logs = [_log(check, warn) for check in checks]
    outputs = [{**o, "log": log["dataset"]} for log in logs for o in log["verdict"]["outputs"]]
    return {"worst": worst_output(outputs), "logs": logs}


def _log(check: CheckResult, warn: Callable[[str], None]) -> dict[str, Any]:
    """Figures and curves of one record."""
    columns, rows = check.given, _Rows(check)
    name = columns.record.name
    for part in check.parts():
        rows.add(part)
    if QUATERNION[0] in check.fixed.outputs and not rows.references:
        warn(f"accuracy: {name} has no attitude to compare with")
    for line in columns.warnings:
        warn(line)
    return {
        "dataset": name,
        "samples": rows.count,
        "seconds": None if columns.t is None else _number(rows.last),
        "word": check.build.word,
        "reference": None if not rows.references else "comparison" if check.comparison else "truth",
        "truth": rows.against_truth(),
        "verdict": check.accuracy.to_json(),
        "stated_ranges": claim_lines(check.claims),
        "series": rows.series(),
    }


class _Rows:
    """All rows of a check, piece by piece.

    ``count`` are the rows so far, ``last`` is the time of the last one from the first one on
    (without times its number), ``times`` are those of the rows in which an output is first beyond
    its tolerance, ``references`` the outputs with a truth.
    """

    def __init__(self, check: CheckResult) -> None:
        self.check, self.count, self.last = check, 0, 0.0
        self.references = tuple(_truths(check, check.given))
        self.times = dict.fromkeys(
            (d.first_beyond for d in check.accuracy.differences if d.first_beyond is not None), 0.0
        )
        self._outputs = check.build.estimators[check.number].outputs
        self._truths = [Differences(self._outputs, self.references, judged=False) for _ in range(2)]
        self._bins: dict[tuple[str, str], _Bins] = defaultdict(lambda: _Bins(check.rows))
        self._origin = 0.0

    def add(self, part: Part) -> None:
        """The next rows."""
        columns, n = part.given, len(part.given)
        start, self.count = self.count, self.count + n
        if columns.t is None:
            t = np.arange(float(start), float(start + n))
        else:
            self._origin = self._origin if start else columns.t[0]
            t = columns.t - self._origin
        self.last = float(t[-1])
        self.times |= {k: float(t[k - start]) for k in self.times if start <= k < start + n}
        self._bins["t", ""].add(t)
        truths = _truths(self.check, columns)
        for errors, run in zip(self._truths, part[1:], strict=True):
            errors.add(run.outputs, truths)
        deviations = differences(self._outputs, part.fixed.outputs, part.floating.outputs)
        for d, own in zip(self.check.accuracy.differences, deviations, strict=True):
            scale = 180.0 if d.unit == "ht" else 1.0
            curves = {"fixed": part.fixed.outputs, "truth": truths, "error": {d.output: own.apart}}
            for curve, values in curves.items():
                if d.output in values:
                    self._bins[curve, d.output].add(scale * values[d.output])

    def against_truth(self) -> list[dict[str, Any]]:
        """Fixed point and float64 against truth, output by output."""
        return [
            {**fixed.to_json(), **{f"float_{n}": floating.to_json()[n] for n in ("max", "rms")}}
            for fixed, floating in zip(*(x.result() for x in self._truths), strict=True)
        ]

    def series(self) -> dict[str, Any]:
        """Every output: values, truth, error against float64, tolerance.

        Where a point stands for several samples ``fixed`` and ``truth`` are the first of them, and
        ``low`` and ``high`` the least and the greatest of fixed point. ``beyond_from`` is when the
        error first exceeds the tolerance.
        """
        units = {o.name: o.unit for o in self._outputs}
        bins, size = self._bins, self._bins["t", ""].size

        def curve(d: Difference) -> dict[str, Any]:
            name, first = d.output, d.first_beyond
            unit = "deg" if d.unit == "ht" else units.get(name, d.unit)
            fixed, truth = bins.get(("fixed", name)), bins.get(("truth", name))
            ends = {} if fixed is None or size == 1 else {"low": fixed.low, "high": fixed.high}
            return {
                "unit": unit,
                "fixed": None if fixed is None else _numbers(fixed.first),
                **{end: _numbers(values) for end, values in ends.items()},
                "truth": None if truth is None else _numbers(truth.first),
                "error": _numbers(bins["error", name].high),
                "tolerance": (180.0 if d.unit == "ht" else 1.0) * (d.tolerance or 0.0) or None,
                "beyond_from": None if first is None else _number(self.times[first]),
            }

        return {
            "samples_per_point": size,
            "t": _numbers(bins["t", ""].first),
            "outputs": {d.output: curve(d) for d in self.check.accuracy.differences},
        }


def _truths(check: CheckResult, columns: Feed) -> dict[str, FloatArray]:
    """Truth of each output, in its unit; that of Euler angles may follow from the quaternion."""
    truths = dict(columns.truth)
    units = {o.name: o.unit for o in check.build.estimators[check.number].outputs}
    if all(name in truths for name in QUATERNION):
        q = attitude_of(truths)
        is_known = np.isfinite(q).all(axis=1)
        euler = np.full((len(q), 3), np.nan)
        euler[is_known] = quaternion_to_euler(q[is_known]) / np.pi
        for name, column in ANGLES.items():
            if units.get(name) == "ht":
                truths.setdefault(name, euler[:, column])
    return truths
