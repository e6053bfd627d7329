"""An experiment of cases: each with many seeds, figures, cycles, targets, and one page."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import nan
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.estimator import Estimator
from boresight.sim.experiments.experiment import Experiment, ExperimentResult
from boresight.sim.experiments.seeds import Runs, figures_of, run_cases, spreads_of
from boresight.sim.experiments.targets import render, targets_of
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.plotting import Section, histories
from boresight.sim.worlds.loop import Loop, close_loop


@dataclass(frozen=True)
class Case:
    """A row of the page: options of the world, parameters and options of the estimator."""

    meaning: str
    world: Mapping[str, Any] = field(default_factory=dict)
    params: Mapping[str, float] = field(default_factory=dict)
    options: Mapping[str, Any] = field(default_factory=dict)


class CasesExperiment(Experiment):
    """Base class of experiments that run named cases of a world with many seeds each.

    The figures are ``NAME_CASE_FIGURE``, pooled over the runs (`Runs.pooled`), and the cycles to
    the last urgent output and to the next record, ``NAME_latency_cycles_CONFIG`` and
    ``NAME_interval_cycles_CONFIG``; the targets are those of ``targets.csv`` beside the class's
    file; the page ``NAME.html`` has the targets, a row for each case, and plots of the first run
    of some.
    """

    #: A batched world, called with ``seeds`` and a case's options, and the estimator in it.
    world: ClassVar[Callable[..., Any]]
    estimator: ClassVar[type[Estimator]]
    #: Machines whose cycles count.
    configs: ClassVar[Sequence[str]] = ("small", "fast")
    #: In the order of the page's rows; the details of the result are their meanings.
    cases: ClassVar[Mapping[str, Case]]
    most_runs: ClassVar[Mapping[str, int]] = {}  #: most runs of some cases.
    at_once: ClassVar[int] = 25  #: runs of one task.
    #: Paragraphs of the page; may hold {runs}, {seed} and {last}, the last seed.
    intro: ClassVar[str]
    columns: ClassVar[Mapping[str, str]]  #: head of a column to the figure in it.
    #: Cases whose first run is plotted: its `Runs.shown` are the ``panels`` of `histories`.
    shown: ClassVar[Sequence[str]]
    shown_text: ClassVar[str]  #: description of the plots.
    step_s: ClassVar[float]  #: time between two records.
    log: ClassVar[bool] = False  #: whether the plots have logarithmic axes.
    counts: Mapping[str, float] = {}  #: what targets need besides runs (`targets_of`).

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        cls.pages = (f"{cls.name}.html",)

    @staticmethod
    def figures(
        case: Case, world: Any, loop: Loop, reference: Mapping[str, FloatArray]
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Figures (runs,) of a case's loop on the integer C, and panels of its first run.

        ``reference``: outputs (n,) of float64 on the records of the first run. A number is the
        figure of every run.
        """
        raise NotImplementedError

    def further(
        self, outcomes: Mapping[str, Runs], *, seed: int, runs: int, say: Callable[[str], None]
    ) -> dict[str, float]:
        """Figures besides, by their whole names."""
        return {}

    def sections(self, outcomes: Mapping[str, Runs]) -> list[Section]:
        """Sections of the page besides."""
        return []

    def run_case(self, name: str, seeds: range) -> Runs:
        """Run a case with these seeds; ``saturated_sum`` is among its figures."""
        case = self.cases[name]
        estimator = self.estimator(**case.options)
        world = type(self).world(seeds=seeds, **case.world)
        build = Build(estimator, params=[case.params])
        level = make_level("c", build, runs=world.runs)
        loop = close_loop(world, level, keep=[o.name for o in estimator.outputs])
        reference = make_level("float", build).run(np.ascontiguousarray(loop.inputs[:, 0]))
        figures, panels = self.figures(case, world, loop, reference.outputs)
        assert loop.run.saturated is not None
        figures["saturated_sum"] = loop.run.saturated.sum(axis=0)
        runs = np.ones(world.runs)
        return Runs({figure: value * runs for figure, value in figures.items()}, panels)

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
        rows: list[list[str | float]] = [
            [meaning, *(figures.get(f"{self.name}_{name}_{k}", nan) for k in self.columns.values())]
            for name, meaning in meanings.items()
        ]
        intro = self.intro.format(runs=runs, seed=seed, last=seed + runs - 1)
        plots = [
            (meanings[n], histories(outcomes[n].shown, step_s=self.step_s, log=self.log, name=n))
            for n in self.shown
        ]
        sections = [
            Section(title="Cases", columns=("", *self.columns), rows=rows),
            *self.sections(outcomes),
            Section(title="First run", text=self.shown_text, figures=plots),
        ]
        paragraphs = [" ".join(paragraph.split()) for paragraph in intro.split("\n\n")]
        page = render(self.name, paragraphs, targets, sections)
        return ExperimentResult(
            figures=figures, targets=targets, details=meanings, pages={self.pages[0]: page}
        )
