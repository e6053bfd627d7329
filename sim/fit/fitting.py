"""A profile from runs: records and hostile inputs, then what it changes."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

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

__all__ = ["Effect", "Fitted", "effect", "fitted"]

#: Updates of each hostile stimulus.
HOSTILE_STEPS = 2000
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
