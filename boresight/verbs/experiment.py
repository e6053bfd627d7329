"""Run a published experiment in simulation and judge its targets.

boresight experiment ma2014 -o build  # the 2014 paper's tables and figures
boresight experiment satcom --runs 2 -o build  # an antenna on a vehicle, in closed loop
boresight experiment my_experiment.py:Mine  # your own
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

from boresight.model.errors import InputError, require_whole
from boresight.model.tools.files import output_folder
from boresight.options import ExperimentName, OutputFolder, Progress
from boresight.sim.experiments.experiment import Experiment, experiment_of, result_of
from boresight.sim.experiments.targets import target_rows
from boresight.sim.result import Result, plain


def experiment(
    name: Annotated[str | type[Experiment] | Experiment, ExperimentName],
    /,
    *,
    output: OutputFolder = "build",
    seed: int = 1,
    runs: int | None = None,
    progress: Progress = None,
) -> Result:
    """Run an experiment and write ``NAME.json``, and the pages that it makes.

    Returns ``figures``; ``targets``, each with ``name``, ``source``, ``value``, ``limit`` (least
    and greatest good value) and ``pass``; ``files``. Raises InputError for an unknown name, a seed
    out of range, a folder that cannot be written, and an experiment that raises or gives no
    `ExperimentResult`.

    Parameters
    ----------
    name : str, class or Experiment
        A name that `boresight info` lists, FILE.py:CLASS, a class or an object.
    seed : int
        Seed of the first run.
    runs : int, optional
        Number of runs; by default the experiment's own.
    """
    instance = experiment_of(name)
    require_whole("seed", seed, 0, 2**31)
    runs = instance.runs if runs is None else runs
    require_whole("runs", runs, 2, 1000)
    files = (f"{instance.name}.json", *instance.pages)
    with output_folder(output, f"experiment {instance.name}", files=files) as folder:
        result = result_of(instance, seed=seed, runs=runs, say=progress or (lambda text: None))
        data: dict[str, Any] = {
            "experiment": instance.name,
            "figures": dict(result.figures),
            "targets": plain(result.targets),
            "files": [str(Path(output) / name) for name in files],
        }
        whole = {"good": result.good, **data, "details": result.details}
        try:
            text = json.dumps(whole, allow_nan=False)
        except (TypeError, ValueError) as error:
            where = f"experiment {instance.name}, figures or details"
            wanted = "plain data: finite numbers, texts, lists, dictionaries"
            fix = "convert it, for example by float()"
            raise InputError.at(where, wanted=wanted, found=str(error), fix=fix) from None
        (folder / files[0]).write_text(text + "\n")
        for name in instance.pages:
            (folder / name).write_text(result.pages[name], encoding="utf-8")
    targets = result.targets
    judged = [target for target in targets if target.judged]
    met = sum(target.good for target in judged)
    reported = sum(not (target.good or target.binding) for target in judged)
    besides = f"; {reported} missed that are reported, not binding" if reported else ""
    missed = [t.to_json()["name"] for t in targets if t.binding and not t.good]
    heads = ("what", "source", "value", "target", "verdict")
    rows = [{head: row[head] for head in heads} for row in target_rows(targets)]
    places = "\n".join(data["files"])
    summary = f"{places}\ntargets met: {met} of {len(judged)}{besides}"
    return Result(data, {"targets": rows}, summary, failures=missed)
