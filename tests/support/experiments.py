"""The experiments of systems: one run each, with cases that were computed already."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from importlib.resources import files
from typing import Any

import pytest

import boresight.sim.experiments.cases as cases_module
from boresight.sim.experiments.experiment import Experiment, ExperimentResult
from boresight.sim.experiments.seeds import Runs


def result_of(
    experiment: Experiment,
    task: Any,
    cases: Mapping[str, Any],
    runs: Mapping[str, Runs],
    patch: pytest.MonkeyPatch,
) -> ExperimentResult:
    """Run a system's experiment on two seeds from 7 on; ``runs`` of cases are not run again.

    Asserts that it runs ``task`` on all ``cases``, that every target of its table has a figure, and
    that its page has the meaning of every case and the seeds.
    """

    def run_cases(asked: Any, dealt: Any, **options: Any) -> dict[str, Runs]:
        assert asked is task and [name for name, _, _ in dealt] == [*cases]
        assert options["seed"] == 7 and {count for _, _, count in dealt} == {2}
        return {name: runs.get(name, [*runs.values()][-1]) for name in cases}

    patch.setattr(cases_module, "run_cases", run_cases)
    result = experiment.run(seed=7, runs=2, say=lambda text: None)
    table = (
        files(type(experiment).__module__.rpartition(".")[0])
        .joinpath("targets.csv")
        .read_text(encoding="utf-8")
    )
    assert len(result.targets) == len(list(csv.DictReader(table.splitlines())))
    (page,) = result.pages.values()
    assert all(case.meaning in page for case in cases.values()) and "seeds 7 to 8" in page
    return result
