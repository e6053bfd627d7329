"""The main job: one core with all filters, both configurations, proven on the bundled recording.

boresight demo -o build  # what `make` does
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from boresight.arguments import check_number
from boresight.core_files import (
    core_files,
    core_texts,
    map_core,
    project_files,
    together,
    write_core,
    write_system,
    write_text,
)
from boresight.gateware.core import Core
from boresight.gateware.synthesis.routed import Mapped
from boresight.gateware.synthesis.targets import TARGETS
from boresight.model.resolve import estimator_of as find_estimator
from boresight.model.tools.failure import ToolFailed
from boresight.model.tools.files import output_folder
from boresight.options import OutputFolder, PythonOnly, Verb
from boresight.sim.answer import Answer
from boresight.sim.boards import board_system
from boresight.sim.compare.check import Check
from boresight.sim.compare.results import CheckResult, verdict
from boresight.sim.levels.build import Build
from boresight.sim.levels.vectors import recorded
from boresight.sim.records.bundled import bundled
from boresight.sim.records.files import read_record
from boresight.sim.report.data import report_data
from boresight.sim.report.html import render_html
from boresight.sim.rtl.simulators import require

__all__ = ["RECORDING", "STEPS", "DemoCore", "DemoFilter", "DemoResult", "demo"]

RECORDING = "ximu_walk"
FILTERS = ("complementary", "ekf_quaternion", "ekf_bias", "mekf")
CONFIGS = ("small", "fast")
#: Cells of the FPGA, as yosys counts them.
CELLS = {"LUT, yosys": "lut", "FF": "ff", "DSP48A1": "dsp", "RAMB16": "ramb16"}
SIMULATOR = "verilator"
#: Leading samples of the recording that every level runs.
STEPS = 4000
#: Simulated time of the complete board, s.
BOARD_S = 0.1


@dataclass(frozen=True)
class DemoCore:
    """A core with all filters: words of microcode, area, and the clock's estimate (-2, median)."""

    config: str
    words: int
    lut: int
    ff: int
    dsp: int
    ramb16: float
    clock_mhz_estimate: float | None


@dataclass(frozen=True)
class DemoFilter:
    """One filter in one core.

    Attributes
    ----------
    estimator, config : str
    good : bool
        Every level is exact, and near to float64.
    cycles_attitude, cycles_interval : int
        To the attitude, and to the next record.
    lane_use : tuple of float
        Share of the cycles in which each lane is busy.
    updates_proven : mapping of str to int
        By simulator.
    mismatches : int
    vs_float_max_deg : float
        Largest difference from float64, degrees.
    report : str
        Its page.
    """

    estimator: str
    config: str
    good: bool
    cycles_attitude: int
    cycles_interval: int
    lane_use: tuple[float, ...]
    updates_proven: Mapping[str, int]
    mismatches: int
    vs_float_max_deg: float
    report: str


@dataclass(frozen=True)
class DemoResult(Answer):
    """What `demo` gives; ``summary.json`` holds it.

    Attributes
    ----------
    log : str
        The recording.
    good : bool
        All filters and the board are good.
    cores : tuple of DemoCore
    filters : tuple of DemoFilter
        Each in each core.
    board : tuple
        Runs of the complete board.
    verdict : str
        ``good``, or what failed first of the filters.
    """

    log: str
    good: bool
    cores: tuple[DemoCore, ...]
    filters: tuple[DemoFilter, ...]
    board: tuple[Any, ...]
    verdict: str

    def __str__(self) -> str:
        table = f"{_filter_table(self.filters)}\n\n{_core_table(self.cores)}"
        runs = "\n".join(map(str, self.board))
        board = f"complete board in simulation, small\n{runs}"
        pages = "\n".join(f"report: {r.report}" for r in self.filters)
        failed = "" if self.verdict == "good" else f"\n{self.verdict}"
        return f"{table}\n\n{board}\n\n{pages}{failed}"


