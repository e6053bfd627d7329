"""The report as one HTML file that needs nothing else: styles, charts and curves are inside it."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from boresight.gateware.synthesis.targets import TARGETS
from boresight.model.declarations import EXACT_UNITS
from boresight.model.tools.files import output_folder
from boresight.sim.compare.results import CheckResult
from boresight.sim.explore.measure import map_core
from boresight.sim.levels.build import Build
from boresight.sim.pages import UNKNOWN, page
from boresight.sim.report.accuracy import worst_output
from boresight.sim.report.data import report_data
from boresight.sim.report.plots import error_plot, log_difference_plot, output_plot
from boresight.sim.report.schedule import CHART_COLOURS, schedule_chart

#: Cycles whose chart is unfolded, at most.
_MAX_CYCLES = 640
#: Rows of the table of advice, at most.
_MAX_ADVICE = 12


def _range_bar(row: Mapping[str, Any]) -> dict[str, float] | None:
    """Where the observed range lies within the format, both ends in percent of the bar."""
    low, high = row["observed_min"], row["observed_max"]
    if low is None or high is None:
        return None
    bottom, top = row["format_min"], row["format_max"]
    left, right = (100.0 * (x["value"] - bottom) / (top - bottom) for x in (low, high))
    left, right = max(0.0, left), min(100.0, right)
    return {"left": round(min(left, 99.0), 2), "width": round(max(right - left, 1.0), 2)}


def _plots(log: Mapping[str, Any], k: int) -> dict[str, str | None]:
    series, truth = log["series"], log["reference"] or "comparison"
    outputs, attitude = series["outputs"], series["vs_log_deg"]
    time_label = "sample" if log["seconds"] is None else "time from the first sample, s"
    t = (series["t"], time_label)
    has_error = any(o["unit"] not in EXACT_UNITS for o in outputs.values())
    return {
        "outputs": output_plot(*t, outputs, truth, salt=f"outputs{k}"),
        "errors": error_plot(*t, outputs, salt=f"errors{k}") if has_error else None,
        "vs_log": log_difference_plot(*t, attitude, truth, salt=f"log{k}") if attitude else None,
    }


def _warnings(data: Mapping[str, Any]) -> list[str]:
    """Warnings that restrict the numbers, without the failures, which the page has above."""
    failures = data["verdict"]["failures"]
    messages = [w.partition(": ")[2] for w in data["warnings"]]
    return [
        w
        for w, text in zip(data["warnings"], messages, strict=True)
        if not any(text and (text in f or f.partition(": ")[2] in w) for f in failures)
    ]


def render_html(data: Mapping[str, Any]) -> str:
    """HTML text of the dict that `sim.report.data.report_data` builds.

    The file is self-contained: no script, no address outside, printable. ValueError: a number is
    not finite.
    """
    json.dumps(data, allow_nan=False)
    rows, prominent, others = data["numerics"], list[Any](), list[Any]()
    for r in rows:
        interface = r["output"] or r["kind"] in ("input", "param", "state")
        named = interface or r["state"] in ("saturated", "tight")
        (prominent if named else others).append((r, _range_bar(r)))
    return page(
        "boresight.sim.report",
        "report.html",
        d=data,
        warnings=_warnings(data),
        most_cycles=_MAX_CYCLES,
        worst=worst_output,
        advice=sorted((r for r in rows if r["advice"]), key=lambda r: -r["wasted_bits"]),
        most_advice=_MAX_ADVICE,
        unknown=UNKNOWN,
        chart=schedule_chart(data["schedule"]),
        colours=CHART_COLOURS,
        plots=[_plots(log, k) for k, log in enumerate(data["accuracy"]["logs"])],
        tables=[
            ("Inputs, parameters, states, outputs, and what needs attention", True, prominent),
            ("All other values", False, others),
        ],
    )


def write_report(
    folder: Path,
    build: Build,
    results: Sequence[CheckResult],
    inputs: Sequence[Path],
    tell: Callable[[str], None],
) -> str:
    """Write report.html and report.json, with the area; returns the name of the page."""
    part = TARGETS.get(build.target, TARGETS["xc6slx9"])
    files = ("report.html", "report.json")
    with output_folder(folder, "check", files=files, inputs=inputs) as place:
        tell(f"synthesis (yosys) for {part.title}")
        area = map_core(build.core, part)
        data = report_data(build.core, *results, area=area, device=part.device, grade=part.grade)
        text = json.dumps(data, indent=1) + "\n"
        (place / "report.json").write_text(text, encoding="utf-8", newline="\n")
        (place / "report.html").write_text(render_html(data), encoding="utf-8", newline="\n")
    return str(folder / "report.html")
