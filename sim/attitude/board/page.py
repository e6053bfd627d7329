"""The page of a simulated board: one self-contained HTML file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from boresight.sim.attitude.board.timeline import Timeline, timeline_plot
from boresight.sim.pages import Section, Verdict, page_of

__all__ = ["render_page"]


#: Head of the table.
_COLUMNS = (
    *("filter", "updates", "samples lost", "words that differ", "with a fresh field"),
    *("data-ready to sample, µs", "program, cycles", "beside it, µs"),
    *("data-ready to registers, µs", "to the last bit, µs"),
)


def _cells(run: Mapping[str, Any], clock_mhz: float) -> list[str | Verdict]:
    """A row of the table."""
    lost, mismatches = run["lost_samples"], run["mismatches"]
    return [
        run["filter"],
        f"{run['updates']:,}",
        *(Verdict(str(count), good=False) if count else "0" for count in (lost, mismatches)),
        str(run["fields"]),
        f"{run['transfer_cycles'][1] / clock_mhz:.2f}",
        str(run["program_cycles"]),
        f"{run['beside_program_us']:.2f}",
        f"{run['in_registers_us']:.2f}",
        f"{run['frame_end_us']:.0f}",
    ]


def render_page(data: Mapping[str, Any], timelines: Sequence[Timeline]) -> str:
    """HTML text of the result of `boresight run ESTIMATOR board`."""
    equal = "Every attitude frame equals the integer models, word by word; no sample was lost."
    return page_of(
        "The complete board in simulation",
        [
            "ADIS16385 on SPI and HMR3300 on its serial line at the pins; configuration "
            f"{data['config']}, {data['clock_mhz']:.0f} MHz, compass: {data['source']}, motion: "
            f"{data['log']}. Build {data['build']}.",
            equal if data["good"] else Verdict("FAILED: see the table.", good=False),
        ],
        [
            Section(figures=[("", timeline_plot(timelines, salt="board"))]),
            Section(
                title="Figures",
                columns=_COLUMNS,
                rows=[_cells(run, data["clock_mhz"]) for run in data["runs"]],
                right=True,
            ),
        ],
        note='All times are counted in the simulation, worst update. "Beside it": calibration, '
        "change of program, results. The host's line runs at "
        f"{data['setup']['host_baud']:,} baud and gets every update. Waits after power-up are "
        "shortened; all other speeds are the real ones. Made by boresight run.",
    )
