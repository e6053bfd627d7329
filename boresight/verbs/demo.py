"""The main job of `make`: all filters in one core, both configurations, on bundled real data."""

from __future__ import annotations

import json
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from boresight.arguments import check_number
from boresight.core_files import core_files, project_files, write_core, write_system, write_text
from boresight.disk.output import output_folder
from boresight.gateware.core import Core
from boresight.gateware.synthesis.estimate import Estimate
from boresight.gateware.system.programs import system_core
from boresight.model.resolve import estimator_of as find_estimator
from boresight.options import Outcome, progress_of
from boresight.sim.board.setup import REAL
from boresight.sim.compare.check import Check
from boresight.sim.levels.build import Build
from boresight.sim.records.bundled import bundled
from boresight.sim.records.files import read_record
from boresight.sim.records.record import Record
from boresight.sim.report.data import report_data
from boresight.sim.report.html import render_html
from boresight.verbs.compile import estimate_core, together
from boresight.verbs.simulate import BOARD_FILES, default_log, simulate_text, write_board

__all__ = ["FILTERS", "RECORDING", "STEPS", "add_arguments", "call", "demo", "summary_table"]

RECORDING = "ximu_walk"
#: Programs of the core, by number.
FILTERS = ("complementary", "ekf_quaternion", "ekf_bias", "mekf")
CONFIGS = ("small", "fast")
#: Leading samples of the recording that every level runs.
STEPS = 4000
#: Simulated time of the complete board, s.
BOARD_S = 0.1


def demo(
    names: Sequence[str] = FILTERS,
    *,
    output: str | Path = "build",
    steps: int = STEPS,
    restarts: int | None = None,
    progress: Callable[[str], None] | None = None,
) -> dict[str, Any]:
    """Compile one core with all filters, prove it on the bundled recording, estimate, report.

    Writes ``<output>/core-<config>/`` (Verilog, ISE project of the complete system, C, register
    map, ``report.json`` and a page for each filter) for small and fast, ``<output>/board/``, the
    page of the complete board in simulation, and ``<output>/summary.json``. ``restarts`` is the
    effort of the scheduler.
    """
    say = progress or (lambda text: None)
    estimators = [find_estimator(name) for name in names]
    check_number("steps", steps, 1)
    record = read_record(bundled(RECORDING)).head(steps)
    summary: dict[str, Any] = {"log": RECORDING, "good": False, "cores": [], "filters": []}
    with output_folder(output, "demo", of=",".join(names), files=_files(names)) as folder:
        for config in CONFIGS:
            place = folder / f"core-{config}"
            place.mkdir()
            say(f"{config}: {', '.join(names)} in one core")
            build = Build(*estimators, config=config, restarts=restarts)
            say("synthesis (yosys) and clock estimate")
            area = estimate_core(build.core)
            write_core(place, build, area=area)
            system = system_core(names, config=config, restarts=restarts)
            write_system(place / "ise-mimas", "mimas", system)
            if config == CONFIGS[0]:
                of_board = system
            summary["cores"].append(_figures(build.core, area))
            shown = Path(output) / place.name
            summary["filters"] += _prove(place, shown, build, record, area, say)
        say("the complete board, both sensors at its pins")
        (folder / "board").mkdir()
        updates = round(BOARD_S * REAL.rate_hz)
        board = write_board(
            folder / "board", names[-1], of_board, default_log(updates), updates=updates, say=say
        )
        summary["board"] = board["runs"]
        summary["good"] = board["good"] and all(r["good"] for r in summary["filters"])
        write_text(folder / "summary.json", json.dumps(summary, indent=1) + "\n")
    return summary


def _files(names: Sequence[str]) -> list[str]:
    """What is written."""
    core = [*core_files(names), *project_files("mimas", system=True)]
    core += [f"report-{name}.html" for name in names]
    return [
        *(f"core-{config}/{name}" for config in CONFIGS for name in core),
        *(f"board/{name}" for name in BOARD_FILES),
        "summary.json",
    ]


