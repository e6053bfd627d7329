"""Tuning: a pattern search on the emitted C, and its effect on other logs.

The figure that falls is a weighted mean of the errors against truth (`sim.accuracy.figures`), each
the mean over the trials. One figure alone counts in its unit; of several each counts as a share of
what it was with the given parameters, so that metres and radians weigh the same. By default every
output with a truth has weight 1, but of an attitude the total angle alone.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from boresight.model.declarations import Param
from boresight.model.errors import InputError, require_choice
from boresight.sim.accuracy.figures import ANGLES
from boresight.sim.accuracy.scoring import Scorer
from boresight.sim.accuracy.search import Sensitivity, Tuned, pattern_search, sensitivities

__all__ = ["Fold", "Objective", "Tuning", "detuned", "means", "weights_of"]

#: Figures of one trial, by name.
Score = Mapping[str, float]


def means(scores: Sequence[Score]) -> dict[str, float]:
    """Mean of each figure over the trials that have it."""
    names = dict.fromkeys(n for s in scores for n in s)
    return {n: float(np.mean([s[n] for s in scores if n in s])) for n in names}


def weights_of(
    figures: Mapping[str, str], chosen: Mapping[str, float] | None = None
) -> dict[str, float]:
    """Weights of figures (units by name): ``chosen`` on top of the module's defaults.

    Raises
    ------
    InputError
        No such figure, a weight below zero or not finite, or none above zero.
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
            "weights", wanted="one above 0", found="zeros", fix="give a figure a weight"
        )
    return weights


@dataclass(frozen=True)
class Objective:
    """The figure that a search reduces.

    Attributes
    ----------
    weights : mapping of str to float
        By figure.
    scales : mapping of str to float
        Divisor of each figure.
    """

    weights: Mapping[str, float]
    scales: Mapping[str, float]

    @classmethod
    def of(cls, weights: Mapping[str, float], baseline: Score) -> Objective:
        """Shares of the ``baseline``, where several count and those are above zero."""
        active = {n: w for n, w in weights.items() if w}
        several = len(active) > 1
        shares = {n: several and np.isfinite(baseline[n]) and baseline[n] > 0.0 for n in active}
        return cls(active, {n: baseline[n] if shares[n] else 1.0 for n in active})

    def value(self, scores: Sequence[Score]) -> float:
        """Weighted mean over figures of their means over the trials; NaN if none has any."""
        weighted = {n: x for n, x in means(scores).items() if n in self.weights}
        weight = sum(self.weights[n] for n in weighted)
        total = sum(self.weights[n] * x / self.scales[n] for n, x in weighted.items())
        return total / weight if weight else float("nan")


@dataclass(frozen=True)
class Fold:
    """One fold: indices of its trials, result of tuning on the others, scores of the tests."""

    test: tuple[int, ...]
    train: tuple[int, ...]
    tuned: Tuned
    scores: tuple[Score, ...]


@dataclass(frozen=True)
class Tuning:
    """Searches over the same trials, of which none is run twice with the same values.

    Attributes
    ----------
    scorer : Scorer
    params : sequence of Param
        Those that move.
    start : mapping of str to float
        Every parameter at the start.
    objective : Objective
    rounds : int
        Most rounds of a search.
    say : callable
        Told what happens.
    """

    scorer: Scorer
    params: Sequence[Param]
    start: Mapping[str, float]
    objective: Objective
    rounds: int
    say: Callable[[str], None]
    _memory: dict[tuple[tuple[str, float], ...], dict[int, Score]] = field(default_factory=dict)

    def scores(self, values: Mapping[str, float], indices: Sequence[int]) -> list[Score]:
        """Scores of some trials with ``values`` on top of the start."""
        parameters = {**self.start, **values}
        cached = self._memory.setdefault(tuple(sorted(parameters.items())), {})
        missing = [k for k in indices if k not in cached]
        cached.update(zip(missing, self.scorer.scores(parameters, missing), strict=True))
        return [cached[k] for k in indices]

    def search(self, indices: Sequence[int], subject: str) -> Tuned:
        """The best values on some trials."""
        start = time.perf_counter()
        result = pattern_search(
            lambda values: self.objective.value(self.scores(values, indices)),
            self.params,
            self.start,
            rounds=self.rounds,
            progress=lambda text: self.say(f"{subject}, {text}"),
        )
        seconds = time.perf_counter() - start
        self.say(f"{subject}: {result.start:.4g} to {result.best:.4g}, {seconds:.1f} s")
        return result

    def folds(self, tests: Sequence[tuple[int, ...]]) -> list[Fold]:
        """Cross-validation: each fold is tuned on the other folds' trials."""
        results = []
        for k, test in enumerate(tests):
            train = tuple(i for i in range(len(self.scorer.feeds)) if i not in test)
            tuned = self.search(train, f"fold {k + 1} of {len(tests)}")
            results.append(Fold(test, train, tuned, tuple(self.scores(tuned.values, test))))
        return results

    def around(self, values: Mapping[str, float], factor: float = 2.0) -> list[Sensitivity]:
        """Errors with each parameter over and times a factor, over all trials."""
        indices = range(len(self.scorer.feeds))

        def errors(moved: Mapping[str, float]) -> dict[str, float]:
            return means(self.scores({**values, **moved}, indices))

        slopes = sensitivities(
            lambda v: self.objective.value(self.scores({**values, **v}, indices)),
            self.params,
            values,
            factor,
        )
        return [
            replace(
                s,
                errors_at_low=errors({s.parameter: s.low}),
                errors_at_high=errors({s.parameter: s.high}),
            )
            for s in slopes
        ]


def detuned(start: Mapping[str, float], params: Sequence[Param], factor: float) -> dict[str, float]:
    """The start with its parameters over and times a factor in turn, in their legal range."""
    out = dict(start)
    for k, p in enumerate(params):
        out[p.name] = min(max(out[p.name] * (factor if k % 2 else 1.0 / factor), p.low), p.high)
    return out
