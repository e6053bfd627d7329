"""The paper's tests, section by section: the measured figures, as plain data."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from boresight.gateware.core import build_core
from boresight.model.arrays import FloatArray
from boresight.model.attitude import ESTIMATORS
from boresight.sim.attitude.ma2014 import paper
from boresight.sim.attitude.ma2014.methods import METHODS, Method, gains, run_method, score
from boresight.sim.attitude.ma2014.spectrum import line_amplitude, share, spectrum
from boresight.sim.attitude.ma2014.world import CASES, E1, E2, LOOP_HZ, make_log, noise_free_log
from boresight.sim.campaign import dispatch
from boresight.sim.records.record import Record

__all__ = [
    "HEADING_RUNS",
    "JUDGED",
    "KALMAN",
    "SIDE_RUNS",
    "differences",
    "heading_test",
    "kinematics",
    "plain",
    "stacked",
    "timing",
]

Say = Callable[[str], None]

#: Runs, at most, of the cases that only show what an error does.
SIDE_RUNS = 10
#: Runs, at most, of the heading test.
HEADING_RUNS = 40
JUDGED = ("noise", "C")
KALMAN = ("ekf_quaternion", "ekf_table_4")
#: Heading test [Hz]: its frequency, and below which the paper's gyro error lies.
LINE_HZ, SLOW_HZ = 1.0 / 6.0, 0.02


def plain(x: FloatArray, digits: int = 5) -> Any:
    """Lists of rounded numbers."""
    return (np.round(np.asarray(x, dtype=np.float64), digits) + 0.0).tolist()  # no minus zero


def _summary(x: FloatArray) -> dict[str, Any]:
    """Values (runs, 3): the spread over the runs."""
    quantiles = {"p05": 5, "p25": 25, "median": 50, "p75": 75, "p95": 95}
    out = {name: plain(np.percentile(x, q, axis=0)) for name, q in quantiles.items()}
    return out | {"pooled": plain(np.sqrt(np.square(x).mean(axis=0)))}


def _row(error: FloatArray) -> dict[str, Any]:
    """Errors (steps, runs, 3) of one method: standard deviation and largest value of each run.

    ``max_moving``: the largest after the run's mean has been taken off.
    """
    centred = error - error.mean(axis=0)
    return {
        "sd": _summary(error.std(axis=0)),
        "max": _summary(np.abs(error).max(axis=0)),
        "max_moving": _summary(np.abs(centred).max(axis=0)),
    }


def stacked(
    seeds: Sequence[int], say: Say, jobs: int | None = None
) -> tuple[dict[str, Any], dict[str, FloatArray]]:
    """Section 3.2 in every case: rows of Table 3, and the errors of case C (steps, runs, 3).

    Methods are distributed over processes.
    """
    count = sum(map(len, _seeds(seeds).values()))
    say(f"section 3.2: {len(CASES)} cases, {count} runs of {E2.seconds:g} s")
    rows: dict[str, dict[str, Any]] = {case: {} for case in CASES}
    errors: dict[str, FloatArray] = {}
    completed = {}
    tasks = [(m.key, _of_method, (m, tuple(seeds))) for m in METHODS]
    for key, results in dispatch(jobs, tasks):
        say(f"  {key}")
        completed[key] = results
    for method in METHODS:
        method_rows, method_errors = completed[method.key]
        errors |= {f"{case}/{method.key}": error for case, error in method_errors.items()}
        for case, row in method_rows.items():
            rows[case][method.key] = row
    return rows, errors


def _seeds(seeds: Sequence[int]) -> dict[str, Sequence[int]]:
    """The seeds of each case."""
    return {name: seeds if name in JUDGED else seeds[:SIDE_RUNS] for name in CASES}


@lru_cache(maxsize=1)
def _logs(seeds: tuple[int, ...]) -> list[Record]:
    """The logs of all cases."""
    return [make_log(E2, CASES[name], k) for name, group in _seeds(seeds).items() for k in group]


def _of_method(
    method: Method, seeds: tuple[int, ...]
) -> tuple[dict[str, dict[str, Any]], dict[str, FloatArray]]:
    """Rows of one method by case, and errors (steps, runs, 3) of the cases that are judged."""
    logs, rows, errors, end = _logs(seeds), dict[str, Any](), dict[str, FloatArray](), 0
    forms = run_method(method, logs)
    floating, fixed = (score(angles, logs) for angles, _ in forms)
    for name, group in _seeds(seeds).items():
        part, end = slice(end, end + len(group)), end + len(group)
        difference = np.abs(_wrapped(fixed[:, part] - floating[:, part]))
        row = {
            "title": method.title,
            "estimator": method.estimator.name,
            "paper_row": method.row,
            "float": _row(floating[:, part]),
            "fixed": _row(fixed[:, part]),
            "fixed_vs_float": {
                "max": plain(difference.max(axis=(0, 1)), 9),
                "sd": plain(difference.std(axis=0).max(axis=0), 9),
            },
        }
        if name in JUDGED:
            errors[name] = fixed[:, part]
            row["sd_runs"] = plain(errors[name].std(axis=0))
        rows[name] = row
    rows["C"]["saturated_updates"] = sum(saturated for _, saturated in forms)
    return rows, errors


def _wrapped(x: FloatArray) -> FloatArray:
    """Degrees into [-180, 180)."""
    return np.asarray((x + 180.0) % 360.0 - 180.0)


def heading_test(seeds: Sequence[int], say: Say) -> dict[str, Any]:
    """Section 1.3: spectra of the heading error, case C."""
    say(f"section 1.3: heading, {len(seeds)} runs of {E1.seconds:g} s")
    logs = [make_log(E1, CASES["C"], seed) for seed in seeds]
    methods: dict[str, Any] = {}
    for method in METHODS:
        if method.key.endswith("_as_printed"):
            continue
        ((angles, _),) = run_method(method, logs, ("c",))
        # whole periods: the last sample is the first of the next one
        error = score(angles, logs)[: round(E1.seconds * LOOP_HZ), :, 2]
        s = spectrum(error, LOOP_HZ)
        variance, slow = np.square(error.std(axis=0)), share(s, 0.0, SLOW_HZ)
        methods[method.key] = {
            "title": method.title,
            "sd_deg": _spread(np.sqrt(variance)),
            "energy_below_slow": _spread(slow),
            "slow_deg": _spread(np.sqrt(variance * slow)),
            "line_deg": _spread(line_amplitude(s, LINE_HZ)),
        }
    return {"line_hz": LINE_HZ, "slow_hz": SLOW_HZ, "runs": len(seeds), "methods": methods}


def _spread(x: FloatArray) -> dict[str, float]:
    """Spread over the runs (runs,)."""
    p05, median, p95 = np.percentile(x, (5, 50, 95))
    values = {"p05": p05, "median": median, "p95": p95}
    return {name: round(float(value), 5) for name, value in values.items()}


def kinematics(say: Say) -> list[dict[str, Any]]:
    """Eq. (3) as printed against the consistent set, without any noise, in fixed point."""
    say("eq. (3) as printed, without noise")
    methods = {m.key: m for m in METHODS}
    out = []
    for text, rate, of_sample in (
        ("gyro integrated", LOOP_HZ, 0.0),
        ("gyro integrated", 100.0, 0.0),
        ("filter, gains per sample", LOOP_HZ, 1.0),
        ("filter, gains per second", 100.0, 1.0 / 100.0),
    ):
        log = noise_free_log(E2, rate)
        params = gains(
            [k * of_sample for k in paper.KP], [k * of_sample * of_sample for k in paper.KI]
        )
        row: dict[str, Any] = {"what": text, "rate_hz": rate, "filter": of_sample > 0.0}
        for key in ("ma2014_cf", "ma2014_cf_as_printed"):
            ((angles, _),) = run_method(methods[key], [log], ("c",), params)
            error = score(angles, [log])[:, 0]
            row[key] = {
                "sd": plain(error.std(axis=0), 6),
                "max": plain(np.abs(error).max(axis=0), 6),
            }
        out.append(row)
    return out


def timing(say: Say) -> list[dict[str, Any]]:
    """Cycles of the cores, from their schedules."""
    say("schedules of the cores")
    out = []
    for key in ("ma2014_cf", "ekf_quaternion", "complementary"):
        estimator, row = ESTIMATORS[key](), paper.BESIDE[key]
        program = estimator.compile()
        for config in ("small", "fast"):
            schedule = build_core(program, config, urgent=estimator.urgent).schedule
            cycles = max(schedule.latencies[: estimator.urgent])
            out.append(
                {
                    "estimator": key,
                    "config": config,
                    "cycles": cycles,
                    "interval": schedule.interval,
                    "us": cycles / paper.CLOCK_MHZ,
                    "paper_us": paper.TIME_US[row],
                    "speedup": round(paper.CYCLES[row] / cycles, 1),
                }
            )
    return out


def differences(errors: Mapping[str, FloatArray]) -> dict[str, Any]:
    """Figure 7: the paper's complementary filter less each Kalman filter, in the judged cases."""
    out = {}
    for key in KALMAN:
        for case in ("C", "noise"):
            d = errors[f"{case}/ma2014_cf"] - errors[f"{case}/{key}"]
            out[f"{case}/{key}"] = _row(d)
    return out
