"""Logs with a truth, and estimators and published filters over them, run and judged.

What does not depend on the parameters is done once: the program is compiled, its C built, every
log read. Threads share the logs; each log has levels of its own, whose calls release Python's lock.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.errors import require
from boresight.model.estimator import Estimator
from boresight.model.settings import CURRENT
from boresight.model.tools.external import optional
from boresight.sim.accuracy.figures import ANGLES, Alignment, Errors, attitude_errors, units_of
from boresight.sim.campaign import processes
from boresight.sim.compare.difference import Difference, Differences
from boresight.sim.compare.textbook import wrong_steps
from boresight.sim.compare.verdict import saturations
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import CompiledFloat, Emitted
from boresight.sim.records.feed import Feed, LongFeed, feed_of, fitted
from boresight.sim.records.files import Log, bundled, bundled_names, logs_of
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Record
from boresight.sim.worlds.loop import drive
from boresight.sim.worlds.world import is_world

#: Published attitude filters: classes of the package `vqf` by our names; "basic" is without rest,
#: bias and disturbances.
PEERS = {"vqf_online": "VQF", "vqf_basic": "BasicVQF"}
#: Longest gap [s] that is filled for them.
_LONGEST_GAP_S = 1.0


@dataclass(frozen=True, eq=False)
class Trial:
    """A log with a truth, which allows errors in ``units``.

    ``feeds`` are by name the estimator made for the rates of the log, and its inputs.
    """

    log: Log
    feeds: Mapping[str, tuple[Estimator, Feed | LongFeed]]
    units: Mapping[str, str]

    @property
    def name(self) -> str:
        """Name of the log."""
        return self.log.name

    @property
    def reference(self) -> str:
        """What the log's reference is: "truth", or "comparison", the estimate of another device."""
        return "comparison" if self.log.comparison else "truth"


def read_trials(
    logs: Sequence[Any],
    estimators: Sequence[Estimator],
    *,
    load: bool = False,
    comparisons: bool = True,
) -> tuple[list[Trial], list[str]]:
    """Logs with truth, in the order of their names; lines of warning about these and the others.

    By default the bundled logs. ``load``: hold whole logs in memory, as published filters need;
    ``comparisons``: also logs whose reference is a comparison. Raises InputError for a bad log, a
    log named twice, or none with truth.
    """
    fix = "record it first: boresight run ESTIMATOR WORLD -o log.csv"
    require(not any(map(is_world, logs)), "logs", "logs", "a world", fix)
    trials, notes, left_out = list[Trial](), list[str](), list[str]()
    found = logs_of(logs or [bundled(name) for name in bundled_names()], load=load)
    for name, times in Counter(log.name for log in found).items():
        require(times == 1, "logs", "each once", f"{name} twice", "name it once")
    for log in sorted(found, key=lambda log: log.name):
        members = [fitted(e, log.first) for e in estimators]
        feeds = {
            e.name: (member, feed_of(member, log))
            for e, member in zip(estimators, members, strict=True)
        }
        units = {name: unit for fed in feeds.values() for name, unit in units_of(*fed).items()}
        if load and not units and _has_attitude(log):
            units = dict.fromkeys(ANGLES, "deg")
        if units and (comparisons or not log.comparison):
            trials.append(Trial(log, feeds, units))
            first = [(member, fed, next(fed.parts())) for member, fed in feeds.values()]
            told = dict.fromkeys(
                text
                for member, fed, part in first
                for text in (*fed.warnings, *wrong_steps(Build(member), part.inputs, part.step_s))
            )
            notes += [f"{log.name}: {text}" for text in told]
        else:
            why = "has a device's estimate" if units else "has no truth"
            left_out.append(f"log {log.name} {why}: left out")
    example = estimators[0].outputs[0].name if estimators else "qw"
    wanted, others = f"a log with the truth of an output, as {example}_true", "; ".join(left_out)
    require(bool(trials), "logs", wanted, others or None, "name logs with truth")
    return trials, notes + left_out


def _has_attitude(log: Log) -> bool:
    nine = NineAxis.of(log.first)
    return nine.q is not None and bool((np.isfinite(nine.q).all(axis=1) & nine.counts).any())


@dataclass(frozen=True)
class Scores:
    """A run of a log on one level.

    The level is fixed, float, or package (of a published filter). ``errors`` are root mean squares
    against truth (`sim.accuracy.figures`), ``saturations`` the ``saturated`` updates by value
    (None: nothing can), ``near`` fixed point beside float64, ``offset_deg`` a constant turn that
    was taken out of attitudes.
    """

    level: str
    errors: Mapping[str, float]
    units: Mapping[str, str]
    saturated: int | None = None
    saturations: Mapping[str, int] = field(default_factory=dict)
    near: tuple[Difference, ...] = ()
    offset_deg: tuple[float, ...] = ()
    notes: Sequence[str] = ()  #: lines of warning about the errors.


