"""An experiment of cases: each with many seeds, figures, cycles, targets."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.estimator import Estimator
from boresight.sim.experiments.experiment import Experiment, ExperimentResult
from boresight.sim.experiments.seeds import Runs, figures_of, run_cases, spreads_of
from boresight.sim.experiments.targets import targets_of
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.worlds.loop import Loop, close_loop


@dataclass(frozen=True)
class Case:
    """A row of the table: options of the world, parameters and options of the estimator."""

    meaning: str
    world: Mapping[str, Any] = field(default_factory=dict)
    params: Mapping[str, float] = field(default_factory=dict)
    options: Mapping[str, Any] = field(default_factory=dict)


class CasesExperiment(Experiment):
    """Base class of experiments that run named cases of a world with many seeds each.

    The figures are ``NAME_CASE_FIGURE``, pooled over the runs (`Runs.pooled`), and the cycles to
    the last urgent output and to the next record, ``NAME_latency_cycles_CONFIG`` and
    ``NAME_interval_cycles_CONFIG``; the targets are those of ``targets.csv`` beside the class's
    file; the table of the result has a row for each case.
    """

    #: A batched world, called with ``seeds`` and a case's options, and the estimator in it.
    world: ClassVar[Callable[..., Any]]
    estimator: ClassVar[type[Estimator]]
    #: Machines whose cycles count.
    configs: ClassVar[Sequence[str]] = ("small", "fast")
    #: In the order of the rows; the details of the result are their meanings.
    cases: ClassVar[Mapping[str, Case]]
    most_runs: ClassVar[Mapping[str, int]] = {}  #: most runs of some cases.
    at_once: ClassVar[int] = 25  #: runs of one task.
    columns: ClassVar[Mapping[str, str]]  #: head of a column to the figure in it.
    counts: Mapping[str, float] = {}  #: what targets need besides runs (`targets_of`).

    @staticmethod
    def figures(
        case: Case, world: Any, loop: Loop, reference: Mapping[str, FloatArray]
    ) -> dict[str, Any]:
        """Figures (runs,) of a case's loop on the integer C.

        ``reference``: outputs (n,) of float64 on the records of the first run. A number is the
        figure of every run.
        """
        raise NotImplementedError

    def further(
        self, outcomes: Mapping[str, Runs], *, seed: int, runs: int, say: Callable[[str], None]
    ) -> dict[str, float]:
        """Figures besides, by their whole names."""
        return {}

    def run_case(self, name: str, seeds: range) -> Runs:
        """Run a case with these seeds; ``saturated_sum`` is among its figures."""
        case = self.cases[name]
        estimator = self.estimator(**case.options)
        world = type(self).world(seeds=seeds, **case.world)
        build = Build(estimator, params=[case.params])
        level = make_level("c", build, runs=world.runs)
        loop = close_loop(world, level, keep=[o.name for o in estimator.outputs])
        reference = make_level("float", build).run(np.ascontiguousarray(loop.inputs[:, 0]))
        figures = self.figures(case, world, loop, reference.outputs)
        assert loop.run.saturated is not None
        figures["saturated_sum"] = loop.run.saturated.sum(axis=0)
        runs = np.ones(world.runs)
        return Runs({figure: value * runs for figure, value in figures.items()})

    def run(self, *, seed: int, runs: int, say: Callable[[str], None]) -> ExperimentResult:
        cases = [(name, name, min(runs, self.most_runs.get(name, runs))) for name in self.cases]
        outcomes = run_cases(
            self.run_case, cases, seed=seed, at_once=self.at_once, jobs=self.jobs, say=say
        )
        figures = figures_of(outcomes, f"{self.name}_")
        for config in self.configs:
            schedule = Build(self.estimator(), config=config).core.schedule
            figures[f"{self.name}_latency_cycles_{config}"] = float(schedule.latency)
            figures[f"{self.name}_interval_cycles_{config}"] = float(schedule.interval)
        figures |= self.further(outcomes, seed=seed, runs=runs, say=say)
        folder = Path(inspect.getfile(type(self))).parent
        targets = targets_of(
            folder, figures, spreads_of(outcomes, f"{self.name}_"), runs=runs, **self.counts
        )
        meanings = {name: case.meaning for name, case in self.cases.items()}
        rows = [
            {"case": meaning}
            | {head: figures.get(f"{self.name}_{n}_{k}") for head, k in self.columns.items()}
            for n, meaning in meanings.items()
        ]
        return ExperimentResult(
            figures=figures, targets=targets, details=meanings, tables={"cases": rows}
        )
