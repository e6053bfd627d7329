"""A deterministic pattern search over parameters.

Parameters are moved one after the other, by a factor, within their legal range (Hooke and Jeeves
1961, in the logarithm). No derivative, no chance: the same start gives the same end.

R. Hooke, T. A. Jeeves, "Direct Search Solution of Numerical and Statistical Problems",
J. ACM 8(2):212, 1961, doi 10.1145/321062.321069.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from boresight.model.errors import InputError, require_choice
from boresight.model.estimator import Estimator, Param

__all__ = [
    "Search",
    "Sensitivity",
    "Tuned",
    "deal_folds",
    "deal_named",
    "pattern_search",
    "sensitivities",
    "tunable",
]

#: Values are tried with so many significant digits, as they are printed.
DIGITS = 4
#: First factor of a step, its largest, and the one below which a parameter rests.
FIRST_FACTOR, LARGEST_FACTOR, LAST_FACTOR = 2.0, 8.0, 1.04

#: Figure of parameter values by name, the less the better; inf or NaN if they are of no use.
Objective = Callable[[Mapping[str, float]], float]
Progress = Callable[[str], None]


def rounded(value: float) -> float:
    """The value with `DIGITS` significant digits."""
    return float(f"{value:.{DIGITS}g}")


def tunable(
    estimator: Estimator, start: Mapping[str, float], names: Sequence[str] | None = None
) -> list[Param]:
    """Parameters to tune: those named, or all that are above zero and may be moved by a factor.

    Raises
    ------
    InputError
        Unknown or repeated name, a parameter whose start is not above zero, or nothing to tune.
    """
    legal = {p.name: p for p in estimator.params}
    if names is None:
        out = [p for p in estimator.params if p.low >= 0.0 and start[p.name] > 0.0]
        if not out:
            raise InputError.at(
                estimator.name,
                wanted="a parameter with a start above zero",
                found="none",
                fix="there is nothing to tune",
            )
        return out
    for k, name in enumerate(names):
        require_choice(
            f"parameter {name}", name, legal, f"boresight list shows all of {estimator.name}"
        )
        if name in names[:k]:
            raise InputError.at(
                f"parameter {name}",
                wanted="each parameter once",
                found="it twice",
                fix="name it once",
            )
        if not start[name] > 0.0:
            raise InputError.at(
                f"parameter {name}",
                wanted="a start value above zero",
                found=f"{start[name]:g}",
                fix=f"it is moved by factors: start it with --param {name}=NUMBER",
            )
    return [legal[name] for name in names]


@dataclass(frozen=True)
class Tuned:
    """Where a search ended.

    ``history``: best figure after each round, the first entry being the start.
    """

    values: dict[str, float]
    start: float
    best: float
    evaluations: int
    history: tuple[float, ...] = field(repr=False, default=())


class Search:
    """One search: remembers every figure, so that no point is measured twice."""

    def __init__(self, objective: Objective, params: Sequence[Param]) -> None:
        self.objective = objective
        self.params = tuple(params)
        self.seen: dict[tuple[float, ...], float] = {}

    def figure(self, point: tuple[float, ...]) -> float:
        """Objective at a point; infinite where it is not a number."""
        if point not in self.seen:
            value = self.objective({p.name: v for p, v in zip(self.params, point, strict=True)})
            self.seen[point] = value if math.isfinite(value) else math.inf
        return self.seen[point]

    def moved(self, point: tuple[float, ...], k: int, factor: float) -> tuple[float, ...]:
        """The point with coordinate k times a factor, rounded and kept in its legal range."""
        p = self.params[k]
        value = min(max(rounded(point[k] * factor), p.low), p.high)
        return (*point[:k], value, *point[k + 1 :])


def pattern_search(
    objective: Objective,
    params: Sequence[Param],
    start: Mapping[str, float],
    *,
    rounds: int = 12,
    progress: Progress | None = None,
) -> Tuned:
    """Least figure that coordinate moves and pattern moves find.

    A round tries every parameter up and down by its own factor (first the way that helped last);
    a move that helps doubles the step in the logarithm, two that do not halve it, and two that
    change nothing at all quarter it. After a round
    that helped, the whole step of the round is made again, doubled each time, as long as that
    helps (pattern moves, which run along valleys that lie across the axes). The search ends
    when every factor is below `LAST_FACTOR`, or after ``rounds`` rounds.

    Parameters
    ----------
    objective : callable
        Figure of values by name.
    start : mapping
        Start of every parameter, above zero.
    """
    search = Search(objective, params)
    point = tuple(float(start[p.name]) for p in params)
    best = first = search.figure(point)
    step = [math.log(FIRST_FACTOR)] * len(params)
    sign = [1.0] * len(params)
    history = [best]
    for number in range(rounds):
        base, base_best = point, best
        for k in range(len(params)):
            if step[k] < math.log(LAST_FACTOR):
                continue
            changed = False
            for direction in (sign[k], -sign[k]):
                candidate = search.moved(point, k, math.exp(direction * step[k]))
                figure = search.figure(candidate)
                changed |= figure != best
                if figure < best:
                    point, best, sign[k] = candidate, figure, direction
                    step[k] = min(2.0 * step[k], math.log(LARGEST_FACTOR))
                    break
            else:
                step[k] *= 0.5 if changed else 0.25
        if best < base_best:
            ratios = [a / b for a, b in zip(point, base, strict=True)]
            while True:
                candidate = point
                for k, ratio in enumerate(ratios):
                    candidate = search.moved(candidate, k, ratio)
                figure = search.figure(candidate)
                if not figure < best:
                    break
                point, best = candidate, figure
                ratios = [r * r for r in ratios]
        history.append(best)
        if progress is not None:
            progress(f"round {number + 1} of {rounds}: {best:.4g}, {len(search.seen)} evaluations")
        if all(s < math.log(LAST_FACTOR) for s in step):
            break
    return Tuned(
        {p.name: v for p, v in zip(params, point, strict=True)},
        first,
        best,
        len(search.seen),
        tuple(history),
    )


def deal_folds(count: int, folds: int, seed: int | None = None) -> list[tuple[int, ...]]:
    """Test sets of a K-fold cross-validation: every index in exactly one of them.

    Trials are dealt round-robin in their order, or after a shuffle with a seed.

    Raises
    ------
    InputError
        Fewer than two folds, or more folds than trials.
    """
    if not 2 <= folds <= count:
        raise InputError.at(
            "folds",
            wanted=f"2 to {count}, the number of trials, or 1 for none"
            if count > 1
            else "1, for none, as there is one trial",
            found=str(folds),
            fix="choose another number or name more trials",
        )
    order = list(range(count))
    if seed is not None:
        order = [int(k) for k in np.random.default_rng(seed).permutation(count)]
    return [tuple(sorted(order[k::folds])) for k in range(folds)]


def deal_named(
    names: Sequence[str], folds: int | None, seed: int | None = None
) -> list[tuple[int, ...]]:
    """Test sets of which none shares a name with another: `deal_folds` of the names.

    By default three folds, or as many as there are names; 1: none.
    """
    unique = list(dict.fromkeys(names))
    count = min(3, len(unique)) if folds is None else folds
    return [
        tuple(k for k, name in enumerate(names) if unique.index(name) in test)
        for test in (deal_folds(len(unique), count, seed) if count != 1 else [])
    ]


@dataclass(frozen=True)
class Sensitivity:
    """Objective with one parameter below and above its value (within its legal range).

    ``errors_at_low``, ``errors_at_high``: every figure there, where several are known.
    """

    parameter: str
    value: float
    low: float
    high: float
    at_low: float
    at_high: float
    errors_at_low: Mapping[str, float] = field(default_factory=dict)
    errors_at_high: Mapping[str, float] = field(default_factory=dict)


def sensitivities(
    objective: Objective, params: Sequence[Param], values: Mapping[str, float], factor: float = 2.0
) -> list[Sensitivity]:
    """The objective with each parameter over and times a factor, the others as they are."""
    search = Search(objective, params)
    point = tuple(values[p.name] for p in params)
    out = []
    for k, p in enumerate(params):
        low, high = (search.moved(point, k, f) for f in (1.0 / factor, factor))
        figures = search.figure(low), search.figure(high)
        out.append(Sensitivity(p.name, point[k], low[k], high[k], *figures))
    return out
