"""A profile from runs: records and hostile inputs, then what it changes."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.lowering.profile import Profile, Range
from boresight.model.lowering.trace import Trace
from boresight.sim.accuracy.covariance import covariance_of
from boresight.sim.accuracy.manoeuvres import hostile
from boresight.sim.compare.difference import Difference, Differences
from boresight.sim.fit.choose import intervals, profile_of
from boresight.sim.fit.observe import Inputs, Observer, Reached, joined, pieces_of
from boresight.sim.levels.build import Build
from boresight.sim.levels.floating import CompiledFloat
from boresight.sim.levels.integer import Emitted

__all__ = ["SPARE", "WORSE", "Effect", "Fitted", "Kept", "effect", "fitted", "kept"]

#: Updates of each hostile stimulus.
HOSTILE_STEPS = 2000
#: Factor by which an error has to grow with a profile to be worse.
WORSE = 1.1
#: Bits that a format must gain, of the profiles that are tried where the whole one is worse.
_GAINS = (2, 4, 8)
#: Share of an output's tolerance up to which it may be worse where errors together are smaller.
SPARE = 0.5
#: Factor by which one without a tolerance may then be worse, where others have one.
_UNJUDGED = 1.25
#: Their seed; that of `boresight covariance` is another.
_SEED = 2


@dataclass(frozen=True, eq=False)
class Fitted:
    """A profile, and what it was made of.

    Attributes
    ----------
    estimator : Estimator
        Without a profile.
    trace : Trace
    seen, hostile : mapping of int to (float, float)
        What expressions reached in the records, and in hostile runs.
    intervals : mapping of int to (float, float)
    profile : Profile
    hostile_updates : int
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
    """Run an estimator in float64 and choose ranges from what its values reach.

    Parameters
    ----------
    records : mapping of str to (n, n_inputs), or callable
        Inputs by the name of the log or world, or what gives them in pieces.
    params : mapping, optional
        Parameter values of all runs.
    starts : sequence of mapping
        Parameter values of the hostile runs besides, one after the other.

    Raises
    ------
    InputError
        See `sim.fit.choose.profile_of`.
    """
    say = progress or (lambda text: None)
    trace, overrides = estimator.record(), dict(params or {})
    seen = []
    for name, inputs in records.items():
        say(f"float64 on {name}")
        observer = Observer(trace, estimator, overrides)
        for piece in pieces_of(inputs):
            observer.add(piece)
        seen.append(observer.reached)
    provoked, count = [], 0
    for start in starts:
        values = overrides | dict(start)
        stimuli = hostile(estimator, HOSTILE_STEPS, np.random.default_rng(_SEED))
        for name, stimulus in stimuli.items():
            say(f"float64 on hostile inputs, {name}")
            observer = Observer(trace, estimator, values)
            observer.add(stimulus)
            provoked.append(observer.reached)
            count += len(stimulus)
    ours, theirs = joined(*seen), joined(*provoked)
    every = joined(ours, theirs)
    profile = profile_of(trace, estimator, ours, theirs, [*records])
    return Fitted(estimator, trace, ours, theirs, intervals(trace, every)[0], profile, count)


