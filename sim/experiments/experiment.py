"""Experiments: a system run in simulation, and its figures beside their targets.

A published test, or a user's system, gives figures; a target is the band in which one of them is to
lie, with its source. A missed target stays missed: none is widened until it is met.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from numbers import Real
from typing import Any, ClassVar

from boresight.model.errors import InputError, require
from boresight.model.resolve import load
from boresight.model.step import called

#: Entry points of installed packages that are experiments.
EXPERIMENT_GROUP = "boresight.experiments"


@dataclass(frozen=True, kw_only=True)
class Target:
    """A figure and its accepted band.

    ``name`` says what is measured, ``part`` which part of it (an axis, a channel) if there are
    several, ``source`` where the band is from: a table, a data sheet, a specification. NaN and
    infinity as ``value`` are never good. ``low`` and ``high`` are the smallest and the largest good
    value, None without a limit; ``unit`` is that of all of these. A miss fails the experiment if
    the target is ``binding``; otherwise it is reported. ``beside`` are figures of others for the
    same quantity, by their source; ``spread`` is the range of the value over the runs; ``note``
    tells limits of the measurement; ``needs`` what the run had too little of, such as "250 runs":
    the target is then not judged.
    """

    name: str
    source: str
    value: float
    part: str = ""
    low: float | None = None
    high: float | None = None
    unit: str = ""
    binding: bool = True
    beside: Mapping[str, float] = field(default_factory=dict)
    spread: tuple[float, float] | None = None
    note: str = ""
    needs: str = ""

    def __post_init__(self) -> None:
        where = f"target {self.name}"
        for name in ("value", "low", "high"):
            number = getattr(self, name)
            if not isinstance(number, Real) and (name == "value" or number is not None):
                fix = "write it without quotes" if isinstance(number, str) else "correct it"
                raise InputError.at(where, wanted=f"{name}: a number", found=repr(number), fix=fix)
        if self.low is not None and self.high is not None:
            limits = f"low {self.low:g}, high {self.high:g}"
            require(self.low <= self.high, where, "low up to high", limits, "correct them")

    @property
    def judged(self) -> bool:
        """Whether it has a limit, and the run was long enough for it."""
        return (self.low, self.high) != (None, None) and not self.needs

    @property
    def good(self) -> bool:
        """Whether the value is in the band, or finite if it is not judged."""
        if not self.judged:
            return math.isfinite(self.value)
        low = -math.inf if self.low is None else self.low
        high = math.inf if self.high is None else self.high
        return bool(math.isfinite(self.value) and low <= self.value <= high)  # numpy gives its own

    @property
    def limits(self) -> str:
        """The band, for people; empty without limits."""
        if self.low is None or self.high is None:
            sign, limit = ("at most", self.high) if self.low is None else ("at least", self.low)
            return "" if limit is None else f"{sign} {limit:.4g}"
        return f"{self.low:.4g} to {self.high:.4g}"

    def to_json(self) -> dict[str, Any]:
        """Plain data; ``limit``: least, greatest good value; ``pass``: null if not judged."""
        return {
            "name": f"{self.name}, {self.part}" if self.part else self.name,
            "source": self.source,
            "value": self.value if math.isfinite(self.value) else None,
            "limit": [self.low, self.high],
            "pass": self.good if self.judged else None,
        }


@dataclass(frozen=True, kw_only=True)
class ExperimentResult:
    """Result of a run of an experiment.

    ``figures`` are numbers by name, all finite; ``targets`` the judged ones; ``details`` further
    plain data: curves, tables; ``pages`` the contents of the experiment's `Experiment.pages`.
    """

    figures: Mapping[str, float]
    targets: tuple[Target, ...]
    details: Mapping[str, Any] = field(default_factory=dict)
    pages: Mapping[str, str] = field(default_factory=dict)

    @property
    def good(self) -> bool:
        """Every binding target is met."""
        return all(target.good for target in self.targets if target.binding)


class Experiment:
    """Base class of an experiment.

    ``name`` is by default the class's name in lower case; ``runs`` is the default number of runs,
    from which the spread comes; ``pages`` are names of the files that it makes besides
    ``NAME.json``; ``jobs`` is the number of processes (`seeds.run_cases`), by default one for each
    processor. Figures do not depend on it.
    """

    name: ClassVar[str]
    runs: ClassVar[int] = 100
    pages: ClassVar[tuple[str, ...]] = ()

    def __init__(self, jobs: int | None = None) -> None:
        self.jobs = jobs

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        if "name" not in vars(cls):
            cls.name = cls.__name__.lower()

    def run(self, *, seed: int, runs: int, say: Callable[[str], None]) -> ExperimentResult:
        """Run it ``runs`` times (2 or more), run k with ``seed + k``; ``say`` takes progress."""
        raise NotImplementedError


def experiment_of(source: str | type[Experiment] | Experiment) -> Experiment:
    """The experiment of a name, ``file.py:Class``, a class or an object; see `load`."""
    return load(source, Experiment, "experiment", EXPERIMENT_GROUP)


def result_of(
    experiment: Experiment, *, seed: int, runs: int, say: Callable[[str], None]
) -> ExperimentResult:
    """Run an experiment (`Experiment.run`) and check its result.

    InputError: it raises, or gives anything but an `ExperimentResult` with targets and all pages.
    """
    where, wanted = f"experiment {experiment.name}", "a run that gives an ExperimentResult"
    fix = "write it: it returns ExperimentResult(figures={...}, targets=(...))"
    require(type(experiment).run is not Experiment.run, where, "a method run", None, fix)
    fix = "return ExperimentResult(figures={NAME: NUMBER}, targets=(Target(...), ...))"
    options: Any = {"seed": seed, "runs": runs, "say": say, "kind": ExperimentResult, "answer": fix}
    result = called(experiment.run, where=where, wanted=wanted, **options)
    targets, found = result.targets, f"figures of type {type(result.figures).__name__}"
    require(isinstance(result.figures, Mapping), where, wanted, found, fix)
    good = isinstance(targets, Sequence) and all(isinstance(t, Target) for t in targets)
    require(good, where, wanted, f"targets of type {type(targets).__name__}", fix)
    for name in experiment.pages:
        fix = "return it in ExperimentResult.pages"
        require(isinstance(result.pages.get(name), str), where, f"the page {name}", None, fix)
    return result
