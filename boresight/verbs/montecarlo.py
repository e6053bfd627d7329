"""Run many random draws of a world: errors, NEES, NIS, spread against the bound.

boresight montecarlo my_filter.py my_filter.py --runs 500 -o build  # a world and an estimator
"""

from __future__ import annotations

import json
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

from boresight import options
from boresight.model.errors import InputError, require, require_choice, require_whole
from boresight.model.settings import CURRENT
from boresight.model.tools.files import OutputFile
from boresight.model.words.fixed import check_word
from boresight.sim.campaign import Journal, complete, digest
from boresight.sim.montecarlo.campaign import Campaign, draws, figures, record_count, result_of
from boresight.sim.result import Result
from boresight.sim.worlds.world import NamedWorld, bound_of, drawn

GROUPS = (options.profiles,)

LEVELS = ("c", "fixed", "float")


def montecarlo(
    world: Annotated[NamedWorld, options.WorldName],
    estimator: options.EstimatorName,
    /,
    *,
    runs: int = 100,
    seed: int = 1,
    levels: options.Level = ("c",),
    word: options.Word = 32,
    params: options.Params = None,
    steps: options.Steps = None,
    jobs: options.Jobs = None,
    again: bool = False,
    scheduler: options.Scheduler = None,
    output: options.OutputFolder = "build",
    progress: options.Progress = None,
) -> Result:
    """Run an estimator in many draws of a world: errors, NEES, NIS, spread against the bound.

    Completed draws are stored in ``montecarlo-WORLD-ESTIMATOR.jsonl``, where a later call with the
    same files continues. Results do not depend on the number of processes. Returns ``outputs``,
    ``nees``, ``nis``, ``worst``: see `sim.montecarlo.campaign.figures`. Raises InputError for a
    world without draws or truth, or whose draws are all equal; ToolMissing if a scheduler is given,
    and dask.distributed is not installed.

    Parameters
    ----------
    world : str, class or World
        FILE.py:CLASS, with `World.draw`; `World.bound` gives the bound of the spread.
    estimator : str, class or Estimator
        Name, or FILE.py:CLASS; `Estimator.error_covariance` and `Estimator.nis_freedom` are used
        if they exist.
    runs : int
        Number of draws.
    seed : int
        Seed of the first draw; draw k has seed + k.
    levels : str
        Form that runs: c, fixed or float.
    jobs : int, optional
        Number of processes; by default one for each processor. Objects run in this process.
    again : bool
        Run all draws again, also stored ones.
    scheduler : str, optional
        Address of a Dask cluster that runs the draws; its workers must see the same files.
    output : path
        Folder for ``montecarlo-WORLD-ESTIMATOR.json`` and the journal.
    """
    require_whole("runs", runs, 2, 1_000_000)
    require_whole("seed", seed, 0, 2**31)
    on = levels if isinstance(levels, str) else ",".join(levels)
    require_choice("levels", on, LEVELS)
    check_word(word)
    require_whole("jobs", jobs, 1)
    require_whole("steps", steps, 1)
    values = options.params_of(estimator, params)
    settings = tuple(sorted((values or {}).items()))
    campaign = Campaign((world, estimator), settings, on, word, steps)
    filter, plant = campaign.estimator, campaign.world
    freedom, names = filter.nis_freedom, [o.name for o in filter.outputs]
    good = freedom == 0 or (freedom > 0 and "nis" in names)
    place, found = f"estimator {filter.name}, nis_freedom", f"{freedom}, outputs {', '.join(names)}"
    fix = 'write for example nis_freedom = 1, and Output("nis") among the outputs'
    require(good, place, "a number of measurements, 0 without an output nis", found, fix)
    drawn(plant, seed)
    name = f"montecarlo-{plant.name}-{filter.name}"
    folder = Path(output)
    file = OutputFile(folder / f"{name}.json")
    journal = Journal(folder / f"{name}.jsonl", again=again)
    campaign.length = record_count(campaign, seed)
    seeds = {digest(campaign.identity, campaign.length, k): k for k in range(seed, seed + runs)}
    say = progress or (lambda text: None)
    where: Any = {"jobs": jobs, "scheduler": scheduler, "shared": campaign.texts}
    rows = complete(campaign, draws, seeds, journal, say=say, **where)
    if all(row | {"seed": 0} == rows[0] | {"seed": 0} for row in rows):
        journal.path.unlink(missing_ok=True)
        place, wanted = f"world {plant.name}, draw", "another run for each seed"
        fix = "let draw(self, seed) store the seed, and start(self) make the noise of it"
        raise InputError.at(place, wanted=wanted, found=f"{runs} equal runs", fix=fix)
    longest = max(rows, key=lambda row: row["records"])
    marks = campaign.marks(longest["records"])
    drawn(plant, longest["seed"])
    data = {**campaign.identity, "seed": seed, "runs": runs}
    data |= figures(rows, marks, bound_of(plant, 1 + int(marks[-1])), filter.nis_freedom)
    data["worst"]["command"] = _command(campaign, data["worst"])
    result = result_of(data, filter.outputs)
    file.write(json.dumps(result.to_json(), allow_nan=False) + "\n")
    return result


def _command(campaign: Campaign, worst: Mapping[str, Any]) -> str:
    """The command that runs a draw alone; empty if world or estimator is no text."""
    if not campaign.texts:
        return ""
    names = " ".join(shlex.quote(str(name)) for name in reversed(campaign.named))
    settings = "".join(f" --param {name}={value!r}" for name, value in campaign.params)
    settings += f" --word {campaign.word}" if campaign.word != 32 else ""
    settings += f" --steps {campaign.steps}" if campaign.steps else ""
    settings += CURRENT.get().options
    return f"boresight run {names} --levels {campaign.on} --seed {worst['seed']}{settings}"
