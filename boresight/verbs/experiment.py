"""`boresight experiment`: a system run in simulation, its figures beside what they are to be."""

from __future__ import annotations

import json
from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from pathlib import Path
from typing import Any

from boresight.arguments import check_number
from boresight.disk.output import output_folder
from boresight.options import Outcome, progress_of
from boresight.sim.experiments.experiment import Experiment, Result, Target, grouped
from boresight.sim.experiments.registry import EXPERIMENTS, experiment_of

__all__ = ["add_arguments", "call", "experiment"]


def experiment(
    what: str | type[Experiment] | Experiment,
    *,
    output: str | Path = "build",
    seed: int = 1,
    runs: int | None = None,
    progress: Callable[[str], None] | None = None,
) -> dict[str, Any]:
    """Run an experiment and write ``NAME.json``, and the pages that it makes.

    Parameters
    ----------
    what : str, class or Experiment
        A name, ``file.py:Class``, a class or an object.
    output : path
        Folder for the files.
    seed : int
        Of the first run.
    runs : int, optional
        How many runs the spread comes from; by default the experiment's own number.

    Returns
    -------
    dict
        ``experiment``, its name; ``figures`` by name; ``targets``, each with ``name``, ``source``,
        ``value``, ``limit`` (least and greatest good value) and ``pass``; ``files``. The JSON file
        has ``details`` besides.

    Raises
    ------
    InputError
        Unknown name, seed out of range, folder that cannot be written.
    """
    return _experiment(what, output, seed, runs, progress)[0]


def _experiment(
    what: str | type[Experiment] | Experiment,
    output: str | Path,
    seed: int,
    runs: int | None,
    progress: Callable[[str], None] | None,
) -> tuple[dict[str, Any], Result]:
    """What `experiment` returns, and what it comes from."""
    found = experiment_of(what)
    check_number("seed", seed, 0, 2**31)
    runs = found.runs if runs is None else runs
    check_number("runs", runs, 2, 1000)
    files = (f"{found.name}.json", *found.pages)
    with output_folder(output, f"experiment {found.name}", files=files) as folder:
        result = found.run(seed=seed, runs=runs, say=progress or (lambda text: None))
        data = {
            "experiment": found.name,
            "figures": dict(result.figures),
            "targets": [target.to_json() for target in result.targets],
            "files": [str(Path(output) / name) for name in files],
        }
        text = json.dumps(data | {"details": result.details}, allow_nan=False)
        (folder / files[0]).write_text(text + "\n")
        for name in found.pages:
            (folder / name).write_text(result.pages[name], encoding="utf-8")
    return data, result


def _line(group: tuple[Target, ...]) -> str:
    """Targets that differ in their part alone, for people."""
    first = group[0]
    values = " / ".join(f"{target.value:.3g}" for target in group)
    judged = any(target.judged for target in group)
    good = all(target.good for target in group)
    verdict = ("pass" if judged else "    ") if good else "FAIL"
    return f"{verdict}  {first.name} ({first.source}): {values} {first.unit}".rstrip()


def add_arguments(parser: ArgumentParser) -> None:
    """What the command line takes."""
    parser.add_argument("name", help=f"one of: {', '.join(EXPERIMENTS)}; or FILE.py:CLASS")
    parser.add_argument("--seed", type=int, default=1, help="of the first run")
    parser.add_argument("--runs", type=int, help="how many runs the spread comes from")
    parser.add_argument("-o", "--output", default="build", metavar="DIR")


def call(args: Namespace) -> Outcome:
    """Do it; see `Outcome`."""
    data, result = _experiment(args.name, args.output, args.seed, args.runs, progress_of(args))
    judged = [target for target in result.targets if target.judged]
    met = sum(target.good for target in judged)
    lines = [
        *map(_line, grouped(result.targets)),
        f"targets met: {met} of {len(judged)}",
        *data["files"],
    ]
    return 0 if result.good else 1, data, "\n".join(lines)
