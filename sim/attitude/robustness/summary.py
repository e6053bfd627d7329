"""Runs of a protocol put together: means by group of cases, ratios to the rival, the worst."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from boresight.sim.accuracy.figures import ANGLES
from boresight.sim.attitude.robustness.plan import Case
from boresight.sim.attitude.robustness.runs import SETTLED_DEG

__all__ = ["RIVAL", "SMALL_DEG", "WORSE", "summary", "text"]

#: The published filter that others are measured by, where it runs.
RIVAL = "vqf_online"
#: Ratio to the rival from which on a single run is listed.
WORSE = 1.15
#: A ratio to the rival on one trial is left out where both are below this, degrees.
SMALL_DEG = 0.5
#: Suffix of the name of a filter in float64.
FLOAT = " float64"

Row = Mapping[str, Any]


def label(row: Row) -> str:
    """Name of a filter at a level."""
    return str(row["estimator"]) + (FLOAT if row["level"] == "float" else "")


def summary(cases: Sequence[Case], runs: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Plain data of all runs.

    ``filters``: labels, in order. ``groups``: for each group of cases ``rows`` by label, with the
    mean of every figure over trials and cases, the median time to settle with the share that never
    did, the ratio of means to `RIVAL` and the worst single one. ``trials``: mean of the judged
    figure by trial, group and label. ``fixed``: how far fixed point is from float64. ``refused``:
    filters without figures of some runs, of how many, and why of the first.
    """
    judged = {case.group: case.judged for case in cases}
    group_of = {case.name: case.group for case in cases}
    filters = list(dict.fromkeys(label(row) for run in runs for row in run["rows"]))
    groups = []
    for group, figure in judged.items():
        group_runs = [run for run in runs if group_of[run["case"]] == group]
        table = [{label(row): row for row in run["rows"]} for run in group_runs]
        rows = {name: _row([t[name] for t in table]) for name in filters}
        for name in filters:
            if RIVAL in filters and name != RIVAL and not name.endswith(FLOAT):
                rows[name] |= _against(group_runs, table, name, figure)
        groups.append({"group": group, "judged": figure, "runs": len(group_runs), "rows": rows})
    return {
        "filters": filters,
        "rival": RIVAL if RIVAL in filters else None,
        "groups": groups,
        "trials": _by_trial(runs, group_of, judged, filters),
        "fixed": _fixed(runs),
        "refused": _refused(runs, filters),
    }


def _mean(values: Iterable[float | None]) -> float | None:
    numbers = [v for v in values if v is not None]
    return float(np.mean(numbers)) if numbers else None


def _row(rows: Sequence[Row]) -> dict[str, Any]:
    """Means of one filter over the runs of a group; None where it has none."""
    row_means: dict[str, Any] = {name: _mean(row.get(name) for row in rows) for name in ANGLES}
    for limit in SETTLED_DEG:
        times = [row[key] for row in rows if (key := f"settled_{limit:g}") in row]
        row_means[f"settled_{limit:g}"] = _median(times)
        row_means[f"never_{limit:g}"] = times.count(None) / len(times) if times else None
    return row_means


