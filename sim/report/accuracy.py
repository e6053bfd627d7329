"""Outputs over a record and their errors: fixed point against float64, both against truth.

Every error is one of `sim.compare.difference`: nothing is computed a second time. Half turns are
shown in degrees.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.model.declarations import QUATERNION
from boresight.sim.attitude.accuracy import attitude_error, attitude_rmse
from boresight.sim.attitude.outputs import attitude_of
from boresight.sim.attitude.rotation import quaternion_to_euler
from boresight.sim.compare.difference import ATTITUDE, Difference, differences
from boresight.sim.compare.results import CheckResult

__all__ = ["ANGLES", "BINS", "accuracy_section", "worst_output"]

FloatArray = npt.NDArray[np.float64]

#: Outputs that are Euler angles, with their columns in `quaternion_to_euler`.
ANGLES = {"heading": 2, "pitch": 0, "roll": 1}
#: Points of a curve, at most.
BINS = 1000


def _number(x: float, digits: int = 6) -> float | None:
    return float(f"{x:.{digits}g}") if math.isfinite(x) else None


class _Bins:
    """Cuts n samples into at most `BINS` runs of equal length."""

    def __init__(self, n: int) -> None:
        self.size = -(-n // BINS)
        self.starts = np.arange(0, n, self.size)

    def first(self, x: FloatArray) -> list[float | None]:
        """First finite value of each run, None if there is none."""
        out = []
        for start in self.starts:
            part = x[start : start + self.size]
            good = part[np.isfinite(part)]
            out.append(_number(float(good[0]), 5) if len(good) else None)
        return out

    def largest(self, x: FloatArray) -> list[float | None]:
        """Largest value of each run, None if it has none."""
        lowest = np.where(np.isfinite(x), x, -np.inf)
        return [_number(float(v), 5) for v in np.maximum.reduceat(lowest, self.starts)]


def worst_output(outputs: Sequence[Mapping[str, Any]]) -> Mapping[str, Any]:
    """The output that uses most of its tolerance; those without one come last."""

    def used(o: Mapping[str, Any]) -> tuple[bool, float]:
        largest = math.inf if o["max"] is None else float(o["max"])
        if o["tolerance"] is None:
            return False, largest
        return True, largest / o["tolerance"] if o["tolerance"] else largest * 1e300

    return max(outputs, key=used)


def accuracy_section(
    checks: Sequence[CheckResult], warn: Callable[[str], None], *, truth: bool
) -> dict[str, Any]:
    """Figures of each check's record in ``logs``, with its curves; above them those of the worst.

    ``verdict`` has the differences to float64 by output, above all the largest of any record;
    ``parted`` where the first of them leaves its tolerance; ``truth`` those of both to the record's
    truths. ``vs_float_max_deg`` is the largest difference of an Euler angle in any sample,
    ``vs_float_attitude_max_deg`` the largest turn between the two attitudes, ``rmse_deg`` is taken
    against the record's attitude, which is the truth or a comparison (``reference``): null for what
    is no attitude.
    """
    keys = (
        *("dataset", "samples", "seconds", "word", "reference", "truth", "vs_float_max_deg"),
        *("vs_float_max_sample", "vs_float_attitude_max_deg", "rmse_deg", "float_rmse_deg"),
    )
    if not checks:
        warn("accuracy: no log was run")
        return {**dict.fromkeys(keys), "verdict": None, "logs": []}
    logs = [_log(check, warn, truth=truth, named=len(checks) > 1) for check in checks]
    verdicts = [log["verdict"] for log in logs]
    worst = worst_output([{**worst_output(v["outputs"]), "log": k} for k, v in enumerate(verdicts)])
    return {
        **{k: logs[worst["log"]][k] for k in keys},
        "verdict": verdicts[0] if len(logs) == 1 else _merged(logs),
        "logs": logs,
    }


def _merged(logs: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """One verdict of several logs: the worst of each output, and everything that went wrong."""
    verdicts = [log["verdict"] for log in logs]
    named = [(log["dataset"], v) for log, v in zip(logs, verdicts, strict=True)]
    by_output = zip(*([{**o, "log": name} for o in v["outputs"]] for name, v in named), strict=True)

    def counts(key: str) -> dict[str, int]:
        return dict(sum((Counter(v[key]) for v in verdicts), Counter[str]()))

    return {
        "good": all(v["good"] for v in verdicts),
        "outputs": [dict(worst_output(same)) for same in by_output],
        "saturated_updates": sum(v["saturated_updates"] for v in verdicts),
        "saturated": counts("saturated"),
        "beyond_range": [f"{name}: {text}" for name, v in named for text in v["beyond_range"]],
        "clamped_inputs": counts("clamped_inputs"),
        "culprit": next((f"{name}: {v['culprit']}" for name, v in named if v["culprit"]), ""),
        "source": verdicts[0]["source"],
    }


def _log(
    check: CheckResult, warn: Callable[[str], None], *, truth: bool, named: bool
) -> dict[str, Any]:
    """Figures and curves of one record; ``named``: warnings tell which."""
    columns = check.given
    t = np.arange(float(len(columns))) if columns.t is None else columns.t - columns.t[0]
    known = _truths(check)
    data = {
        "dataset": columns.record.name,
        "samples": len(columns),
        "seconds": None if columns.t is None else _number(float(t[-1])),
        "word": check.build.word,
        "reference": None if not known else "truth" if truth else "comparison",
        "truth": _against_truth(check, known),
        "verdict": check.accuracy.to_json(),
        "parted": _parted(check, t),
        **_attitude(check),
    }
    bins = _Bins(len(columns))
    series = {
        "samples_per_point": bins.size,
        "t": bins.first(t),
        "outputs": _curves(check, known, bins, t),
        "vs_log_deg": _vs_log(check, bins),
    }
    if QUATERNION[0] in check.fixed.outputs and not known:
        warn(f"accuracy: {columns.record.name} has no attitude to compare with")
    where = f"accuracy, {columns.record.name}" if named else "accuracy"
    for line in check.accuracy.faults():
        warn(f"{where}: {line}")
    for line in columns.warnings:
        warn(line)
    return {**data, "series": series}


def _parted(check: CheckResult, t: FloatArray) -> dict[str, Any] | None:
    """The first sample in which an output is beyond its tolerance, and the first wrong value."""
    beyond = [
        (d.first_beyond, d.output) for d in check.accuracy.differences if d.first_beyond is not None
    ]
    if not beyond:
        return None
    step = min(beyond)[0]
    return {
        "sample": step,
        "t": _number(float(t[step])),
        "outputs": [output for first, output in beyond if first == step],
        "culprit": check.accuracy.culprit,
    }


def _truths(check: CheckResult) -> dict[str, FloatArray]:
    """Truth of each output, in its unit; that of Euler angles may follow from the quaternion."""
    known = dict(check.given.truth)
    units = {o.name: o.unit for o in check.build.estimators[check.number].outputs}
    if all(name in known for name in QUATERNION):
        q = attitude_of(known)
        there = np.isfinite(q).all(axis=1)
        euler = np.full((len(q), 3), np.nan)
        euler[there] = quaternion_to_euler(q[there]) / np.pi
        for name, column in ANGLES.items():
            if units.get(name) == "ht":
                known.setdefault(name, euler[:, column])
    return known


def _against_truth(check: CheckResult, known: Mapping[str, FloatArray]) -> list[dict[str, Any]]:
    """Fixed point and float64 against truth, output by output."""
    outputs = check.build.estimators[check.number].outputs
    both = (
        differences(outputs, run.outputs, known, judged=False)
        for run in (check.fixed, check.floating)
    )
    return [
        {**fixed.to_json(), "float_max": floating.to_json()["max"],
         "float_rms": floating.to_json()["rms"]}
        for fixed, floating in zip(*both, strict=True)
    ]  # fmt: skip


def _attitude(check: CheckResult) -> dict[str, Any]:
    """What is said of an attitude besides."""
    by_name = {d.output: d for d in check.accuracy.differences}
    angles = [by_name[a] for a in ANGLES if a in by_name and by_name[a].unit == "ht"]
    worst = max(angles, key=lambda d: d.largest, default=None)
    out: dict[str, Any] = {
        "vs_float_max_deg": None if worst is None else _number(180.0 * worst.largest),
        "vs_float_max_sample": None if worst is None else worst.at_step,
        "vs_float_attitude_max_deg": _number(by_name[ATTITUDE].largest)
        if ATTITUDE in by_name
        else None,
        "rmse_deg": None,
        "float_rmse_deg": None,
    }
    q, counts = _reference(check), check.given.counts
    if q is not None and (np.isfinite(q).all(axis=1) & counts).any():
        for key, run in (("rmse_deg", check.fixed), ("float_rmse_deg", check.floating)):
            rmse = attitude_rmse(attitude_of(run.outputs), q, counts)
            out[key] = {k: _number(v) for k, v in rmse._asdict().items()}
    return out


def _reference(check: CheckResult) -> FloatArray | None:
    """The record's attitude (n, 4)."""
    there = all(name in check.given.truth for name in QUATERNION)
    return attitude_of(check.given.truth) if there else None


