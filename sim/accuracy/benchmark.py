"""Every estimator on every record: ours in float and in fixed point, and the published ones.

Fixed point is the emitted C, whose words are those of the core; float is the compiled float64. The
published attitude filters that run sample by sample in Python are spread over processes (`spawn`: a
script that calls `benchmark` with more than one needs ``if __name__ == "__main__"``).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from queue import SimpleQueue

import numpy as np

from boresight.model.estimator import Estimator
from boresight.sim.accuracy.figures import ANGLES, Alignment, Errors, attitude_errors
from boresight.sim.accuracy.peers import PEERS, dip_rad, peer, require_peers, run_peer
from boresight.sim.accuracy.scoring import Scorer
from boresight.sim.accuracy.trials import Trial
from boresight.sim.campaign import dispatch
from boresight.sim.compare.difference import Difference, Differences
from boresight.sim.levels.build import Build
from boresight.sim.levels.floating import CompiledFloat
from boresight.sim.levels.level import Level
from boresight.sim.records.feed import Feed, LongFeed
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.worlds.loop import Loop, drive

__all__ = ["Result", "benchmark"]

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Result:
    """One estimator, at one level, on one record.

    ``level``: "fixed", "float", or "package" for a peer. ``errors``, with their ``units``:
    `sim.accuracy.figures`, empty where the record has no truth of its outputs. ``seconds``: of its
    own run, by the clock on the wall, whatever runs beside it. ``saturated`` counts updates in
    which an operation saturated; ``near`` compares every sample of fixed point with float64; both
    belong to fixed point. ``offset_deg``: what `sim.accuracy.figures.aligned` took out.
    """

    estimator: str
    level: str
    trial: str
    errors: Mapping[str, float]
    units: Mapping[str, str]
    seconds: float
    saturated: int | None = None
    near: tuple[Difference, ...] = ()
    offset_deg: tuple[float, ...] = ()


def _ours(
    estimator: Estimator,
    trials: Sequence[Trial],
    params: Mapping[str, float] | None,
    word: int,
    with_float: bool,
    jobs: int | None,
    align: str,
) -> list[Result]:
    """One of our estimators on all records, made anew for each rate that it needs to know."""
    groups: dict[tuple[float, ...], tuple[Estimator, list[tuple[str, Feed | LongFeed]]]] = {}
    for t in trials:
        member, feed = t.fed(estimator)
        groups.setdefault(tuple(member.rates_hz.values()), (member, []))[1].append((t.name, feed))
    out: list[Result] = []
    for member, feeds in groups.values():
        out += _at_one_rate(member, feeds, params, word, with_float, jobs, align)
    return out


def _at_one_rate(
    estimator: Estimator,
    named_feeds: Sequence[tuple[str, Feed | LongFeed]],
    params: Mapping[str, float] | None,
    word: int,
    with_float: bool,
    jobs: int | None,
    align: str,
) -> list[Result]:
    """One of our estimators on records, by name, that one build of it takes."""
    feeds = [columns for _, columns in named_feeds]
    scorer, build = (
        Scorer(estimator, feeds, word=word, jobs=jobs),
        Build(estimator, params=[params]),
    )
    levels: SimpleQueue[CompiledFloat] = SimpleQueue()
    for _ in range(scorer.jobs if with_float else 0):
        levels.put(CompiledFloat(build))

    def run_log(index: int, level: Level) -> list[Result]:
        if not with_float:
            return _on_log(estimator, *named_feeds[index], [level], align)
        floating = levels.get()
        try:
            return _on_log(estimator, *named_feeds[index], [level, floating], align)
        finally:
            levels.put(floating)

    return list(chain.from_iterable(zip(*scorer.each(run_log, params), strict=True)))


def _runs(columns: Feed | LongFeed, levels: Sequence[Level]) -> Iterator[tuple[Feed, list[Loop]]]:
    """Levels on a log from a reset on, part by part."""
    for k, part in enumerate(columns.parts()):
        yield part, [loop for level in levels for loop in drive(part, level, anew=not k)]


def _on_log(
    estimator: Estimator, trial: str, columns: Feed | LongFeed, levels: Sequence[Level], align: str
) -> list[Result]:
    """Fixed point, and float64, on a log; where an offset is taken out, twice: first to see it."""
    offsets = [Alignment(align) for _ in levels]
    for part, loops in _runs(columns, levels) if align != "none" else ():
        for offset, loop in zip(offsets, loops, strict=True):
            offset.add_outputs(part, loop.outputs)
    comparison = Differences(estimator.outputs, [o.name for o in estimator.outputs])
    errors = [Errors(estimator) for _ in levels]
    seconds, saturated = [0.0 for _ in levels], 0
    for part, loops in _runs(columns, levels):
        for k, loop in enumerate(loops):
            errors[k].add(part, offsets[k].turned_outputs(loop.outputs))
            seconds[k] += loop.seconds
        saturated += loops[0].run.n_saturated
        if len(loops) > 1:
            comparison.add(loops[0].outputs, loops[1].outputs)
    out = [
        Result(estimator.name, name, trial, e.result(), e.units, duration, offset_deg=o.offset_deg)
        for name, e, duration, o in zip(("fixed", "float"), errors, seconds, offsets, strict=False)
    ]
    deviations = tuple(comparison.result()) if len(levels) > 1 else ()
    return [replace(out[0], saturated=saturated, near=deviations), *out[1:]]


def _dips(trials: Sequence[Trial]) -> dict[str, float]:
    """Dip of the field [rad] by folder, as of one place: the median over its logs.

    A single log's own dip carries the errors of its sensors' calibration (2 to 3 degrees).
    """
    dips: dict[str, list[float]] = {}
    for t in trials:
        log = NineAxis.of(t.record)
        if log.mag_new.any():
            dips.setdefault(t.folder, []).append(dip_rad(log))
    return {folder: float(np.median(values)) for folder, values in dips.items()}


def _peer(
    name: str, trials: Sequence[Trial], dips: Mapping[str, float], align: str
) -> list[Result]:
    """One peer on some records."""
    out = []
    for trial in trials:
        log = NineAxis.of(trial.record)
        start = time.perf_counter()
        q = run_peer(peer(name), trial.record, dips.get(trial.folder))
        seconds = time.perf_counter() - start
        offset = Alignment(align)
        offset.add(q, log.attitude, log.counts)
        error = attitude_errors(offset.turned(q), log.attitude, log.counts)
        out.append(
            Result(
                name,
                "package",
                trial.name,
                error,
                dict.fromkeys(ANGLES, "deg"),
                seconds,
                offset_deg=offset.offset_deg,
            )
        )
    return out


def benchmark(
    estimators: Sequence[Estimator],
    peers: Sequence[str],
    trials: Sequence[Trial],
    *,
    params: Mapping[str, Mapping[str, float]] | None = None,
    word: int = 32,
    with_float: bool = True,
    align: str = "none",
    jobs: int | None = None,
    progress: Progress | None = None,
) -> list[Result]:
    """Run everything.

    Parameters
    ----------
    peers : sequence of str
        Keys of `sim.accuracy.peers.PEERS`.
    params : mapping, optional
        Parameter values of our estimators, by their name.
    with_float : bool
        Also run compiled float64.
    align : str
        Constant offset that is taken out of every attitude first: `ALIGNMENTS`.
    jobs : int, optional
        Threads and processes; by default one for each processor.

    Returns
    -------
    list of Result
        Ours in the order given, fixed before float, then the peers; each in the order of the
        trials.

    Raises
    ------
    InputError
        Unknown names, an illegal parameter, a peer whose package is not installed.
    """
    say = progress or (lambda text: None)
    require_peers([peer(name) for name in peers])
    dips = _dips(trials) if peers else {}
    bare = [replace(t, feeds={}) for t in trials]
    # Long ones first, so that no process is left with one at the end.
    tasks: list[tuple[str, Callable[..., list[Result]], tuple[object, ...]]] = [
        (f"{name} on {t.name}", _peer, (name, [t], dips, align))
        for name in peers
        if PEERS[name].slow
        for t in sorted(bare, key=lambda t: -len(t.log))
    ]
    tasks += [(name, _peer, (name, bare, dips, align)) for name in peers if not PEERS[name].slow]
    count = len(estimators) + len(tasks)
    out: list[Result] = []

    def add_results(label: str, results: list[Result]) -> None:
        seconds = sum(r.seconds for r in results)
        out.extend(results)
        say(f"[{len(completed) + 1}/{count}] {label}, {seconds:.1f} s")
        completed.append(label)

    completed: list[str] = []
    for e in estimators:
        values = (params or {}).get(e.name)
        add_results(e.name, _ours(e, trials, values, word, with_float, jobs, align))
    for label, results in dispatch(jobs, tasks):
        add_results(label, results)
    rank = {name: k for k, name in enumerate([*(e.name for e in estimators), *peers])}
    place = {t.name: k for k, t in enumerate(trials)}
    return sorted(out, key=lambda r: (rank[r.estimator], r.level == "float", place[r.trial]))
