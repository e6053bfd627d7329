"""Tuning: a deterministic pattern search on the emitted C, and its effect on other logs.

Each parameter moves on an axis of its own: by factors if it is positive, by steps in proportion to
its range otherwise. No derivatives, no random numbers: the same start gives the same end (R. Hooke,
T. A. Jeeves, "Direct Search Solution of Numerical and Statistical Problems", J. ACM 8(2):212, 1961,
doi 10.1145/321062.321069). A descent begins at the start, another one at the best of `SPREAD`
points that fill the ranges, so that a local minimum near the start is left; and from the better end
it begins again with large steps as long as that helps.

The figure that falls is a weighted mean of the errors against truth (`sim.accuracy.figures`), each
the mean over the logs. One error alone counts in its unit; of several each counts as a share of
what it was with the given parameters, so that metres and radians weigh the same. By default every
output with a truth has weight 1, but of an attitude the total angle alone.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from boresight.model.declarations import Param
from boresight.model.errors import require, require_choice
from boresight.model.estimator import Estimator
from boresight.sim.accuracy.figures import ANGLES, means
from boresight.sim.accuracy.runs import LogRuns
from boresight.sim.compare.verdict import saturated_text
from boresight.sim.result import Result, Row

#: Values are tried with so many significant digits, as they are printed.
DIGITS = 4
#: First step on an axis, the largest, and the one below which a parameter rests.
FIRST_STEP, LARGEST_STEP, LAST_STEP = math.log(2.0), math.log(8.0), math.log(1.002)
#: Points that fill the ranges, and share of the largest value from which on they do.
SPREAD, SMALLEST = 16, 1e-4
#: Share by which another descent must improve, to be followed by one more.
_HELPS = 1e-3
#: Share of its range that a parameter moves by a step of 1, if it does not move by factors.
_SHARE = 0.1


@dataclass(frozen=True)
class Axis:
    """The axis of a parameter; 0 on it is the start."""

    param: Param
    start: float

    @property
    def by_factors(self) -> bool:
        """Whether the parameter moves by factors."""
        return self.param.low >= 0.0 and self.start > 0.0

    def value(self, place: float) -> float:
        """The parameter at a place, rounded and within its range."""
        p = self.param
        step = _SHARE * (p.high - p.low) * place
        value = self.start * math.exp(place) if self.by_factors else self.start + step
        return min(max(float(f"{value:.{DIGITS}g}"), p.low), p.high)

    @property
    def limits(self) -> tuple[float, float]:
        """Places of the least and the greatest value."""

        def place(end: float) -> float:
            if self.by_factors:
                return math.log(end / self.start) if end > 0.0 else -math.inf
            return (end - self.start) / (_SHARE * (self.param.high - self.param.low))

        return place(self.param.low), place(self.param.high)


def axes_of(
    estimator: Estimator, start: Mapping[str, float], names: Sequence[str] | None = None
) -> list[Axis]:
    """Axes of the named parameters, or of all; raises InputError for bad names, and for none."""
    known = {p.name: p for p in estimator.params}
    names = [*known] if names is None else names
    require(bool(names), estimator.name, "parameters", names, "there is nothing to tune")
    for k, name in enumerate(names):
        where, fix = f"parameter {name}", f"boresight info shows all of {estimator.name}"
        require_choice(where, name, known, fix)
        require(name not in names[:k], where, "each once", f"{name} twice", "name it once")
    return [Axis(known[name], start[name]) for name in names]


class Tuned(NamedTuple):
    """Where a search ended; ``history`` is the best figure after each round, the start first."""

    values: dict[str, float]
    evaluations: int
    history: list[float]


def spread(axes: Sequence[Axis]) -> Iterator[dict[str, float]]:
    """`SPREAD` points that fill the ranges, by factors where no value is below 0.

    The additive sequence of the generalised golden ratio (M. Roberts, 2018): deterministic.
    """
    ratio = 2.0
    for _ in range(50):  # the root of r^(n + 1) = r + 1
        ratio = (1.0 + ratio) ** (1.0 / (len(axes) + 1))
    for point in range(1, SPREAD + 1):
        values = {}
        for k, axis in enumerate(axes):
            p, share = axis.param, (0.5 + point * ratio ** -(k + 1)) % 1.0
            low = max(p.low, SMALLEST * p.high)
            by_factors = p.low >= 0.0 and low > 0.0
            far = low * (p.high / low) ** share if by_factors else p.low + share * (p.high - p.low)
            values[p.name] = Axis(p, far).value(0.0)
        yield values


def pattern_search(
    objective: Callable[[Mapping[str, float]], float],
    axes: Sequence[Axis],
    rounds: int,
    progress: Callable[[str], None] = lambda text: None,
) -> Tuned:
    """Least figure that descents from several points find; see this module.

    ``objective`` maps values by name to the figure; a descent has ``rounds`` at most.
    """
    known: dict[tuple[float, ...], float] = {}

    def figure(values: Mapping[str, float]) -> float:
        point = tuple(values.values())
        if point not in known:
            value = objective(values)
            known[point] = value if math.isfinite(value) else math.inf
        return known[point]

    def descended(values: Mapping[str, float]) -> Tuned:
        own = [Axis(axis.param, values[axis.param.name]) for axis in axes]
        return _descent(figure, own, rounds, lambda text: progress(f"{text}, {len(known)} runs"))

    start = {axis.param.name: axis.value(0.0) for axis in axes}
    best = descended(start)
    history = [*best.history]
    for begin in (min(spread(axes), key=figure), None, None, None):
        found = descended(begin or best.values)
        history += [min(history[-1], value) for value in found.history[1:]]
        helps = found.history[-1] < (1.0 - _HELPS) * best.history[-1]
        best = min(best, found, key=lambda tuned: tuned.history[-1])
        if not (begin or helps):
            break
    return Tuned(best.values, len(known), history)


def _descent(
    figure: Callable[[Mapping[str, float]], float],
    axes: Sequence[Axis],
    rounds: int,
    progress: Callable[[str], None],
) -> Tuned:
    """Least figure that coordinate moves and pattern moves find.

    A round tries every parameter in both directions (first the one that helped last). A move that
    helps doubles the step of its parameter, two that do not halve it, and two that change nothing
    at all quarter it. After a round that helped, the whole move of the round is repeated, doubled
    each time, as long as that helps: such moves follow valleys that lie across the axes. The search
    ends when every step is below `LAST_STEP`, or after ``rounds`` rounds.
    """
    low, high = np.transpose([axis.limits for axis in axes])

    def values_at(places: np.ndarray) -> dict[str, float]:
        return {a.param.name: a.value(place) for a, place in zip(axes, places, strict=True)}

    point, sign, step = np.zeros(len(axes)), np.ones(len(axes)), np.full(len(axes), FIRST_STEP)
    best = figure(values_at(point))
    history = [best]
    for number in range(rounds):
        base, base_best = point, best
        for k in np.flatnonzero(step >= LAST_STEP):
            changed = False
            for direction in (sign[k], -sign[k]):
                candidate = point.copy()
                candidate[k] = np.clip(point[k] + direction * step[k], low[k], high[k])
                found = figure(values_at(candidate))
                changed |= found != best
                if found < best:
                    point, best, sign[k] = candidate, found, direction
                    step[k] = min(2.0 * step[k], LARGEST_STEP)
                    break
            else:
                step[k] *= 0.5 if changed else 0.25
        move = point - base
        while best < base_best:
            candidate = np.clip(point + move, low, high)
            if not (found := figure(values_at(candidate))) < best:
                break
            point, best, move = candidate, found, 2.0 * move
        history.append(best)
        progress(f"round {number + 1} of {rounds}: {best:.4g}")
        if (step < LAST_STEP).all():
            break
    return Tuned(values_at(point), 0, history)


def folds_of(count: int, folds: int | None) -> list[tuple[int, ...]]:
    """Test sets of a cross-validation: every index in exactly one of them.

    By default three folds, or as many as there are indices; 1: none. Indices are dealt in turn.
    Raises InputError for more folds than indices.
    """
    folds = min(3, count) if folds is None else folds
    wanted = f"1 (none) to {count}, the number of logs"
    require(folds <= count, "folds", wanted, folds, "choose another number")
    return [tuple(range(count)[k::folds]) for k in range(folds)] if folds > 1 else []


_SOURCE = (
    "root mean square error against truth of the emitted C (the core's words), mean over the logs; "
    "of an attitude the angles, by BROAD's method, in deg"
)


def weights_of(
    figures: Mapping[str, str], chosen: Mapping[str, float] | None = None
) -> dict[str, float]:
    """Weights of errors (units by name): ``chosen`` on top of the module's defaults.

    Raises InputError for no such error, a weight below zero or not finite, or none above zero.
    """
    has_attitude = ANGLES[0] in figures
    weights = {n: float(not has_attitude or n == ANGLES[0]) for n in figures}
    for name, weight in (chosen or {}).items():
        where = f"weight {name}"
        require_choice(where, name, figures, "weigh an output that the logs have a truth of")
        require(0.0 <= weight < math.inf, where, "0 or more", weight, "choose another")
        weights[name] = weight
    require(any(weights.values()), "weights", "one above 0", "only zeros", "give an error a weight")
    return weights


@dataclass
class Tuning:
    """Searches over the same logs, none of which runs twice with the same values.

    ``axes`` are of the parameters that move, ``start`` has every parameter, ``weights`` are of the
    errors; a search has ``rounds`` at most; ``say`` is called with a line of progress.
    """

    runs: LogRuns
    axes: Sequence[Axis]
    start: Mapping[str, float]
    weights: Mapping[str, float]
    rounds: int
    say: Callable[[str], None]
    _known: dict[tuple[tuple[str, float], ...], dict[int, Mapping[str, float]]] = field(
        default_factory=dict
    )

    def __post_init__(self) -> None:
        baseline = means(self.scores({}))
        self.weights = {n: w for n, w in self.weights.items() if w}
        one = len(self.weights) == 1
        self._scales = {
            n: 1.0 if one or not 0.0 < baseline[n] < math.inf else baseline[n] for n in self.weights
        }

    def scores(
        self, values: Mapping[str, float], indices: Sequence[int] | None = None
    ) -> list[Mapping[str, float]]:
        """Errors of some logs (all by default) with ``values`` on top of the start."""
        indices = range(len(self.runs.feeds)) if indices is None else indices
        parameters = {**self.start, **values}
        known = self._known.setdefault(tuple(sorted(parameters.items())), {})
        missing = [k for k in indices if k not in known]
        found = self.runs.run(parameters, missing)
        known.update((k, fixed.errors) for k, (fixed, *_) in zip(missing, found, strict=True))
        return [known[k] for k in indices]

    def figure(self, scores: Sequence[Mapping[str, float]]) -> float:
        """Weighted mean over errors of their means over the logs; NaN if none has any."""
        errors = {n: x for n, x in means(scores).items() if n in self.weights}
        weight = math.fsum(self.weights[n] for n in errors)
        total = math.fsum(self.weights[n] * x / self._scales[n] for n, x in errors.items())
        return total / weight if weight else math.nan

    def search(self, indices: Sequence[int], subject: str) -> Tuned:
        """The best values on some logs."""
        tuned = pattern_search(
            lambda values: self.figure(self.scores(values, indices)),
            self.axes,
            self.rounds,
            progress=lambda text: self.say(f"{subject}, {text}"),
        )
        self.say(f"{subject}: {tuned.history[0]:.4g} to {tuned.history[-1]:.4g}")
        return tuned

    def cross_validation(self, tests: Sequence[tuple[int, ...]], names: Sequence[str]) -> Any:
        """Each fold with parameters tuned on the other folds; None without folds."""
        folds, every = list[Row](), list[Mapping[str, float]]()
        for k, test in enumerate(tests):
            train = [i for i in range(len(names)) if i not in test]
            tuned = self.search(train, f"fold {k + 1} of {len(tests)}")
            scores = self.scores(tuned.values, test)
            every += scores
            folds.append(
                {
                    "test": [names[i] for i in test],
                    "train_figure": tuned.history[-1],
                    "test_figure": self.figure(scores),
                    "test_error": means(scores),
                    "parameters": tuned.values,
                }
            )
        return {"folds": folds, "mean_test_error": means(every)} if folds else None

    def _at_ends(self, values: Mapping[str, float]) -> list[str]:
        """Notes about parameters that moved to an end of their ranges."""
        notes = []
        for axis in self.axes:
            p, value = axis.param, values[axis.param.name]
            if value in (p.low, p.high) and value != axis.start:
                notes.append(
                    f"{p.name} ends at the {'lower' if value == p.low else 'upper'} end of its "
                    f"range, {p.low:g} to {p.high:g}: a wider range may give a smaller error"
                )
        return notes

    def result(
        self, names: Sequence[str], units: Mapping[str, str], tests: Sequence[tuple[int, ...]]
    ) -> Result:
        """Tune, and cross-validate on ``tests`` (`folds_of`); units of the errors."""
        name = self.runs.estimator.name
        tuned = self.search(range(len(names)), "all logs")
        cross = self.cross_validation(tests, names)
        scores = self.scores({}), self.scores(tuned.values)
        before, after = map(means, scores)
        parameters = {**self.start, **tuned.values}
        words = [fixed for fixed, *_ in self.runs.run(parameters)]
        updates = sum(fixed.saturated or 0 for fixed in words)
        values = dict(sum((Counter(fixed.saturations) for fixed in words), Counter[str]()))
        errors: list[Row] = [
            {
                "error": error,
                "before": before[error],
                "tuned": after[error],
                "held out": cross["mean_test_error"].get(error) if cross else None,
                "unit": units.get(error, ""),
            }
            for error in before
        ]
        moved: list[Row] = [
            {
                "parameter": axis.param.name,
                "before": self.start[axis.param.name],
                "tuned": tuned.values[axis.param.name],
                "unit": axis.param.unit,
            }
            for axis in self.axes
        ]
        data = {
            "estimator": name,
            "parameters": parameters,
            "source": _SOURCE,
            "units": units,
            "weights": self.weights,
            "error": {"default": before, "tuned": after},
            "trials": [
                {"trial": name, "default": b, "tuned": a}
                for name, b, a in zip(names, *scores, strict=True)
            ],
            "tuned_parameters": moved,
            "search": {"evaluations": tuned.evaluations, "history": tuned.history},
            "cross_validation": cross,
            "saturated_updates": updates,
            "saturations": values,
        }
        summary = (
            f"{name}: {tuned.history[0]:.4g} to {tuned.history[-1]:.4g} in "
            f"{tuned.evaluations} evaluations over {len(names)} logs"
        )
        tables = {"error, mean over the logs": errors, "parameters": moved}
        notes = [f"tuned, {saturated_text(updates, values)}"] if updates else []
        notes += self._at_ends(tuned.values)
        if not tests:
            why = "there is one log" if len(names) == 1 else "there is one fold"
            notes.append(f"no cross-validation, since {why}: the error on other logs is not known")
        return Result(data, tables, summary, notes)
