"""A profile from runs with records and hostile inputs, and its effect."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.lowering.profile import Profile, Range
from boresight.model.lowering.trace import Trace
from boresight.sim.accuracy.covariance import covariance_of
from boresight.sim.accuracy.manoeuvres import hostile
from boresight.sim.compare.diagnosis import Wasted, wasted_bits
from boresight.sim.compare.difference import Difference, Differences
from boresight.sim.fit.choose import profile_of
from boresight.sim.fit.observe import Inputs, Observer, Reached, joined, pieces_of
from boresight.sim.levels.build import Build
from boresight.sim.levels.floating import CompiledFloat
from boresight.sim.levels.integer import Emitted

#: Updates of each hostile stimulus.
HOSTILE_STEPS = 2000
#: Factor by which an error has to grow with a profile to be worse.
WORSE = 1.1
#: Share of its tolerance up to which an output may be worse if the mean error is smaller.
SPARE = 0.5
#: Factor by which an output without a tolerance may then be worse, if others have one.
_UNJUDGED = 1.25
#: Seed of the hostile stimuli.
_SEED = 2


@dataclass(frozen=True, eq=False)
class Fitted:
    """A profile, and the runs of an estimator without one from which it was made.

    By the number of an expression: its range in the records, in hostile runs, and its interval.
    """

    estimator: Estimator
    trace: Trace
    seen: Reached
    hostile: Reached
    intervals: Mapping[int, Range]
    profile: Profile
    hostile_updates: int


def fitted(
    estimator: Estimator,
    records: Mapping[str, Inputs],
    *,
    params: Mapping[str, float] | None = None,
    starts: Sequence[Mapping[str, float]] = ({},),
    progress: Callable[[str], None] | None = None,
) -> Fitted:
    """Run an estimator in float64 and choose ranges from those of its values.

    Parameters
    ----------
    records : mapping of str to (n, n_inputs), or callable
        Inputs by the name of the log or world, or a function that gives them in pieces.
    params : mapping, optional
        Parameter values of all runs.
    starts : sequence of mapping
        Further parameter values of the hostile runs, one after the other.

    Raises
    ------
    InputError
        See `sim.fit.choose.profile_of`.
    """
    say = progress or (lambda text: None)
    trace, overrides = estimator.record(), dict(params or {})

    def reached(inputs: Inputs, values: Mapping[str, float]) -> Reached:
        observer = Observer(trace, estimator, values)
        for piece in pieces_of(inputs):
            observer.add(piece)
        return observer.reached

    seen: Reached = {}
    provoked: Reached = {}
    updates = 0
    for name, inputs in records.items():
        say(f"float64 on {name}")
        seen = joined(seen, reached(inputs, overrides))
    for start in starts:
        stimuli = hostile(estimator, HOSTILE_STEPS, np.random.default_rng(_SEED))
        for name, stimulus in stimuli.items():
            say(f"float64 on hostile inputs, {name}")
            provoked = joined(provoked, reached(stimulus, overrides | dict(start)))
            updates += len(stimulus)
    profile, bounds = profile_of(trace, estimator, seen, provoked, [*records])
    return Fitted(estimator, trace, seen, provoked, bounds, profile, updates)


class Effect(NamedTuple):
    """Fixed point with some formats: against float64 on the records, and under hostile inputs.

    Of each output the largest difference of all records; saturated updates; hostile updates after
    which a variance is negative, if states are a covariance.
    """

    differences: tuple[Difference, ...]
    saturated_updates: int
    negative_updates: int


def effect(
    estimator: Estimator,
    profile: Profile | None,
    records: Mapping[str, Inputs],
    *,
    params: Mapping[str, float] | None = None,
    word: int = 32,
) -> Effect | str:
    """Effect of the formats of a profile, or of none; the reason if it does not compile."""
    variant = copy.copy(estimator)
    variant.profile = profile
    build = Build(variant, word=word, params=[params])
    try:
        words = Emitted(build)
    except InputError as error:
        return str(error)
    floating, worst, saturated = CompiledFloat(build), dict[str, Difference](), 0
    for inputs in records.values():
        deviations = Differences(estimator.outputs, [o.name for o in estimator.outputs])
        words.reset()
        floating.reset()
        for piece in pieces_of(inputs):
            run = words.run(piece)
            saturated += run.n_saturated
            deviations.add(run.outputs, floating.run(piece).outputs)
        for d in deviations.result():
            if d.output not in worst or d.largest > worst[d.output].largest:
                worst[d.output] = d
    return Effect(tuple(worst.values()), saturated, _negative(variant, words, build))


def wasted_ranges(fit: Fitted, word: int = 32) -> list[Wasted]:
    """Inputs and states whose declared ranges waste bits on the records, the worst first."""
    variant = copy.copy(fit.estimator)
    variant.profile = fit.profile
    program, nodes = variant.compile_traced(word=word)
    leaves = {n: [leaf] for n, leaf in zip(program.inputs, fit.trace.inputs, strict=True)}
    for (number, _), (leaf, _, after) in zip(program.states, fit.trace.states, strict=True):
        leaves[number] = [leaf, after]
    reached = {}
    for number, expressions in leaves.items():
        if ranges := [fit.seen[e.number] for e in expressions if e.number in fit.seen]:
            reached[number] = min(low for low, _ in ranges), max(high for _, high in ranges)
    return wasted_bits(variant, program, nodes, reached)


def _negative(estimator: Estimator, words: Emitted, build: Build) -> int:
    """Hostile updates after which a variance is negative."""
    try:
        covariance = covariance_of(estimator)
    except InputError:
        return 0
    negative = 0
    stimuli = hostile(estimator, HOSTILE_STEPS, np.random.default_rng(_SEED + 1))
    for inputs in stimuli.values():
        run = words.run_anew(inputs)
        assert run.states is not None
        p = covariance.of_words(build.programs[0], run.states)
        negative += int((np.diagonal(p, axis1=1, axis2=2) < 0.0).any(axis=1).sum())
    return negative


class Selection(NamedTuple):
    """The profile with all ranges or none; effects of intervals, of the choice, of all ranges.

    ``before`` is the reason if intervals alone do not compile.
    """

    profile: Profile
    before: Effect | str
    after: Effect
    full: Effect


def select_ranges(
    fit: Fitted,
    records: Mapping[str, Inputs],
    *,
    params: Mapping[str, float] | None = None,
    word: int = 32,
) -> Selection:
    """Choose the more exact formats: all ranges, or none.

    With all ranges an output becomes `WORSE` only if

    * its error stays within `SPARE` of its tolerance (or, if it has none and others have, grows by
      no more than a quarter), and the mean becomes smaller, or
    * outputs were beyond their tolerances, and none is now.

    No more updates saturate, and no more variances are negative. If it does not compile without the
    profile, all ranges are kept.

    Raises
    ------
    InputError
        It does not compile with the profile either.
    """
    before, full = (
        effect(fit.estimator, profile, records, params=params, word=word)
        for profile in (None, fit.profile)
    )
    if isinstance(full, str):
        raise InputError(full)
    if isinstance(before, str) or _accepted(before, full):
        return Selection(fit.profile, before, full, full)
    return Selection(replace(fit.profile, ranges={}), before, before, full)


def _accepted(before: Effect, after: Effect) -> bool:
    """Whether formats may be kept; see `select_ranges`."""
    pairs = [*zip(before.differences, after.differences, strict=True)]
    sizes = [(a.largest, b.largest) for a, b in pairs]
    factors = [b / a if a > 0.0 else math.inf if b > 0.0 else 1.0 for a, b in sizes]
    worse = [(factor, d) for factor, (_, d) in zip(factors, pairs, strict=True) if factor > WORSE]
    most = _UNJUDGED if any(d.tolerance is not None for d in after.differences) else WORSE
    is_tolerable = all(
        factor <= most if d.tolerance is None else d.largest <= SPARE * d.tolerance
        for factor, d in worse
    )
    mean = np.log(np.clip(factors, 1e-9, 1e9)).mean() if factors else 0.0
    is_repair = not all(a.good for a, _ in pairs) and all(b.good for _, b in pairs)
    is_safe = all(b <= a for a, b in zip(before[1:], after[1:], strict=True))
    return is_safe and (not worse or is_repair or (is_tolerable and mean < 0.0))
