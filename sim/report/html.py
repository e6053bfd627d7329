"""The report as one HTML file that needs nothing else: styles, charts and curves are inside it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from boresight.model.declarations import EXACT_UNITS
from boresight.sim.pages import UNKNOWN, page
from boresight.sim.report.chart import CHART_COLOURS, schedule_chart
from boresight.sim.report.plots import error_plot, log_difference_plot, output_plot
from boresight.sim.report.schedule import KINDS
from boresight.sim.report.sources import source_of

__all__ = ["render_html"]


def net_name(text: str) -> str:
    """A name out of the netlist; those that synthesis made up say nothing."""
    return "(made by synthesis)" if text.startswith("$") else text


def _worst(outputs: Sequence[Mapping[str, Any]]) -> Mapping[str, Any]:
    """The output that uses most of its tolerance; those without one come last."""

    def used(o: Mapping[str, Any]) -> tuple[bool, float]:
        largest = math.inf if o["max"] is None else float(o["max"])
        if o["tolerance"] is None:
            return False, largest
        return True, largest / o["tolerance"] if o["tolerance"] else largest * 1e300

    return max(outputs, key=used)


def _range_bar(row: Mapping[str, Any]) -> dict[str, float] | None:
    """Where the observed range lies within the format, both ends in percent of the bar."""
    low, high = row["observed_min"], row["observed_max"]
    if low is None or high is None:
        return None
    bottom, top = row["format_min"], row["format_max"]
    left, right = (100.0 * (x["value"] - bottom) / (top - bottom) for x in (low, high))
    left, right = max(0.0, left), min(100.0, right)
    return {"left": round(min(left, 99.0), 2), "width": round(max(right - left, 1.0), 2)}


def _plots(log: Mapping[str, Any]) -> dict[str, str | None]:
    series, other = log["series"], log["reference"] or "comparison"
    outputs, turned = series["outputs"], series["vs_log_deg"]
    along = "sample" if log["seconds"] is None else "time from the first sample, s"
    t = (series["t"], along)
    inexact = any(o["unit"] not in EXACT_UNITS for o in outputs.values())
    return {
        "outputs": output_plot(*t, outputs, other, salt="outputs"),
        "errors": error_plot(*t, outputs, salt="errors") if inexact else None,
        "vs_log": log_difference_plot(*t, turned, other, salt="log") if turned else None,
    }


def _named(row: Mapping[str, Any]) -> bool:
    """Whether a value is part of the estimator's interface or needs attention."""
    return (
        row["kind"] in ("input", "param", "state")
        or row["output"]
        or row["state"] in ("saturated", "tight")
    )


def _finite(data: Mapping[str, Any]) -> None:
    """ValueError if the data holds what JSON cannot."""

    def walk(x: Any, path: str) -> None:
        if isinstance(x, Mapping):
            for key, value in x.items():
                walk(value, f"{path}.{key}")
        elif isinstance(x, list | tuple):
            for k, value in enumerate(x):
                walk(value, f"{path}.{k}")
        elif isinstance(x, float) and not math.isfinite(x):
            raise ValueError(f"{path[1:]} must be finite, not {x!r}")

    walk(data, "")


def render_html(data: Mapping[str, Any]) -> str:
    """HTML text of the dict that `sim.report.data.report_data` builds.

    The file is self-contained: no script, no address outside, printable.

    Raises
    ------
    ValueError
        If a number is not finite.
    """
    _finite(data)
    rows = data["numerics"]
    return page(
        "boresight.sim.report",
        "report.html",
        d=data,
        worst=_worst,
        net_name=net_name,
        unknown=UNKNOWN,
        source=lambda path: source_of(data, path) or "",
        chart=schedule_chart(data["schedule"]),
        colours=CHART_COLOURS,
        kinds=KINDS,
        plots=[_plots(log) for log in data["accuracy"]["logs"]],
        tables=[
            (
                "Inputs, parameters, states, outputs, and what needs attention",
                True,
                [(r, _range_bar(r)) for r in rows if _named(r)],
            ),
            ("All other values", False, [(r, _range_bar(r)) for r in rows if not _named(r)]),
        ],
    )
