"""One log in every case through every filter: errors against the truth, as flat rows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.attitude.front.sensed import full_scale_params
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.resolve import estimator_of
from boresight.sim.accuracy.figures import attitude_errors, gives_attitude
from boresight.sim.accuracy.peers import run_peer
from boresight.sim.attitude.robustness.plan import Case, cases_of
from boresight.sim.compare.difference import differences
from boresight.sim.levels.build import Build
from boresight.sim.levels.floating import CompiledFloat
from boresight.sim.levels.integer import Emitted
from boresight.sim.levels.level import Run
from boresight.sim.records.feed import feed, fitted
from boresight.sim.records.files import read_record
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.rotations.accuracy import largest_turn_deg
from boresight.sim.rotations.outputs import attitude_of

#: Seconds after the start in which no error counts, for all filters alike.
LEFT_OUT_S = 1.0
Levels = dict[tuple[str, tuple[tuple[str, float], ...]], tuple[Emitted, CompiledFloat]]


@dataclass(frozen=True)
class Suite:
    """Name of a list of cases (`plan.cases_of`), estimators, and published filters."""

    cases: str
    estimators: Sequence[str]
    peers: Sequence[str] = ()


def run_log(suite: Suite, log: str | Path | NineAxis) -> list[dict[str, Any]]:
    """Run every filter on a log in every case.

    Returns
    -------
    list of dict
        One row per case, filter and level ("fixed", "float", "package"). A filter that cannot run
        a case has the reason under ``refused`` in place of figures.
    """
    recorded = log if isinstance(log, NineAxis) else NineAxis.of(read_record(Path(log)))
    levels: Levels = {}
    rows: list[dict[str, Any]] = []
    for case in cases_of(suite.cases):
        changed = prepared(case, recorded)
        head = {"log": recorded.name, "case": case.name, "group": case.group}
        for name in suite.estimators:
            rows += [head | row for row in _own(name, case, changed, levels)]
        for name in suite.peers:
            row: dict[str, Any] = {"filter": name, "level": "package"}
            try:
                row |= figures_of(changed, run_peer(name, changed.record()))
            except InputError as error:
                row["refused"] = str(error)
            rows.append(head | row)
    return rows


def _own(name: str, case: Case, log: NineAxis, levels: Levels) -> Iterator[dict[str, Any]]:
    """Yield the rows of one estimator in fixed point and in float64."""
    try:
        estimator, (fixed, floating) = run_estimator(name, log, case.full_scale, levels)
    except InputError as error:  # made for another rate, for example
        yield {"filter": name, "level": "fixed", "refused": str(error)}
        return
    attitudes = [attitude_of(run.outputs) for run in (fixed, floating)]
    errors = differences(estimator.outputs, fixed.outputs, floating.outputs)
    yield {
        "filter": name,
        "level": "fixed",
        **figures_of(log, attitudes[0]),
        "good": all(e.good for e in errors) and not fixed.n_saturated,
        "apart_deg": largest_turn_deg(*attitudes),
        "saturated": fixed.n_saturated,
    }
    yield {"filter": name, "level": "float", **figures_of(log, attitudes[1])}


def run_estimator(
    name: str, log: NineAxis, full_scale: Sequence[str], levels: Levels
) -> tuple[Estimator, list[Run]]:
    """Run an estimator, made for the log's rates, in fixed point and in float64.

    ``full_scale`` is that of `Case`. ``levels`` keeps what was built.

    Raises
    ------
    InputError
        The outputs are not an attitude, or the estimator cannot run at the log's rates.
    """
    record = log.record()
    rates = tuple(sorted(fitted(estimator_of(name), record).rates_hz.items()))
    if (name, rates) not in levels:
        estimator = estimator_of(name)
        estimator = estimator.for_rates(dict(rates)) if rates else estimator
        if not gives_attitude(estimator):
            raise InputError.at(
                name,
                wanted="an estimator whose outputs are an attitude, qw qx qy qz",
                found="another one",
                fix="name another",
            )
        build = Build(estimator)
        levels[name, rates] = Emitted(build), CompiledFloat(build)
    both = levels[name, rates]
    estimator = both[0].build.estimators[0]
    largest = {key: float(np.abs(getattr(log, key)).max()) for key in full_scale}
    scales = full_scale_params(estimator.params, rate=largest.get("gyr"), force=largest.get("acc"))
    inputs = feed(estimator, record).inputs
    for level in both:
        level.set_params(scales)
    return estimator, [level.run_anew(inputs) for level in both]


def figures_of(log: NineAxis, q: FloatArray) -> dict[str, float | None]:
    """Errors of attitudes (n, 4) against a log's truth [deg], without the first `LEFT_OUT_S`."""
    counted = np.asarray(log.counts & (log.t >= log.t[0] + LEFT_OUT_S))
    return dict(attitude_errors(q, log.attitude, counted))


def prepared(case: Case, log: NineAxis) -> NineAxis:
    """Return the log of a case.

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
