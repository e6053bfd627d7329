"""Many draws of a world: errors, NEES, NIS and spread against the bound.

boresight montecarlo my_filter.py my_filter.py --runs 500 -o build  # a world and an estimator
"""

from __future__ import annotations

import json
import math
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from numbers import Real
from pathlib import Path
from typing import Annotated, Any, TypeAlias

from boresight.arguments import JOBS_MOST, SEED_MOST, check_number, check_optional, check_word
from boresight.disk.output import OutputFile
from boresight.model.errors import InputError, require_choice
from boresight.model.estimator import Estimator
from boresight.options import (
    EstimatorName,
    Jobs,
    Option,
    OutputFolder,
    Params,
    PythonOnly,
    Verb,
    Word,
)
from boresight.sim.answer import Answer, JsonObject, plain
from boresight.sim.campaign import Journal, complete
from boresight.sim.cluster import executor_for
from boresight.sim.montecarlo.campaign import Campaign, draws
from boresight.sim.montecarlo.figures import figures, text
from boresight.sim.worlds.world import NamedWorld, bound_of, drawn

__all__ = ["Consistency", "MonteCarloResult", "OutputSpread", "WorstDraw", "montecarlo"]

LEVELS = ("c", "fixed", "float")

#: Over the marks; None: no number.
Curve: TypeAlias = Sequence[float | None]


@dataclass(frozen=True)
class OutputSpread:
    """An output's errors over the draws, in its unit, at each mark.

    Attributes
    ----------
    mean, mean_band : Curve
        Mean, and half its band of 95 %.
    sd, sd_band : Curve, two of them
        Standard deviation, and its band of 95 %.
    rms : Curve
    bound, ratio : Curve or None
        Least standard deviation that any estimator can reach, where the world knows it, and ``sd``
        over it.
    """

    mean: Curve
    mean_band: Curve
    sd: Curve
    sd_band: Sequence[Curve]
    rms: Curve
    bound: Curve | None = None
    ratio: Curve | None = None

    def to_json(self) -> JsonObject:
        """Plain data, without what the world does not know."""
        return {k: plain(v) for k, v in vars(self).items() if v is not None}


@dataclass(frozen=True)
class Consistency:
    """NEES or NIS per degree of freedom: 1 where a filter is as good as it says.

    ``mean`` is over the draws, of NEES at each mark; ``band`` its 95 %.
    """

    freedom: int
    mean: Curve | float
    band: Sequence[float]


@dataclass(frozen=True)
class WorstDraw:
    """The draw in which most updates saturated; of equal ones, that with the largest last error.

    ``error`` is that of ``output`` at the last mark, without its sign, in the output's unit;
    ``times_rms`` is its ratio to the root mean square of all draws. Both are None where the error
    is no number. ``command`` runs the draw alone.
    """

    seed: int
    output: str
    error: float | None
    times_rms: float | None
    saturated: int
    command: str


@dataclass(frozen=True)
class MonteCarloResult(Answer):
    """What `montecarlo` gives; its JSON file holds it.

    Attributes
    ----------
    world, estimator, level : str
    world_file, sources, program : str
        Digests of what the draws depend on: the world's file; source files of world, estimator and
        Boresight with all that they import, and versions; the program.
    params : mapping of str to float
        Values other than the defaults.
    word : int
        Word width, bits.
    steps : int or None
        Most records of a draw.
    seed, runs : int
        Of the first draw, and how many.
    marks : sequence of int
        Records at which the errors are looked at.
    outputs : mapping of str to OutputSpread
    nees, nis : Consistency or None
        Where estimator and level tell a covariance, and innovations.
    saturated : int
        Updates.
    worst : WorstDraw
    file : str
        The JSON file.
    units : mapping of str to str
        Of the outputs; not in JSON.
    """

    world: str
    world_file: str
    sources: str
    estimator: str
    program: str
    params: Mapping[str, float]
    level: str
    word: int
    steps: int | None
    seed: int
    runs: int
    marks: Sequence[int]
    outputs: Mapping[str, OutputSpread]
    saturated: int
    worst: WorstDraw
    file: str
    nees: Consistency | None = None
    nis: Consistency | None = None
    units: Mapping[str, str] = field(default_factory=dict)

    def to_json(self) -> JsonObject:
        """Plain data, as in the file, and ``file``."""
        data = super().to_json()
        for name in ("saturated", "worst", "file"):  # after the rest
            data[name] = data.pop(name)
        gone = {"units", *(name for name in ("nees", "nis") if data[name] is None)}
        return {name: value for name, value in data.items() if name not in gone}

    def __str__(self) -> str:
        w = self.worst
        error = "no number" if w.error is None else f"{w.error:.4g} {self.units[w.output]}".rstrip()
        times = "" if w.times_rms is None else f", {w.times_rms:.2g} times the rms"
        worst = (
            f"worst draw: seed {w.seed}, {w.output} off by {error} at its end{times}, "
            f"saturated updates: {w.saturated}"
        )
        again = [f"again: {w.command}"] if w.command else []
        return "\n".join([text(self.to_json(), self.units), worst, *again, self.file])


