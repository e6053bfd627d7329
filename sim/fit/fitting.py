"""A profile from runs with records and hostile inputs, and its effect.

Ranges are chosen from observed values: margin, half of the spare bits, and exceptions.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.lowering.graph import Flag, Graph
from boresight.model.lowering.profile import Profile, Range, record_digest
from boresight.model.lowering.trace import Trace
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.rounded import binary_exponent
from boresight.sim.accuracy.covariance import covariance_of
from boresight.sim.compare.diagnosis import MARGIN_BITS, Wasted, wasted_bits
from boresight.sim.compare.difference import Difference, Differences
from boresight.sim.compare.twin import Traced
from boresight.sim.fit.observe import Inputs, Observer, Reached, hostile, joined, pieces_of
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import CompiledFloat, Emitted

HOSTILE_BITS = 1.0  #: Bits above the largest value of hostile runs.
#: Most bits added by half of the spare bits, and bits added where nothing limits a value.
MOST_BITS, UNLIMITED_BITS = 3.0, 2.0
#: Lower limit of a divisor whose interval reaches zero, as a share of the smallest observed one.
FLOOR = 2.0**-4
WIDEST = 2.0 ** Arithmetic(word=32).norm_max  #: Largest ratio of the divisors that a word can hold.
_DIVIDING = ("div", "rsqrt", "sqrt")  #: Functions whose last argument must not be zero.


def chosen(seen: Range, provoked: Range | None, interval: Range) -> Range | None:
    """Range for the format of a value; None: its interval.

    `MARGIN_BITS` above the largest magnitude seen in records, and half of the remaining bits up to
    the interval, at most `MOST_BITS`; or `HOSTILE_BITS` above that of hostile runs, if this is
    more. The sign is that of the interval.
    """
    size, limit = (max(abs(low), abs(high)) for low, high in (seen, interval))
    hostile = 0.0 if provoked is None else max(map(abs, provoked)) * 2.0**HOSTILE_BITS
    size *= 2.0**MARGIN_BITS
    if not 0.0 < size < limit:
        return None
    extra_bits = UNLIMITED_BITS
    if math.isfinite(limit):
        extra_bits = min(0.5 * math.log2(limit / size), MOST_BITS)
    size = max(size * 2.0**extra_bits, hostile)
    if size >= limit:
        return None
    if math.isfinite(limit) and binary_exponent(size) == binary_exponent(limit):
        return None
    return max(interval[0], -size), min(interval[1], size)


def intervals(trace: Trace, seen: Reached) -> tuple[dict[int, Range], dict[int, Range]]:
    """Interval of each expression, and the limits that it needs, by its number.

    A divisor or radicand whose interval crosses zero is limited to `FLOOR` times the smallest one
    seen; a divisor whose interval is wider than any word can divide by, to the largest one seen
    with all margins. Raises InputError for one that was seen on both sides of zero.
    """
    graph, operands, limits = Graph(trace.tracer.name), list[Any](), dict[int, Range]()
    for e in trace.tracer.expressions:
        graph.line = e.line
        args = [operands[a.number] for a in e.args]
        range_ = _limits_of(e.kind, args, seen.get(e.args[-1].number)) if e.args else None
        if range_ is not None:
            limits[e.number] = range_
            args[-1] = graph.limited(args[-1], *range_)
        operands.append(getattr(graph, e.kind)(*args, *e.data))
    nodes = [m.node if isinstance(m, Flag) else m for m in operands]
    return {k: (node.low, node.high) for k, node in enumerate(nodes)}, limits


def _limits_of(kind: str, args: Sequence[Any], seen: Range | None) -> Range | None:
    """Limits of the last argument of a division or root; None if it needs none.

    The lower limit of a divisor whose interval excludes zero is that of the interval.
    """
    if kind not in _DIVIDING or seen is None:
        return None
    node, (low, high) = args[-1], seen
    margin = 2.0 ** (MARGIN_BITS + UNLIMITED_BITS)
    if kind == "div" and low * high > 0.0:
        lower, upper = (node.low, node.high) if low > 0.0 else (-node.high, -node.low)
        if lower <= 0.0 or upper > lower * WIDEST:
            smallest, largest = sorted((abs(low), abs(high)))
            ends = lower if lower > 0.0 else smallest * FLOOR, largest * margin
            return ends if low > 0.0 else (-ends[1], -ends[0])
    if kind != "div" and node.low < 0.0 <= low:
        return low * FLOOR, high * margin
    return None


def between(trace: Trace, elements: Collection[str]) -> set[int]:
    """Numbers of the expressions on paths from some states to their next values.

    The states are a covariance whose ranges are proven; saturation in between could make it
    negative.
    """
    pairs = [(leaf, after) for leaf, _, after in trace.states if leaf.data[1] in elements]
    descendants, ancestors = {s.number for s, _ in pairs}, {after.number for _, after in pairs}
    for e in trace.tracer.expressions:
        if any(a.number in descendants for a in e.args):
            descendants.add(e.number)
    for e in reversed(trace.tracer.expressions):
        if e.number in ancestors:
            ancestors.update(a.number for a in e.args)
    return descendants & ancestors


def profile_of(
    trace: Trace, estimator: Estimator, seen: Reached, provoked: Reached, logs: Sequence[str]
) -> Profile:
    """The profile for ranges seen in records and provoked by hostile inputs."""
    bounds, limits = intervals(trace, joined(seen, provoked))
    by_interval = {e.args[-1].number for e in trace.tracer.expressions if e.kind in _DIVIDING}
    by_interval |= between(trace, estimator.covariance_elements)
    ranges: dict[int, Range] = {}
    for e in trace.needed:
        keeps_interval = e.number in by_interval and math.isfinite(sum(bounds[e.number]))
        if e.args and e.number in seen and not keeps_interval:
            range_ = chosen(seen[e.number], provoked.get(e.number), bounds[e.number])
            ranges |= {} if range_ is None else {e.number: range_}
    digest = record_digest(trace, estimator.inputs)
    return Profile(estimator.name, digest, tuple(logs), ranges, limits)


HOSTILE_STEPS = 2000  #: Updates of each hostile stimulus.
WORSE = 1.1  #: Factor by which an error has to grow with a profile to be worse.
#: Share of its tolerance up to which an output may be worse if the mean error is smaller.
SPARE = 0.5
#: Factor by which an output without a tolerance may then be worse, if others have one.
_UNJUDGED = 1.25
_SEED = 2  #: Seed of the hostile stimuli.


@dataclass(frozen=True, eq=False)
class Fitted:
    """A profile, and the runs of an estimator without one from which it was made.

    ``seen``: ranges in the records, by the number of an expression; ``updates`` by record.
    """

    estimator: Estimator
    trace: Trace
    seen: Reached
    profile: Profile
    updates: Mapping[str, int]
    hostile_updates: int


def fitted(
    estimator: Estimator,
    records: Mapping[str, Inputs],
    *,
    params: Mapping[str, float] | None = None,
    stressed: bool = True,
    progress: Callable[[str], None] | None = None,
) -> Fitted:
    """Run an estimator in float64 and choose ranges from those of its values.

    ``records`` are inputs (n, n_inputs) by the name of the log or world, or functions that give
    them in pieces; ``stressed``: hostile runs count, too.
    Raises InputError as `intervals`.
    """
    say = progress or (lambda text: None)
    trace, overrides = estimator.record(), dict(params or {})

    def run(observer: Observer, inputs: Inputs) -> int:
        updates = 0
        for piece, anew in pieces_of(inputs):
            if anew:
                observer.reset()
            updates += len(observer.add(piece))
        return updates

    observer, updates = Observer(trace, estimator, overrides), dict[str, int]()
    for name, inputs in records.items():
        say(f"float64 on {name}")
        updates[name] = run(observer, inputs)
    seen, hostile_updates = observer.reached, 0
    observer = Observer(trace, estimator, overrides)
    stimuli = hostile(estimator, HOSTILE_STEPS, np.random.default_rng(_SEED))
    for name, stimulus in stimuli.items() if stressed else ():
        say(f"float64, stress test, {name}")
        hostile_updates += run(observer, stimulus)
    profile = profile_of(trace, estimator, seen, observer.reached, [*records])
    return Fitted(estimator, trace, seen, profile, updates, hostile_updates)


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
        for piece, anew in pieces_of(inputs):
            for level in (words, floating) if anew else ():
                level.reset()
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
    return wasted_bits(Traced(variant, program, nodes), reached)


def _negative(estimator: Estimator, words: Emitted, build: Build) -> int:
    """Hostile updates after which a variance is negative."""
    covariance, negative = covariance_of(estimator), 0
    if not covariance.axes:
        return 0
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
    profile, all ranges are kept; InputError if it does not with it either.
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
    change = math.fsum(math.log(min(max(x, 1e-9), 1e9)) for x in factors)
    is_repair = not all(a.good for a, _ in pairs) and all(b.good for _, b in pairs)
    is_safe = all(b <= a for a, b in zip(before[1:], after[1:], strict=True))
    return is_safe and (not worse or is_repair or (is_tolerable and change < 0.0))
