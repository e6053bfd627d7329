"""Tuning: a pattern search on the emitted C, and its effect on other logs.

The figure that falls is a weighted mean of the errors against truth (`sim.accuracy.figures`), each
the mean over the logs. One error alone counts in its unit; of several each counts as a share of
what it was with the given parameters, so that metres and radians weigh the same. By default every
output with a truth has weight 1, but of an attitude the total angle alone.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from boresight.model.errors import InputError, require_choice
from boresight.sim.accuracy.benchmark import means
from boresight.sim.accuracy.figures import ANGLES
from boresight.sim.accuracy.runs import LogRuns
from boresight.sim.accuracy.search import Axis, Tuned, pattern_search
from boresight.sim.compare.verdict import saturated_text
from boresight.sim.result import Result, Row

#: Errors of a log, by name.
Score = Mapping[str, float]

_SOURCE = (
    "root mean square error against truth of the emitted C (the core's words), mean over the logs; "
    "of an attitude the angles, by BROAD's method, in deg"
)


def weights_of(
    figures: Mapping[str, str], chosen: Mapping[str, float] | None = None
) -> dict[str, float]:
    """Weights of errors (units by name): ``chosen`` on top of the module's defaults.

    Raises
    ------
    InputError
        No such error, a weight below zero or not finite, or none above zero.
    """
    has_attitude = ANGLES[0] in figures
    weights = {n: float(not has_attitude or n == ANGLES[0]) for n in figures}
    for name, weight in (chosen or {}).items():
        require_choice(
            f"weight {name}", name, figures, "weigh an output that the logs have a truth of"
        )
        if not 0.0 <= weight < np.inf:
            raise InputError.at(
                f"weight {name}", wanted="0 or more", found=f"{weight:g}", fix="choose another"
            )
        weights[name] = weight
    if not any(weights.values()):
        raise InputError.at(
            "weights", wanted="one above 0", found="zeros", fix="give an error a weight"
        )
    return weights


@dataclass
class Tuning:
    """Searches over the same logs, none of which runs twice with the same values.

    Attributes
    ----------
    runs : LogRuns
    axes : sequence of Axis
        Axes of the parameters that move.
    start : mapping of str to float
        Every parameter at the start.
    weights : mapping of str to float
        Weights of the errors.
    rounds : int
        Most rounds of a search.
    say : callable
        Called with a line of progress.
    """

    runs: LogRuns
    axes: Sequence[Axis]
    start: Mapping[str, float]
    weights: Mapping[str, float]
    rounds: int = 12
    say: Callable[[str], None] = lambda text: None
    _known: dict[tuple[tuple[str, float], ...], dict[int, Score]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        baseline = means(self.scores({}))
        active = {n: w for n, w in self.weights.items() if w}
        several = len(active) > 1
        self.weights = active
        self._scales = {
            n: baseline[n] if several and np.isfinite(baseline[n]) and baseline[n] > 0.0 else 1.0
            for n in active
        }

    def scores(
        self, values: Mapping[str, float], indices: Sequence[int] | None = None
    ) -> list[Score]:
        """Errors of some logs (all by default) with ``values`` on top of the start."""
        indices = range(len(self.runs.feeds)) if indices is None else indices
        parameters = {**self.start, **values}
        known = self._known.setdefault(tuple(sorted(parameters.items())), {})
        missing = [k for k in indices if k not in known]
        known.update(zip(missing, self.runs.errors(parameters, missing), strict=True))
        return [known[k] for k in indices]

    def figure(self, scores: Sequence[Score]) -> float:
        """Weighted mean over errors of their means over the logs; NaN if none has any."""
        errors = {n: x for n, x in means(scores).items() if n in self.weights}
        weight = sum(self.weights[n] for n in errors)
        total = sum(self.weights[n] * x / self._scales[n] for n, x in errors.items())
        return total / weight if weight else math.nan

    def search(self, indices: Sequence[int], subject: str) -> Tuned:
        """The best values on some logs."""
        tuned = pattern_search(
            lambda values: self.figure(self.scores(values, indices)),
            self.axes,
            rounds=self.rounds,
            progress=lambda text: self.say(f"{subject}, {text}"),
        )
        self.say(f"{subject}: {tuned.start:.4g} to {tuned.best:.4g}")
        return tuned

    def cross_validation(self, tests: Sequence[tuple[int, ...]], names: Sequence[str]) -> Any:
        """Each fold with parameters tuned on the other folds; None without folds."""
        folds, every = list[Row](), list[Score]()
        for k, test in enumerate(tests):
            train = [i for i in range(len(names)) if i not in test]
            tuned = self.search(train, f"fold {k + 1} of {len(tests)}")
            scores = self.scores(tuned.values, test)
            every += scores
            folds.append(
                {
                    "test": [names[i] for i in test],
                    "train_figure": tuned.best,
                    "test_figure": self.figure(scores),
                    "test_error": means(scores),
                    "parameters": tuned.values,
                }
            )
        return {"folds": folds, "mean_test_error": means(every)} if folds else None

    def sensitivity(self, values: Mapping[str, float]) -> list[dict[str, Any]]:
        """Errors with each parameter moved down and up, the others as they are, over all logs.

        A positive parameter moves by a factor of 2, another one by log(2) tenths of its range.
        """
        rows: list[dict[str, Any]] = []
        for axis in self.axes:
            name = axis.param.name
            here = Axis(axis.param, values[name])
            row: dict[str, Any] = {"parameter": name, "value": values[name]}
            for end, place in (("low", -math.log(2.0)), ("high", math.log(2.0))):
                scores = self.scores({**values, name: here.value(place)})
                row |= {end: here.value(place), f"at_{end}": self.figure(scores)}
                row |= {f"errors_at_{end}": means(scores)}
            rows.append(row)
        return rows


def tuned_result(
    tuning: Tuning,
    default: Mapping[str, float],
    names: Sequence[str],
    units: Mapping[str, str],
    tests: Sequence[tuple[int, ...]],
) -> Result:
    """Tune, cross-validate, and vary the result.

    Parameters
    ----------
    default : mapping of str to float
        Parameters before.
    names : sequence of str
        Names of the logs.
    units : mapping of str to str
        Units of the errors.
    tests : sequence of tuple of int
        Test sets of the cross-validation (`folds_of`).
    """
    tuned = tuning.search(range(len(names)), "all logs")
    cross = tuning.cross_validation(tests, names)
    before, after = tuning.scores(default), tuning.scores(tuned.values)
    sensitivity = tuning.sensitivity(tuned.values)
    words = [fixed for fixed, *_ in tuning.runs.run({**tuning.start, **tuned.values})]
    updates = sum(fixed.saturated or 0 for fixed in words)
    values = sum((Counter(fixed.saturations) for fixed in words), Counter[str]())
    held_out = cross["mean_test_error"] if cross else {}
    errors: list[Row] = [
        {
            "error": name,
            "before": means(before)[name],
            "tuned": means(after)[name],
            "held out": held_out.get(name),
            "unit": units.get(name, ""),
        }
        for name in means(before)
    ]
    moved: list[Row] = [
        {
            "parameter": axis.param.name,
            "before": default[axis.param.name],
            "tuned": tuned.values[axis.param.name],
            "unit": axis.param.unit,
            "figure below": row["at_low"],
            "figure above": row["at_high"],
        }
        for axis, row in zip(tuning.axes, sensitivity, strict=True)
    ]
    data = {
        "estimator": tuning.runs.estimator.name,
        "parameters": {**tuning.start, **tuned.values},
        "source": _SOURCE,
        "units": units,
        "weights": tuning.weights,
        "error": {"default": means(before), "tuned": means(after)},
        "trials": [
            {"trial": name, "default": b, "tuned": a}
            for name, b, a in zip(names, before, after, strict=True)
        ],
        "tuned_parameters": moved,
        "search": {"evaluations": tuned.evaluations, "history": tuned.history},
        "sensitivity": sensitivity,
        "cross_validation": cross,
        "saturated_updates": updates,
        "saturations": dict(values),
    }
    summary = (
        f"{tuning.runs.estimator.name}: {tuned.start:.4g} to {tuned.best:.4g} in "
        f"{tuned.evaluations} evaluations over {len(names)} logs"
    )
    tables = {
        "error, mean over the logs": errors,
        "parameters; figure with each divided and multiplied by 2": moved,
    }
    notes = [f"tuned, {saturated_text(updates, dict(values))}"] if updates else []
    return Result(data, tables, summary, notes)
