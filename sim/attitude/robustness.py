"""Attitude filters on logs that are made harder in one way each (`CASES`), with their truth.

``python -m boresight.sim.attitude.robustness mekf,vqf_online LOG... [-o OUT.json]``

Chance is drawn from the log's name: the same log and change give the same result everywhere.
"""

from __future__ import annotations

import argparse
import json
import sys
import zlib
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from boresight.model.arrays import FloatArray
from boresight.model.attitude.front import full_scale_params
from boresight.model.declarations import GRAVITY
from boresight.model.errors import InputError, require
from boresight.model.estimator import Estimator
from boresight.model.resolve import estimator_of, split_names
from boresight.model.tools.external import optional
from boresight.sim.accuracy.figures import attitude_errors, gives_attitude
from boresight.sim.accuracy.runs import PEERS, run_peer
from boresight.sim.attitude.worlds import fast_turn
from boresight.sim.compare.difference import differences
from boresight.sim.levels.build import Build, Run
from boresight.sim.levels.registry import CompiledFloat, Emitted
from boresight.sim.records.feed import feed, fitted
from boresight.sim.records.files import bundled, log_files, read_record
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.result import Result
from boresight.sim.rotations.accuracy import attitude_of, largest_turn_deg

#: Hz, rates at which logs are played.
RATES_HZ = (50.0, 100.0, 142.0, 286.0, 500.0, 1000.0)


def _rng(log: NineAxis, salt: int = 0) -> np.random.Generator:
    return np.random.default_rng([zlib.crc32(log.name.encode()), salt])


def _rows(log: NineAxis, rows: slice | npt.NDArray[np.intp]) -> NineAxis:
    """Some samples, with the time since the one before that is left."""
    t, mov = log.t[rows], None if log.mov is None else log.mov[rows]
    q, steps = log.attitude[rows], np.diff(t, prepend=t[0] - log.dt[rows][0])
    return NineAxis(log.name, t, log.gyr[rows], log.acc[rows], log.mag[rows], q, steps, mov)


def cut_in_motion(log: NineAxis, place: int | None = None) -> NineAxis:
    """The log from 2 s after its first movement; or from a random sample that moves.

    ``place`` numbers the draws, which lie in the first two thirds of the movement.
    """
    moving = np.flatnonzero(log.counts)
    if place is None:
        return _rows(log, slice(int(np.searchsorted(log.t, log.t[moving[0]] + 2.0)), None))
    return _rows(log, slice(int(moving[int(_rng(log, place).uniform() * len(moving) / 1.5)]), None))


def resampled(log: NineAxis, rate_hz: float) -> NineAxis:
    """At another rate: gyro, force and field are means over the new steps, held where it is higher.

    The integral of each sensor is read off at the new times, linearly between samples; the
    attitude is the chord between its neighbours.
    """
    start = log.t[0] - log.dt[0]
    count = int((log.t[-1] - start) * rate_hz)
    times = start + np.arange(count + 1) / rate_hz

    def means(values: FloatArray) -> FloatArray:
        sums = np.concatenate([np.zeros((1, 3)), np.cumsum(values * log.dt[:, None], axis=0)])
        read = [np.interp(times, [start, *log.t], column) for column in sums.T]
        return np.diff(read).T * rate_hz

    t = times[1:]
    upper = np.clip(np.searchsorted(log.t, t - 1e-9), 1, len(log) - 1)
    low, high = log.attitude[upper - 1], log.attitude[upper]
    high = np.where((low * high).sum(axis=1, keepdims=True) < 0.0, -high, high)
    share = (t - log.t[upper - 1]) / (log.t[upper] - log.t[upper - 1])
    q = low + np.clip(share, 0.0, 1.0)[:, None] * (high - low)
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    mov = None if log.mov is None else log.mov[upper]
    steps, first = np.full(count, 1.0 / rate_hz), int(np.argmax(log.mag_new))
    held = np.maximum.accumulate(np.where(log.mag_new, np.arange(len(log)), first))
    mag = means(log.mag[held])
    return NineAxis(log.name, t, means(log.gyr), means(log.acc), mag, q, steps, mov)


def hard_iron(log: NineAxis, draw: int) -> NineAxis:
    """The magnetometer off by a tenth of the field; ``draw`` numbers the directions."""
    direction = _rng(log, draw).standard_normal(3)
    size = 0.1 * np.nanmedian(np.linalg.norm(log.mag, axis=1))
    return replace(log, mag=log.mag + size * direction / np.linalg.norm(direction))


def without_field(log: NineAxis, seconds: float | None = None) -> NineAxis:
    """No field for so long, from the middle of the log on; or never any."""
    since = log.t - 0.5 * (log.t[0] + log.t[-1])
    blind = np.full(len(log), True) if seconds is None else (since >= 0.0) & (since < seconds)
    return replace(log, mag=np.where(blind[:, None], np.nan, log.mag))


def clipped(log: NineAxis, sensor: str, share: float) -> NineAxis:
    """The full scale of a sensor, "gyr" or "acc", is a share of the log's largest component.

    Of the accelerometer it is gravity and a share of what the largest component has beyond it.
    """
    values, offset = getattr(log, sensor), GRAVITY if sensor == "acc" else 0.0
    limit = offset + share * max(float(np.abs(values).max()) - offset, 0.0)
    return replace(log, **{sensor: np.clip(values, -limit, limit)})


