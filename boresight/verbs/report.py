"""`boresight report`: one HTML page and one JSON file about an estimator on logs."""

from __future__ import annotations

import json
import os
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import quote

from boresight.arguments import check_machine, check_number
from boresight.core_files import write_text
from boresight.disk.output import output_folder
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.resolve import Named
from boresight.model.resolve import estimator_of as find_estimator
from boresight.options import Outcome, model_options, params_of, progress_of
from boresight.sim.answer import Answer, JsonObject
from boresight.sim.compare.check import Check
from boresight.sim.compare.results import verdict
from boresight.sim.levels.build import Build
from boresight.sim.records.files import log_files, read_logs
from boresight.sim.report.against import read_report
from boresight.sim.report.data import report_data
from boresight.sim.report.html import render_html
from boresight.sim.report.widths import width_section
from boresight.verbs.compile import estimate_core

__all__ = ["ReportResult", "add_arguments", "call", "links_of", "report"]


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
    name: Named,
    *logs: Any,
    config: str = "small",
    word: int = 32,
    steps: int | None = None,
    synth: bool = True,
    widths: bool = False,
    against: str | Path | None = None,
    output: str | Path = "build",
    comparison: bool = False,
    params: Mapping[str, float] | None = None,
    progress: Callable[[str], None] | None = None,
) -> ReportResult:
    """Check an estimator on logs, estimate area and clock, and write the report.

    Parameters
    ----------
    logs
        Paths of logs or folders, or what `sim.records.record.Record.of` takes.
    widths : bool
        Run the first log in words of other widths too.
    against : path, optional
        The report.json of another run: what differs becomes a table.
    comparison : bool
        The logs' reference is another device's estimate, not truth.

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
    if steps is not None:
        check_number("steps", steps, 1)
    before = None if against is None else read_report(against)
    build = Build(estimator, config=config, word=word, params=[params])
    paths = log_files(log for log in logs if isinstance(log, str | Path))
    records = [record.head(steps) for record, _ in read_logs(logs)]
    if not records:
        raise InputError.at("logs", wanted="at least one log", found="none", fix="name a log file")
    files = ("report.html", "report.json")
    with output_folder(output, "report", of=estimator.name, files=files, inputs=paths) as folder:
        checking = Check(build, progress=progress)
        results = [result for record in records for result in checking.run(record)]
        area = None
        if synth:
            say("synthesis (yosys) and clock estimate")
            area = estimate_core(build.core)
        swept = width_section(results[0], progress=say) if widths else None
        data = report_data(
            build.core, *results, area=area, comparison=comparison, widths=swept, before=before
        )
        write_text(folder / "report.json", json.dumps(data, indent=1) + "\n")
        page = render_html(data, links=links_of(estimator, Path(output)))
        write_text(folder / "report.html", page)
    return ReportResult(Path(output) / "report.html", data, verdict(results))


def links_of(estimator: Estimator, folder: Path) -> dict[str, str]:
    """Addresses, seen from a folder, of the files that an estimator of the user's is written in.

    By name; of two files of one name there is none.
    """
    found: dict[str, set[str]] = {}
    for cls in type(estimator).__mro__:
        if cls.__module__.partition(".")[0] in ("boresight", "builtins"):
            continue
        for member in (*vars(cls).values(), *vars(sys.modules.get(cls.__module__, cls)).values()):
            code = getattr(member, "__code__", None)
            if code is not None and Path(code.co_filename).is_file():
                path = Path(code.co_filename).resolve()
                found.setdefault(path.name, set()).add(os.path.relpath(path, folder.resolve()))
    return {name: quote(*paths) for name, paths in found.items() if len(paths) == 1}


def add_arguments(parser: ArgumentParser) -> None:
    """What the command line takes."""
    parser.add_argument("estimator")
    parser.add_argument("logs", nargs="+", metavar="LOG", help="logs, or folders of logs")
    model_options(parser)
    parser.add_argument("--steps", type=int, help="leading samples of each log")
    parser.add_argument("--no-synth", action="store_true", help="leave area and clock out")
    parser.add_argument(
        "--widths", action="store_true", help="errors in words of 18 to 32 bits too: a plot"
    )
    parser.add_argument(
        "--against", metavar="FILE", help="report.json of another run: a table of what differs"
    )
    parser.add_argument(
        "--comparison",
        action="store_true",
        help="the logs' reference is another device's estimate, not truth",
    )
    parser.add_argument("-o", "--output", default="build", metavar="DIR")


def call(args: Namespace) -> Outcome:
    """Do it; see `Outcome`."""
    found = report(
        args.estimator,
        *args.logs,
        config=args.config,
        word=args.word,
        steps=args.steps,
        synth=not args.no_synth,
        widths=args.widths,
        against=args.against,
        output=args.output,
        comparison=args.comparison,
        params=params_of(args, [args.estimator]),
        progress=progress_of(args),
    )
    return 0 if found.good else 1, found.to_json(), str(found)