def demo(
    names: Annotated[Sequence[str], PythonOnly] = FILTERS,
    *,
    output: OutputFolder = "build",
    steps: int = STEPS,
    progress: Callable[[str], None] | None = None,
) -> DemoResult:
    """Compile one core with all filters, prove it on the bundled recording, estimate, report.

    Writes ``<output>/core-<config>/`` (Verilog, ISE project of the complete system, C, register
    map, ``report.json`` and a page for each filter) for small and fast, ``<output>/board/``, the
    page of the complete board in simulation, and ``<output>/summary.json``.

    Parameters
    ----------
    names : sequence of str
        Filters.
    output : path
        Folder for the files.
    steps : int
        Leading samples of the recording.

    Returns
    -------
    DemoResult
        Figures of both cores, of each filter in them and of the board.

    Raises
    ------
    ToolMissing
        There is no Verilator, or not what it needs.
    ToolFailed
        A level could not run; found before the first synthesis.
    """
    say = progress or (lambda text: None)
    estimators = [find_estimator(name) for name in names]
    check_number("steps", steps, 1)
    record = read_record(bundled(RECORDING)).head(steps)
    cores: list[DemoCore] = []
    rows: list[DemoFilter] = []
    verdicts: list[str] = []
    require(SIMULATOR)
    with output_folder(output, "demo", files=_files(names)) as folder:
        for config in CONFIGS:
            place = folder / f"core-{config}"
            place.mkdir()
            say(f"{config}: {', '.join(names)} in one core")
            build = Build(*estimators, config=config)
            results = Check(build, simulator=SIMULATOR, progress=say).run(record)
            _require_runs(results)
            say("synthesis (yosys) and clock estimate")
            area = map_core(build.core, TARGETS["xc6slx9"])
            write_core(place, build.core, core_texts(build, recorded(build), area=area))
            system = board_system().core(
                names, config=config, word=32, clock_hz=100_000_000, params={}
            )
            write_system(place / "ise-mimas", "mimas", system)
            if config == CONFIGS[0]:
                of_board = system
            cores.append(_figures(build.core, area))
            shown = Path(output) / place.name
            rows += _report(place, shown, build, results, area, say)
            verdicts.append(verdict(results))
        say("the complete board, both sensors at its pins")
        (folder / "board").mkdir()
        board = board_system().simulate(
            folder / "board",
            names[-1],
            None,
            config=CONFIGS[0],
            seconds=BOARD_S,
            source="heading",
            feed=None,
            core=of_board,
            say=say,
        )
        board_verdict = "good" if board.good else "FAILED: the complete board"
        result = DemoResult(
            log=RECORDING,
            good=board.good and all(r.good for r in rows),
            cores=tuple(cores),
            filters=tuple(rows),
            board=board.runs,
            verdict=next((text for text in verdicts if text != "good"), board_verdict),
        )
        write_text(folder / "summary.json", json.dumps(result.to_json(), indent=1) + "\n")
    return result


def _files(names: Sequence[str]) -> list[str]:
    """What is written."""
    core = [*core_files(names), *project_files("mimas", system=True)]
    core += [f"report-{name}.html" for name in names]
    return [
        *(f"core-{config}/{name}" for config in CONFIGS for name in core),
        *(f"board/{name}" for name in board_system().files),
        "summary.json",
    ]


def _require_runs(results: Sequence[CheckResult]) -> None:
    """Raise if a level could not run, with the reason."""
    for level in (level for result in results for level in result.levels):
        if level.error:
            raise ToolFailed(f"{level.level} in {level.simulator}: {level.error}")


def _report(
    folder: Path,
    shown: Path,
    build: Build,
    results: Sequence[CheckResult],
    area: Mapped,
    say: Callable[[str], None],
) -> list[DemoFilter]:
    """All filters of a core on the recording, in turns: their pages, report.json, a row for each.

    ``shown`` is the folder's name when all is done.
    """
    rows, reports = [], []
    for number, result in enumerate(results):
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


def _figures(core: Core, area: Mapped) -> DemoCore:
    """The figures of a core as a whole."""
    return DemoCore(
        config=core.machine.name,
        words=len(core.image.rom),
        lut=round(area.used["lut"]),
        ff=round(area.used["ff"]),
        dsp=round(area.used["dsp"]),
        ramb16=area.used["ramb16"],
        clock_mhz_estimate=None if area.clock is None else area.clock.median_mhz,
    )


def _row(report: dict[str, Any], *, good: bool, page: str) -> DemoFilter:
    """The figures of one filter in one core."""
    timing, levels = report["timing"], report["verification"]
    return DemoFilter(
        estimator=report["design"],
        config=report["config"],
        good=good,
        cycles_attitude=timing["latency_cycles"]["predicted"],
        cycles_interval=timing["interval_cycles"],
        lane_use=tuple(lane["utilisation"] for lane in report["schedule"]["lanes"]),
        updates_proven={x["simulator"]: x["n_total"] for x in levels},
        mismatches=sum(x["n_mismatch"] for x in levels),
        vs_float_max_deg=report["accuracy"]["vs_float_max_deg"],
        report=page,
    )


def _filter_table(filters: Sequence[DemoFilter]) -> str:
    """The filters for people."""
    head = ("filter", "core", "attitude", "next", "lanes busy", "in RTL", "wrong", "vs float")
    lines = [head, ("", "", "cycles", "cycles", "%", "updates", "", "max deg")]
    for r in filters:
        lines.append(
            (
                r.estimator,
                r.config,
                str(r.cycles_attitude),
                str(r.cycles_interval),
                " ".join(f"{100 * use:.0f}" for use in r.lane_use),
                str(r.updates_proven[SIMULATOR]),
                str(r.mismatches),
                f"{r.vs_float_max_deg:.6f}",
            )
        )
    return "\n".join(f"{a:16s}{b:7s}" + "".join(f"{c:>11s}" for c in rest) for a, b, *rest in lines)


def _core_table(cores: Sequence[DemoCore]) -> str:
    """The cores for people."""
    part = TARGETS["xc6slx9"].device
    lines = [f"{'core with all of them':40s}" + "".join(f"{c.config:>12s}" for c in cores)]
    for name, key in (
        ("microcode, words", "words"),
        *((f"{name} (of {part.capacity(key):,})", key) for name, key in CELLS.items()),
        ("clock, MHz (estimate, xc6slx9-2, median nets)", "clock_mhz_estimate"),
    ):
        lines.append(f"{name:40s}" + "".join(f"{getattr(c, key)!s:>12s}" for c in cores))
    return "\n".join(lines)


VERB = Verb(demo)
