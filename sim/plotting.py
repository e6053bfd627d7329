"""Pages and plots: self-contained HTML files with one style sheet (``base.html``), inline SVG.

A page of text, tables and plots consists of `Section`; one with more has a template beside the code
that fills it. The same data give the same text.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.tools.external import optional

#: Okabe and Ito's colours, distinct for every kind of colour vision.
COLOUR = {
    "heading": "#0072B2",
    "pitch": "#D55E00",
    "roll": "#009E73",
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


def settings() -> Any:
    """Context with the style."""
    return optional("matplotlib").rc_context(
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
            "axes.grid": True,
            "grid.color": "#dddddd",
            "grid.linewidth": 0.6,
            "axes.spines.top": False,
            "axes.spines.right": False,
            "lines.linewidth": 1.1,
            "legend.frameon": False,
            "path.simplify": False,
        }
    )


def figure_and_axes(
    height: float, rows: int = 1, columns: int = 1, **keywords: Any
) -> tuple[Any, Any]:
    """A figure as wide as the page, ``height`` inches high, and its axes (one, or an array)."""
    optional("matplotlib")
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.4, height), layout="constrained")
    return figure, figure.subplots(rows, columns, **keywords)


def legend(axes: Any, columns: int) -> None:
    """A legend over the axes, outside."""
    place: Any = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "borderaxespad": 0.2}
    axes.legend(ncols=columns, handlelength=2.0, columnspacing=1.6, **place)


def svg(figure: Any, salt: str) -> str:
    """A figure as an SVG element for HTML: no XML head, no metadata, no outside address."""
    text = io.StringIO()
    with optional("matplotlib").rc_context({"svg.hashsalt": salt}):
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

    ``panels`` are curves by their names in the legend, by the label of a plot; ``step_s`` is the
    time between two values. With ``log`` values have logarithmic axes; else a first eighth that
    would hide the rest is cut. ``name`` is the salt of `svg`.
    """
    optional("matplotlib")
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


#: Text for an unknown value.
UNKNOWN = "\N{EM DASH}"


class Verdict(NamedTuple):
    """A text in green if it is good, else in red."""

    text: str
    good: bool

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True, kw_only=True)
class Section:
    """A part of a page: a table with a head, and figures (caption, SVG by `sim.plotting.svg`).

    A cell is a text, a `Verdict`, or a number, which is formatted by `number`.
    """

    title: str = ""
    text: str = ""
    columns: Sequence[str] = ()
    rows: Sequence[Sequence[str | float | Verdict]] = ()
    figures: Sequence[tuple[str, str]] = ()


def number(x: Any, digits: int = 4) -> str:
    """Format a number with grouped thousands and its significant digits; NaN as None, unknown."""
    if x is None or math.isnan(x):
        return UNKNOWN
    is_whole = math.isfinite(x) and (float(x).is_integer() or abs(x) >= 10 ** (digits - 1))
    return f"{x:z,.0f}" if is_whole and abs(x) < 1e9 else f"{x:z.{digits}g}"


def unit(text: str) -> str:
    """Format a unit."""
    return "half turns" if text == "ht" else text


def page(name: str, **values: Any) -> str:
    """Render the jinja2 template in file ``name``.

    Templates have the filters ``number`` and ``unit``. A missing value is an error; values are
    escaped.
    """
    import jinja2

    here = Path(__file__).parent
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader([here, here / "report"]),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {"number": number, "unit": unit}
    return environment.get_template(name).render(values)


def section_of(title: str, rows: Sequence[Mapping[str, Any]]) -> Section:
    """A section with a table of rows by column; columns without any value are left out."""
    columns = [*dict.fromkeys(name for row in rows for name, v in row.items() if v is not None)]
    cells = [[_cell(row.get(column)) for column in columns] for row in rows]
    return Section(title=title[:1].upper() + title[1:], columns=columns, rows=cells)


def _cell(value: Any) -> str | float | Verdict:
    if isinstance(value, Verdict):
        return value
    if isinstance(value, bool):
        return Verdict("yes" if value else "no", value)
    if isinstance(value, int | float):
        return value
    return "" if value is None else str(value)


def page_of(title: str, intro: Sequence[str | Verdict], sections: Sequence[Section]) -> str:
    """The text of a page of paragraphs and sections."""
    return page("sections.html", title=title, intro=intro, sections=sections)
