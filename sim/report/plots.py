"""Curves of the report as inline SVG: the same data gives the same text."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import cycle
from typing import Any

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.declarations import EXACT_UNITS
from boresight.sim.pages import unit as shown_unit
from boresight.sim.plotting import COLOUR, INK, PALETTE, RED, figure_and_axes, legend, settings, svg

Curve = Sequence[float | None]

#: Data of each output in a plot by unit: see `sim.report.accuracy`.
Outputs = Mapping[str, Mapping[str, Any]]

_DOTTED: dict[str, Any] = {"linestyle": (0, (1.5, 2.0)), "linewidth": 1.6, "alpha": 0.75}


def _floats(curve: Curve) -> FloatArray:
    return np.array([np.nan if v is None else v for v in curve], dtype=np.float64)


def _wrap(unit: str, y: FloatArray) -> FloatArray:
    """A gap instead of a stroke across the plot where an angle passes +-180 deg."""
    y = y.copy()
    y[1:][(np.abs(np.diff(y)) > 180.0) & (unit == "deg")] = np.nan
    return y


def _finite_points(t: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    finite = np.isfinite(y)
    return t[finite], y[finite]


def _colours(names: Sequence[str]) -> dict[str, str]:
    """A colour for each curve: its own, or the next unused one."""
    unused = cycle(c for c in PALETTE if c not in {COLOUR.get(name) for name in names})
    return {name: COLOUR[name] if name in COLOUR else next(unused) for name in names}


def _panels(outputs: Outputs, time_label: str) -> tuple[Any, Iterator[tuple[Any, str, list[str]]]]:
    """A figure with a panel for each unit: axes, unit, outputs in it; ``time_label``: its axis."""
    units = list(dict.fromkeys(o["unit"] for o in outputs.values()))
    figure, axes = figure_and_axes(2.4 * len(units), len(units), sharex=True, squeeze=False)
    axes[-1, 0].set_xlabel(time_label)
    names = ([n for n, o in outputs.items() if o["unit"] == unit] for unit in units)
    return figure, zip(axes[:, 0], units, names, strict=True)


def output_plot(times: Curve, time_label: str, outputs: Outputs, truth: str, *, salt: str) -> str:
    """Outputs over time, and where they are known their truths, which ``truth`` names."""
    plotted = {name: o for name, o in outputs.items() if o["fixed"] is not None}
    with settings():
        figure, panels = _panels(plotted, time_label)
        t = _floats(times)
        for axes, unit, names in panels:
            step = {"drawstyle": "steps-post"} if unit in EXACT_UNITS else {}
            for name, colour in _colours(names).items():
                y = _floats(plotted[name]["fixed"])
                axes.plot(t, _wrap(unit, y), color=colour, label=name, **step)
                if "low" in plotted[name]:
                    band = (_floats(plotted[name][end]) for end in ("low", "high"))
                    axes.fill_between(t, *band, color=colour, alpha=0.25, linewidth=0)
                if plotted[name]["truth"] is not None:
                    t_truth, y = _finite_points(t, _floats(plotted[name]["truth"]))
                    axes.plot(t_truth, _wrap(unit, y), color=colour, **_DOTTED)
            if any(plotted[name]["truth"] is not None for name in names):
                axes.plot([], [], color=INK, label=truth, **_DOTTED)
            _mark_parting(axes, [plotted[name] for name in names])
            axes.set_ylabel(shown_unit(unit) or "dimensionless")
            legend(axes, 6)
        return svg(figure, salt)


def error_plot(times: Curve, time_label: str, outputs: Outputs, *, salt: str) -> str:
    """Fixed point against float64, with each output's tolerance."""
    plotted = {name: o for name, o in outputs.items() if o["unit"] not in EXACT_UNITS}
    with settings():
        figure, panels = _panels(plotted, time_label)
        t = _floats(times)
        for axes, unit, names in panels:
            for name, colour in _colours(names).items():
                y = _floats(plotted[name]["error"])
                _draw_log(axes, t, y, colour, name)
            for limit in dict.fromkeys(filter(None, (plotted[n]["tolerance"] for n in names))):
                style = {"color": INK, "linestyle": "--", "linewidth": 0.9}
                axes.axhline(limit, label=f"tolerance {limit:.3g}", **style)
            _mark_parting(axes, [plotted[name] for name in names])
            axes.set_yscale("log")
            axes.set_ylabel("|fixed - float64|" + (f", {shown_unit(unit)}" if unit else ""))
            legend(axes, 6)
        return svg(figure, salt)


def _mark_parting(axes: Any, outputs: Sequence[Mapping[str, Any]]) -> None:
    """A red line where the first of the outputs leaves its tolerance."""
    times = [o["beyond_from"] for o in outputs if o["beyond_from"] is not None]
    if times:
        first = min(times)
        axes.axvline(first, color=RED, linewidth=1.6, label=f"parts at {first:g}")


def _draw_log(axes: Any, t: FloatArray, y: FloatArray, colour: str, name: str) -> None:
    """A curve on a logarithmic axis: differences below 1e-15 are gaps."""
    t, y = _finite_points(t, y)
    y = np.where(y < 1e-15, np.nan, y)
    axes.plot(t, y, color=colour, label=name, linewidth=0.9)
    present = np.isfinite(np.concatenate([[np.nan], y, [np.nan]]))
    isolated = present[1:-1] & ~present[:-2] & ~present[2:]
    axes.plot(t[isolated], y[isolated], color=colour, marker=".", markersize=2.5, linestyle="")


def log_difference_plot(
    times: Curve, time_label: str, curves: Mapping[str, Curve], truth: str, *, salt: str
) -> str:
    """Fixed point against the record's attitude."""
    with settings():
        figure, axes = figure_and_axes(2.7)
        axes.set_xlabel(time_label)
        for name, curve in curves.items():
            _draw_log(axes, _floats(times), _floats(curve), COLOUR[name], name)
        axes.set_yscale("log")
        axes.set_ylabel(f"difference to the {truth}, deg")
        legend(axes, 3)
        return svg(figure, salt)
