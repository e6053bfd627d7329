"""`boresight montecarlo`: many draws of a world; is the estimator as good as it says and can be?"""

from __future__ import annotations

import json
import os
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

from boresight.arguments import JOBS_MOST, check_choice, check_number, check_word
from boresight.disk.output import OutputFile
from boresight.loop import NamedWorld, world_of
from boresight.model.errors import InputError
from boresight.model.resolve import Named, estimator_of
from boresight.options import Outcome, number_options, params_of, progress_of
from boresight.sim.montecarlo.campaign import Campaign, made
from boresight.sim.montecarlo.deal import cluster, complete
from boresight.sim.montecarlo.figures import figures, text
from boresight.sim.montecarlo.journal import Journal

__all__ = ["add_arguments", "call", "montecarlo"]

LEVELS = ("c", "fixed", "float")


def montecarlo(
    world: NamedWorld,
    estimator: Named,
    *,
    runs: int = 100,
    seed: int = 1,
    on: str = "c",
    word: int = 32,
    params: Mapping[str, float] | None = None,
    steps: int | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    executor: Any = None,
    output: str | Path = "build",
    progress: Callable[[str], None] | None = None,
) -> dict[str, Any]:
    """Run draws of a world on an estimator: errors, NEES, NIS, spread against the bound.

    Every draw that is done stands in ``montecarlo-WORLD-ESTIMATOR.runs``; called again, also with
    more runs, it goes on there. The results do not depend on how the draws are dealt out.

    Parameters
    ----------
    world : str, class or World
        With `World.draw`; `World.bound` gives what no estimator can beat.
    estimator : str, class or Estimator
        With `Estimator.error_covariance` and `Estimator.nis_freedom`, if it has these.
    runs, seed : int
        How many draws, and the seed of the first.
    on : str
        "c", "fixed" or "float".
    jobs : int, optional
        Processes; by default one for each processor. World and estimator that are no texts run in
        this process.
    scheduler : str, optional
        Address of a Dask scheduler whose workers run them instead.
    executor : concurrent.futures.Executor, optional
        Who runs them, instead of both.
    output : path
        Folder of ``montecarlo-WORLD-ESTIMATOR.json`` and of the journal.

    Returns
    -------
    dict
        See `sim.montecarlo.figures.figures`; ``file``.

    Raises
    ------
    InputError
        A world without draws or truth; a journal of another campaign.
    ToolMissing
        A scheduler is given, and dask.distributed is not installed.
    """
    check_number("runs", runs, 2, 1_000_000)
    check_number("seed", seed, 0, 2**31)
    check_choice("on", on, LEVELS)
    check_word(word)
    check_number("jobs", 1 if jobs is None else jobs, 1, JOBS_MOST)
    if steps is not None:
        check_number("steps", steps, 1)
    filter = estimator_of(estimator)
    filter.param_values(params)
    campaign = Campaign(
        world if isinstance(world, str) else world_of(world),
        estimator if isinstance(estimator, str) else filter,
        tuple(sorted((params or {}).items())),
        on,
        word,
        steps,
    )
    made.cache_clear()  # their files may have changed since
    plant, filter = campaign.parts()
    plant.draw(seed)
    name = f"montecarlo-{plant.name}-{filter.name}"
    folder = Path(output)
    result = OutputFile(folder / f"{name}.json", "montecarlo", of=name)
    journal = Journal(folder / f"{name}.runs", campaign.identity())
    seeds = range(seed, seed + runs)
    own = (jobs or os.cpu_count() or 1) if campaign.texts else 1
    say = progress or (lambda text: None)
    with _others(campaign, scheduler, executor) as dealer:
        found = complete(campaign, seeds, journal, say=say, jobs=own, executor=dealer)
    data = {
        **campaign.identity(),
        "seed": seed,
        **figures(found, plant.bound(), filter.nis_freedom),
    }
    result.write(json.dumps(data, allow_nan=False) + "\n")
    return data | {"file": str(folder / f"{name}.json")}


def _others(
    campaign: Campaign, scheduler: str | None, executor: Any
) -> AbstractContextManager[Any]:
    """Who runs the draws, if not this machine's processes."""
    if executor is None and scheduler is not None:
        if not campaign.texts:
            raise InputError.at(
                "scheduler",
                wanted="world and estimator by name or file, which its workers can read",
                found="objects",
                fix="give texts, or leave the scheduler out",
            )
        return cluster(scheduler)
    return nullcontext(executor)


def add_arguments(parser: ArgumentParser) -> None:
    """What the command line takes."""
    parser.add_argument("world", metavar="WORLD", help="FILE.py:CLASS, with draw(seed)")
    parser.add_argument("estimator", metavar="ESTIMATOR")
    parser.add_argument("--runs", type=int, default=100, help="how many draws")
    parser.add_argument("--seed", type=int, default=1, help="of the first draw")
    parser.add_argument("--on", default="c", help=", ".join(LEVELS))
    number_options(parser)
    parser.add_argument("--steps", type=int, help="most records of a draw")
    parser.add_argument("--jobs", type=int, help="processes; default: one for each processor")
    parser.add_argument(
        "--scheduler", metavar="ADDRESS", help="of a Dask cluster that runs the draws"
    )
    parser.add_argument("-o", "--output", default="build", metavar="DIR")


def call(args: Namespace) -> Outcome:
    """Do it; see `Outcome`."""
    data = montecarlo(
        args.world,
        args.estimator,
        runs=args.runs,
        seed=args.seed,
        on=args.on,
        word=args.word,
        params=params_of(args, [args.estimator]),
        steps=args.steps,
        jobs=args.jobs,
        scheduler=args.scheduler,
        output=args.output,
        progress=progress_of(args),
    )
    units = {o.name: o.unit for o in estimator_of(args.estimator).outputs}
    return 0, data, text(data, units) + f"\n{data['file']}"
