"""`boresight experiment`: a system run in simulation, its figures beside what they are to be."""

from __future__ import annotations

import json
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from boresight.arguments import check_number
from boresight.disk.output import output_folder
from boresight.model.resolve import names_of_entry_points
from boresight.options import Outcome, progress_of
from boresight.sim.answer import Answer
from boresight.sim.experiments.experiment import Experiment, Target, grouped
from boresight.sim.experiments.registry import EXPERIMENT_GROUP, EXPERIMENTS, experiment_of

__all__ = ["ExperimentResult", "add_arguments", "call", "experiment"]


@dataclass(frozen=True)
class ExperimentResult(Answer):
    """What `experiment` gives; the JSON file has ``details`` besides.

    Attributes
    ----------
    experiment : str
        Its name.
    figures : mapping of str to float
    targets : tuple of Target
        In JSON each with ``name``, ``source``, ``value``, ``limit`` (least and greatest good value)
        and ``pass``.
    files : tuple of str
        What was written.
    """

    experiment: str
    figures: Mapping[str, float]
    targets: tuple[Target, ...]
    files: tuple[str, ...] = field(repr=False)

    @property
    def good(self) -> bool:
        """Every binding target is met."""
        return all(target.good for target in self.targets if target.binding)

    def __str__(self) -> str:
        judged = [target for target in self.targets if target.judged]
        met = sum(target.good for target in judged)
        return "\n".join(
            [
                *map(_line, grouped(self.targets)),
                f"targets met: {met} of {len(judged)}",
                *self.files,
            ]
        )


def experiment(
    what: str | type[Experiment] | Experiment,
    *,
    output: str | Path = "build",
    seed: int = 1,
    runs: int | None = None,
    progress: Callable[[str], None] | None = None,
) -> ExperimentResult:
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
    ExperimentResult
        Figures, targets, files.

    Raises
    ------
    InputError
        Unknown name, seed out of range, folder that cannot be written.
    """
    found = experiment_of(what)
    check_number("seed", seed, 0, 2**31)
    runs = found.runs if runs is None else runs
    check_number("runs", runs, 2, 1000)
    files = (f"{found.name}.json", *found.pages)
    with output_folder(output, f"experiment {found.name}", files=files) as folder:
        result = found.run(seed=seed, runs=runs, say=progress or (lambda text: None))
        told = ExperimentResult(
            experiment=found.name,
            figures=dict(result.figures),
            targets=result.targets,
            files=tuple(str(Path(output) / name) for name in files),
        )
        more = {"figures": dict(result.figures), "details": result.details}  # all finite
        text = json.dumps(told.to_json() | more, allow_nan=False)
        (folder / files[0]).write_text(text + "\n")
        for name in found.pages:
            (folder / name).write_text(result.pages[name], encoding="utf-8")
    return told


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
    names = sorted({*EXPERIMENTS, *names_of_entry_points(EXPERIMENT_GROUP)})
    parser.add_argument("name", help=f"one of: {', '.join(names)}; or FILE.py:CLASS")
    parser.add_argument("--seed", type=int, default=1, help="of the first run")
    parser.add_argument("--runs", type=int, help="how many runs the spread comes from")
    parser.add_argument("-o", "--output", default="build", metavar="DIR")


def call(args: Namespace) -> Outcome:
    """Do it; see `Outcome`."""
    told = experiment(
        args.name, output=args.output, seed=args.seed, runs=args.runs, progress=progress_of(args)
    )
    return int(not told.good), told.to_json(), str(told)
