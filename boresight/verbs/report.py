"""`boresight report`: one HTML page and one JSON file about an estimator on a log."""

from __future__ import annotations

import json
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from boresight.arguments import check_machine, check_number
from boresight.disk.output import output_folder
from boresight.gateware.core import Core
from boresight.gateware.synthesis.estimate import Estimate
from boresight.model.estimator import Estimator
from boresight.model.resolve import Named
from boresight.model.resolve import estimator_of as find_estimator
from boresight.options import Outcome, model_options, params_of, progress_of
from boresight.sim.compare.check import CheckResult
from boresight.sim.compare.check import check as check_log
from boresight.sim.records.record import Record
from boresight.sim.report.data import report_data
from boresight.sim.report.html import render_html
from boresight.verbs.compile import core_for, estimate_core

__all__ = ["add_arguments", "call", "report", "write_report"]


def write_report(
    folder: Path,
    estimator: Estimator,
    core: Core,
    result: CheckResult,
    log: Record,
    area: Estimate | None,
    *,
    comparison: bool,
) -> dict[str, Any]:
    """Write report.json and report.html into ``folder`` and return the data."""
    data = report_data(core, estimator, area=area, check=result, log=log, comparison=comparison)
    (folder / "report.json").write_text(json.dumps(data, indent=1) + "\n")
    (folder / "report.html").write_text(render_html(data), encoding="utf-8")
    return data


def report(
    name: Named,
    log_path: str | Path,
    *,
    config: str = "small",
    word: int = 32,
    steps: int | None = None,
    synth: bool = True,
    output: str | Path = "build",
    comparison: bool = False,
    params: Mapping[str, float] | None = None,
    progress: Callable[[str], None] | None = None,
) -> dict[str, Any]:
    """Check an estimator on a log, estimate area and clock, and write the report.

    Parameters
    ----------
    comparison : bool
        The log's reference is another device's estimate, not truth.

    Raises
    ------
    InputError
        Unknown names, bad log, folder that cannot be written.
    """
    say = progress or (lambda text: None)
    estimator = find_estimator(name)
    check_machine(config, word)
    if steps is not None:
        check_number("steps", steps, 1)
    estimator.param_values(params)
    log = Record.of(log_path)
    files = ("report.html", "report.json")
    with output_folder(
        output, "report", of=estimator.name, files=files, inputs=[log_path]
    ) as folder:
        core = core_for(estimator, config=config, word=word, params=params)
        result = check_log(
            estimator,
            log,
            config=config,
            word=word,
            steps=steps,
            params=params,
            core=core,
            progress=progress,
        )
        area = None
        if synth:
            say("synthesis (yosys) and clock estimate")
            area = estimate_core(core)
        return write_report(folder, estimator, core, result, log, area, comparison=comparison)


def add_arguments(parser: ArgumentParser) -> None:
    """What the command line takes."""
    parser.add_argument("estimator")
    parser.add_argument("log")
    model_options(parser)
    parser.add_argument("--steps", type=int)
    parser.add_argument("--no-synth", action="store_true", help="leave area and clock out")
    parser.add_argument(
        "--comparison",
        action="store_true",
        help="the log's reference is another device's estimate, not truth",
    )
    parser.add_argument("-o", "--output", default="build", metavar="DIR")


def call(args: Namespace) -> Outcome:
    """Do it; see `Outcome`."""
    data = report(
        args.estimator,
        args.log,
        config=args.config,
        word=args.word,
        steps=args.steps,
        synth=not args.no_synth,
        output=args.output,
        comparison=args.comparison,
        params=params_of(args, [args.estimator]),
        progress=progress_of(args),
    )
    good = all(v["good"] for v in data["verification"]) and data["accuracy"]["verdict"]["good"]
    return 0 if good else 1, data, f"{args.output}/report.html"
