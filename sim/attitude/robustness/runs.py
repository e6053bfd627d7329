"""Every case of a log through every filter, as flat rows, and their summary."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.attitude.front.sensed import full_scale_params
from boresight.model.errors import InputError, require
from boresight.model.estimator import Estimator
from boresight.model.resolve import estimator_of
from boresight.sim.accuracy.figures import attitude_errors
from boresight.sim.accuracy.peers import PEERS, run_peer
from boresight.sim.attitude.robustness.variants import CASES, Case
from boresight.sim.compare.difference import differences
from boresight.sim.levels.build import Build
from boresight.sim.levels.floating import CompiledFloat
from boresight.sim.levels.integer import Emitted
from boresight.sim.levels.level import Run
from boresight.sim.records.feed import feed, fitted
from boresight.sim.records.files import read_record
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.result import Result
from boresight.sim.rotations.accuracy import largest_turn_deg
from boresight.sim.rotations.outputs import attitude_of

#: Seconds after the start in which no error counts, for all filters alike.
LEFT_OUT_S = 1.0
#: s, shortest motion of a log: the shortest cut is the last third of it.
SHORTEST_S = 6.0
#: The published filter that others are compared with, and its smallest error in a ratio [deg].
RIVAL, SMALL_DEG = "vqf_online", 0.5

Row = dict[str, Any]
Levels = dict[tuple[Any, ...], tuple[Emitted, CompiledFloat]]


def run_log(names: Sequence[str], log: Path | NineAxis) -> list[Row]:
    """Return one row per case and filter; without figures, but ``refused``, if it cannot run it."""
    recorded = log if isinstance(log, NineAxis) else NineAxis.of(read_record(log))
    moving = recorded.t[recorded.counts & np.isfinite(recorded.attitude).all(axis=1)]
    require(
        len(moving) > 0 and moving[-1] - moving[0] > SHORTEST_S,
        f"log {recorded.name!r}",
        f"more than {SHORTEST_S:g} s of motion with a reference attitude",
        f"{np.ptp(moving) if len(moving) else 0.0:.3g} s",
        "leave this log out",
    )
    built, rows = Levels(), list[Row]()
    for number, case in enumerate(CASES):
        changed = case.change(recorded)
        for name in names:
            row: Row = {"log": recorded.name, "case": case.group, "number": number, "filter": name}
            try:
                if name in PEERS:
                    row |= figures_of(changed, run_peer(name, changed.record()))
                else:
                    row |= _own(name, case, changed, built)
            except InputError as error:  # made for another rate, for example
                row["refused"] = str(error)
            rows.append(row)
    return rows


def _own(name: str, case: Case, log: NineAxis, built: Levels) -> Row:
    """Figures of one of our estimators in fixed point, and how far it is from float64."""
    estimator, (fixed, floating) = run_estimator(name, case.full_scale, log, built)
    q, q_float = (attitude_of(run.outputs) for run in (fixed, floating))
    near = differences(estimator.outputs, fixed.outputs, floating.outputs)
    return {
        **figures_of(log, q),
        "good": all(d.good for d in near) and not fixed.n_saturated,
        "apart_deg": largest_turn_deg(q, q_float),
        "saturated": fixed.n_saturated,
    }


def run_estimator(
    name: str, full_scale: str, log: NineAxis, built: Levels
) -> tuple[Estimator, list[Run]]:
    """Run an estimator, made for the log's rates, in fixed point and in float64."""
    record = log.record()
    rates = fitted(estimator_of(name), record).rates_hz
    levels = built.get(key := (name, *sorted(rates.items())))
    if levels is None:
        build = Build(estimator_of(name).for_rates(rates) if rates else estimator_of(name))
        levels = built[key] = Emitted(build), CompiledFloat(build)
    estimator = levels[0].build.estimators[0]
    largest = {key: float(np.abs(getattr(log, key)).max()) for key in ("gyr", "acc")}
    rate, force = (largest[key] if key == full_scale else None for key in ("gyr", "acc"))
    inputs = feed(estimator, record).inputs
    for level in levels:
        level.set_params(full_scale_params(estimator.params, rate=rate, force=force))
    return estimator, [level.run_anew(inputs) for level in levels]


def figures_of(log: NineAxis, q: FloatArray) -> dict[str, float]:
    """Errors of attitudes (n, 4) against a log's truth [deg], without the first `LEFT_OUT_S`."""
    return attitude_errors(q, log.attitude, log.counts & (log.t >= log.t[0] + LEFT_OUT_S))


def summary(rows: Sequence[Row]) -> Result:
    """Return mean errors by group of cases and filter, ratios to `RIVAL`, and what is wrong."""
    filters = list(dict.fromkeys(r["filter"] for r in rows))
    rival = {(r["log"], r["number"]): r for r in rows if r["filter"] == RIVAL and "total" in r}
    errors, ratios, failures = list[Row](), list[Row](), list[str]()
    for group, judged in {c.group: c.judged for c in CASES}.items():
        note = "" if judged == "total" else f" ({judged})"
        errors.append({"case": group + note})
        for name in filters:
            own = [r for r in rows if (r["case"], r["filter"]) == (group, name) and judged in r]
            errors[-1][name] = float(np.mean([r[judged] for r in own])) if own else None
            pairs = [(r, b) for r in own if (b := rival.get((r["log"], r["number"])))]
            if name == RIVAL or not pairs:
                continue
            worst = [(r[judged] / max(b[judged], SMALL_DEG), r["log"]) for r, b in pairs]
            ratio, inclination = (
                sum(r[figure] for r, _ in pairs) / sum(b[figure] for _, b in pairs)
                for figure in (judged, "inclination")
            )
            row = {"filter": name, "case": group, "ratio": ratio, "of inclination": inclination}
            ratios.append(row | dict(zip(("worst", "in"), max(worst), strict=True)))
    for name in filters:
        own = [r for r in rows if r["filter"] == name]
        if bad := [r for r in own if not r.get("good", True)]:
            far = max(bad, key=lambda r: r["apart_deg"])
            failures.append(
                f"{name}: fixed point is {far['apart_deg']:.6f} deg from float64 and saturates "
                f"{far['saturated']} times in {far['log']}, {far['case']}"
            )
        if refused := [r["refused"] for r in own if "refused" in r]:
            failures.append(f"{name}: {len(refused)} of {len(own)} runs failed: {refused[0]}")
    tables = {
        "Root mean square error without the first second, deg": errors,
        f"Ratio to {RIVAL}": ratios,
    }
    data = {"errors_deg": errors, "against_rival": ratios, "rows": rows}
    return Result(data, tables, failures=failures)
