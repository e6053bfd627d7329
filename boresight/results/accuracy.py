"""Result of `boresight accuracy`: errors from truth and from float64, and its text."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from typing import ClassVar, TypeAlias

import numpy as np

from boresight.model.declarations import ATTITUDE, QUATERNION
from boresight.model.estimator import Estimator
from boresight.sim.accuracy.benchmark import Result
from boresight.sim.accuracy.figures import ANGLES
from boresight.sim.accuracy.peers import PEERS
from boresight.sim.accuracy.trials import Trial
from boresight.sim.accuracy.tuning import means
from boresight.sim.answer import Answer, Figure
from boresight.sim.compare.difference import Difference
from boresight.sim.report.accuracy import ANGLES as EULER

__all__ = ["AccuracyLog", "AccuracyNear", "AccuracyResult", "AccuracyRow", "AccuracyTrial"]

#: Root mean square errors by output, of an attitude by angle in degrees; None: no number.
Figures: TypeAlias = Mapping[str, float | None]

_METHOD = ", of attitudes in degrees by the method of the BROAD benchmark (doi 10.3390/data6070072)"


def source_of(*, attitudes: bool) -> str:
    """How errors are measured, of attitudes or without any."""
    return (
        f"root mean square error against truth{_METHOD * attitudes}, over the samples that count; "
        "means over the trials with truth; fixed point is the emitted C, whose words are the core's"
    )


@dataclass(frozen=True)
class AccuracyLog:
    """A log.

    ``reference`` is "truth", "comparison" (another device's estimate) or the name of a published
    filter that stands in; ``rate_hz`` is the median, of a long file over the first 65,536 rows,
    None where nothing tells the time.
    """

    trial: str
    samples: int
    rate_hz: float | None
    reference: str
    folder: str

    @classmethod
    def of(cls, trial: Trial) -> AccuracyLog:
        """The log of a trial."""
        first = trial.log.first
        timed = {"t", "dt"} & set(first.columns)
        return cls(
            trial=trial.name,
            samples=len(trial.log),
            rate_hz=round(1.0 / float(np.median(first.steps())), 3) if timed else None,
            reference=trial.reference,
            folder=trial.folder,
        )


@dataclass(frozen=True)
class AccuracyNear:
    """Fixed point against float64 over all logs: the largest difference, of words how many."""

    output: str
    unit: str
    apart: float | None
    tolerance: float | None
    good: bool

    @classmethod
    def of(cls, several: Sequence[Difference]) -> AccuracyNear:
        """The differences of one output over all logs."""
        first, differences = several[0], [_apart(d) for d in several]
        return cls(
            output=first.output,
            unit=first.unit,
            apart=_number(sum(differences) if first.unit == "words" else max(differences)),
            tolerance=first.tolerance,
            good=all(d.good for d in several),
        )


@dataclass(frozen=True)
class AccuracyTrial:
    """One estimator on one log: its errors, and how far fixed point is from float64.

    ``offset_deg``: the constant turn that was taken out of its attitude (``align``), a rotation
    vector about east, north and up; empty without.
    """

    trial: str
    error: Figures
    vs_float: Figures
    saturated_updates: int | None
    offset_deg: tuple[float, ...] = ()

    @classmethod
    def of(cls, result: Result) -> AccuracyTrial:
        """A result as plain numbers."""
        near = {d.output: _number(_apart(d)) for d in result.near}
        errors = _plain(result.errors)
        return cls(result.trial, errors, near, result.saturated, result.offset_deg)


@dataclass(frozen=True)
class AccuracyRow:
    """One estimator at one level.

    Attributes
    ----------
    estimator, level, kind, summary : str
        ``level`` is "fixed", "float" or, of a published filter, "package"; ``kind`` "ours" or
        "peer".
    attitude : bool
        Its errors are ``total``, ``heading`` and ``inclination``.
    units : mapping of str to str
        Of the errors.
    mean : mapping of str to float, or None
        Errors, mean over the logs with truth; None without any.
    mean_by_folder : mapping of str to such
    vs_float : tuple of AccuracyNear
    saturated_updates : int or None
        None where nothing can saturate.
    seconds : float
        That it took.
    trials : tuple of AccuracyTrial
    """

    estimator: str
    level: str
    kind: str
    summary: str
    attitude: bool
    units: Mapping[str, str]
    mean: Figures | None
    mean_by_folder: Mapping[str, Figures | None]
    vs_float: tuple[AccuracyNear, ...]
    saturated_updates: int | None
    seconds: float
    trials: tuple[AccuracyTrial, ...] = field(repr=False)

    @classmethod
    def of(cls, results: Sequence[Result], summary: str, folders: Mapping[str, str]) -> AccuracyRow:
        """One estimator at one level; ``folders`` of the trials with truth, which means are of."""
        first, units = results[0], {n: u for r in results for n, u in r.units.items()}
        saturated = [r.saturated for r in results if r.saturated is not None]
        named: dict[str, list[str]] = {}
        for trial, folder in folders.items():
            named.setdefault(folder, []).append(trial)
        return cls(
            estimator=first.estimator,
            level=first.level,
            kind="peer" if first.level == "package" else "ours",
            summary=summary,
            attitude=ANGLES[0] in units,
            units=units,
            mean=_mean(results, folders),
            mean_by_folder={folder: _mean(results, names) for folder, names in named.items()},
            vs_float=tuple(map(AccuracyNear.of, zip(*(r.near for r in results), strict=True))),
            saturated_updates=sum(saturated) if saturated else None,
            seconds=round(sum(r.seconds for r in results), 3),
            trials=tuple(map(AccuracyTrial.of, results)),
        )


@dataclass(frozen=True)
class AccuracyResult(Answer):
    """What `boresight.accuracy` gives; ``accuracy.json`` holds it.

    Attributes
    ----------
    source : str
        How errors are measured.
    word : int
        Word width, bits.
    good : bool
        Fixed point is as near to float64 as accepted.
    logs : tuple of AccuracyLog
    left_out : tuple of str
        Logs without reference.
    parameters : mapping of str to mapping
        Values other than the defaults, by estimator.
    estimators : tuple of AccuracyRow
        Each estimator at each level.
    align : str
        Constant offset that was taken out of attitudes: none, heading or full.
    declination_deg : float
        By which references were turned to magnetic north.
    """

    judged: ClassVar[Mapping[str, Figure]] = {
        "word": Figure("word", "same"),
        "good": Figure("good", "count", falls=True),
        "estimators.*.mean.*": Figure("error against truth", "error"),
        "estimators.*.trials.*.error.*": Figure("error against truth", "error"),
        "estimators.*.vs_float.*.apart": Figure("fixed-float", "error"),
        "estimators.*.saturated_updates": Figure("updates that saturated", "count"),
    }

    source: str
    word: int
    good: bool
    logs: tuple[AccuracyLog, ...]
    left_out: tuple[str, ...]
    parameters: Mapping[str, Mapping[str, float]]
    estimators: tuple[AccuracyRow, ...]
    align: str = "none"
    declination_deg: float = 0.0

    @classmethod
    def of(
        cls,
        estimators: Sequence[Estimator],
        trials: Sequence[Trial],
        results: Sequence[Result],
        left_out: Sequence[str],
        params: Mapping[str, Mapping[str, float]],
        word: int,
        align: str,
        declination_deg: float,
    ) -> AccuracyResult:
        """Tables of a benchmark's results."""
        folders = {t.name: t.folder for t in trials if t.reference == "truth"}
        summaries = {name: peer.summary for name, peer in PEERS.items()}
        summaries |= {e.name: e.summary for e in estimators}
        groups = groupby(results, key=lambda r: (r.estimator, r.level))
        rows = tuple(AccuracyRow.of([*of], summaries[name], folders) for (name, _), of in groups)
        return cls(
            source=source_of(attitudes=any(row.attitude for row in rows)),
            word=word,
            good=all(d.good for row in rows for d in row.vs_float),
            logs=tuple(map(AccuracyLog.of, trials)),
            left_out=tuple(left_out),
            parameters={name: dict(values) for name, values in params.items()},
            estimators=rows,
            align=align,
            declination_deg=declination_deg,
        )

    def __str__(self) -> str:
        """Attitude filters side by side, ours in fixed point with float beside; others each."""
        floating = {r.estimator: r for r in self.estimators if r.level == "float"}
        rows = [r for r in self.estimators if r.level != "float"]
        lines: list[str] = []
        if attitude := [r for r in rows if r.attitude]:
            lines += _attitudes(self, attitude, floating)
        for row in rows:
            if names := _own_outputs(row):
                lines += ["", *_outputs(self, row, names, floating.get(row.estimator))]
        if self.left_out:
            lines += ["", "left out, no reference: " + ", ".join(self.left_out)]
        return "\n".join(lines).strip("\n")


def _number(x: float) -> float | None:
    return float(x) if np.isfinite(x) else None


def _plain(figures: Mapping[str, float]) -> dict[str, float | None]:
    return {n: _number(v) for n, v in figures.items()}


def _mean(results: Sequence[Result], trials: Collection[str]) -> dict[str, float | None] | None:
    """Plain mean over some trials; None of no trials."""
    averages = means([r.errors for r in results if r.trial in trials])
    return _plain(averages) if averages else None


def _apart(d: Difference) -> float:
    """Largest difference; of words how many differ."""
    return float(round(d.rms**2 * d.samples)) if d.unit == "words" else d.largest


def _deg(value: float | None, width: int = 7, digits: int = 2) -> str:
    return f"{'-':>{width}s}" if value is None else f"{value:{width}.{digits}f}"


def _short(value: float | None, width: int) -> str:
    return f"{'-' if value is None else f'{value:.4g}':>{width}s}"


def _count(value: float | None, width: int) -> str:
    return f"{'-' if value is None else f'{value:,.0f}':>{width}s}"


def _own_outputs(row: AccuracyRow) -> list[str]:
    """Outputs of an estimator that the table of attitudes does not show."""
    names = dict.fromkeys((*row.units, *(d.output for d in row.vs_float)))
    shown = {*ANGLES, *EULER, *QUATERNION, ATTITUDE, "status"} if row.attitude else set()
    return [name for name in names if name not in shown]


def _outputs(
    data: AccuracyResult, row: AccuracyRow, names: Sequence[str], floating: AccuracyRow | None
) -> list[str]:
    """One estimator, output by output."""
    mean, other = row.mean or {}, (floating.mean if floating else None) or {}
    near = {d.output: d for d in row.vs_float}
    trials = sum(log.reference == "truth" for log in data.logs)
    lines = [
        f"{row.estimator}, W = {data.word}: root mean square error against truth, mean over "
        f"{trials} log{'s' if trials != 1 else ''}; over every sample the",
        f"largest difference of fixed point and float64; updates that saturated: "
        f"{_count(row.saturated_updates, 0)}",
        f"  {'':20s}{'error':>10s}{'in float64':>12s}{'fixed-float':>13s}{'accepted':>11s}",
    ]
    for name in names:
        d = near.get(name)
        unit = row.units.get(name) or (d.unit if d else "")
        line = f"  {f'{name} {unit}':20s}{_short(mean.get(name), 10)}{_short(other.get(name), 12)}"
        if d is not None:
            line += f"{_short(d.apart, 13)}{_short(d.tolerance, 11)}"
            line += "" if d.good else "  BEYOND"
        lines.append(line)
    for trial in row.trials if len(row.trials) > 1 else ():
        listing = ", ".join(f"{n} {_short(x, 0)}" for n, x in trial.error.items() if n in names)
        lines.append(f"  {trial.trial}: {listing or 'no truth'}")
    return lines


def _table(
    rows: Sequence[AccuracyRow],
    names: Sequence[str],
    title: str,
    figure: Callable[[AccuracyRow, str], float | None],
    reference: str = "",
) -> list[str]:
    """Trials (or folders) down, estimators across: one figure of each but the reference."""
    width = max(len(n) for n in names)
    lines = [
        "",
        title,
        f"  {'':{width}s}" + "".join(f"{f'[{k + 1}]':>7s}" for k in range(len(rows))),
    ]
    return lines + [
        f"  {name:{width}s}"
        + "".join(_deg(None if row.estimator == reference else figure(row, name)) for row in rows)
        for name in names
    ]


def _of(row: AccuracyRow, trial: str) -> AccuracyTrial:
    return next(t for t in row.trials if t.trial == trial)


def _total(row: AccuracyRow, trial: str) -> float | None:
    return _of(row, trial).error.get("total")


def _offset(row: AccuracyRow, trial: str) -> float | None:
    """Length of the offset of a trial; about the vertical alone with its sign."""
    offset = _of(row, trial).offset_deg
    return (sum(offset) if not any(offset[:2]) else math.hypot(*offset)) if offset else None


def _folder_total(row: AccuracyRow, folder: str) -> float | None:
    return (row.mean_by_folder[folder] or {}).get("total")


def _attitudes(
    data: AccuracyResult, rows: Sequence[AccuracyRow], floating: Mapping[str, AccuracyRow]
) -> list[str]:
    """Every attitude filter in one table, then trial by trial."""
    by_kind: dict[str, list[str]] = {}
    for log in data.logs:
        by_kind.setdefault(log.reference, []).append(log.trial)
    truth = by_kind.pop("truth", [])
    width = max(len(r.estimator) for r in rows)
    lines = [
        f"RMSE in degrees, mean over {len(truth)} trial{'s' if len(truth) != 1 else ''} with "
        f"truth. Ours: fixed point, W = {data.word};",
        "float64 beside it, and over every sample of all logs the largest angle between the two,",
        "samples whose status words differ, updates that saturated.",
        f"  {'':{width + 5}s}{'total':>7s}{'heading':>9s}{'inclin.':>9s}"
        f"{'float total':>13s}{'fixed-float':>13s}{'status':>9s}{'saturated':>11s}",
    ]
    for k, row in enumerate(rows):
        mean = row.mean or {}
        line = (
            f"  {f'[{k + 1}]':>4s} {row.estimator:{width}s}"
            + _deg(mean.get("total"))
            + _deg(mean.get("heading"), 9)
            + _deg(mean.get("inclination"), 9)
        )
        if row.kind == "ours":
            other = (twin.mean if (twin := floating.get(row.estimator)) else None) or {}
            near = {d.output: d.apart for d in row.vs_float}
            line += (
                _deg(other.get("total"), 13)
                + _deg(near.get(ATTITUDE), 13, 6)
                + _count(near.get("status"), 9)
                + _count(row.saturated_updates, 11)
            )
        lines.append(line)
    folders = list(rows[0].mean_by_folder)
    if len(folders) > 1:
        lines += _table(rows, folders, "Total RMSE, mean by folder, degrees", _folder_total)
    if truth:
        lines += _table(rows, truth, "Total RMSE by trial, degrees", _total)
    for kind, names in by_kind.items():
        lines += _table(
            rows,
            names,
            "Not truth, outside the means: against the log's comparison"
            if kind == "comparison"
            else f"No reference, outside the means: difference to {kind}",
            _total,
            kind,
        )
    if data.align != "none":
        what = {"heading": "heading, counter-clockwise", "full": "angle"}[data.align]
        title = f"Constant offset taken out of each log, degrees ({what})"
        lines += _table(rows, [log.trial for log in data.logs], title, _offset)
    if data.declination_deg:
        lines += ["", f"references turned to magnetic north, {data.declination_deg:g} deg east"]
    beyond = [
        f"{r.estimator}, {d.output}: {d.apart:.4g} {d.unit} from float64, BEYOND {d.tolerance:.3g}"
        for r in rows
        for d in r.vs_float
        if not d.good and d.apart is not None
    ]
    return lines + (["", *beyond] if beyond else [])
