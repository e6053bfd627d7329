"""An experiment of cases: each with many seeds, figures, cycles, targets, and one page."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Protocol

from boresight.sim.experiments.experiment import Experiment, ExperimentResult
from boresight.sim.experiments.page import render
from boresight.sim.experiments.seeds import Runs, figures_of, run_cases, spreads_of
from boresight.sim.experiments.targets import targets_of
from boresight.sim.pages import Section


class Case(Protocol):
    """Anything with a meaning in words."""

    @property
    def meaning(self) -> str:
        """Head of a row of the page."""


class CasesExperiment(Experiment):
    """Base class of experiments that run named cases with many seeds each.

    The figures are ``NAME_CASE_FIGURE``, pooled over the runs (`Runs.pooled`), and `cycles`; the
    targets are those of ``targets.csv`` beside the class's file; the page ``NAME.html`` has the
    targets, a row for each case, and plots of the first run of some.

    Attributes
    ----------
    cases : mapping of str to Case
        In the order of the page's rows; the details of the result are their meanings.
    at_once : int
        Runs of one task (`run_cases`).
    intro : str
        Paragraphs of the page; may hold {runs}, {seed} and {last}, the last seed.
    columns : mapping of str to str
        Head of a column to the figure in it.
    shown : tuple of str
        Cases whose first run is plotted.
    shown_text : str
        Description of the plots.
    """

    cases: ClassVar[Mapping[str, Any]]
    at_once: ClassVar[int] = 25
    intro: ClassVar[str]
    columns: ClassVar[Mapping[str, str]]
    shown: ClassVar[Sequence[str]]
    shown_text: ClassVar[str]

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        cls.pages = (f"{cls.name}.html",)

    @staticmethod
    def run_case(name: str, seeds: range, /) -> Runs:
        """Run a case with these seeds."""
        raise NotImplementedError

    def cycles(self) -> Mapping[str, float]:
        """Cycles of the core by figure, without ``NAME_``."""
        return {}

    def plot(self, runs: Runs, name: str) -> str:
        """SVG of the first run of a case."""
        raise NotImplementedError

    def run(self, *, seed: int, runs: int, say: Callable[[str], None]) -> ExperimentResult:
        cases = [(name, name, runs) for name in self.cases]
        outcomes = run_cases(
            self.run_case, cases, seed=seed, at_once=self.at_once, jobs=self.jobs, say=say
        )
        figures = figures_of(outcomes, f"{self.name}_")
        figures |= {f"{self.name}_{key}": float(value) for key, value in self.cycles().items()}
        folder = Path(inspect.getfile(type(self))).parent
        targets = targets_of(folder, figures, spreads_of(outcomes, f"{self.name}_"), runs=runs)
        meanings = {name: case.meaning for name, case in self.cases.items()}
        rows: list[list[str | float]] = [
            [meaning, *(figures[f"{self.name}_{name}_{key}"] for key in self.columns.values())]
            for name, meaning in meanings.items()
        ]
        intro = self.intro.format(runs=runs, seed=seed, last=seed + runs - 1)
        page = render(
            self.name,
            [" ".join(paragraph.split()) for paragraph in intro.split("\n\n")],
            targets,
            [
                Section(title="Cases", columns=("", *self.columns), rows=rows),
                Section(
                    title="First run",
                    text=self.shown_text,
                    figures=[(meanings[n], self.plot(outcomes[n], n)) for n in self.shown],
                ),
            ],
        )
        return ExperimentResult(
            figures=figures, targets=targets, details=meanings, pages={self.pages[0]: page}
        )
