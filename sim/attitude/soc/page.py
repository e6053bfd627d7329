"""The page of the comparison: hardware, integer C, float C and the paper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from boresight.sim.attitude.ma2014.paper import CLOCK_MHZ
from boresight.sim.pages import Section, page_of
from boresight.sim.plotting import COLOUR, INK, figure_and_axes, legend, settings, svg

__all__ = ["bars", "render_page", "timeline"]

_FORMS = (
    ("float C", "float", COLOUR["pitch"]),
    ("integer C", "integer", COLOUR["amber"]),
    ("core", "hardware", COLOUR["heading"]),
)

#: Head of the table.
_COLUMNS = (
    *("filter", "float C, cycles", "integer C, cycles", "core, cycles", "the paper, cycles"),
    *("integer C / core", "float C / core", "float C, bytes", "integer C, bytes"),
    *("integer C, updates that differ", "float C from float64, deg"),
)

Row = Mapping[str, Any]


def _cycles(row: Row, form: str) -> float:
    value = row[form]["cycles"]
    return float(value if form == "hardware" else value["median"])


def bars(rows: Sequence[Row], *, salt: str = "soc-bars") -> str:
    """Cycles of one update, logarithmic: three bars for each filter, the paper's as a mark."""
    with settings():
        figure, axes = figure_and_axes(0.9 + 0.72 * len(rows))
        axes.set_xscale("log")
        for k, (label, form, colour) in enumerate(_FORMS):
            positions = [y + 0.26 * (k - 1) for y in range(len(rows))]
            values = [_cycles(row, form) for row in rows]
            axes.barh(positions, values, left=0.0, height=0.23, color=colour, label=label)
            for y, value in zip(positions, values, strict=True):
                axes.text(1.05 * value, y, f"{value:,.0f}", va="center", fontsize=8)
        paper = [(y, row["paper_cycles"]) for y, row in enumerate(rows) if row["paper_cycles"]]
        axes.plot(
            [c for _, c in paper],
            [y - 0.26 for y, _ in paper],
            linestyle="none",
            marker="|",
            markersize=15,
            markeredgewidth=2.2,
            color=INK,
            label="float C in the paper",
        )
        axes.set_yticks(range(len(rows)), [row["estimator"] for row in rows])
        axes.set_ylim(len(rows) - 0.5, -0.5)
        axes.set_xlim(100.0, 1e6)
        ticks = [10**k for k in range(2, 7)]
        axes.set_xticks(ticks, [f"{tick:,}" for tick in ticks])
        axes.grid(False, axis="y")
        axes.tick_params(axis="y", length=0)
        axes.set_axisbelow(True)
        axes.set_xlabel("cycles of one update, logarithmic")
        legend(axes, 4)
        return svg(figure, salt)


def timeline(rows: Sequence[Row], *, salt: str = "soc-time") -> str:
    """Times of one update at the paper's clock, linear; the paper's two times as lines."""
    with settings():
        figure, axes = figure_and_axes(0.9 + 0.72 * len(rows))
        for k, (label, form, colour) in enumerate(_FORMS):
            positions = [y + 0.26 * (k - 1) for y in range(len(rows))]
            axes.barh(
                positions,
                [_cycles(row, form) / CLOCK_MHZ for row in rows],
                height=0.23,
                color=colour,
                label=label,
            )
        peak = max(_cycles(row, "float") for row in rows) / CLOCK_MHZ
        for row_at, row in enumerate(rows):
            time = _cycles(row, "hardware") / CLOCK_MHZ
            axes.text(time + 0.006 * peak, row_at + 0.26, f"{time:.2f} µs", va="center", fontsize=8)
        for name, cycles in {
            (f"{row['paper_cycles'] / CLOCK_MHZ:,.0f} µs in the paper", row["paper_cycles"])
            for row in rows
            if row["paper_cycles"]
        }:
            axes.axvline(cycles / CLOCK_MHZ, color=INK, linewidth=0.9, linestyle=(0, (4, 3)))
            axes.text(cycles / CLOCK_MHZ, len(rows) - 0.52, f" {name}", fontsize=8, va="bottom")
        axes.set_yticks(range(len(rows)), [row["estimator"] for row in rows])
        axes.set_ylim(len(rows) - 0.5, -0.5)
        axes.set_xlim(0.0, 1.06 * peak)
        axes.grid(False, axis="y")
        axes.tick_params(axis="y", length=0)
        axes.set_axisbelow(True)
        axes.set_xlabel(f"µs for one update at {CLOCK_MHZ:g} MHz")
        legend(axes, 3)
        return svg(figure, salt)


def _cells(row: Row) -> list[str]:
    """A row of the table."""
    paper, ratios = row["paper_cycles"], row["ratios"]
    return [
        row["estimator"],
        *(f"{_cycles(row, form):,.0f}" for form in ("float", "integer", "hardware")),
        f"{paper:,}" if paper else "",
        f"{ratios['integer_to_hardware']:.0f}",
        f"{ratios['float_to_hardware']:.0f}",
        f"{row['float']['code_bytes']:,}",
        f"{row['integer']['code_bytes']:,}",
        f"{row['integer']['mismatches']} of {row['integer']['updates']:,}",
        f"{row['float']['apart_deg']:.1e}",
    ]


def _offload(row: Row) -> str:
    """Result of the complete board."""
    to_memory = row["update_to_memory_cycles"]
    return (
        f"The complete board with {row['estimator']} on the core: {row['in_memory']:,} of "
        f"{row['updates']:,} updates in the processor's memory, {row['mismatches']} differ; sample "
        f"to results {row['sample_to_update_cycles']['max']} cycles, from there through the "
        f"interrupt into memory {to_memory['median']} (at most {to_memory['max']})."
    )


def render_page(report: Mapping[str, Any]) -> str:
    """HTML text of the report of ``python -m boresight.sim.attitude.soc -o DIR``."""
    rows = report["software"]
    sections = [
        Section(figures=[("", bars(rows))]),
        Section(
            title="Time of one update, as in Figure 8 of Ma Long et al. (2014)",
            figures=[("", timeline(rows))],
        ),
        Section(title="Figures", columns=_COLUMNS, rows=[*map(_cells, rows)], right=True),
    ]
    if "offload" in report:
        sections.append(Section(title="Offload", text=_offload(report["offload"])))
    return page_of(
        "Hardware and software on one FPGA",
        [
            "The same filters as float C with the soft-float library (the paper's way), as integer "
            "C (bit-equal to the core), both on a simulated VexRiscv, and on the core: "
            f"{rows[0]['integer']['updates']:,} recorded updates of {rows[0]['log']} each, by the "
            "processor's own cycle counter."
        ],
        sections,
        note="Cycles are medians; the core's are those from the sample to the attitude. Our "
        "estimate for the soft core's clock is 65 MHz, so microseconds at "
        f"{CLOCK_MHZ:g} MHz are cycles in the paper's unit, not a promise. Made by make firmware.",
    )
