"""`boresight experiment`: a published experiment in simulation, as a page and as JSON."""

from __future__ import annotations

import json
from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from pathlib import Path
from typing import Any

from boresight.arguments import check_choice, check_number
from boresight.disk.output import output_folder
from boresight.options import Outcome, progress_of
from boresight.sim.experiments import ma2014
from boresight.sim.experiments.ma2014_html import render

__all__ = ["EXPERIMENTS", "add_arguments", "call", "experiment", "target_lines"]

#: Name: what runs it, what renders its page.
EXPERIMENTS = {"ma2014": (ma2014.run, render)}


def experiment(
    name: str,
    *,
    output: str | Path = "build",
    seed: int = 1,
    runs: int = ma2014.RUNS,
    progress: Callable[[str], None] | None = None,
) -> dict[str, Any]:
    """Run an experiment and write ``<name>.html`` and ``<name>.json``.

    Parameters
    ----------
    name : str
        One of `EXPERIMENTS`.
    output : path
        Folder for the two files.
    seed : int
        Of the first run.
    runs : int
        How many runs the spread comes from.

    Returns
    -------
    dict
        The contents of the JSON file; ``good`` tells whether every internal claim held. Targets
        are reported in ``targets`` and do not count there.

    Raises
    ------
    InputError
        Unknown name, seed out of range, folder that cannot be written.
    """
    check_choice("experiment", name, EXPERIMENTS)
    check_number("seed", seed, 0, 2**31)
    check_number("runs", runs, 2, 1000)
    run, page = EXPERIMENTS[name]
    files = (f"{name}.html", f"{name}.json")
    with output_folder(output, f"experiment {name}", files=files) as folder:
        data = run(seed=seed, runs=runs, progress=progress)
        (folder / f"{name}.json").write_text(json.dumps(data, allow_nan=False) + "\n")
        (folder / f"{name}.html").write_text(page(data), encoding="utf-8")
    return data


def target_lines(data: dict[str, Any]) -> list[str]:
    """The targets for people, one line each."""
    return [
        f"{'pass' if t['good'] else 'FAIL'}  {t['name']} ({t['source']}): "
        + " / ".join(f"{x:.3g}" for x in t["ours"])
        + (f" {t['unit']}" if t["unit"] else "")
        for t in data["targets"]
    ]


def add_arguments(parser: ArgumentParser) -> None:
    """What the command line takes."""
    parser.add_argument("name", help=f"one of: {', '.join(EXPERIMENTS)}")
    parser.add_argument("--seed", type=int, default=1, help="of the first run")
    parser.add_argument("-o", "--output", default="build", metavar="DIR")


def call(args: Namespace) -> Outcome:
    """Do it; see `Outcome`."""
    data = experiment(args.name, output=args.output, seed=args.seed, progress=progress_of(args))
    met = sum(t["good"] for t in data["targets"])
    lines = [
        *target_lines(data),
        f"targets met: {met} of {len(data['targets'])}",
        f"{args.output}/{args.name}.html",
    ]
    lines += [f"FAILED: {c['claim']}" for c in data["claims"] if not c["good"]]
    return 0 if data["good"] else 1, data, "\n".join(lines)
