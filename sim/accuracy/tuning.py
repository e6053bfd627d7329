"""Tuning: a deterministic pattern search, and the figure that falls.

Each parameter moves on an axis of its own: by factors if it is positive, by steps in proportion to
its range otherwise (R. Hooke, T. A. Jeeves, "Direct Search Solution of Numerical and Statistical
Problems", J. ACM 8(2):212, 1961, doi 10.1145/321062.321069). A descent begins at the start, another
one at the best of `SPREAD` points that fill the ranges; from the better end it begins again with
large steps as long as that helps.

The figure is a weighted mean of the errors against truth (`sim.accuracy.figures`), each the mean
over the logs. One error alone counts in its unit, each of several as a share of what it was with
the given parameters. By default every output with a truth has weight 1, but of an attitude the
total angle alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from boresight.model.declarations import Param
from boresight.model.errors import require, require_choice
from boresight.model.estimator import Estimator
from boresight.sim.accuracy.figures import ANGLES, means

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
        found = _descent(figure, [Axis(a.param, values[a.param.name]) for a in axes], rounds)
        progress(f"{found.history[-1]:.4g} after {len(known)} runs")
        return found

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
    figure: Callable[[Mapping[str, float]], float], axes: Sequence[Axis], rounds: int
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
    for _ in range(rounds):
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


def figure_of(
    weights: Mapping[str, float], before: Mapping[str, float]
) -> Callable[[Sequence[Mapping[str, float]]], float]:
    """The figure of some logs' errors; NaN if none of these counts. ``before``: means at the start.

    See this module.
    """
    scales = dict.fromkeys(weights, 1.0)
    if sum(w > 0.0 for w in weights.values()) > 1:
        scales |= {n: before[n] for n in weights if 0.0 < before[n] < math.inf}

    def figure(scores: Sequence[Mapping[str, float]]) -> float:
        errors = {n: x for n, x in means(scores).items() if weights.get(n)}
        weight = math.fsum(weights[n] for n in errors)
        total = math.fsum(weights[n] * x / scales[n] for n, x in errors.items())
        return total / weight if weight else math.nan

    return figure