class LogRuns:
    """The emitted C of an estimator over logs, with ``floating`` compiled float64 beside it.

    ``members`` are for each log the estimator, made for its rates, and its inputs; ``jobs`` are
    threads, by default one for each processor; ``align`` is one of `ALIGNMENTS`.
    """

    def __init__(
        self,
        members: Sequence[tuple[Estimator, Feed | LongFeed]],
        *,
        floating: bool = False,
        word: int = 32,
        jobs: int | None = None,
        align: str = "none",
    ) -> None:
        self.estimator, self.feeds = members[0][0], [columns for _, columns in members]
        self.align, self.jobs = align, min(processes(jobs), len(members))
        rates = [tuple(member.rates_hz.values()) for member, _ in members]
        builds = {of: Build(e, word=word) for of, (e, _) in zip(rates, members, strict=True)}
        kinds = (Emitted, CompiledFloat)[: 1 + floating]
        self._levels = [[kind(builds[of]) for kind in kinds] for of in rates]

    def run(
        self, params: Mapping[str, float] | None = None, indices: Sequence[int] | None = None
    ) -> list[list[Scores]]:
        """Run some logs (all by default); the scores of each, fixed point first."""
        self.estimator.param_values(params)
        indices = range(len(self.feeds)) if indices is None else indices
        now = (CURRENT.get(),)
        with ThreadPoolExecutor(self.jobs, initializer=CURRENT.set, initargs=now) as pool:
            return [*pool.map(lambda index: self._scores(index, params), indices)]

    def _scores(self, index: int, params: Mapping[str, float] | None) -> list[Scores]:
        """One log on all levels; twice if an offset is taken out, first to measure it."""
        columns, levels = self.feeds[index], self._levels[index]
        for level in levels:
            level.set_params(params)
        offsets = [Alignment(self.align) for _ in levels]
        for k, part in enumerate(columns.parts() if self.align != "none" else ()):
            for offset, level in zip(offsets, levels, strict=True):
                (loop,) = drive(part, level, anew=not k)
                offset.add_outputs(part, loop.outputs)
        outputs = self.estimator.outputs
        comparison = Differences(outputs, [o.name for o in outputs])
        errors = [Errors(self.estimator) for _ in levels]
        saturated = 0
        for k, part in enumerate(columns.parts()):
            loops = [loop for level in levels for loop in drive(part, level, anew=not k)]
            for n, loop in enumerate(loops):
                errors[n].add(part, offsets[n].turned_outputs(loop.outputs))
            saturated += loops[0].run.n_saturated
            if len(loops) > 1:
                comparison.add(loops[0].outputs, loops[1].outputs)
        near = tuple(comparison.result()) if len(levels) > 1 else ()
        inputs = (s for k, part in enumerate(columns.parts()) for s in part.spans(not k))
        values = saturations(levels[0], inputs, params) if saturated else {}
        scores = [
            Scores(name, e.result(), e.units, offset_deg=offset.offset_deg, notes=e.notes)
            for name, e, offset in zip(("fixed", "float"), errors, offsets, strict=False)
        ]
        scores[0] = replace(scores[0], saturated=saturated, saturations=values, near=near)
        return scores


def run_peer(name: str, record: Record) -> FloatArray:
    """Attitudes (n, 4) b to n (ENU) of one of `PEERS`, as its own package runs it.

    It wants one rate: a log with other steps gets the median step, and gaps are filled with the
    sample that ends them. Without any field it is its six-axis form. Where the magnetometer has
    nothing new it is fed the zero vector, which it skips, and is told the magnetometer's mean step.
    InputError: a log without the inputs of a filter.

    D. Laidig, T. Seel, "VQF: Highly accurate IMU orientation estimation with bias estimation and
    magnetic disturbance rejection", Information Fusion 91:187, 2023,
    doi 10.1016/j.inffus.2022.10.014.
    """
    log = NineAxis.of(record)
    step = float(np.median(log.dt))
    # The samples of a gap are copies of the next one.
    times = np.clip(np.rint(log.dt / step), 1, _LONGEST_GAP_S / step).astype(np.int64)
    rows, last = np.repeat(np.arange(len(log)), times), np.cumsum(times) - 1
    samples, settings = [log.gyr[rows], log.acc[rows]], {}
    if has_field := log.mag_new.any():
        samples.append(np.zeros_like(samples[0]))
        samples[-1][last] = np.where(log.mag_new[:, None], log.mag, 0.0)
        settings["magTs"] = step * (len(rows) / int(np.count_nonzero(log.mag_new)))
    out = getattr(optional("vqf"), PEERS[name])(step, **settings).updateBatch(*samples)
    return np.asarray(out["quat9D" if has_field else "quat6D"], dtype=np.float64)[last]


def published(name: str, record: Record, align: str) -> Scores:
    """One of `PEERS` on a log."""
    log, q = NineAxis.of(record), run_peer(name, record)
    offset = Alignment(align)
    offset.add(q, log.attitude, log.counts)
    errors = attitude_errors(offset.turned(q), log.attitude, log.counts)
    units = dict.fromkeys(ANGLES, "deg")
    return Scores("package", errors, units, offset_deg=offset.offset_deg)
