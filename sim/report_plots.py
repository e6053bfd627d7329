"""Curves of the report as inline SVG: the same data gives the same text."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping, Sequence
from typing import Any

__all__ = ["euler_plot", "float_difference_plot", "log_difference_plot"]

#: Okabe and Ito's colours: apart for every kind of colour vision.
_COLOUR = {"heading": "#0072B2", "pitch": "#D55E00", "roll": "#009E73", "inclination": "#D55E00"}
_STYLE = {"heading": "-", "pitch": "-", "roll": "-", "inclination": "-"}
_INK = "#222222"

Curves = Mapping[str, Sequence[float | None]]


def _svg(figure: Any, salt: str) -> str:
    """A figure as an SVG element for HTML: no XML head, no metadata, no outside address."""
    import matplotlib

    text = io.StringIO()
    with matplotlib.rc_context({"svg.hashsalt": salt}):
        figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    svg = text.getvalue()
    svg = svg[svg.index("<svg"):]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r' xmlns(:\w+)?="[^"]*"', "", svg).replace("xlink:href", "href")
    svg = re.sub(r"<svg [^>]*?(viewBox=\"[^\"]*\")[^>]*>",
                 r'<svg class="plot" role="img" \1>', svg, count=1)
    return re.sub(r"\n\s*", "\n", svg).strip()


def _axes(height: float) -> tuple[Any, Any]:
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.4, height), layout="constrained")
    FigureCanvasSVG(figure)
    axes = figure.subplots()
    axes.set_xlabel("time from the first sample, s")
    axes.grid(True, which="major", color="#dddddd", linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)
    return figure, axes


def _settings() -> Any:
    import matplotlib

    return matplotlib.rc_context({
        "svg.fonttype": "none", "font.size": 9.0, "font.family": "sans-serif",
        "axes.edgecolor": "#666666", "axes.labelcolor": _INK, "text.color": _INK,
        "xtick.color": _INK, "ytick.color": _INK, "axes.linewidth": 0.7,
        "lines.linewidth": 1.1, "legend.frameon": False, "path.simplify": False,
    })


def _floats(curve: Sequence[float | None]) -> Any:
    import numpy as np

    return np.array([np.nan if v is None else v for v in curve], dtype=np.float64)


def _unwrapped(y: Any) -> Any:
    """A gap instead of a stroke across the plot where an angle passes +-180 deg."""
    import numpy as np

    y = y.copy()
    y[1:][np.abs(np.diff(y)) > 180.0] = np.nan
    return y


def _known(t: Any, y: Any) -> tuple[Any, Any]:
    import numpy as np

    good = np.isfinite(y)
    return t[good], y[good]


def _legend(axes: Any, columns: int) -> None:
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=columns, borderaxespad=0.2,
                handlelength=2.0, columnspacing=1.6)


def euler_plot(times: Sequence[float | None], fixed: Curves, other: Curves | None,
               other_name: str, *, salt: str) -> str:
    """Euler angles over time, and those of the log."""
    with _settings():
        figure, axes = _axes(3.1)
        t = _floats(times)
        for name, curve in fixed.items():
            axes.plot(t, _unwrapped(_floats(curve)), color=_COLOUR[name], label=name)
        for name, curve in (other or {}).items():
            where, y = _known(t, _floats(curve))
            axes.plot(where, _unwrapped(y), color=_COLOUR[name], linestyle=(0, (1.5, 2.0)),
                      linewidth=1.6, alpha=0.75, label=f"{name}, {other_name}")
        axes.set_ylabel("angle, deg")
        axes.set_ylim(-185.0, 185.0)
        axes.set_yticks(range(-180, 181, 60))
        _legend(axes, 6)
        return _svg(figure, salt)


def _log_plot(times: Sequence[float | None], curves: Curves, label: str, *, salt: str,
              lowest: float) -> str:
    import numpy as np

    with _settings():
        figure, axes = _axes(2.7)
        t = _floats(times)
        for name, curve in curves.items():
            y = _floats(curve)
            y[y < lowest] = np.nan  # equal, as far as a curve can show
            where, shown = _known(t, y)
            axes.plot(where, shown, color=_COLOUR[name], linestyle=_STYLE[name], label=name,
                      linewidth=0.9)
        axes.set_yscale("log")
        axes.set_ylabel(label)
        _legend(axes, 3)
        return _svg(figure, salt)


def float_difference_plot(times: Sequence[float | None], curves: Curves, word: int, *,
                          salt: str) -> str:
    """Fixed point against float64."""
    return _log_plot(times, curves, f"|fixed (W = {word}) - float64|, deg", salt=salt,
                     lowest=1e-12)


def log_difference_plot(times: Sequence[float | None], curves: Curves, other_name: str, *,
                        salt: str) -> str:
    """Fixed point against the log's attitude."""
    return _log_plot(times, curves, f"difference to the {other_name}, deg", salt=salt,
                     lowest=1e-6)
