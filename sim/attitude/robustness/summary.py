"""Rows of the suite as tables: mean errors by group of cases, ratios to a published filter."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from boresight.sim.attitude.robustness.plan import Case
from boresight.sim.result import Result

#: The published filter that others are compared with, where it runs.
RIVAL = "vqf_online"
#: Smallest error of the rival in a ratio, degrees.
SMALL_DEG = 0.5

Row = Mapping[str, Any]


def summary(cases: Sequence[Case], rows: Sequence[Row]) -> Result:
    """Return mean errors by group of cases and filter, ratios to `RIVAL`, and what is wrong."""
    judged = {case.group: case.judged for case in cases}
    filters = list(dict.fromkeys(r["filter"] for r in rows))
    errors, worst = [], []
    for group, figure in judged.items():
        words = [r for r in rows if r["group"] == group and r["level"] != "float"]
        by_filter = {f: [r for r in words if r["filter"] == f] for f in filters}
        note = "" if figure == "total" else " (inclination)"
        name = {"case": group + note}
        errors.append(name | {f: _mean(r.get(figure) for r in own) for f, own in by_filter.items()})
        worst += _against_rival(group, figure, by_filter)
    return Result(
        data={"errors_deg": errors, "against_rival": worst, "rows": rows},
        tables={
            "Root mean square error without the first second, deg": errors,
            f"Ratio to {RIVAL}": worst,
        },
        failures=_failures(rows, filters),
    )


def _mean(values: Iterable[float | None]) -> float | None:
    numbers = [v for v in values if v is not None]
    return float(np.mean(numbers)) if numbers else None


def _against_rival(
    group: str, figure: str, by_filter: Mapping[str, Sequence[Row]]
) -> list[dict[str, Any]]:
    """Return each filter's ratio of mean errors to the rival's, and its worst single run."""
    rival = {(r["log"], r["case"]): r[figure] for r in by_filter.get(RIVAL, ()) if figure in r}
    out = []
    for name, own in by_filter.items():
        runs = [r for r in own if (r["log"], r["case"]) in rival and figure in r]
        pairs = [(r, rival[r["log"], r["case"]]) for r in runs]
        if name == RIVAL or not pairs:
            continue
        ratios = [(r[figure] / max(b, SMALL_DEG), r["log"], r["case"]) for r, b in pairs]
        out.append(
            {
                "filter": name,
                "case": group,
                "ratio": sum(r[figure] for r, _ in pairs) / sum(b for _, b in pairs),
                "worst": max(ratios)[0],
                "in": ", ".join(max(ratios)[1:]),
            }
        )
    return out


def _failures(rows: Sequence[Row], filters: Sequence[str]) -> list[str]:
    """Return a line for each estimator that is far from float64, and for each that cannot run."""
    lines = []
    for name in filters:
        own = [r for r in rows if r["filter"] == name]
        bad = [r for r in own if not r.get("good", True)]
        if bad:
            far = max(bad, key=lambda r: r["apart_deg"])
            lines.append(
                f"{name}: fixed point is {far['apart_deg']:.6f} deg from float64 and saturates "
                f"{far['saturated']} times in {far['log']}, {far['case']}"
            )
        refused = [r["refused"] for r in own if "refused" in r]
        if refused:
            lines.append(f"{name}: {len(refused)} of {len(own)} runs failed: {refused[0]}")
    return lines