@dataclass(frozen=True)
class Effect:
    """Fixed point with some formats: against float64 on the records, and under hostile inputs.

    Attributes
    ----------
    differences : tuple of Difference
        Of each output the largest of all records.
    saturated_updates : int
    negative_updates : int
        Of hostile ones, those after which a variance is negative, where states are a covariance.
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
    """What formats of a profile, or of none, give; the reason where nothing can be compiled."""
    other = copy.copy(estimator)
    other.profile = profile
    build = Build(other, word=word, params=[params])
    try:
        words = Emitted(build)
    except InputError as error:
        return str(error)
    floating, worst, saturated = CompiledFloat(build), dict[str, Difference](), 0
    for inputs in records.values():
        beside = Differences(estimator.outputs, [o.name for o in estimator.outputs])
        words.reset()
        floating.reset()
        for piece in pieces_of(inputs):
            run = words.run(piece)
            saturated += run.n_saturated
            beside.add(run.outputs, floating.run(piece).outputs)
        for d in beside.result():
            if d.output not in worst or d.largest > worst[d.output].largest:
                worst[d.output] = d
    return Effect(tuple(worst.values()), saturated, _negative(other, words, build))


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


@dataclass(frozen=True)
class Kept:
    """The formats from runs that are kept, compared with those of intervals on the records.

    Attributes
    ----------
    profile : Profile
        With all ranges, those that gain many bits, or none.
    before : Effect or str
        Of intervals alone; the reason where nothing compiles so.
    after, whole : Effect
        Of what is kept; of all ranges.
    """

    profile: Profile
    before: Effect | str
    after: Effect
    whole: Effect


def kept(
    fit: Fitted,
    records: Mapping[str, Inputs],
    *,
    params: Mapping[str, float] | None = None,
    word: int = 32,
) -> Kept:
    """Choose what makes outputs most exact: all ranges, those that gain many bits, or none.

    Of several, what leaves fewest outputs beyond their tolerance, then what makes errors together
    (their geometric mean) smallest. An output becomes `WORSE` only if

    * its error stays within `SPARE` of its tolerance (or, where it has none and others have, grows
      by no more than a quarter), and errors together become smaller, or
    * outputs were beyond their tolerances, and none is.

    Nothing more saturates, and no more variances are negative. Where nothing compiles without it,
    all ranges are kept.

    Raises
    ------
    InputError
        It does not compile with the profile either.
    """
    profile = fit.profile

    def tried(some: Profile | None) -> Effect | str:
        return effect(fit.estimator, some, records, params=params, word=word)

    before, whole = tried(None), tried(profile)
    if isinstance(whole, str):
        raise InputError(whole)
    if isinstance(before, str) or (_holds(before, whole) and not _worse(before, whole)):
        return Kept(profile, before, whole, whole)
    candidates = [(profile, whole)]
    for bits in _GAINS:
        ranges = {n: r for n, r in profile.ranges.items() if _gain(fit.intervals[n], r) >= bits}
        some = replace(profile, ranges=ranges)
        after = tried(some) if ranges else ""
        candidates += [(some, after)] if isinstance(after, Effect) else []
    none = replace(profile, ranges={}), before
    better = [c for c in candidates if _accepted(before, c[1])]
    best, after = min(better, key=lambda c: (_beyond(c[1]), _mean(before, c[1])), default=none)
    return Kept(best, before, after, whole)


def _gain(interval: Range, range_: Range) -> float:
    """Bits that a format gains."""
    wide, narrow = (max(map(abs, ends)) for ends in (interval, range_))
    return math.log2(wide / narrow) if narrow else 0.0


def _factors(before: Effect, after: Effect) -> list[float]:
    """By which errors change; of one that stays 0, 1."""
    errors = [
        (a.largest, b.largest) for a, b in zip(before.differences, after.differences, strict=True)
    ]
    return [b / a if a > 0.0 else math.inf if b > 0.0 else 1.0 for a, b in errors]


def _holds(before: Effect, after: Effect) -> bool:
    """Whether nothing more saturates, and no more variances are negative."""
    saturated = after.saturated_updates <= before.saturated_updates
    return saturated and after.negative_updates <= before.negative_updates


def _worse(before: Effect, after: Effect) -> list[tuple[float, Difference]]:
    """Outputs whose errors grow by more than `WORSE`, each after its factor."""
    factors = zip(_factors(before, after), after.differences, strict=True)
    return [(factor, d) for factor, d in factors if factor > WORSE]


def _mean(before: Effect, after: Effect) -> float:
    """Geometric mean of the factors."""
    logs = [math.log(min(max(x, 1e-9), 1e9)) for x in _factors(before, after)]
    return math.exp(math.fsum(logs) / max(len(logs), 1))


def _beyond(some: Effect) -> int:
    """Outputs beyond their tolerances."""
    return sum(not d.good for d in some.differences)


def _accepted(before: Effect, after: Effect) -> bool:
    """Whether formats may be kept; see `kept`."""
    unjudged = _UNJUDGED if any(d.tolerance is not None for d in after.differences) else WORSE
    spared = all(
        factor <= unjudged if d.tolerance is None else d.largest <= SPARE * d.tolerance
        for factor, d in _worse(before, after)
    )
    passes = _beyond(before) > 0 == _beyond(after)
    return _holds(before, after) and (passes or (spared and _mean(before, after) < 1.0))