def _prove(
    folder: Path,
    shown: Path,
    build: Build,
    record: Record,
    area: Estimate,
    say: Callable[[str], None],
) -> list[dict[str, Any]]:
    """All filters of a core on the recording, in turns: their pages, report.json, a row for each.

    ``shown`` is the folder's name when all is done.
    """
    rows, reports = [], []
    found = Check(build, simulator="verilator", progress=say).run(record)
    for number, result in enumerate(found):
        for line in (result.estimator, *(f"  {x.line()}" for x in result.levels)):
            say(line)
        report = report_data(build.core.select(number), result, area=area, comparison=True)
        page = f"report-{result.estimator}.html"
        write_text(folder / page, render_html(report))
        reports.append(report)
        rows.append(_row(report, good=result.good, page=str(shown / page)))
    data = together(build.core, reports)
    write_text(folder / "report.json", json.dumps(data, indent=1) + "\n")
    return rows


def _figures(core: Core, area: Estimate) -> dict[str, Any]:
    """The figures of a core as a whole."""
    fmax = area.corner(grade=2, nets="median").fmax_mhz
    return {
        "config": core.machine.name,
        "words": len(core.image.rom),
        "lut": area.area.lut,
        "ff": area.area.ff,
        "dsp": area.area.dsp,
        "ramb16": area.area.ramb16,
        "clock_mhz_estimate": None if fmax is None else round(fmax, 1),
    }


def _row(report: dict[str, Any], *, good: bool, page: str) -> dict[str, Any]:
    """The figures of one filter in one core."""
    timing, levels = report["timing"], report["verification"]
    return {
        "estimator": report["design"],
        "config": report["config"],
        "good": good,
        "cycles_attitude": timing["latency_cycles"]["predicted"],
        "cycles_interval": timing["interval_cycles"],
        "paper_cycles": timing["paper_cycles"],
        "speedup": timing["speedup"],
        "lane_use": [lane["utilisation"] for lane in report["schedule"]["lanes"]],
        "updates_proven": {x["simulator"]: x["n_total"] for x in levels},
        "mismatches": sum(x["n_mismatch"] for x in levels),
        "vs_float_max_deg": report["accuracy"]["vs_float_max_deg"],
        "report": page,
    }


def summary_table(data: dict[str, Any]) -> str:
    """The summary as two tables for people."""
    head = (
        "filter",
        "core",
        "attitude",
        "next",
        "paper",
        "faster",
        "lanes busy",
        "in RTL",
        "wrong",
        "vs float",
    )
    lines = [head, ("", "", "cycles", "cycles", "cycles", "", "%", "updates", "", "max deg")]
    for r in data["filters"]:
        lines.append(
            (
                r["estimator"],
                r["config"],
                r["cycles_attitude"],
                r["cycles_interval"],
                r["paper_cycles"],
                f"{r['speedup']}x",
                " ".join(f"{100 * use:.0f}" for use in r["lane_use"]),
                r["updates_proven"].get("verilator", 0),
                r["mismatches"],
                f"{r['vs_float_max_deg']:.6f}",
            )
        )
    text = "\n".join(
        f"{a:16s}{b:7s}" + "".join(f"{c!s:>11s}" for c in rest) for a, b, *rest in lines
    )
    text += f"\n\n{'core with all of them':40s}" + "".join(
        f"{c['config']:>12s}" for c in data["cores"]
    )
    for name, key in (
        ("microcode, words", "words"),
        ("LUT (yosys, of 5,720)", "lut"),
        ("FF (of 11,440)", "ff"),
        ("DSP48A1 (of 16)", "dsp"),
        ("RAMB16 (of 32)", "ramb16"),
        ("clock, MHz (estimate, -2, median nets)", "clock_mhz_estimate"),
    ):
        text += f"\n{name:40s}" + "".join(f"{c[key]!s:>12s}" for c in data["cores"])
    if "board" in data:
        text += "\n\ncomplete board in simulation, small\n" + simulate_text({"runs": data["board"]})
    return text


def add_arguments(parser: ArgumentParser) -> None:
    """What the command line takes."""
    parser.add_argument("-o", "--output", default="build", metavar="DIR")
    parser.add_argument("--steps", type=int, default=STEPS, help="leading samples of the recording")


def call(args: Namespace) -> Outcome:
    """Do it; see `Outcome`."""
    data = demo(output=args.output, steps=args.steps, progress=progress_of(args))
    text = (
        summary_table(data) + "\n\n" + "\n".join(f"report: {r['report']}" for r in data["filters"])
    )
    return 0 if data["good"] else 1, data, text
