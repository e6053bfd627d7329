"""Estimators, their parameters, experiments, configurations.

boresight list  # for people
boresight list --json  # for programs
"""

from __future__ import annotations

from dataclasses import dataclass

from boresight.gateware.machine import ALL_CONFIGS
from boresight.model.declarations import Input, Output, Param
from boresight.model.estimator import Estimator
from boresight.model.resolve import ESTIMATOR_GROUP, offered
from boresight.options import Verb
from boresight.sim.answer import Answer, Json, JsonObject
from boresight.sim.experiments.experiment import Experiment
from boresight.sim.experiments.registry import EXPERIMENT_GROUP

__all__ = ["Catalogue", "ListedConfig", "ListedEstimator", "ListedExperiment", "list_estimators"]


@dataclass(frozen=True)
class ListedEstimator:
    """An estimator: its name, what it is, and its declarations."""

    name: str
    summary: str
    inputs: tuple[Input, ...]
    parameters: tuple[Param, ...]
    outputs: tuple[Output, ...]

    def to_json(self) -> JsonObject:
        """Plain data."""

        def entries(every: tuple[object, ...], *names: str) -> Json:
            return [{name: getattr(item, name) for name in names} for item in every]

        return {
            "name": self.name,
            "summary": self.summary,
            "inputs": entries(self.inputs, "name", "unit", "low", "high"),
            "parameters": entries(
                self.parameters, "name", "default", "low", "high", "unit", "meaning"
            ),
            "outputs": entries(self.outputs, "name", "unit"),
        }


@dataclass(frozen=True)
class ListedExperiment:
    """An experiment: its name, and what it is."""

    name: str
    summary: str


@dataclass(frozen=True)
class ListedConfig:
    """A configuration of the core: lanes, and words of their registers."""

    name: str
    lanes: int
    registers: int


@dataclass(frozen=True)
class Catalogue(Answer):
    """Estimators, experiments and configurations.

    Attributes
    ----------
    estimators : tuple of ListedEstimator
        By name.
    experiments : tuple of ListedExperiment
        By name.
    configs : tuple of ListedConfig
    unusable : tuple of str
        One line for each entry point of an installed package that cannot be loaded.
    """

    estimators: tuple[ListedEstimator, ...]
    experiments: tuple[ListedExperiment, ...]
    configs: tuple[ListedConfig, ...]
    unusable: tuple[str, ...] = ()

    def __str__(self) -> str:
        lines = []
        for e in self.estimators:
            lines.append(f"{e.name}: {e.summary}")
            lines += [
                f"    {p.name:20s} {p.default:<10g} {p.unit:12s} [{p.low:g}, {p.high:g}]"
                for p in e.parameters
            ]
        lines.append(f"experiments: {', '.join(e.name for e in self.experiments)}")
        lines.append(
            "configurations: "
            + ", ".join(
                f"{c.name} ({c.lanes} lane{'s' if c.lanes > 1 else ''}, {c.registers:,} registers)"
                for c in self.configs
            )
        )
        return "\n".join([*lines, *self.unusable])


def list_estimators() -> Catalogue:
    """Estimators with their inputs, parameters and outputs, experiments, configurations.

    Those of installed packages are among them: entry points of the groups `boresight.estimators`
    and `boresight.experiments`.
    """
    estimators, first = offered(Estimator, "estimator", ESTIMATOR_GROUP)
    experiments, second = offered(Experiment, "experiment", EXPERIMENT_GROUP)
    return Catalogue(
        estimators=tuple(
            ListedEstimator(name, e.summary, tuple(e.inputs), tuple(e.params), tuple(e.outputs))
            for name, e in estimators.items()
        ),
        experiments=tuple(
            ListedExperiment(name, experiments[name].summary) for name in sorted(experiments)
        ),
        configs=tuple(
            ListedConfig(m.name, m.lanes, m.register_words) for m in ALL_CONFIGS.values()
        ),
        unusable=(*first, *second),
    )


VERB = Verb(list_estimators)
