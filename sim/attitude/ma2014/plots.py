"""Plots of the page, as inline SVG; their captions are in page.html."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from boresight.sim.attitude.ma2014 import paper
from boresight.sim.plotting import COLOUR, figure_and_axes, legend, settings, svg

__all__ = ["plots"]

AXES = paper.AXES
_METHOD = {
    "gyro": COLOUR["amber"],
    "mag_acc": COLOUR["other"],
    "complementary": COLOUR["heading"],
    "ekf_quaternion": COLOUR["roll"],
    "ekf_quaternion_vector": COLOUR["sky"],
    "letter": COLOUR["grey"],
}
_NUMBER = {
    "gyro": "Figure 1: gyro alone",
    "mag_acc": "Figure 2: mag/acc alone",
    "complementary": "Figure 5: complementary filter",
}
_TIME = "time from the start of the motion, s"


def _limit(axes: Any, value: float) -> None:
    """The paper's largest difference, both signs."""
    for sign in (-1.0, 1.0):
        axes.axhline(sign * value, color="#444444", linewidth=0.8, linestyle=(0, (4.0, 3.0)))
    axes.annotate(
        f"dashed: \N{PLUS-MINUS SIGN}{value:g} deg, paper",
        (1.0, 1.0),
        xycoords="axes fraction",
        ha="right",
        va="bottom",
        fontsize=8,
        xytext=(0, 2),
        textcoords="offset points",
    )


def motion_plot(figures: Mapping[str, Any]) -> str:
    """Stage angles and the Euler angles they make."""
    t, stages, truth = (np.asarray(figures[k]) for k in ("time_s", "stages_deg", "truth_deg"))
    with settings():
        figure, (upper, lower) = figure_and_axes(3.9, 2, sharex=True, sharey=True)
        for axes, curves, names in (
            (upper, stages, ("stage x", "stage y", "stage z")),
            (lower, truth, AXES),
        ):
            for k, name in enumerate(names):
                axes.plot(t[::2], curves[::2, k], color=COLOUR[AXES[k]], label=name)
            axes.set_yticks((-20, -10, 0, 10, 20))
            legend(axes, 3)
        upper.set_ylabel("stage angle, deg")
        lower.set_ylabel("Euler angle, deg")
        lower.set_xlabel(_TIME)
        lower.set_xlim(0.0, t[-1])
        return svg(figure, "motion")


def spectra_plot(spectra: Mapping[str, Any]) -> str:
    """Amplitude spectra of the heading error: gyro, mag/acc, complementary filter."""
    f = np.asarray(spectra["frequency_hz"])
    with settings():
        figure, rows = figure_and_axes(5.4, 3, sharex=True)
        for axes, key in zip(rows, _NUMBER, strict=True):
            method = spectra["methods"][key]
            for n in range(1, 7):
                axes.axvline(
                    n * spectra["line_hz"],
                    color="#8a8f98",
                    linewidth=0.8,
                    linestyle=(0, (1.0, 2.5)),
                )
            axes.vlines(f[1:], 0.0, method["amplitude_deg"][1:], color=_METHOD[key], linewidth=1.4)
            axes.set_ylim(bottom=0.0)
            axes.margins(y=0.12)
            axes.set_ylabel("amplitude, deg")
            axes.set_title(
                f"{_NUMBER[key]} (below {spectra['slow_hz']:g} Hz: "
                f"{100 * method['energy_below_slow']['shown']:.0f} % of its energy; "
                f"line at 1/6 Hz: {method['line_deg']['shown']:.3f} deg)",
                loc="left",
                fontsize=9,
            )
        rows[-1].set_xlabel("frequency, Hz (dotted: multiples of 1/6 Hz)")
        rows[-1].set_xlim(0.0, 1.0)
        rows[-1].set_xticks(np.arange(0.0, 1.01, 0.1))
        return svg(figure, "spectra")


def _three(
    name: str,
    height: float,
    t: np.ndarray,
    limits: Sequence[float],
    curves: Sequence[tuple[np.ndarray, str | None, str]],
    label: str,
) -> str:
    """Curves (steps, 3) of each angle: values, colour (None: the angle's), name in the legend."""
    with settings():
        figure, rows = figure_and_axes(height, 3, sharex=True)
        for k, axes in enumerate(rows):
            for values, colour, title in curves:
                ink = colour or COLOUR[AXES[k]]
                axes.plot(t, values[:, k], color=ink, label=title or None, linewidth=0.9)
            _limit(axes, limits[k])
            axes.set_ylabel(f"{AXES[k]}{label}, deg")
            axes.margins(y=0.15)
        if len(curves) > 1:
            legend(rows[0], 2)
        rows[-1].set_xlabel(_TIME)
        rows[-1].set_xlim(0.0, t[-1])
        return svg(figure, name)