def montecarlo(
    world: Annotated[NamedWorld, Option(metavar="WORLD")],
    estimator: EstimatorName,
    *,
    runs: int = 100,
    seed: int = 1,
    on: str = "c",
    word: Word = 32,
    params: Params = None,
    steps: int | None = None,
    jobs: Jobs = None,
    scheduler: Annotated[str | None, Option(metavar="ADDRESS")] = None,
    executor: Annotated[Any, PythonOnly] = None,
    output: OutputFolder = "build",
    progress: Callable[[str], None] | None = None,
) -> MonteCarloResult:
    """Run draws of a world on an estimator: errors, NEES, NIS, spread against the bound.

    Every draw that is done stands in ``montecarlo-WORLD-ESTIMATOR.runs``; called again, also with
    more runs, it goes on there. The results do not depend on how the draws are dealt out.

    Parameters
    ----------
    world : str, class or World
        FILE.py:CLASS, with `World.draw`; `World.bound` gives what no estimator can beat.
    estimator : str, class or Estimator
        Name, or FILE.py:CLASS; with `Estimator.error_covariance` and `Estimator.nis_freedom`, if it
        has these.
    runs : int
        How many draws.
    seed : int
        Of the first draw.
    on : str
        Level: c, fixed or float.
    steps : int, optional
        Most records of a draw.
    jobs : int, optional
        Processes; by default one for each processor. World and estimator that are no texts run in
        this process.
    scheduler : str, optional
        Of a Dask cluster whose workers run the draws instead.
    executor : concurrent.futures.Executor, optional
        Who runs them, instead of both.
    output : path
        Folder of ``montecarlo-WORLD-ESTIMATOR.json`` and of the journal.

    Returns
    -------
    MonteCarloResult
        Errors by output, NEES, NIS and the spread over the bound.

    Raises
    ------
    InputError
        A world without draws or truth, or whose draws are all equal; a journal of another campaign.
    ToolMissing
        A scheduler is given, and dask.distributed is not installed.
    """
    check_number("runs", runs, 2, 1_000_000)
    check_number("seed", seed, 0, SEED_MOST)
    require_choice("on", on, LEVELS)
    check_word(word)
    check_optional("jobs", jobs, 1, JOBS_MOST)
    check_optional("steps", steps, 1)
    settings = tuple(sorted((params or {}).items()))
    campaign = Campaign((world, estimator), settings, on, word, steps)
    filter, plant = campaign.estimator, campaign.world
    filter.param_values(params)
    _check_nis(filter)
    drawn(plant, seed)
    name = f"montecarlo-{plant.name}-{filter.name}"
    folder = Path(output)
    result = OutputFile(folder / f"{name}.json", "montecarlo", of=name)
    journal = Journal(folder / f"{name}.runs", campaign.identity)
    seeds = {number: number for number in range(seed, seed + runs)}
    own = jobs if campaign.texts else 1
    say = progress or (lambda text: None)
    wanted = "world and estimator"
    with executor_for(scheduler, executor, texts=campaign.texts, wanted=wanted) as dealer:
        rows = complete(campaign, draws, seeds, journal, say=say, jobs=own, executor=dealer)
    if all(row | {"seed": 0} == rows[0] | {"seed": 0} for row in rows):
        journal.path.unlink(missing_ok=True)  # a world that is corrected begins anew
        raise InputError.at(
            f"world {plant.name}, draw",
            wanted="another run for each seed",
            found=f"{runs} equal runs",
            fix="let draw(self, seed) store the seed, and start(self) make the noise of it",
        )
    judged = figures(rows, bound_of(plant, 1 + max(rows[0]["marks"])), filter.nis_freedom)
    outcome = MonteCarloResult(
        **campaign.identity,
        seed=seed,
        **judged
        | {key: Consistency(**judged[key]) for key in ("nees", "nis") if key in judged}
        | {"outputs": {key: OutputSpread(**spread) for key, spread in judged["outputs"].items()}}
        | {"worst": WorstDraw(**judged["worst"], command=_command(campaign, judged["worst"]))},
        file=str(folder / f"{name}.json"),
        units={o.name: o.unit for o in filter.outputs},
    )
    data = {key: value for key, value in outcome.to_json().items() if key != "file"}
    result.write(json.dumps(data, allow_nan=False) + "\n")
    return outcome


def _check_nis(estimator: Estimator) -> None:
    """Raise InputError unless NIS can be computed, or is not asked for."""
    freedom, names = estimator.nis_freedom, [o.name for o in estimator.outputs]
    is_number = isinstance(freedom, Real) and 0 <= float(freedom) < math.inf
    if not is_number or (freedom and "nis" not in names):
        raise InputError.at(
            f"estimator {estimator.name}, nis_freedom",
            wanted="a number of measurements, 0 without an output nis",
            found=f"{freedom!r}, outputs {', '.join(names)}",
            fix='write for example nis_freedom = 1, and Output("nis") among the outputs',
        )


def _command(campaign: Campaign, worst: Mapping[str, Any]) -> str:
    """The command that runs a draw alone; empty if world or estimator is no text."""
    if not campaign.texts:
        return ""
    names = " ".join(shlex.quote(str(name)) for name in campaign.named)
    options = "".join(f" --param {name}={value!r}" for name, value in campaign.params)
    options += f" --word {campaign.word}" if campaign.word != 32 else ""
    options += f" --steps {campaign.steps}" if campaign.steps else ""
    return f"boresight simulate {names} --on {campaign.on} --seed {worst['seed']}{options}"


VERB = Verb(montecarlo)