def _vs_log(check: CheckResult, bins: _Bins) -> dict[str, Any] | None:
    """Heading and inclination against the record's attitude."""
    q = _reference(check)
    if q is None:
        return None
    error = attitude_error(attitude_of(check.fixed.outputs), q)
    return {name: bins.largest(getattr(error, name)) for name in ("heading", "inclination")}


def _curves(
    check: CheckResult, known: Mapping[str, FloatArray], bins: _Bins, t: FloatArray
) -> dict[str, dict[str, Any]]:
    """Every output, and the attitude: values, truth, error against float64, tolerance.

    ``beyond_from`` is when the error first exceeds that.
    """
    units = {o.name: o.unit for o in check.build.estimators[check.number].outputs}

    def curve(d: Difference) -> dict[str, Any]:
        scale = 180.0 if d.unit == "ht" else 1.0
        first = d.first_beyond
        fixed, right = check.fixed.outputs.get(d.output), known.get(d.output)
        return {
            "unit": "deg" if d.unit == "ht" else units.get(d.output, d.unit),
            "fixed": None if fixed is None else bins.first(scale * fixed),
            "truth": None if right is None else bins.first(scale * right),
            "error": bins.largest(scale * d.apart),
            "tolerance": None if not d.tolerance else scale * d.tolerance,
            "beyond_from": None if first is None else _number(float(t[first])),
        }

    return {d.output: curve(d) for d in check.accuracy.differences}
