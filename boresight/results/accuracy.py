"""What `boresight accuracy` found: error from truth and from float64, and how it is told."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

from boresight.sim.answer import Answer
from boresight.sim.compare.difference import ATTITUDE

__all__ = ["AccuracyLog", "AccuracyNear", "AccuracyResult", "AccuracyRow", "AccuracyTrial"]

#: Root mean square errors by output, of an attitude by angle in degrees; None: no number.
Figures: TypeAlias = Mapping[str, float | None]


@dataclass(frozen=True)
class AccuracyLog:
    """A log.

    ``reference`` is "truth", "comparison" (another device's estimate) or the name of a published
    filter that stands in; ``rate_hz`` is the median, None where nothing tells the time.
    """

    trial: str
    samples: int
    rate_hz: float | None
    reference: str
    folder: str


@dataclass(frozen=True)
class AccuracyNear:
    """Fixed point against float64 over all logs: the largest difference, of words how many."""

    output: str
    unit: str
    apart: float | None
    tolerance: float | None
    good: bool


@dataclass(frozen=True)
class AccuracyTrial:
    """One estimator on one log: its errors, and how far fixed point is from float64."""

    trial: str
    error: Figures
    vs_float: Figures
    saturated_updates: int | None


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
        Errors, mean over the logs with truth; None if there is none.
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
    """

    source: str
    word: int
    good: bool
    logs: tuple[AccuracyLog, ...]
    left_out: tuple[str, ...]
    parameters: Mapping[str, Mapping[str, float]]
    estimators: tuple[AccuracyRow, ...]

    def __str__(self) -> str:
        """Attitude filters side by side, ours in fixed point with float beside; others each."""
        floating = {r.estimator: r for r in self.estimators if r.level == "float"}
        rows = [r for r in self.estimators if r.level != "float"]
        lines: list[str] = []
        if attitude := [r for r in rows if r.attitude]:
            lines += _attitudes(self, attitude, floating)
        for row in rows:
            if not row.attitude:
                lines += ["", *_outputs(self, row, floating.get(row.estimator))]
        if self.left_out:
            lines += ["", "left out, no reference: " + ", ".join(self.left_out)]
        return "\n".join(lines).strip("\n")


def _deg(value: float | None, width: int = 7, digits: int = 2) -> str:
    return f"{'-':>{width}s}" if value is None else f"{value:{width}.{digits}f}"


def _short(value: float | None, width: int) -> str:
    return f"{'-' if value is None else f'{value:.4g}':>{width}s}"


def _count(value: float | None, width: int) -> str:
    return f"{'-' if value is None else f'{value:,.0f}':>{width}s}"


def _outputs(data: AccuracyResult, row: AccuracyRow, floating: AccuracyRow | None) -> list[str]:
    """One estimator, output by output."""
    mean, other = row.mean or {}, (floating.mean if floating else None) or {}
    near = {d.output: d for d in row.vs_float}
    trials = sum(log.reference == "truth" for log in data.logs)
    lines = [
        f"{row.estimator}, W = {data.word}: root mean square error against truth, mean over "
        f"{trials} log{'s' if trials != 1 else ''}; over every sample the",
        f"largest difference of fixed point and float64; updates that saturated: "
        f"{row.saturated_updates:,}",
        f"  {'':20s}{'error':>10s}{'in float64':>12s}{'fixed-float':>13s}{'accepted':>11s}",
    ]
    for name in [*row.units, *(n for n in near if n not in row.units)]:
        d = near.get(name)
        unit = row.units.get(name) or (d.unit if d else "")
        line = f"  {f'{name} {unit}':20s}{_short(mean.get(name), 10)}{_short(other.get(name), 12)}"
        if d is not None:
            line += f"{_short(d.apart, 13)}{_short(d.tolerance, 11)}"
            line += "" if d.good else "  BEYOND"
        lines.append(line)
    for trial in row.trials if len(row.trials) > 1 else ():
        found = ", ".join(f"{n} {_short(x, 0)}" for n, x in trial.error.items())
        lines.append(f"  {trial.trial}: {found or 'no truth'}")
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


def _total(row: AccuracyRow, trial: str) -> float | None:
    return next(t for t in row.trials if t.trial == trial).error.get("total")


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
    beyond = [
        f"{r.estimator}, {d.output}: {d.apart:.4g} {d.unit} from float64, BEYOND {d.tolerance:.3g}"
        for r in rows
        for d in r.vs_float
        if not d.good and d.apart is not None
    ]
    return lines + (["", *beyond] if beyond else [])
