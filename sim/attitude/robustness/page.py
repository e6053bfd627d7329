"""The page of a protocol: one HTML file that needs nothing else."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from boresight.sim.attitude.robustness.runs import LEFT_OUT_S, SETTLED_DEG, SETTLED_FOR_S
from boresight.sim.attitude.robustness.summary import FLOAT
from boresight.sim.pages import UNKNOWN, degrees, page
from boresight.sim.plotting import INK, figure_and_axes, legend, log_axis, settings, svg

__all__ = ["render_page"]

#: Okabe and Ito's colours and a marker for each filter, in turn.
_STYLES = (
    ("#0072B2", "o"),
    ("#D55E00", "s"),
    ("#222222", "D"),
    ("#009E73", "^"),
    ("#CC79A7", "v"),
    ("#777777", "P"),
    ("#E69F00", "X"),
    ("#56B4E9", "<"),
)


#: Deviations of the field: key of `worse.field_off`, label, colour.
_FIELD = (
    ("field_heading", "from north, deg", "#CC79A7"),
    ("field_dip", "dip from its median, deg", "#009E73"),
    ("field_norm", "norm from its median, %", "#777777"),
)


def _plotted(data: Mapping[str, Any]) -> list[str]:
    """Filters in plots: float64 lies upon fixed point."""
    return [name for name in data["filters"] if not name.endswith(FLOAT)]


def dots(
    rows: Sequence[tuple[str, Mapping[str, float | None]]],
    names: Sequence[str],
    axis: str,
    salt: str,
) -> str:
    """A row for each group, a mark for each filter; logarithmic."""
    with settings():
        figure, axes = figure_and_axes(1.1 + 0.24 * len(rows))
        axes.grid(False, axis="y")
        axes.spines["left"].set_visible(False)
        axes.tick_params(axis="y", length=0)
        log_axis(axes)
        for k, name in enumerate(names):
            colour, marker = _STYLES[k % len(_STYLES)]
            points = [(v[name], j) for j, (_, v) in enumerate(rows) if v[name]]
            if points:
                axes.plot(
                    *zip(*points, strict=True),
                    linestyle="none",
                    marker=marker,
                    color=colour,
                    markersize=5,
                    label=name,
                )
        axes.set_yticks(range(len(rows)), [name for name, _ in rows])
        axes.set_ylim(len(rows) - 0.5, -0.5)
        axes.set_xlabel(axis)
        if axes.get_legend_handles_labels()[0]:
            legend(axes, len(names))
        return svg(figure, salt=salt)


def strip(data: Mapping[str, Any], name: str, salt: str) -> str:
    """Ratio to the rival of every trial, group by group."""
    groups, rival = [g["group"] for g in data["groups"]], data["rival"]
    with settings():
        figure, axes = figure_and_axes(1.0 + 0.24 * len(groups))
        axes.grid(False, axis="y")
        axes.set_xscale("log", base=2)
        axes.axvline(1.0, color=INK, linewidth=0.8)
        points = [
            (t["rows"][name] / t["rows"][rival], groups.index(t["group"]))
            for t in data["trials"]
            if t["rows"][name] and t["rows"][rival]
        ]
        axes.plot(*zip(*points, strict=True), "o", color=_STYLES[0][0], markersize=4, alpha=0.5)
        axes.set_yticks(range(len(groups)), groups)
        axes.set_ylim(len(groups) - 0.5, -0.5)
        axes.xaxis.set_major_formatter(lambda x, _: f"{x:g}")
        axes.set_xlabel(f"error of {name} over that of {rival}, trial by trial")
        return svg(figure, salt=salt)


def story(run: Mapping[str, Any], name: str, rival: str, salt: str) -> str:
    """Both errors over the time of a run, and the true deviations of the field; rest is shaded."""
    curves = {n: np.array(v, dtype=np.float64) for n, v in run["curves"].items()}
    t, rest = curves["t"], curves["moves"] < 0.5
    with settings():
        figure, axes = figure_and_axes(3.8, 2, sharex=True, height_ratios=(3, 2))
        for k, (key, label) in enumerate((("ours", name), ("rival", rival))):
            axes[0].plot(t, curves[key], color=_STYLES[k][0], label=label)
        for key, label, colour in _FIELD:
            axes[1].plot(t, curves[key], color=colour, label=label, linewidth=0.9)
        axes[0].set_ylim(0.0)
        axes[0].set_ylabel(f"{run['figure']} error, deg")
        axes[1].set_ylabel("field off")
        axes[1].set_xlabel("s after the start")
        for pair, columns in zip(axes, (2, 3), strict=True):
            pair.fill_between(
                t, 0, 1, where=rest, transform=pair.get_xaxis_transform(), color="#eef0f3", lw=0
            )
            pair.margins(x=0.0)
            legend(pair, columns)
        return svg(figure, salt=salt)


def render_page(data: Mapping[str, Any]) -> str:
    """HTML text of the result of `boresight accuracy --protocol`."""
    names, groups = _plotted(data), data["groups"]
    limit = f"{SETTLED_DEG[1]:g}"
    errors = [(g["group"], {n: g["rows"][n][g["judged"]] for n in names}) for g in groups]
    times = [(g["group"], {n: g["rows"][n][f"settled_{limit}"] for n in names}) for g in groups]
    ours = [n for n in names if any("ratio" in g["rows"][n] for g in groups)]
    return page(
        "boresight.sim.attitude.robustness",
        "protocol.html",
        d=data,
        deg=degrees,
        percent=lambda x: UNKNOWN if x is None else f"{100.0 * x:.0f} %",
        names=names,
        ours=ours,
        limits=[f"{x:g}" for x in SETTLED_DEG],
        left_out=LEFT_OUT_S,
        settled_for=SETTLED_FOR_S,
        errors=dots(errors, names, "error, deg (logarithmic)", "errors"),
        times=dots(times, names, f"s until it stays below {limit} deg (logarithmic)", "times"),
        stories=[
            (
                w,
                [
                    story(run, w["estimator"], data["rival"], f"story-{k}-{j}")
                    for j, run in enumerate(w["shown"])
                ],
            )
            for k, w in enumerate(data.get("worse", ()))
        ],
        strips={n: strip(data, n, f"strip-{k}") for k, n in enumerate(ours)},
    )