def error_plot(figures: Mapping[str, Any]) -> str:
    """Figure 6: complementary filter less truth, consistent and as printed."""
    t, error = np.asarray(figures["time_s"]), figures["error_deg"]
    curves = (
        (np.asarray(error["complementary_as_printed"]), "#b9bec6", "eq. (3) as printed"),
        (np.asarray(error["complementary"]), None, "complementary, consistent kinematics"),
    )
    return _three("error", 5.8, t, paper.FIG_6_DEG, curves, " error")


def difference_plot(figures: Mapping[str, Any], key: str) -> str:
    """Figure 7: complementary filter less Kalman filter."""
    t, error = np.asarray(figures["time_s"]), figures["error_deg"]
    d = np.asarray(error["complementary"]) - np.asarray(error[key])
    return _three(f"difference-{key}", 5.0, t, (paper.FIG_7_DEG,) * 3, ((d, None, ""),), "")


#: Rows of the plot of Table 3.
_NAMES = {
    "gyro": "gyro alone",
    "mag_acc": "mag/acc alone",
    "ekf_quaternion": "Kalman, quaternion",
    "ekf_quaternion_vector": "Kalman, vectors",
    "complementary": "complementary",
    "letter": "to the letter",
}


def table_3_plot(rows: Mapping[str, Any]) -> str:
    """Table 3, case C: the paper's values among ours."""
    dot = {"markersize": 5, "markeredgecolor": "white", "markeredgewidth": 0.8}
    with settings():
        figure, columns = figure_and_axes(0.42 * len(_NAMES) + 1.1, 1, 3, sharey=True)
        for axis, axes in enumerate(columns):
            for y, key in enumerate(_NAMES):
                row, ink = rows[key], _METHOD[key]
                sd = {q: x[axis] for q, x in (row["fixed"] or row["float"])["sd"].items()}
                axes.hlines(y, sd["p05"], sd["p95"], color=ink, linewidth=1.4)
                axes.hlines(y, sd["p25"], sd["p75"], color=ink, linewidth=6.0, alpha=0.55)
                axes.plot(sd["median"], y, "o", color=ink, **dot)
                printed = paper.TABLE_3[row["paper_row"]][axis]
                axes.plot(printed, y, "D", color="#111111", markersize=4.5, markerfacecolor="none")
            axes.set_xscale("log")
            axes.set_xlim(0.05, 1.6)
            axes.set_xticks((0.05, 0.1, 0.2, 0.5, 1.0), ("0.05", "0.1", "0.2", "0.5", "1"))
            axes.minorticks_off()
            axes.set_title(AXES[axis], loc="left", fontsize=9.5, fontweight="bold")
            axes.set_xlabel("standard deviation of the error, deg")
        columns[0].set_yticks(range(len(_NAMES)), list(_NAMES.values()))
        columns[0].set_ylim(len(_NAMES) - 0.5, -0.5)
        return svg(figure, "table-3")


def timing_plot(rows: Sequence[Mapping[str, Any]]) -> str:
    """Figure 8: time of one update."""
    bars = [
        ("complementary, paper (MicroBlaze)", paper.TIME_US["complementary"], "#9aa0a8"),
        ("Kalman, paper (MicroBlaze)", paper.TIME_US["kalman"], "#9aa0a8"),
    ]
    bars += [
        (f"{_NAMES[r['estimator']]}, core {r['config']}", r["us"], _METHOD[r["estimator"]])
        for r in rows
    ]
    with settings():
        figure, axes = figure_and_axes(0.3 * len(bars) + 0.7)
        axes.grid(False, axis="y")
        axes.barh(
            range(len(bars)), [us for _, us, _ in bars], color=[c for _, _, c in bars], height=0.62
        )
        for y, (_, us, _) in enumerate(bars):
            text = f"{us:,.0f}" if us > 100.0 else f"{us:.2f}"
            axes.annotate(
                f"{text} \N{MICRO SIGN}s",
                (us, y),
                xytext=(4, 0),
                textcoords="offset points",
                va="center",
            )
        axes.set_xscale("log")
        axes.set_xlim(1.0, 3000.0)
        axes.set_xticks((1, 10, 100, 1000), ("1", "10", "100", "1,000"))
        axes.minorticks_off()
        axes.set_yticks(range(len(bars)), [name for name, _, _ in bars])
        axes.invert_yaxis()
        axes.set_xlabel("time from sample to attitude at 100 MHz, \N{MICRO SIGN}s")
        return svg(figure, "timing")


def plots(data: Mapping[str, Any]) -> dict[str, str]:
    """All of them by name."""
    figures = data["figures"]
    return {
        "motion": motion_plot(figures),
        "spectra": spectra_plot(data["spectra"]),
        "error": error_plot(figures),
        "difference": difference_plot(figures, "ekf_quaternion"),
        "difference_vector": difference_plot(figures, "ekf_quaternion_vector"),
        "table_3": table_3_plot(data["table_3"]["cases"]["C"]),
        "timing": timing_plot(data["timing"]),
    }
