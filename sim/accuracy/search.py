"""A deterministic pattern search over parameters (Hooke and Jeeves 1961).

Each parameter moves on an axis of its own: by factors if it is positive, by steps in proportion to
its range otherwise. No derivatives, no random numbers: the same start gives the same end.

R. Hooke, T. A. Jeeves, "Direct Search Solution of Numerical and Statistical Problems",
J. ACM 8(2):212, 1961, doi 10.1145/321062.321069.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from boresight.model.declarations import Param
from boresight.model.errors import InputError, require, require_choice
from boresight.model.estimator import Estimator

#: Values are tried with so many significant digits, as they are printed.
DIGITS = 4
#: First step on an axis, the largest, and the one below which a parameter rests.
FIRST_STEP, LARGEST_STEP, LAST_STEP = math.log(2.0), math.log(8.0), math.log(1.04)
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
    """Axes of the named parameters, or of all.

    Raises
    ------
    InputError
        Unknown or repeated name, or nothing to tune.
    """
    known = {p.name: p for p in estimator.params}
    names = [*known] if names is None else names
    require(bool(names), estimator.name, "parameters", names, "there is nothing to tune")
    for k, name in enumerate(names):
        fix = f"boresight info shows all of {estimator.name}"
        require_choice(f"parameter {name}", name, known, fix)
        require(name not in names[:k], f"parameter {name}", "each once", names, "name it once")
    return [Axis(known[name], start[name]) for name in names]


class Tuned(NamedTuple):
    """Where a search ended; ``history`` is the best figure after each round, the start first."""

    values: dict[str, float]
    evaluations: int
    history: list[float]


def pattern_search(
    objective: Callable[[Mapping[str, float]], float],
    axes: Sequence[Axis],
    rounds: int,
    progress: Callable[[str], None] = lambda text: None,
) -> Tuned:
    """Least figure that coordinate moves and pattern moves find.

    A round tries every parameter in both directions (first the one that helped last). A move that
    helps doubles the step of its parameter, two that do not halve it, and two that change nothing
    at all quarter it. After a round that helped, the whole move of the round is repeated, doubled
    each time, as long as that helps: such moves follow valleys that lie across the axes. The search
    ends when every step is below `LAST_STEP`, or after ``rounds`` rounds.
    """
    known: dict[tuple[float, ...], float] = {}
    low, high = np.transpose([axis.limits for axis in axes])

    def figure(places: np.ndarray) -> float:
        point = tuple(axis.value(place) for axis, place in zip(axes, places, strict=True))
        if point not in known:
            value = objective({a.param.name: v for a, v in zip(axes, point, strict=True)})
            known[point] = value if math.isfinite(value) else math.inf
        return known[point]

    point, sign, step = np.zeros(len(axes)), np.ones(len(axes)), np.full(len(axes), FIRST_STEP)
    best = figure(point)
    history = [best]
    for number in range(rounds):
        base, base_best = point, best
        for k in np.flatnonzero(step >= LAST_STEP):
            changed = False
            for direction in (sign[k], -sign[k]):
                candidate = point.copy()
                candidate[k] = np.clip(point[k] + direction * step[k], low[k], high[k])
                found = figure(candidate)
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
            if not figure(candidate) < best:
                break
            point, best, move = candidate, figure(candidate), 2.0 * move
        history.append(best)
        progress(f"round {number + 1} of {rounds}: {best:.4g}, {len(known)} evaluations")
        if (step < LAST_STEP).all():
            break
    values = {axis.param.name: axis.value(u) for axis, u in zip(axes, point, strict=True)}
    return Tuned(values, len(known), history)


def folds_of(count: int, folds: int | None) -> list[tuple[int, ...]]:
    """Test sets of a cross-validation: every index in exactly one of them.

    By default three folds, or as many as there are indices; 1: none. Indices are dealt in turn.

    Raises
    ------
    InputError
        More folds than indices.
    """
    folds = min(3, count) if folds is None else folds
    if folds > count:
        wanted, fix = (f"1 (none) to {count}, the number of logs", "choose another number")
        raise InputError.at("folds", wanted=wanted, found=str(folds), fix=fix)
    return [tuple(range(count)[k::folds]) for k in range(folds)] if folds > 1 else []