def _median(times: Sequence[float | None]) -> float | None:
    """Median, those that never settled being the latest of all."""
    median = sorted(np.inf if t is None else t for t in times)[len(times) // 2] if times else np.inf
    return float(median) if np.isfinite(median) else None


def _against(
    runs: Sequence[Row], table: Sequence[Mapping[str, Row]], name: str, figure: str
) -> dict[str, Any]:
    """Ratio of the means of the judged figure, and of the inclination; the worst run."""
    pairs = [
        (t[name][figure], t[RIVAL][figure], run)
        for t, run in zip(table, runs, strict=True)
        if figure in t[name] and figure in t[RIVAL]
    ]
    if not pairs:
        return {}
    ratios = [(a / max(b, SMALL_DEG), run["trial"], run["case"]) for a, b, run in pairs]
    flat = [[t[n]["inclination"] for t in table if "inclination" in t[n]] for n in (name, RIVAL)]
    return {
        "ratio": sum(a for a, _, _ in pairs) / sum(b for _, b, _ in pairs),
        "inclination_ratio": float(np.mean(flat[0]) / np.mean(flat[1])),
        "worst": dict(zip(("ratio", "trial", "case"), max(ratios), strict=True)),
    }


def _by_trial(
    runs: Sequence[Row],
    group_of: Mapping[str, str],
    judged: Mapping[str, str],
    filters: Sequence[str],
) -> list[dict[str, Any]]:
    grouped: dict[tuple[str, str], list[Row]] = {}
    for run in runs:
        grouped.setdefault((run["trial"], group_of[run["case"]]), []).append(run)
    return [
        {
            "trial": trial,
            "group": group,
            "rows": {
                name: _mean(
                    row.get(judged[group])
                    for run in values
                    for row in run["rows"]
                    if label(row) == name
                )
                for name in filters
            },
        }
        for (trial, group), values in grouped.items()
    ]


def _fixed(runs: Sequence[Row]) -> list[dict[str, Any]]:
    """Fixed point against float64, over every sample of every run."""
    largest: dict[str, dict[str, Any]] = {}
    for run in runs:
        for row in run["rows"]:
            if row["level"] != "fixed" or "refused" in row:
                continue
            initial = {"apart_deg": 0.0, "where": "", "changed": 0, "saturated": 0, "good": True}
            entry = largest.setdefault(row["estimator"], initial)
            if row["apart_deg"] > entry["apart_deg"]:
                entry |= {"apart_deg": row["apart_deg"], "where": f"{run['trial']}, {run['case']}"}
            entry["changed"] += row["changed"]
            entry["saturated"] += row["saturated"]
            entry["good"] &= row["good"] and not row["saturated"]
    return [{"estimator": name, **entry} for name, entry in largest.items()]


def _refused(runs: Sequence[Row], filters: Sequence[str]) -> list[dict[str, Any]]:
    """Filters that could not run every case; no figure counts those runs."""
    refusals = []
    for name in filters:
        rows = [row for run in runs for row in run["rows"] if label(row) == name]
        reasons = [row["refused"] for row in rows if "refused" in row]
        if reasons:
            refusals.append(
                {"filter": name, "runs": len(reasons), "of": len(rows), "reason": reasons[0]}
            )
    return refusals


def _deg(x: float | None) -> str:
    return f"{'-' if x is None else f'{x:.2f}':>9s}"


def text(data: Mapping[str, Any]) -> str:
    """The result of `summary` as text."""
    filters, width = data["filters"], max(len(g["group"]) for g in data["groups"]) + 2
    lines = [
        "Root mean square error in degrees, mean over trials; the first second is left out.",
        *(f"  [{k + 1}] {name}" for k, name in enumerate(filters)),
        "",
        f"  {'':{width}s}" + "".join(f"{f'[{k + 1}]':>9s}" for k in range(len(filters))),
    ]
    for g in data["groups"]:
        name = g["group"] + ("" if g["judged"] == "total" else " *")
        line = f"  {name:{width}s}" + "".join(_deg(g["rows"][f][g["judged"]]) for f in filters)
        lines.append(line)
    if any(g["judged"] != "total" for g in data["groups"]):
        lines.append("  * inclination: nothing tells the heading there")
    limit = f"settled_{SETTLED_DEG[1]:g}"
    lines += ["", f"Median time until the error stays below {SETTLED_DEG[1]:g} deg, s"]
    for g in data["groups"]:
        line = f"  {g['group']:{width}s}" + "".join(_deg(g["rows"][f][limit]) for f in filters)
        lines.append(line)
    for name in filters if data["rival"] else ():
        ratios = [
            (g["group"], g["rows"][name]) for g in data["groups"] if "ratio" in g["rows"][name]
        ]
        if ratios:
            lines += ["", f"{name} against {data['rival']}: ratio, and the worst single run"]
            for group, row in ratios:
                worst = row["worst"]
                lines.append(
                    f"  {group:{width}s}{row['ratio']:9.2f}{worst['ratio']:9.2f}  "
                    f"{worst['trial']}, {worst['case']}"
                )
    for w in data.get("worse", ()):
        trials = len({run["trial"] for run in w["runs"]})
        lines += [
            "",
            f"{w['estimator']}: {len(w['runs'])} of {w['of']} runs more than "
            f"{100.0 * (WORSE - 1.0):.0f} % worse, of {trials} trials; curves on the page",
        ]
    for f in data["fixed"]:
        lines += [
            "",
            f"{f['estimator']}, fixed point from float64 over every sample: at most "
            f"{f['apart_deg']:.6f} deg ({f['where']}); {f['changed']} status words differ, "
            f"{f['saturated']} updates saturated{'' if f['good'] else ': BEYOND'}",
        ]
    for r in data["refused"]:
        lines += ["", f"{r['filter']}: {r['runs']} of {r['of']} runs FAILED: {r['reason']}"]
    return "\n".join(lines)
