"""Check, estimate and write report.html and report.json.

boresight report my_filter.py log.csv -o report  # one page about it
boresight report mekf log.csv --no-synth -o report  # sooner: no area, no clock
boresight report mekf folder --widths -o report  # several logs; words of 18 to 32 bits
boresight report mekf log.csv --against old/report.json  # what differs from another run
boresight report mekf long.parquet --rtl-rows 16000 -o report  # RTL on a part of a long log
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any
from urllib.parse import quote

from boresight.arguments import check_machine, check_optional, check_target, check_urgent
from boresight.core_files import map_core, write_text
from boresight.gateware.synthesis.routed import Mapped
from boresight.gateware.synthesis.targets import TARGETS
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.resolve import estimator_of as find_estimator
from boresight.model.tools.files import output_folder
from boresight.options import (
    Config,
    EstimatorName,
    Logs,
    Option,
    OutputFolder,
    Params,
    Urgent,
    Verb,
    Word,
)
from boresight.sim.answer import Answer, JsonObject
from boresight.sim.compare.check import Check
from boresight.sim.compare.results import verdict
from boresight.sim.levels.build import Build
from boresight.sim.records.files import log_files
from boresight.sim.records.log import logs_of
from boresight.sim.report.against import read_report
from boresight.sim.report.data import report_data
from boresight.sim.report.html import render_html
from boresight.sim.report.widths import width_section

__all__ = ["ReportResult", "links_of", "report"]


@dataclass(frozen=True)
class ReportResult(Answer):
    """What `report` gives.

    Attributes
    ----------
    page : Path
        The HTML page.
    report : mapping
        Contents of report.json, and of `to_json`.
    verdict : str
        ``good``, or what failed.
    """

    page: Path
    report: JsonObject = field(repr=False)
    verdict: str = field(repr=False)

    @property
    def good(self) -> bool:
        """Every form is equal, and every output within its tolerance of float64."""
        return self.verdict == "good"

    def to_json(self) -> JsonObject:
        """The contents of report.json."""
        return self.report

    def _shown(self) -> JsonObject:
        accuracy: Any = self.report["accuracy"]
        return {
            "page": str(self.page),
            "good": self.good,
            "verification": self.report["verification"],
            "outputs": accuracy["verdict"].get("outputs"),
        }

    def __str__(self) -> str:
        return f"{self.page}" + ("" if self.good else f"\n{self.verdict}")


def report(
    name: EstimatorName,
    *logs: Logs,
    config: Config = "small",
    word: Word = 32,
    steps: int | None = None,
    synth: bool = True,
    target: str = "xc6slx9",
    widths: bool = False,
    against: Annotated[str | Path | None, Option(metavar="FILE")] = None,
    output: OutputFolder = "build",
    comparison: bool = False,
    params: Params = None,
    urgent: Urgent = None,
    rtl_rows: Annotated[int | None, Option(metavar="N")] = None,
    progress: Callable[[str], None] | None = None,
) -> ReportResult:
    """Check an estimator on logs, estimate area and clock, and write the report.

    Parameters
    ----------
    logs : paths, or data in memory (`Record.of`)
        Logs, or folders of logs.
    steps : int, optional
        Leading samples of each log.
    synth : bool
        Area and clock too (yosys); --no-synth: without.
    target : str
        Part: xc6slx9, ecp5-25k, lifcl-17, ... (docs/targets.md); area alone where it is no
        Spartan-6.
    widths : bool
        Run the first log in words of 18 to 32 bits too: a plot of the errors.
    against : path, optional
        report.json of another run: what differs becomes a table.
    comparison : bool
        The logs' reference is another device's estimate, not truth.
    rtl_rows : int, optional
        Rows of each log that run in RTL, as with check; by default all of them.

    Returns
    -------
    ReportResult

    Raises
    ------
    InputError
        Unknown names, bad log, no log, no report to compare with, folder that cannot be written.
    """
    say = progress or (lambda text: None)
    estimator = find_estimator(name)
    check_machine(config, word)
    check_target(target, TARGETS)
    part = TARGETS[target]
    check_optional("steps", steps, 1)
    check_optional("rtl_rows", rtl_rows, 1)
    check_urgent(urgent, [estimator])
    before = None if against is None else read_report(against)
    build = Build(estimator, config=config, word=word, params=[params], urgent=urgent)
    paths = log_files(log for log in logs if isinstance(log, str | Path))
    records = logs_of(logs, steps)
    if not records:
        raise InputError.at("logs", wanted="at least one log", found="none", fix="name a log file")
    files = ("report.html", "report.json")
    with output_folder(output, "report", files=files, inputs=paths) as folder:
        checking = Check(build, progress=progress)
        results = [
            result
            for log in records
            for result in checking.run(log, keep_all=False, rtl_rows=rtl_rows)
        ]
        area: Mapped | None = None
        if synth:
            say(f"synthesis (yosys) for {part.title}")
            area = map_core(build.core, part)
        swept = width_section(results[0], progress=say) if widths else None
        data = report_data(
            build.core,
            *results,
            area=area,
            comparison=comparison,
            device=part.device,
            grade=part.grade,
            widths=swept,
            before=before,
        )
        write_text(folder / "report.json", json.dumps(data, indent=1) + "\n")
        page = render_html(data, links=links_of(estimator, Path(output)))
        write_text(folder / "report.html", page)
    return ReportResult(Path(output) / "report.html", data, verdict(results))


def links_of(estimator: Estimator, folder: Path) -> dict[str, str]:
    """Addresses, seen from a folder, of the files that an estimator of the user's is written in.

    By name; files that share a name are left out.
    """
    links: dict[str, set[str]] = {}
    for cls in type(estimator).__mro__:
        if cls.__module__.partition(".")[0] in ("boresight", "builtins"):
            continue
        for member in (*vars(cls).values(), *vars(sys.modules.get(cls.__module__, cls)).values()):
            code = getattr(member, "__code__", None)
            if code is not None and Path(code.co_filename).is_file():
                path = Path(code.co_filename).resolve()
                links.setdefault(path.name, set()).add(os.path.relpath(path, folder.resolve()))
    return {name: quote(*paths) for name, paths in links.items() if len(paths) == 1}


VERB = Verb(report)
