"""One trial in some cases through every filter: the figures, as plain data.

Runs are distributed over processes, which build every filter once; a trial is named by its file or
its world, so that each process reads it itself.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from boresight.model.arrays import BoolArray, FloatArray
from boresight.model.attitude.front.sensed import full_scale_params
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.resolve import estimator_of
from boresight.sim.accuracy.figures import attitude_errors, gives_attitude
from boresight.sim.accuracy.peers import dip_rad, peer, run_peer
from boresight.sim.attitude.robustness import logs as carriers
from boresight.sim.attitude.robustness.plan import Case, cases_of
from boresight.sim.campaign import digest, sources
from boresight.sim.compare.difference import differences
from boresight.sim.levels.build import Build
from boresight.sim.levels.floating import CompiledFloat
from boresight.sim.levels.integer import Emitted
from boresight.sim.levels.level import Run
from boresight.sim.records.feed import feed, fitted
from boresight.sim.records.files import read_record
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.rotations.accuracy import attitude_error, largest_turn_deg
from boresight.sim.rotations.outputs import attitude_of

__all__ = [
    "LEFT_OUT_S",
    "SETTLED_DEG",
    "Campaign",
    "counted",
    "figures_of",
    "log_of",
    "name_of",
    "prepared",
    "run_ours",
    "settled_s",
    "tasks_of",
]

Params = tuple[tuple[str, tuple[tuple[str, float], ...]], ...]

#: Seconds after the start that no error counts, for all filters alike.
LEFT_OUT_S = 1.0
#: A filter has settled when its error stays below these [deg], for so long [s].
SETTLED_DEG = (2.0, 5.0)
SETTLED_FOR_S = 10.0


@dataclass(frozen=True)
class Campaign:
    """Trials, filters and parameters of a campaign.

    Attributes
    ----------
    trials : tuple of str
        Files, or ``carrier:NAME:SEED`` for a draw of `sim.attitude.robustness.logs`.
    estimators, peers : tuple of str
        Ours (or of a user's file), and published ones.
    params : parameter values by estimator, both sorted
    """

    protocol: str
    trials: tuple[str, ...]
    estimators: tuple[str, ...]
    peers: tuple[str, ...]
    params: Params = ()
    word: int = 32

    def identity(self) -> dict[str, Any]:
        """All inputs of the figures, as plain data."""
        classes = map(estimator_of, self.estimators)
        return {
            "protocol": self.protocol,
            "sources": sources(*classes),
            "trials": {name_of(t): _digest(t) for t in self.trials},
            "estimators": {name: _levels(self, name)[0].program.digest for name in self.estimators},
            "peers": {name: version(peer(name).package) for name in self.peers},
            "params": {name: dict(values) for name, values in self.params},
            "word": self.word,
        }


def name_of(trial: str) -> str:
    """Name of a trial."""
    if trial.startswith("carrier:"):
        return trial.removeprefix("carrier:").replace(":", "-")
    return Path(trial).stem


def _digest(trial: str) -> str:
    if trial.startswith("carrier:"):
        return trial
    return hashlib.sha256(Path(trial).read_bytes()).hexdigest()


def log_of(trial: str) -> NineAxis:
    """The log of a trial.

    Raises
    ------
    InputError
        It cannot be read, or has no attitude as truth.
    """
    return log_with_digest(trial, _digest(trial))


@lru_cache(maxsize=2)
def log_with_digest(trial: str, _: str) -> NineAxis:
    """The log of a trial, read again when its digest changes."""
    if trial.startswith("carrier:"):
        _, name, seed = trial.split(":")
        return carriers.carrier(name, int(seed))
    log = NineAxis.of(read_record(Path(trial)))
    log.attitude  # noqa: B018 (raises InputError if the log has none)
    return log


@lru_cache(maxsize=16)
def _levels(
    campaign: Campaign, name: str, rates: tuple[tuple[str, float], ...] = ()
) -> tuple[Emitted, CompiledFloat]:
    """Fixed point and float64 of one of ours, made for rates where it needs to know them."""
    params = dict(dict(campaign.params).get(name, ()))
    estimator = estimator_of(name)
    estimator = estimator.for_rates(dict(rates)) if rates else estimator
    build = Build(estimator, word=campaign.word, params=[params])
    if not gives_attitude(build.estimators[0]):
        raise InputError.at(
            name,
            wanted="an estimator whose outputs are an attitude, qw qx qy qz",
            found="another one",
            fix="leave --protocol out, or name another",
        )
    return Emitted(build), CompiledFloat(build)


def settled_s(t: FloatArray, error: FloatArray, limit: float) -> float | None:
    """When an error first stays below a limit for `SETTLED_FOR_S`, from t[0] on; None: never.

    Samples whose error is NaN say nothing.
    """
    is_finite = np.isfinite(error)
    t, above = t[is_finite], error[is_finite] >= limit
    if not len(t):
        return None
    # Spans that begin at the start or with a sample above the limit, and their durations.
    starts = np.concatenate([[t[0]], t[above]])
    durations = np.diff(np.concatenate([starts, [t[-1]]]))
    settled = np.flatnonzero(durations >= SETTLED_FOR_S)
    return float(starts[settled[0]] - t[0]) if len(settled) else None


def counted(log: NineAxis) -> BoolArray:
    """Samples (n,) that count: those of the log, but for the first `LEFT_OUT_S`."""
    return np.asarray(log.counts & (log.t >= log.t[0] + LEFT_OUT_S))


def figures_of(log: NineAxis, q: FloatArray) -> dict[str, float | None]:
    """Figures of attitudes (n, 4) against a log's truth: `ANGLES`, ``settled_2``, ``settled_5``."""
    metrics: dict[str, float | None] = dict(attitude_errors(q, log.attitude, counted(log)))
    error = attitude_error(q, log.attitude).total
    for limit in SETTLED_DEG:
        metrics[f"settled_{limit:g}"] = settled_s(log.t, error, limit)
    return metrics


def run_ours(
    campaign: Campaign, name: str, log: NineAxis, full_scale: Sequence[str] = ()
) -> tuple[Estimator, list[Run]]:
    """One of ours, made for the log's rates, and its runs in fixed point and in float64.

    ``full_scale``: see `Case`.
    """
    record = log.record()
    rates = tuple(sorted(fitted(estimator_of(name), record).rates_hz.items()))
    levels = _levels(campaign, name, rates)
    estimator = levels[0].build.estimators[0]
    largest = {key: float(np.abs(getattr(log, key)).max()) for key in full_scale}
    scales = full_scale_params(estimator.params, rate=largest.get("gyr"), force=largest.get("acc"))
    for level in levels:
        level.set_params({**scales, **(level.build.params[0] or {})})
    inputs = feed(estimator, record).inputs
    return estimator, [level.run_anew(inputs) for level in levels]


def _ours(campaign: Campaign, name: str, case: Case, log: NineAxis) -> list[dict[str, Any]]:
    estimator, runs = run_ours(campaign, name, log, case.full_scale)
    q = [attitude_of(run.outputs) for run in runs]
    deviations = differences(estimator.outputs, runs[0].outputs, runs[1].outputs)
    figures = {
        "good": all(d.good for d in deviations),
        "apart_deg": largest_turn_deg(*q),
        "changed": sum(int(np.count_nonzero(d.apart)) for d in deviations if d.unit == "words"),
        "saturated": runs[0].n_saturated,
    }
    return [
        {"estimator": name, "level": "fixed", **figures_of(log, q[0]), **figures},
        {"estimator": name, "level": "float", **figures_of(log, q[1])},
    ]


def run_cases(campaign: Campaign, cases: Sequence[tuple[str, str]]) -> list[dict[str, Any]]:
    """Metrics of every filter in cases (trial, name of the perturbation).

    A filter that can make nothing of a case has no metrics.
    """
    by_name = {case.name: case for case in cases_of(campaign.protocol)}
    out = []
    for trial, case in cases:
        log = prepared(by_name[case], log_of(trial))
        rows = []
        for name in campaign.estimators:
            try:
                rows += _ours(campaign, name, by_name[case], log)
            except InputError as error:  # one that is made for another rate, for example
                rows.append({"estimator": name, "level": "fixed", "refused": str(error)})
        dip = dip_rad(log_of(trial))
        for name in campaign.peers:
            row: dict[str, Any] = {"estimator": name, "level": "package"}
            try:
                row |= figures_of(log, run_peer(peer(name), log.record(), dip))
            except InputError as error:
                row["refused"] = str(error)
            rows.append(row)
        out.append({"trial": name_of(trial), "case": case, "rows": rows})
    return out


def prepared(case: Case, log: NineAxis) -> NineAxis:
    """The log of a case.

    Raises
    ------
    InputError
        Less than two seconds of it count.
    """
    log = case.work(log)
    if not (log.counts & np.isfinite(log.attitude).all(axis=1) & (log.t > log.t[0] + 2.0)).any():
        raise InputError.at(
            f"log {log.name!r}, {case.name}",
            wanted="more than two seconds of motion with a reference attitude",
            found="less",
            fix="leave this log out",
        )
    return log


def tasks_of(campaign: Campaign) -> dict[str, tuple[str, str]]:
    """Cases of a campaign as `run_cases` takes them, by digest."""
    pairs = [(t, case.name) for t in campaign.trials for case in cases_of(campaign.protocol)]
    identity = campaign.identity()
    return {digest(identity, pair): pair for pair in pairs}


def params_key(params: Mapping[str, Mapping[str, float]] | None) -> Params:
    """Parameter values as `Campaign` holds them."""
    return tuple(
        (name, tuple(sorted(values.items()))) for name, values in sorted((params or {}).items())
    )
