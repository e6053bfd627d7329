"""The report as one HTML file that needs nothing else: styles and curves."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np

from boresight.gateware.synthesis.targets import TARGETS
from boresight.model.arrays import FloatArray
from boresight.model.declarations import EXACT_UNITS
from boresight.model.tools.files import output_folder
from boresight.sim.compare.results import CheckResult
from boresight.sim.explore.measure import map_core
from boresight.sim.levels.build import Build
from boresight.sim.plotting import INK, PALETTE, RED, figure_and_axes, legend, page, settings, svg
from boresight.sim.plotting import unit as shown_unit
from boresight.sim.report.data import report_data

#: Rows of the table of advice, at most.
_MAX_ADVICE = 12
#: Values over time; None: there is none.
Curve = Sequence[float | None]
#: Data of outputs, by name: see `sim.report.accuracy`.
Outputs = Mapping[str, Mapping[str, Any]]

_DOTTED: dict[str, Any] = {"linestyle": (0, (1.5, 2.0)), "linewidth": 1.6, "alpha": 0.75}


def _range_bar(row: Mapping[str, Any]) -> dict[str, float]:
    """Where the observed range lies within the format, both ends in percent of the bar."""
    bottom, top = row["format_min"], row["format_max"]
    ends = (row[end] for end in ("observed_min", "observed_max"))
    left, right = (100.0 * (x - bottom) / (top - bottom) for x in ends)
    left, right = max(0.0, left), min(100.0, right)
    return {"left": round(min(left, 99.0), 2), "width": round(max(right - left, 1.0), 2)}


def _plots(log: Mapping[str, Any], k: int) -> dict[str, str | None]:
    """The plots of a log: its outputs, and their differences from float64."""
    series, truth = log["series"], log["reference"] or "comparison"
    time_label = "sample" if log["seconds"] is None else "time from the first sample, s"
    t = np.array(series["t"], dtype=np.float64), time_label
    outputs = _by_unit({n: o for n, o in series["outputs"].items() if o["fixed"] is not None})
    errors = _by_unit({n: o for n, o in series["outputs"].items() if o["unit"] not in EXACT_UNITS})
    return {
        "outputs": output_plot(*t, outputs, truth, salt=f"outputs{k}"),
        "errors": error_plot(*t, errors, salt=f"errors{k}") if errors else None,
    }


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
        "report.html",
        d=data,
        advice=sorted((r for r in rows if r["advice"]), key=lambda r: -r["wasted_bits"]),
        most_advice=_MAX_ADVICE,
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


def _by_unit(outputs: Outputs) -> dict[str, Outputs]:
    units = dict.fromkeys(o["unit"] for o in outputs.values())
    return {unit: {n: o for n, o in outputs.items() if o["unit"] == unit} for unit in units}


def _panels(
    outputs: Mapping[str, Outputs], time_label: str
) -> tuple[Any, Iterator[tuple[Any, str, Outputs]]]:
    """A figure with a panel for each entry: its axes, the key, the outputs in it."""
    figure, axes = figure_and_axes(2.4 * len(outputs), len(outputs), sharex=True, squeeze=False)
    axes[-1, 0].set_xlabel(time_label)
    return figure, zip(axes[:, 0], *zip(*outputs.items(), strict=True), strict=True)


def output_plot(
    t: FloatArray, time_label: str, panels: Mapping[str, Outputs], truth: str, *, salt: str
) -> str:
    """Outputs over time by unit, and where they are known their truths, which ``truth`` names."""

    def wrapped(curve: Curve, unit: str) -> FloatArray:
        """A gap instead of a stroke across the plot where an angle passes +-180 deg."""
        y = np.array(curve, dtype=np.float64)
        y[1:][(np.abs(np.diff(y)) > 180.0) & (unit == "deg")] = np.nan
        return y

    with settings():
        figure, plots = _panels(panels, time_label)
        for axes, unit, outputs in plots:
            step = {"drawstyle": "steps-post"} if unit in EXACT_UNITS else {}
            for name, colour in zip(outputs, cycle(PALETTE), strict=False):
                o = outputs[name]
                axes.plot(t, wrapped(o["fixed"], unit), color=colour, label=name, **step)
                if "low" in o:
                    band = (np.array(o[end], dtype=np.float64) for end in ("low", "high"))
                    axes.fill_between(t, *band, color=colour, alpha=0.25, linewidth=0)
                if o["truth"] is not None:
                    known = np.array([x is not None for x in o["truth"]])
                    y = wrapped([x for x in o["truth"] if x is not None], unit)
                    axes.plot(t[known], y, color=colour, **_DOTTED)
            if any(o["truth"] is not None for o in outputs.values()):
                axes.plot([], [], color=INK, label=truth, **_DOTTED)
            _mark_first_beyond(axes, outputs)
            axes.set_ylabel(shown_unit(unit) or "dimensionless")
            legend(axes, 6)
        return svg(figure, salt)


def error_plot(t: FloatArray, time_label: str, panels: Mapping[str, Outputs], *, salt: str) -> str:
    """Fixed point against float64 by unit, logarithmic, with each output's tolerance."""
    with settings():
        figure, plots = _panels(panels, time_label)
        for axes, unit, outputs in plots:
            for name, colour in zip(outputs, cycle(PALETTE), strict=False):
                _draw_log(axes, t, np.array(outputs[name]["error"], dtype=np.float64), colour, name)
            for limit in dict.fromkeys(filter(None, (o["tolerance"] for o in outputs.values()))):
                style = {"color": INK, "linestyle": "--", "linewidth": 0.9}
                axes.axhline(limit, label=f"tolerance {limit:.3g}", **style)
            _mark_first_beyond(axes, outputs)
            axes.set_yscale("log")
            axes.set_ylabel("|fixed - float64|" + (f", {shown_unit(unit)}" if unit else ""))
            legend(axes, 6)
        return svg(figure, salt)


def _mark_first_beyond(axes: Any, outputs: Outputs) -> None:
    """A red line where the first of the outputs leaves its tolerance."""
    times = [o["beyond_from"] for o in outputs.values() if o["beyond_from"] is not None]
    if times:
        axes.axvline(min(times), color=RED, linewidth=1.6, label=f"parts at {min(times):g}")


def _draw_log(axes: Any, t: FloatArray, y: FloatArray, colour: str, name: str) -> None:
    """A curve on a logarithmic axis: differences below 1e-15 are gaps."""
    t, y = t[np.isfinite(y)], y[np.isfinite(y)]
    y = np.where(y < 1e-15, np.nan, y)
    axes.plot(t, y, color=colour, label=name, linewidth=0.9)
    present = np.isfinite(np.concatenate([[np.nan], y, [np.nan]]))
    isolated = present[1:-1] & ~present[:-2] & ~present[2:]
    axes.plot(t[isolated], y[isolated], color=colour, marker=".", markersize=2.5, linestyle="")