def fast_turns(log: NineAxis, count: int = 8) -> NineAxis:
    """So many times in its movement the sensor turns at 1 to 1.5 of its gyro's full scale.

    It does so for 20 to 200 ms about a random axis, with rise and fall (`fast_turn`); full scale
    is the largest component of the log's own rate. The turns begin in parts of equal length.
    """
    rng, full_scale = _rng(log), float(np.abs(log.gyr).max())
    edges = np.linspace(log.t[log.counts][0], log.t[log.counts][-1], count + 1)
    for begin, length in zip(edges[:-1], np.diff(edges), strict=True):
        direction = rng.standard_normal(3)
        rate = rng.uniform(1.0, 1.5) * full_scale / np.abs(direction).max()
        begin_s = begin + rng.uniform(0.0, 0.5) * length
        seconds = rng.uniform(0.02, 0.2)
        log = fast_turn(log, begin_s=begin_s, rate_rad_s=rate * direction, seconds=seconds)
    return replace(log, gyr=np.clip(log.gyr, -full_scale, full_scale))


def gaps(log: NineAxis, share: float = 0.02, longest: int = 20) -> NineAxis:
    """A share of the samples never comes, in runs of up to ``longest``; times tell of it."""
    rng, present = _rng(log), np.full(len(log), True)
    count = round(2.0 * share * len(log) / (1 + longest))
    for first in rng.integers(1, len(log), count):
        present[first : first + int(rng.integers(1, longest + 1))] = False
    return _rows(log, np.flatnonzero(present))


class Case(NamedTuple):
    """One change of every log; those of a ``group`` are reported together, by their mean.

    ``judged`` is the figure that counts: "inclination" where no sensor shows the heading.
    ``full_scale`` is the sensor, "gyr" or "acc", whose largest component in the log is its full
    scale, which the estimators learn as from a board (`full_scale_params`).
    """

    group: str
    change: Callable[[NineAxis], NineAxis]
    judged: str = "total"
    full_scale: str = ""


CASES = (
    Case("as recorded", lambda log: log),
    Case("starts in motion", cut_in_motion),
    *(Case("starts anywhere", partial(cut_in_motion, place=k)) for k in range(10)),
    *(Case(f"{rate:g} Hz", partial(resampled, rate_hz=rate)) for rate in RATES_HZ),
    Case("no field for a minute", partial(without_field, seconds=60.0)),
    Case("never a field", without_field, judged="inclination"),
    Case("gaps in the samples", gaps),
    *(Case("field offset 10 %", partial(hard_iron, draw=k)) for k in range(3)),
    *(
        Case(f"{key} clipped at {share:g}", partial(clipped, sensor=key, share=share), "total", key)
        for key in ("gyr", "acc")
        for share in (0.8, 0.6)
    ),
    Case("fast turns", fast_turns, full_scale="gyr"),
)


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
        "beyond": [d.output for d in near if not d.good],
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
        if bad := [r for r in own if r.get("beyond") or r.get("saturated")]:
            far = max(bad, key=lambda r: r["apart_deg"])
            failures.append(
                f"{name}: fixed point is {far['apart_deg']:.6f} deg from float64, beyond the "
                f"tolerance in {', '.join(far['beyond']) or 'no output'}, and {far['saturated']} "
                f"updates saturate, in {far['log']}, {far['case']}"
            )
        if refused := [r["refused"] for r in own if "refused" in r]:
            failures.append(f"{name}: {len(refused)} of {len(own)} runs failed: {refused[0]}")
    tables = {
        "Root mean square error without the first second, deg": errors,
        f"Ratio to {RIVAL}": ratios,
    }
    data = {"errors_deg": errors, "against_rival": ratios, "rows": rows}
    return Result(data, tables, failures=failures)


def main(arguments: Sequence[str]) -> int:
    """Print the tables; return 1 if a filter fails, 2 for bad input."""
    parser = argparse.ArgumentParser(prog="python -m boresight.sim.attitude.robustness")
    parser.add_argument("filters", help="estimators and published filters, with commas between")
    parser.add_argument("logs", nargs="*", help="logs, or folders of logs, with truth")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("-o", "--output", type=Path, help="JSON file with every row")
    given = parser.parse_args(arguments)
    try:
        require(given.jobs >= 1, "--jobs", "1 or more", given.jobs)
        names = split_names(given.filters)
        if not PEERS.keys().isdisjoint(names):
            optional("vqf")
        for name in names:
            good = name in PEERS or gives_attitude(estimator_of(name))
            require(good, "filters", "estimators with outputs qw qx qy qz", name, "name others")
        files = log_files(given.logs) if given.logs else [bundled("synthetic_60s")]
        with ProcessPoolExecutor(given.jobs, mp_context=get_context("spawn")) as pool:
            rows = [row for rows in pool.map(partial(run_log, names), files) for row in rows]
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    result = summary(rows)
    if given.output:
        given.output.write_text(json.dumps(result.to_json(), indent=1) + "\n", encoding="utf-8")
    print(result)
    return int(not result.good)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
