"""The times of one sample on the board as a figure: from data-ready to the last bit of the frame.

In the style of Figure 8 of Ma Long et al. (2014), which shows the times of this work in software
on a soft processor: 316 us and 1.14 ms.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from boresight.sim.plotting import COLOUR, INK, figure_and_axes, settings, svg

__all__ = ["Span", "Timeline", "timeline_plot"]


@dataclass(frozen=True)
class Span:
    """A named span of time, us from data-ready."""

    name: str
    start_us: float
    end_us: float

    @property
    def length_us(self) -> float:
        """Duration."""
        return self.end_us - self.start_us


@dataclass(frozen=True)
class Timeline:
    """Times of one update of a filter.

    Attributes
    ----------
    filter : str
        Name of the filter.
    frames : tuple of Span
        The SPI frames of the sample.
    core : tuple of Span
        Programs of the core, in order.
    line : Span
        The frame to the host.
    period_us : float
        From one data-ready to the next.
    paper_us : float or None
        Time of the paper's processor for the filter alone.
    """

    filter: str
    frames: tuple[Span, ...]
    core: tuple[Span, ...]
    line: Span
    period_us: float
    paper_us: float | None

    @property
    def in_registers_us(self) -> float:
        """Data-ready to the new attitude in the registers."""
        return max(span.end_us for span in self.core)


_COLOURS = {"calibrate": COLOUR["amber"], "filter": COLOUR["heading"]}


def timeline_plot(timelines: Sequence[Timeline], *, salt: str) -> str:
    """Three plots: a whole sample, its part in the core, and bars with the paper's times."""
    with settings():
        figure, (sample_axes, core_axes, bar_axes) = figure_and_axes(
            3.4 + 0.62 * len(timelines),
            rows=3,
            height_ratios=[2.4, 0.6 + 0.42 * len(timelines), 0.6 + 0.42 * len(timelines)],
        )
        _plot_sample(sample_axes, timelines[0])
        _plot_core(core_axes, timelines)
        _plot_bars(bar_axes, timelines)
        return svg(figure, salt)


def _row(axes: Any, y: float, span: Span, colour: str, *, text: str = "") -> None:
    axes.barh(
        y,
        span.length_us,
        left=span.start_us,
        height=0.62,
        color=colour,
        edgecolor="white",
        linewidth=0.5,
    )
    if text:
        axes.text(
            (span.start_us + span.end_us) / 2,
            y,
            text,
            ha="center",
            va="center",
            color="white",
            fontsize=7.5,
        )


def _set_rows(axes: Any, names: Sequence[str]) -> None:
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.5, -0.65)
    axes.grid(False, axis="y")
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)
    axes.set_axisbelow(True)


def _plot_sample(axes: Any, timeline: Timeline) -> None:
    """Data-ready, SPI frames, core, host line on one axis."""
    for span in timeline.frames:
        _row(axes, 0, span, COLOUR["roll"])
        axes.text(
            (span.start_us + span.end_us) / 2,
            -0.42,
            span.name,
            ha="center",
            va="bottom",
            fontsize=7,
        )
    for span in timeline.core:
        _row(axes, 1, span, _COLOURS.get(span.name, COLOUR["grey"]))
    _row(axes, 2, timeline.line, COLOUR["sky"], text="attitude frame")
    end = max(timeline.line.end_us, timeline.period_us) * 1.02
    for edge in (0.0, timeline.period_us):
        axes.axvline(edge, color=INK, linewidth=0.8, linestyle=(0, (4, 3)))
    axes.annotate(
        f"attitude in registers {timeline.in_registers_us:.2f} µs",
        (timeline.in_registers_us, 1),
        xytext=(timeline.in_registers_us + 0.02 * end, 1),
        va="center",
    )
    _set_rows(axes, ["SPI frames", "core", "host line"])
    axes.set_xlim(-0.01 * end, end)
    axes.set_xlabel("µs from data-ready; dashed: data-ready of this and of the next sample")
    axes.set_title(f"One sample through the board ({timeline.filter})", loc="left", fontsize=10)


def _plot_core(axes: Any, timelines: Sequence[Timeline]) -> None:
    """The part in the core alone, from the last SPI frame."""
    longest = max(timeline.core[-1].end_us - timeline.core[0].start_us for timeline in timelines)
    for y, timeline in enumerate(timelines):
        start = timeline.core[0].start_us
        for span in timeline.core:
            _row(
                axes,
                y,
                Span(span.name, span.start_us - start, span.end_us - start),
                _COLOURS.get(span.name, COLOUR["grey"]),
                text=span.name if span.length_us > 0.06 * longest else "",
            )
        axes.text(
            timeline.core[-1].end_us - start,
            y,
            f"  {timeline.core[-1].end_us - start:.2f} µs",
            va="center",
        )
    _set_rows(axes, [timeline.filter for timeline in timelines])
    axes.set_xlim(left=0.0, right=1.12 * longest)
    axes.set_xlabel("µs from the last bit of the sample")
    axes.set_title("The core's part: calibration (amber), filter (blue)", loc="left", fontsize=10)


def _plot_bars(axes: Any, timelines: Sequence[Timeline]) -> None:
    """Times of the filters beside the paper's, logarithmic."""
    axes.set_xscale("log")
    for y, timeline in enumerate(timelines):
        filter_us = next(span.length_us for span in timeline.core if span.name == "filter")
        axes.barh(y, filter_us, left=0.1, height=0.3, color=COLOUR["heading"])
        axes.text(1.06 * filter_us, y, f"{filter_us:.2f} µs", va="center")
        if timeline.paper_us is not None:
            axes.plot(
                timeline.paper_us,
                y,
                marker="|",
                markersize=14,
                markeredgewidth=2.4,
                color=COLOUR["pitch"],
            )
            axes.text(
                timeline.paper_us,
                y - 0.42,
                f"{timeline.paper_us:,.0f} µs in the paper",
                ha="right",
                va="center",
                fontsize=8,
                color=COLOUR["pitch"],
            )
    _set_rows(axes, [timeline.filter for timeline in timelines])
    axes.set_xlim(0.1, 3000.0)
    axes.set_xticks([0.1, 1.0, 10.0, 100.0, 1000.0], ["0.1", "1", "10", "100", "1,000"])
    axes.set_xlabel(
        "µs for one update, logarithmic; mark: software on a soft processor at 100 MHz "
        "(Ma Long et al. 2014, Figure 8)"
    )
    axes.set_title("The filter alone, beside the paper", loc="left", fontsize=10)
