"""Curves of the report as inline SVG: the same data gives the same text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from boresight.sim.plotting import COLOUR, figure_and_axes, legend, settings, svg

__all__ = ["euler_plot", "float_difference_plot", "log_difference_plot"]

_STYLE = {"heading": "-", "pitch": "-", "roll": "-", "inclination": "-"}

Curves = Mapping[str, Sequence[float | None]]


def _axes(height: float) -> tuple[Any, Any]:
    figure, axes = figure_and_axes(height)
    axes.set_xlabel("time from the first sample, s")
    return figure, axes


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


def euler_plot(
    times: Sequence[float | None],
    fixed: Curves,
    other: Curves | None,
    other_name: str,
    *,
    salt: str,
) -> str:
    """Euler angles over time, and those of the log."""
    with settings():
        figure, axes = _axes(3.1)
        t = _floats(times)
        for name, curve in fixed.items():
            axes.plot(t, _unwrapped(_floats(curve)), color=COLOUR[name], label=name)
        for name, curve in (other or {}).items():
            where, y = _known(t, _floats(curve))
            axes.plot(
                where,
                _unwrapped(y),
                color=COLOUR[name],
                linestyle=(0, (1.5, 2.0)),
                linewidth=1.6,
                alpha=0.75,
                label=f"{name}, {other_name}",
            )
        axes.set_ylabel("angle, deg")
        axes.set_ylim(-185.0, 185.0)
        axes.set_yticks(range(-180, 181, 60))
        legend(axes, 6)
        return svg(figure, salt)


def _log_plot(
    times: Sequence[float | None], curves: Curves, label: str, *, salt: str, lowest: float
) -> str:
    import numpy as np

    with settings():
        figure, axes = _axes(2.7)
        t = _floats(times)
        for name, curve in curves.items():
            y = _floats(curve)
            y[y < lowest] = np.nan  # equal, as far as a curve can show
            where, shown = _known(t, y)
            axes.plot(
                where, shown, color=COLOUR[name], linestyle=_STYLE[name], label=name, linewidth=0.9
            )
        axes.set_yscale("log")
        axes.set_ylabel(label)
        legend(axes, 3)
        return svg(figure, salt)


def float_difference_plot(
    times: Sequence[float | None], curves: Curves, word: int, *, salt: str
) -> str:
    """Fixed point against float64."""
    return _log_plot(times, curves, f"|fixed (W = {word}) - float64|, deg", salt=salt, lowest=1e-12)


def log_difference_plot(
    times: Sequence[float | None], curves: Curves, other_name: str, *, salt: str
) -> str:
    """Fixed point against the log's attitude."""
    return _log_plot(times, curves, f"difference to the {other_name}, deg", salt=salt, lowest=1e-6)
