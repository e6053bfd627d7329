"""A filter's covariance put to the test: millions of updates of the C, positiveness, drift.

A covariance is what the estimator says (`Estimator.covariance_elements`) or what its states are
named as: ``p00``, ``p01``, ``p11`` (or ``p_xx``, ``p_xy``), the upper or the lower half. The
stimulus is hostile on purpose (`sim.accuracy.manoeuvres`), for one initial covariance after the
other. Estimators that share a covariance update it in random turns. Watched are the diagonal after
every update, the eigenvalues at intervals, the saturation flag, and the difference to float64 on
the same input.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.declarations import ATTITUDE
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Program
from boresight.sim.answer import Answer, JsonObject
from boresight.sim.compare.difference import Difference, differences
from boresight.sim.levels.build import Build
from boresight.sim.levels.floating import CompiledFloat
from boresight.sim.levels.integer import Emitted
from boresight.sim.levels.level import Level, Run
from boresight.sim.rtl.sharing import random_turns

__all__ = [
    "P0",
    "Covariance",
    "CovarianceTrial",
    "covariance_of",
    "covariance_trial",
    "initial_covariances",
]


#: Initial variances of an attitude, rad^2.
P0 = (1e-8, 1e-6, 1e-4, 1e-2, 1.0)
#: Share of their default of other initial variances; of initial deviations the roots.
SHARES = (1e-4, 1e-2, 1.0, 1e2, 1e4)
#: Least eigenvalue that rounding explains, in last bits.
_LEAST_EIGENVALUE = -4.0
#: Most updates of one estimator in a turn, of those that share states.
_LONGEST = 8
_ELEMENT = re.compile(r"p_?([0-9a-z])([0-9a-z])")


@dataclass(frozen=True)
class Covariance:
    """States that form a covariance: its axes, and (row, column, state) of each element."""

    axes: tuple[str, ...]
    elements: tuple[tuple[int, int, int], ...]

    def of_words(self, program: Program, states: IntArray) -> FloatArray:
        """Matrices (n, axes, axes) of state words (n, n_states), in the least LSB of them."""
        lsb = {k: program.format(program.states[k][0]).lsb for _, _, k in self.elements}
        p = np.zeros((len(states), len(self.axes), len(self.axes)))
        for i, j, k in self.elements:
            p[:, i, j] = p[:, j, i] = states[:, k] * (lsb[k] / min(lsb.values()))
        return p


def covariance_of(estimator: Estimator) -> Covariance:
    """The covariance among an estimator's states.

    An element counts where its two diagonal elements are states too, so a state ``pos`` is none.

    Raises
    ------
    InputError
        There is none.
    """
    elements = dict(estimator.covariance_elements) or {
        s.name: (m[1], m[2]) for s in estimator.states if (m := _ELEMENT.fullmatch(s.name))
    }
    entries = [(*elements[s.name], k) for k, s in enumerate(estimator.states) if s.name in elements]
    axes = [i for i, j, _ in entries if i == j]
    if not axes:
        raise InputError.at(
            estimator.name,
            wanted="states that are a covariance, named p00, p01, p11, ... (or p_xx, p_xy, ...)",
            found=", ".join(s.name for s in estimator.states[:8]) or "no states",
            fix="name them so, or choose a Kalman filter",
        )
    return Covariance(
        tuple(axes),
        tuple((axes.index(i), axes.index(j), k) for i, j, k in entries if {i, j} <= {*axes}),
    )


@dataclass(frozen=True)
class CovarianceTrial(Answer):
    """Result of `covariance_trial`.

    Attributes
    ----------
    updates : int
        Updates of the C.
    negative_diagonals : int
        Updates after which a variance was below zero.
    least_eigenvalue : float
        Smallest eigenvalue seen, in least significant bits of the covariance's words.
    eigenvalues_checked : int
        Covariances of which eigenvalues were taken.
    saturated : int
        Updates that raised the saturation flag.
    drift : dict of str to float
        Largest difference to float64 at the end of a run of `compared` updates, by output with
        its unit; of an attitude the angle alone.
    compared : int
        Updates of each run that float64 repeated.
    """

    estimator: str
    updates: int
    negative_diagonals: int
    least_eigenvalue: float
    eigenvalues_checked: int
    saturated: int
    drift: dict[str, float]
    compared: int

    @property
    def good(self) -> bool:
        """No variance below zero, no eigenvalue below the rounding of one word."""
        return self.negative_diagonals == 0 and self.least_eigenvalue >= _LEAST_EIGENVALUE

    def to_json(self) -> JsonObject:
        """Plain data, with ``good``."""
        return {**super().to_json(), "good": self.good}

    def __str__(self) -> str:
        drift = ", ".join(f"{name} {value:.3g}" for name, value in self.drift.items())
        faults = [f"{self.negative_diagonals} updates with a negative variance"] * (
            self.negative_diagonals > 0
        )
        if self.least_eigenvalue < _LEAST_EIGENVALUE:
            faults.append(f"least eigenvalue below {_LEAST_EIGENVALUE:g} last bits")
        return (
            f"{self.estimator}: {self.updates} updates, {self.negative_diagonals} with a negative "
            f"variance; least eigenvalue {self.least_eigenvalue:,.0f} last bits of P's words, in "
            f"{self.eigenvalues_checked} updates looked at: "
            + (f"FAILED, {', '.join(faults)}" if faults else "good")
            + f"\n  not judged, as this input is hostile: {self.saturated} updates saturated; from "
            f"float64 within {self.compared} updates: {drift}"
        )


class _InTurns:
    """Levels of estimators that share states, run in random turns; of one, run as it is."""

    def __init__(self, levels: Sequence[Level]) -> None:
        self.levels = levels

    def begin(self, params: Mapping[str, float]) -> None:
        """Reset the states, and set these parameters where a level has them."""
        self._last, self._piece = self.levels[0], 0
        for level in self.levels:
            names = {p.name for p in level.build.estimators[level.number].params}
            level.set_params({n: v for n, v in params.items() if n in names})  # type: ignore[attr-defined]
            level.reset()

    def run(self, records: Sequence[FloatArray]) -> list[Run]:
        """Records (n, n_inputs) of each, from where the last ones ended."""
        if len(self.levels) == 1:
            return [self.levels[0].run(records[0])]
        parts: list[list[Run]] = [[] for _ in records]
        counts = [len(inputs) for inputs in records]
        for turn in random_turns(counts, seed=self._piece, longest=_LONGEST):
            level = self.levels[turn.number]
            level.native_states, self._last = self._last.native_states, level
            parts[turn.number].append(level.run(records[turn.number][turn.start : turn.stop]))
        self._piece += 1
        return [Run.joined(runs) for runs in parts]


def covariance_trial(
    estimator: Estimator | Sequence[Estimator],
    records: Mapping[str, Any],
    *,
    updates: int,
    params: Sequence[Mapping[str, float]] = ({},),
    every: int = 50,
    compared: int = 2000,
    chunk: int = 20000,
    word: int = 32,
    progress: Callable[[str], None] | None = None,
) -> CovarianceTrial:
    """Run the C over every stimulus with every parameter set.

    Parameters
    ----------
    estimator : Estimator, or sequence of Estimator
        Several share their states (`Estimator.shares`).
    records : mapping of (n, n_inputs) arrays
        Stimuli by name; each is repeated until its share of ``updates`` is done. Of several
        estimators a sequence of n records for each.
    params : sequence of mappings
        Parameter sets, for example one per initial covariance.
    every : int
        Updates between two covariances whose eigenvalues are taken.
    compared : int
        Leading updates of each stimulus that are repeated in float64; at most its length.

    Raises
    ------
    InputError
        See `covariance_of`.
    """
    estimators = (estimator,) if isinstance(estimator, Estimator) else tuple(estimator)
    name, covariance = ",".join(e.name for e in estimators), covariance_of(estimators[0])
    share = max(1, updates // (len(records) * len(params)))
    total = negative = checked = saturated = 0
    smallest, drift = np.inf, dict[str, float]()
    build = Build(*estimators, word=word)
    numbers = range(len(estimators))
    words = _InTurns([Emitted(build, k) for k in numbers])
    floating = _InTurns([CompiledFloat(build, k) for k in numbers])
    for values in params:
        for stimulus, given in records.items():
            words.begin(values)
            stimuli = [given] if isinstance(estimator, Estimator) else [*given]
            completed, position = 0, 0
            while completed < share:
                limit = -(-(share - completed) // len(estimators))
                piece = [inputs[position : position + min(chunk, limit)] for inputs in stimuli]
                runs = words.run(piece)
                if completed == 0:
                    floating.begin(values)
                    references = floating.run(piece)
                    for e, fixed, real in zip(estimators, runs, references, strict=True):
                        for d in _ends(e, fixed, real, compared):
                            key = f"{d.output} {d.unit}".rstrip()
                            drift[key] = max(drift.get(key, 0.0), d.largest)
                for level, run in zip(words.levels, runs, strict=True):
                    assert run.states is not None
                    p = covariance.of_words(level.program, run.states)
                    negative += int((np.diagonal(p, axis1=1, axis2=2) < 0).any(axis=1).sum())
                    smallest = min(smallest, float(np.linalg.eigvalsh(p[::every]).min()))
                    checked += len(p[::every])
                    saturated += run.n_saturated
                    completed += len(p)
                position = (position + len(piece[0])) % len(stimuli[0])
            total += completed
            if progress is not None:
                given = "".join(f", {key}={value:g}" for key, value in values.items())
                progress(f"{name}: input {stimulus!r}{given}: {total:,} of {updates:,} updates")
    return CovarianceTrial(name, total, negative, smallest, checked, saturated, drift, compared)


def _ends(estimator: Estimator, fixed: Run, floating: Run, compared: int) -> list[Difference]:
    """Differences of a run to float64 over the last tenth of its first ``compared`` updates."""
    stop = min(compared, len(next(iter(fixed.outputs.values()))))
    tail = slice(stop - max(1, stop // 10), stop)
    sides = ({n: x[tail] for n, x in side.outputs.items()} for side in (fixed, floating))
    deviations = differences(estimator.outputs, *sides)
    return [d for d in deviations if d.output == ATTITUDE] or deviations


def initial_covariances(estimator: Estimator) -> list[dict[str, float]]:
    """Parameter sets of several initial covariances, of the parameters named ``p0_...``.

    Angles, in rad and rad^2, take each of `P0`, or its root. Where none is an angle, all take
    `SHARES` of their default, within their range; one empty set where there is none.
    """
    names = [p for p in estimator.params if p.name.startswith("p0_")]
    names = [p for p in names if p.unit in ("rad", "rad^2")] or names
    if not names:
        return [{}]
    sets = []
    for p0, share in zip(P0, SHARES, strict=True):
        values = {}
        for p in names:
            power = 1.0 if p.unit.endswith("^2") else 0.5
            angle = p.unit in ("rad", "rad^2")
            value = (p0 if angle else share) ** power * (1.0 if angle else p.default)
            values[p.name] = min(max(value, p.low), p.high)
        sets.append(values)
    return sets
