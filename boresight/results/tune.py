"""Result of `boresight tune`, and its text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

from boresight.sim.accuracy.search import Sensitivity
from boresight.sim.answer import Answer

__all__ = [
    "CrossValidation",
    "TuneErrors",
    "TuneFold",
    "TuneResult",
    "TuneSearch",
    "TuneTrial",
    "TunedParameter",
]

#: Root mean square errors by output, of an attitude by angle in degrees; None: no number.
Figures: TypeAlias = Mapping[str, float | None]


@dataclass(frozen=True)
class TuneErrors:
    """Errors with the values that were given, and with the tuned ones."""

    given: Figures
    tuned: Figures


@dataclass(frozen=True)
class TuneTrial:
    """Errors of one log, with the values that were given, and with the tuned ones."""

    trial: str
    given: Figures
    tuned: Figures


@dataclass(frozen=True)
class TunedParameter:
    """A parameter: its range, what was given, where the search started, where it ended."""

    name: str
    unit: str
    low: float
    high: float
    given: float
    start: float
    tuned: float


@dataclass(frozen=True)
class TuneSearch:
    """How it was searched.

    ``history`` holds the best figure after each round, ``start`` being its first; a figure is the
    weighted mean of errors over those of the start.
    """

    method: str
    rounds: int
    rounds_most: int
    detune: float
    evaluations: int
    start: float | None
    history: tuple[float | None, ...]


@dataclass(frozen=True)
class TuneFold:
    """One fold: logs held back and trained on, the figures of both, and the parameters."""

    test: tuple[str, ...]
    train: tuple[str, ...]
    train_figure: float | None
    test_figure: float | None
    test_error: Figures
    parameters: Mapping[str, float]


@dataclass(frozen=True)
class CrossValidation:
    """All folds, and means over all logs, each with parameters tuned on the other folds."""

    folds: tuple[TuneFold, ...]
    seed: int | None
    mean_test_figure: float | None
    mean_test_error: Figures
    source: str


@dataclass(frozen=True)
class TuneResult(Answer):
    """What `boresight.tune` gives; ``--params`` reads it.

    Attributes
    ----------
    estimator : str
    parameters : mapping of str to float
        All values, the tuned ones among them.
    word : int
        Word width, bits.
    source : str
        How errors are measured.
    units, weights : mapping
        Of the errors.
    error : TuneErrors
        Mean over all logs.
    trials : tuple of TuneTrial
        Of each log.
    tuned_parameters : tuple of TunedParameter
    search : TuneSearch
    without_truth : tuple of str
        Logs that were left out.
    vary : float
        Factor of the sensitivities.
    sensitivity : tuple of Sensitivity
        Figures with one parameter over and times that factor.
    cross_validation : CrossValidation or None
    """

    estimator: str
    parameters: Mapping[str, float]
    word: int
    source: str
    units: Mapping[str, str]
    weights: Mapping[str, float]
    error: TuneErrors
    trials: tuple[TuneTrial, ...]
    tuned_parameters: tuple[TunedParameter, ...]
    search: TuneSearch
    without_truth: tuple[str, ...]
    vary: float
    sensitivity: tuple[Sensitivity, ...]
    cross_validation: CrossValidation | None

    def __str__(self) -> str:
        what, cross = self._what(), self.cross_validation
        wide = max(14, *(len(f"{n} {unit}") for n, unit in self.units.items()))
        lines = [
            f"{self.estimator}, W = {self.word}, {_trials(len(self.trials))}, "
            f"{self.search.evaluations} evaluations: root mean square error",
            f"  {'':{wide}s}  {'given':>10s}{'tuned':>10s}"
            + ("" if cross is None else "  cross-validated"),
        ]
        for n, unit in self.units.items():
            pair = "".join(
                _number(error.get(n), 10) for error in (self.error.given, self.error.tuned)
            )
            more = "" if cross is None else _number(cross.mean_test_error.get(n), 17)
            lines.append(f"  {f'{n} {unit}':{wide}s}  {pair}{more}".rstrip())
        for k, f in enumerate(() if cross is None else cross.folds):
            lines.append(
                f"  fold {k + 1}: trained on {len(f.train)} {_number(f.train_figure)}, "
                f"tested on {len(f.test)} {_number(f.test_figure)}   ({what})"
            )
        width = max(len(p.name) for p in self.tuned_parameters)
        lines.append(
            f"  {'parameter':{width}s}  {'given':>10s} {'tuned':>10s}  {what} with "
            f"x {1.0 / self.vary:g}, x {self.vary:g}"
        )
        for p, s in zip(self.tuned_parameters, self.sensitivity, strict=True):
            lines.append(
                f"  {p.name:{width}s}  {p.given:10.4g} {p.tuned:10.4g}  "
                f"{_number(s.at_low)} {_number(s.at_high)}  {p.unit:12s}"
                + "; ".join(filter(None, (self._most(s), self._limits(p, s))))
            )
            lines[-1] = lines[-1].rstrip()
        if self.without_truth:
            lines.append("  left out, no truth: " + ", ".join(self.without_truth))
        return "\n".join(lines)

    def _what(self) -> str:
        """What a figure is."""
        weights = {n: w for n, w in self.weights.items() if w}
        if len(weights) == 1:
            alone = next(iter(weights))
            return f"{alone} {self.units[alone]}".strip()
        if len(weights) > 4 and len({*weights.values()}) == 1:
            return f"share of the given, {len(weights)} figures alike"
        weights_text = ", ".join(f"{n} {w:g}" for n, w in weights.items())
        return f"share of the given, weights {weights_text}"

    def _limits(self, p: TunedParameter, s: Sensitivity) -> str:
        """Where the parameter's range limits the tuned value, or those tried beside it."""
        texts = []
        if p.tuned in (p.low, p.high):
            texts.append(f"tuned stands at its limit, {p.tuned:.6g}")
        for factor, tried, limit in ((1.0 / self.vary, s.low, p.low), (self.vary, s.high, p.high)):
            if tried == limit and abs(tried - factor * s.value) > 1e-6 * abs(tried):
                texts.append(f"x {factor:g} is beyond the range, {limit:.6g} was tried")
        return "; ".join(texts)

    def _most(self, s: Sensitivity) -> str:
        """Of several errors that count the one that changes most, in per cent."""
        change = {
            n: [100.0 * (e.get(n, x) / x - 1.0) for e in (s.errors_at_low, s.errors_at_high)]
            for n, x in self.error.tuned.items()
            if x and self.weights.get(n)
        }
        if len(change) < 2:
            return ""
        name = max(change, key=lambda n: max(map(abs, change[n])))
        return f"{name} {change[name][0]:+.1f} %, {change[name][1]:+.1f} %"


def _trials(count: int) -> str:
    return f"{count} trial{'s' * (count != 1)}"


def _number(value: float | None, width: int = 8) -> str:
    return f"{'-' if value is None else f'{value:.4g}':>{width}s}"
