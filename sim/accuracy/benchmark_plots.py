"""Plots of the accuracy page as inline SVG."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from boresight.model.declarations import ATTITUDE
from boresight.sim.plotting import INK, figure_and_axes, legend, log_axis, settings, svg

__all__ = ["difference_plot", "mean_plot", "style_of", "total_of", "trial_plot"]

#: Okabe and Ito's colours for ours; the published filters are grey and hollow.
_OURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#8C564B")
_OUR_MARKERS = ("o", "s", "D", "^", "v", "P", "X")
_PEERS = ("#222222", "#222222", "#777777", "#777777", "#aaaaaa")
_PEER_MARKERS = ("o", "D", "s", "^", "v", "<", ">", "p", "h")

Row = Mapping[str, Any]


def style_of(rows: Sequence[Row]) -> dict[str, dict[str, Any]]:
    """Colour, marker and fill of every estimator, by name, in the order of the rows."""
    out: dict[str, dict[str, Any]] = {}
    ours = peers = 0
    for row in rows:
        if row["kind"] == "ours":
            colour = _OURS[ours % len(_OURS)]
            out[row["estimator"]] = {
                "colour": colour,
                "face": colour,
                "marker": _OUR_MARKERS[ours % len(_OUR_MARKERS)],
            }
            ours += 1
        else:
            out[row["estimator"]] = {
                "colour": _PEERS[min(peers // 2, len(_PEERS) - 1)],
                "face": "white",
                "marker": _PEER_MARKERS[peers % len(_PEER_MARKERS)],
            }
            peers += 1
    return out


def total_of(trial: Mapping[str, Any]) -> float | None:
    """Total RMSE [deg] of one trial of a row."""
    total: float | None = trial["error"].get("total")
    return total


def _figure(height: float) -> tuple[Any, Any]:
    """Axes whose rows are named and whose grid runs up and down."""
    figure, axes = figure_and_axes(height)
    axes.grid(False, axis="y")
    axes.set_axisbelow(True)
    axes.spines["left"].set_visible(False)
    axes.tick_params(axis="y", length=0)
    return figure, axes


def mean_plot(rows: Sequence[Row], *, salt: str) -> str:
    """Mean RMSE of every estimator, best on top: bar for the total, marks for its parts."""
    shown = sorted(
        (r for r in rows if (r["mean"] or {}).get("total") is not None),
        key=lambda r: r["mean"]["total"],
    )
    style = style_of(rows)
    with settings():
        figure, axes = _figure(0.9 + 0.29 * len(shown))
        places = range(len(shown))
        totals = [r["mean"]["total"] for r in shown]
        axes.barh(
            places,
            totals,
            height=0.62,
            color=[
                style[r["estimator"]]["colour"] if r["kind"] == "ours" else "#c9cdd3" for r in shown
            ],
        )
        for key, marker, face in (("heading", "o", "white"), ("inclination", "D", INK)):
            axes.plot(
                [r["mean"][key] for r in shown],
                places,
                linestyle="none",
                marker=marker,
                markersize=4.5,
                markeredgecolor=INK,
                markerfacecolor=face,
                markeredgewidth=0.8,
                label=key,
            )
        for k, total in enumerate(totals):
            axes.annotate(
                f"{total:.2f}",
                (total, k),
                xytext=(6, 0),
                textcoords="offset points",
                va="center",
                fontweight="bold" if shown[k]["kind"] == "ours" else None,
            )
        axes.set_yticks(list(places), [r["estimator"] for r in shown])
        axes.invert_yaxis()
        axes.set_xlim(0.0, 1.08 * max(totals, default=1.0))
        axes.set_xlabel("RMSE, deg, mean over the trials with truth (bar: total)")
        legend(axes, 2)
        return svg(figure, salt)


def _dots(
    rows: Sequence[Row],
    trials: Sequence[str],
    figure_of: Callable[[Mapping[str, Any]], float | None],
    label: str,
    *,
    floor: float = 0.0,
    style: Mapping[str, Mapping[str, Any]],
) -> tuple[Any, Any]:
    """One row for each trial, one mark for each estimator."""
    figure, axes = _figure(1.25 + 0.3 * len(trials) + 0.17 * (len(rows) // 5))
    for k in range(len(trials)):
        axes.axhline(k, color="#e6e8eb", linewidth=0.8, zorder=0)
    ordered = [r for r in rows if r["kind"] != "ours"] + [r for r in rows if r["kind"] == "ours"]
    handles = {}
    for row in ordered:
        value = {t["trial"]: figure_of(t) for t in row["trials"]}
        points = [
            (max(x, floor), k)
            for k, name in enumerate(trials)
            if (x := value.get(name)) is not None and max(x, floor) > 0
        ]
        marking = style[row["estimator"]]
        (handles[row["estimator"]],) = axes.plot(
            [x for x, _ in points],
            [y for _, y in points],
            linestyle="none",
            marker=marking["marker"],
            markersize=6.5 if row["kind"] == "ours" else 5.5,
            markeredgecolor=marking["colour"],
            markerfacecolor=marking["face"],
            markeredgewidth=1.1,
            alpha=0.95,
            label=row["estimator"],
            clip_on=False,
        )
    axes.set_yticks(range(len(trials)), [name.replace("_", " ") for name in trials])
    axes.set_ylim(len(trials) - 0.4, -0.6)
    axes.set_xlabel(label)
    names = [r["estimator"] for r in rows]
    axes.legend(
        [handles[n] for n in names],
        names,
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=5,
        borderaxespad=0.2,
        handlelength=1.2,
        columnspacing=1.6,
    )
    return figure, axes


def trial_plot(
    rows: Sequence[Row],
    trials: Sequence[str],
    *,
    salt: str,
    label: str = "total RMSE, deg (logarithmic)",
) -> str:
    """Total RMSE of every estimator on every trial."""
    with settings():
        figure, axes = _dots(rows, trials, total_of, label, style=style_of(rows))
        log_axis(axes)
        return svg(figure, salt)


def difference_plot(rows: Sequence[Row], trials: Sequence[str], *, salt: str) -> str:
    """Largest angle between fixed point and float64 on every trial; below 1e-7 deg at 1e-7."""
    style = style_of(rows)
    ours = [r for r in rows if r["vs_float"]]
    with settings():
        figure, axes = _dots(
            ours,
            trials,
            lambda trial: trial["vs_float"].get(ATTITUDE),
            "largest angle between fixed point and float64, deg",
            floor=1e-7,
            style=style,
        )
        axes.set_xscale("log")
        return svg(figure, salt)
