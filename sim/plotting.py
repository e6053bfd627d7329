"""Style of all plots, and inline SVG whose text is the same for the same data."""

from __future__ import annotations

import io
import os
import re
from collections.abc import Mapping
from itertools import cycle
from typing import Any

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.tools.extras import optional
from boresight.model.tools.folders import matplotlib_environment
from boresight.sim.pages import number

#: Okabe and Ito's colours, distinct for every kind of colour vision.
COLOUR = {
    "heading": "#0072B2",
    "pitch": "#D55E00",
    "roll": "#009E73",
    "inclination": "#D55E00",
    "other": "#CC79A7",
    "sky": "#56B4E9",
    "amber": "#E69F00",
    "grey": "#8a8f98",
}
#: The same colours in the order in which a plot takes them.
PALETTE = [COLOUR[n] for n in ("heading", "pitch", "roll", "other", "amber", "sky", "grey")]
INK = "#222222"
#: Colour of errors.
RED = "#b3400a"


def _matplotlib() -> Any:
    """Import matplotlib, with a folder for its font cache if the home cannot be written."""
    variables = matplotlib_environment()
    os.environ.update(variables)
    try:
        matplotlib = optional("matplotlib")
        optional("matplotlib.font_manager")  # reads the folder once more
    finally:
        for name in variables:
            del os.environ[name]
    return matplotlib


def settings() -> Any:
    """Context with the style."""
    return _matplotlib().rc_context(
        {
            "svg.fonttype": "none",
            "font.size": 9.0,
            "font.family": "sans-serif",
            "axes.edgecolor": "#666666",
            "axes.labelcolor": INK,
            "text.color": INK,
            "xtick.color": INK,
            "ytick.color": INK,
            "axes.linewidth": 0.7,
            "axes.axisbelow": True,
            "lines.linewidth": 1.1,
            "legend.frameon": False,
            "path.simplify": False,
        }
    )


def figure_and_axes(
    height: float, rows: int = 1, columns: int = 1, **keywords: Any
) -> tuple[Any, Any]:
    """A figure as wide as the page, ``height`` inches high, and its axes (one, or an array)."""
    _matplotlib()
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.4, height), layout="constrained")
    FigureCanvasSVG(figure)
    axes = figure.subplots(rows, columns, **keywords)
    for axis in getattr(axes, "flat", [axes]):
        axis.grid(True, which="major", color="#dddddd", linewidth=0.6)
        axis.spines[["top", "right"]].set_visible(False)
    return figure, axes


def legend(axes: Any, columns: int) -> None:
    """A legend over the axes, outside."""
    axes.legend(
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=columns,
        borderaxespad=0.2,
        handlelength=2.0,
        columnspacing=1.6,
    )


def log_axis(axes: Any) -> None:
    """Logarithmic x with ticks at 1, 2, 5, 10, 20, 50."""
    axes.set_xscale("log")
    _log_ticks(axes.xaxis, (1.0, 2.0, 5.0))


def _log_ticks(axis: Any, digits: tuple[float, ...]) -> None:
    """Ticks of a logarithmic axis at these digits of each decade, as plain numbers."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(base=10.0, subs=digits))
    axis.set_major_formatter(FuncFormatter(lambda x, _: number(x)))
    axis.set_minor_formatter(NullFormatter())


def band(axes: Any, values: FloatArray, step: float, parts: int, **style: Any) -> None:
    """Plot minimum and maximum in each of ``parts`` pieces of a curve, points ``step`` apart."""
    length = max(1, len(values) // parts)
    pieces = values[: len(values) // length * length].reshape(-1, length)
    t = step * length * (np.arange(len(pieces)) + 0.5)
    axes.fill_between(t, pieces.min(axis=1), pieces.max(axis=1), **style)


def svg(figure: Any, salt: str) -> str:
    """A figure as an SVG element for HTML: no XML head, no metadata, no outside address."""
    text = io.StringIO()
    with _matplotlib().rc_context({"svg.hashsalt": salt}):
        figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    out = text.getvalue()
    out = out[out.index("<svg") :]
    out = re.sub(r"<metadata>.*?</metadata>", "", out, flags=re.DOTALL)
    out = re.sub(r' xmlns(:\w+)?="[^"]*"', "", out).replace("xlink:href", "href")
    out = re.sub(
        r"<svg [^>]*?(viewBox=\"[^\"]*\")[^>]*>", r'<svg class="plot" role="img" \1>', out, count=1
    )
    return re.sub(r"\n\s*", "\n", out).strip()


def histories(
    panels: Mapping[str, Mapping[str, FloatArray]], *, step_s: float, log: bool, name: str
) -> str:
    """SVG of curves (n,) over time, in plots below one another; at most 3,000 points of each.

    Parameters
    ----------
    panels : mapping of str to mapping of str to float64 (n,)
        Curves by their names in the legend, by the label of a plot.
    step_s : float
        Time between two values.
    log : bool
        Whether values have logarithmic axes; else a first eighth that would hide the rest is cut.
    name : str
        See `svg`.
    """
    with settings():
        figure, plots = figure_and_axes(0.4 + 1.4 * len(panels), len(panels), sharex=True)
        names = dict.fromkeys(name for curves in panels.values() for name in curves)
        colours = dict(zip(names, cycle(PALETTE), strict=False))
        for plot, (label, curves) in zip(plots, panels.items(), strict=True):
            for key, curve in curves.items():
                every = max(1, len(curve) // 3000)
                t = step_s * np.arange(len(curve))[::every]
                plot.plot(t, curve[::every], color=colours[key], label=key, linewidth=0.8)
            if log:
                plot.set_yscale("log")
                low, high = plot.get_ylim()
                _log_ticks(plot.yaxis, (1.0,) if high > 100.0 * low else (1.0, 3.0))
            else:
                shown = np.stack(list(curves.values()))
                late = shown[:, shown.shape[1] // 8 :]
                shown = late if np.ptp(shown) > 2.0 * np.ptp(late) else shown
                edge = 0.1 * np.ptp(shown) or 1.0
                plot.set_ylim(shown.min() - edge, shown.max() + edge)
            plot.set_ylabel(label)
            if len(curves) > 1:
                legend(plot, len(curves))
        plots[-1].set_xlabel("time, s")
        return svg(figure, name)
