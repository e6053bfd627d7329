"""`boresight report`: one HTML page and one JSON file about an estimator on a log."""

from __future__ import annotations

import json
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from boresight.arguments import check_machine, check_number
from boresight.core_files import write_text
from boresight.disk.output import output_folder
from boresight.model.resolve import Named
from boresight.model.resolve import estimator_of as find_estimator
from boresight.options import Outcome, model_options, params_of, progress_of
from boresight.sim.compare.check import Check
from boresight.sim.levels.build import Build
from boresight.sim.records.files import record_of
from boresight.sim.report.data import report_data
from boresight.sim.report.html import render_html
from boresight.verbs.compile import estimate_core

__all__ = ["add_arguments", "call", "report"]


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
    build = Build(estimator, config=config, word=word, params=[params])
    record = record_of(log_path).head(steps)
    files = ("report.html", "report.json")
    inputs = [log_path]
    with output_folder(output, "report", of=estimator.name, files=files, inputs=inputs) as folder:
        (result,) = Check(build, progress=progress).run(record)
        area = None
        if synth:
            say("synthesis (yosys) and clock estimate")
            area = estimate_core(build.core)
        data = report_data(build.core, result, area=area, comparison=comparison)
        write_text(folder / "report.json", json.dumps(data, indent=1) + "\n")
        write_text(folder / "report.html", render_html(data))
    return data


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
