"""The experiment of Ma Long et al. (2014) in simulation: all that its page shows, as one dict."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.gateware.core import build_core
from boresight.model.errors import InputError
from boresight.model.estimators import ESTIMATORS
from boresight.sim.attitude.rotation import matrix_to_quaternion, quaternion_to_rotation_vector
from boresight.sim.experiments import ma2014_paper as paper
from boresight.sim.experiments.calibration import (
    nearest_rotation,
    orthogonality_error,
    triad_matrix,
)
from boresight.sim.experiments.ma2014_methods import (
    Method,
    available,
    count_mismatches,
    gains_per_s,
    kalman_parameters,
    run_fixed,
    run_float,
    score,
    truth_deg,
)
from boresight.sim.experiments.ma2014_targets import entries_in_band, targets
from boresight.sim.experiments.ma2014_world import (
    AVERAGED,
    CASES,
    E1,
    E2,
    FIELD_UT,
    LEAD,
    LOOP_HZ,
    make_log,
    noise_free_log,
)
from boresight.sim.experiments.spectrum import line_amplitude, share, spectrum
from boresight.sim.records.record import Record
from boresight.sim.worlds.devices import TABLE_2, facts_json
from boresight.sim.worlds.triad import misalignment

__all__ = ["RUNS", "run"]

FloatArray = npt.NDArray[np.float64]
Say = Callable[[str], None]

#: Runs of the two cases that are judged; run k has the seed of the first plus k.
RUNS = 100
#: Runs, at most, of the cases that only show what an error does.
SIDE_RUNS = 10
#: Runs, at most, of the heading test.
HEADING_RUNS = 40
JUDGED = ("noise", "C")
KALMAN = ("ekf_quaternion", "ekf_quaternion_vector")
#: Lines of the heading test [Hz]: its frequency, and below which the paper's gyro error lies.
LINE_HZ, SLOW_HZ, SHOWN_HZ = 1.0 / 6.0, 0.02, 1.0


def _plain(x: FloatArray, digits: int = 5) -> Any:
    """Lists of rounded numbers."""
    return (np.round(np.asarray(x, dtype=np.float64), digits) + 0.0).tolist()  # no minus zero


def _summary(x: FloatArray) -> dict[str, Any]:
    """Values (runs, 3): the spread over the runs."""
    out = {}
    for name, q in (("p05", 5), ("p25", 25), ("median", 50), ("p75", 75), ("p95", 95)):
        out[name] = _plain(np.percentile(x, q, axis=0))
    out["pooled"] = _plain(np.sqrt(np.square(x).mean(axis=0)))
    return out


def _row(error: FloatArray) -> dict[str, Any]:
    """Errors (steps, runs, 3) of one method: standard deviation and largest value of each run.

    ``max_moving``: the largest after the run's mean has been taken off.
    """
    moving = error - error.mean(axis=0)
    return {
        "sd": _summary(error.std(axis=0)),
        "max": _summary(np.abs(error).max(axis=0)),
        "max_moving": _summary(np.abs(moving).max(axis=0)),
    }


def _stacked(seeds: Sequence[int], say: Say) -> tuple[dict[str, Any], dict[str, FloatArray]]:
    """Section 3.2 in every case: rows of Table 3, and the errors of case C (steps, runs, 3)."""
    logs: list[Record] = []
    parts: dict[str, slice] = {}
    for name, case in CASES.items():
        used = seeds if name in JUDGED else seeds[:SIDE_RUNS]
        parts[name] = slice(len(logs), len(logs) + len(used))
        logs += [make_log(E2, case, seed) for seed in used]
    say(f"section 3.2: {len(CASES)} cases, {len(logs)} runs of {E2.seconds:g} s")
    rows: dict[str, dict[str, Any]] = {case: {} for case in CASES}
    errors: dict[str, FloatArray] = {}
    for method in available():
        say(f"  {method.title}")
        real = score(run_float(method, logs), logs)
        fixed, saturated = None, 0
        if method.estimator is not None:
            angles, saturated = run_fixed(method, logs)
            fixed = score(angles, logs)
        for name, part in parts.items():
            row = {
                "title": method.title,
                "estimator": method.estimator,
                "paper_row": method.row,
                "float": _row(real[:, part]),
                "fixed": None,
            }
            if fixed is not None:
                difference = np.abs(_wrapped(fixed[:, part] - real[:, part]))
                row["fixed"] = _row(fixed[:, part])
                row["fixed_vs_float"] = {
                    "max": _plain(difference.max(axis=(0, 1)), 9),
                    "sd": _plain(difference.std(axis=0).max(axis=0), 9),
                }
            rows[name][method.key] = row
            if name in JUDGED:
                best = real if fixed is None else fixed
                row["sd_runs"] = _plain(best[:, part].std(axis=0))
                errors[f"{name}/{method.key}"] = best[:, part]
        rows["C"][method.key]["saturated_updates"] = saturated
    return rows, errors


def _wrapped(x: FloatArray) -> FloatArray:
    """Degrees into [-180, 180)."""
    return np.asarray((x + 180.0) % 360.0 - 180.0)


def _heading_test(seeds: Sequence[int], say: Say) -> dict[str, Any]:
    """Section 1.3: spectra of the heading error, case C; of the first run as curves."""
    say(f"section 1.3: heading, {len(seeds)} runs of {E1.seconds:g} s")
    logs = [make_log(E1, CASES["C"], seed) for seed in seeds]
    out: dict[str, Any] = {
        "line_hz": LINE_HZ,
        "slow_hz": SLOW_HZ,
        "seconds": E1.seconds,
        "runs": len(seeds),
        "methods": {},
    }
    for method in available():
        if method.key.endswith("_as_printed"):
            continue
        angles = run_float(method, logs) if method.estimator is None else run_fixed(method, logs)[0]
        # whole periods: the last sample is the first of the next one
        error = score(angles, logs)[: round(E1.seconds * LOOP_HZ), :, 2]
        s = spectrum(error, LOOP_HZ)
        low = s.frequency <= SHOWN_HZ
        lines = np.stack([line_amplitude(s, n * LINE_HZ) for n in range(1, 7)])
        at_lines = np.square(lines).sum(axis=0) / np.square(s.amplitude).sum(axis=0)
        out["frequency_hz"] = _plain(s.frequency[low], 6)
        variance, slow = np.square(error.std(axis=0)), share(s, 0.0, SLOW_HZ)
        out["methods"][method.key] = {
            "title": method.title,
            "amplitude_deg": _plain(s.amplitude[low, 0], 6),
            **{
                name: _spread(x)
                for name, x in (
                    ("sd_deg", np.sqrt(variance)),
                    ("energy_below_slow", slow),
                    ("slow_deg", np.sqrt(variance * slow)),
                    ("energy_in_lines", at_lines),
                    ("line_deg", lines[0]),
                )
            },
        }
    return out


def _spread(x: FloatArray) -> dict[str, float]:
    """Scalars of each run (runs,): the first, which is shown, and the spread."""
    p05, median, p95 = np.percentile(x, (5, 50, 95))
    return {
        "shown": round(float(x[0]), 5),
        "p05": round(float(p05), 5),
        "median": round(float(median), 5),
        "p95": round(float(p95), 5),
    }


def _kinematics(say: Say) -> list[dict[str, Any]]:
    """Eq. (3) as printed against the consistent set, without any noise, in fixed point."""
    say("eq. (3) as printed, without noise")
    methods = {m.key: m for m in available()}
    out = []
    for text, rate, kp, ki in (
        ("gyro integrated", LOOP_HZ, (0.0,) * 3, (0.0,) * 3),
        ("gyro integrated", 100.0, (0.0,) * 3, (0.0,) * 3),
        ("filter, gains per sample", LOOP_HZ, paper.KP, paper.KI),
        ("filter, gains per second", 100.0, paper.KP, paper.KI),
    ):
        log = noise_free_log(E2, rate)
        per_second = rate != LOOP_HZ  # gains per second: as they are
        params = gains_per_s(kp, ki, 1.0 if per_second else rate)
        row: dict[str, Any] = {"what": text, "rate_hz": rate, "filter": any(kp)}
        for key in ("complementary", "complementary_as_printed"):
            angles, _ = run_fixed(methods[key], [log], params=params)
            error = score(angles, [log])[:, 0]
            row[key] = {
                "sd": _plain(error.std(axis=0), 6),
                "max": _plain(np.abs(error).max(axis=0), 6),
            }
        out.append(row)
    return out


def _timing(say: Say) -> list[dict[str, Any]]:
    """Cycles of the cores, from their schedules."""
    say("schedules of the cores")
    out = []
    for key, row in (
        ("complementary", "complementary"),
        ("ekf_quaternion", "kalman"),
        ("ekf_quaternion_vector", "kalman"),
    ):
        if key not in ESTIMATORS:
            continue
        estimator = ESTIMATORS[key]()
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
                    "paper_row": row,
                    "paper_us": paper.TIME_US[row],
                    "speedup": round(paper.CYCLES[row] / cycles, 1),
                }
            )
    return out


def _calibration(seed: int, repetitions: int = 10, sight_deg: float = 0.5) -> dict[str, Any]:
    """Section 2.2 once: a mounting of a few degrees found from noisy sights of the axes."""
    rng = np.random.default_rng(np.random.SeedSequence([seed, 22]))
    mounting = misalignment(rng, np.radians(3.0))
    sights = mounting + np.radians(sight_deg) * rng.standard_normal((repetitions, 3, 3))
    rows = []
    for n in (1, repetitions):
        t = triad_matrix(sights[:n], np.eye(3))
        t_0 = nearest_rotation(t)
        left = quaternion_to_rotation_vector(matrix_to_quaternion(t_0 @ mounting.T))
        rows.append(
            {
                "repetitions": n,
                "orthogonality_t": orthogonality_error(t),
                "orthogonality_t0": orthogonality_error(t_0),
                "left_deg": float(np.degrees(np.linalg.norm(left))),
            }
        )
    return {"sight_deg": sight_deg, "rows": rows}


def _claims(methods: Sequence[Method], log: Record, say: Say) -> list[dict[str, Any]]:
    """What must hold whatever the numbers are: C equals the integer interpreter."""
    out, done = [], set()
    for method in methods:
        if method.estimator is None or method.estimator in done or method.key.startswith("gyro"):
            continue
        done.add(method.estimator)
        say(f"C against the integer interpreter: {method.estimator}")
        wrong, total = count_mismatches(method, log)
        out.append(
            {
                "claim": f"{method.estimator}: C equals the integer interpreter, bit by bit",
                "mismatches": wrong,
                "updates": total,
                "good": wrong == 0 and total > 0,
            }
        )
    return out


def _table_1(log: Record) -> list[dict[str, Any]]:
    """Table 1 and what the simulated stages do; Euler angles differ from stage angles."""
    euler = truth_deg(log)
    rows, end = [], 0.0
    for row, swing, stage in zip(paper.TABLE_1, E2.swings, np.degrees(E2.ends), strict=True):
        end += swing.seconds
        k = min(LEAD + round(end * LOOP_HZ), len(log) - 1)
        rows.append(
            {**row, "end_s": end, "ours_deg": _plain(stage, 6), "euler_deg": _plain(euler[k], 3)}
        )
    return rows


def _sensor_model() -> dict[str, Any]:
    return {
        "loop_hz": LOOP_HZ,
        "acc_averaged": AVERAGED,
        "field_ut": list(FIELD_UT),
        "lead_samples": LEAD,
        "facts": facts_json(),
        "cases": {k: c.to_json() for k, c in CASES.items()},
        "open": [{"what": a, "taken": b} for a, b in paper.OPEN],
    }


def _differences(errors: Mapping[str, FloatArray]) -> dict[str, Any]:
    """The complementary filter less each Kalman filter, by case and filter."""
    out = {}
    for key in (f"{case}/{name}" for name in KALMAN for case in ("C", "noise")):
        if key in errors:
            d = errors[f"{key.partition('/')[0]}/complementary"] - errors[key]
            out[key] = _row(d) | {"p95_abs": _summary(np.percentile(np.abs(d), 95, axis=0))}
    return out


def _figures(first: Record, errors: Mapping[str, FloatArray], shown: int) -> dict[str, Any]:
    """Curves of the run that is shown, case C."""
    t = first.values("t", "s")[LEAD:]
    keys = ("complementary", "complementary_as_printed", *KALMAN)
    return {
        "time_s": _plain(t, 3),
        "stages_deg": _plain(np.degrees(E2.stages(t)[0]), 3),
        "truth_deg": _plain(truth_deg(first)[LEAD:], 3),
        "error_deg": {
            key: _plain(errors[f"C/{key}"][:, shown], 4) for key in keys if f"C/{key}" in errors
        },
    }


def run(*, seed: int = 1, runs: int = RUNS, progress: Say | None = None) -> dict[str, Any]:
    """Run the experiment.

    Parameters
    ----------
    seed : int, 0 or more
        Of the first run; run k has ``seed + k``. The figures show the run in the middle: the one
        whose complementary heading error has the median standard deviation in case C.
    runs : int, 2 or more
        Runs of each case that is judged.

    Returns
    -------
    dict
        Plain data; see `docs/experiments.md`. ``good`` is False if an internal claim broke;
        targets that are missed do not count there.

    Raises
    ------
    InputError
        A seed or a number of runs out of its range.
    """
    if not isinstance(seed, int) or not 0 <= seed <= 2**31:
        raise InputError.at(
            "seed",
            wanted="an integer of 0 to 2^31",
            found=repr(seed),
            fix="choose one inside the range",
        )
    if not isinstance(runs, int) or not 2 <= runs <= 1000:
        raise InputError.at("runs", wanted="2 to 1000", found=repr(runs), fix="give another number")
    say = progress or (lambda text: None)
    start = time.perf_counter()
    seeds = [seed + k for k in range(runs)]
    rows, errors = _stacked(seeds, say)
    heading = errors["C/complementary"][:, :, 2].std(axis=0)
    shown = int(np.argsort(heading)[(runs - 1) // 2])  # the run in the middle
    first = make_log(E2, CASES["C"], seeds[shown])
    others = [s for s in seeds if s != seeds[shown]][: HEADING_RUNS - 1]
    spectra = _heading_test([seeds[shown], *others], say)
    kinematics = _kinematics(say)
    claims = _claims(available(), first, say)
    timing = _timing(say)
    data = {
        "experiment": "ma2014",
        "title": "Magnetometer-aided MEMS attitude: Ma Long, Zhang Rui, Su Zhigang (2014)",
        "seed": seed,
        "runs": runs,
        "shown_seed": seeds[shown],
        "side_runs": min(runs, SIDE_RUNS),
        "command": f"boresight experiment ma2014 --seed {seed}",
        "sensor_model": _sensor_model(),
        "table_1": _table_1(first),
        "table_2": {
            "gyro_bias_rad_s": TABLE_2.gyro_bias,
            "gyro_var": TABLE_2.gyro,
            "acc_var": TABLE_2.accelerometer,
            "mag_var_g2": TABLE_2.magnetometer_g,
        },
        "table_3": {
            "paper": {k: list(v) for k, v in paper.TABLE_3.items()},
            "cases": rows,
            "in_band": {case: entries_in_band(rows[case]) for case in JUDGED},
        },
        "table_4": {"kp": paper.KP, "ki": paper.KI, "parameters": gains_per_s()},
        "kalman_parameters": {k: kalman_parameters(k) for k in KALMAN if k in ESTIMATORS},
        "spectra": spectra,
        "figures": _figures(first, errors, shown),
        "difference": _differences(errors),
        "kinematics": kinematics,
        "calibration": _calibration(seed),
        "timing": timing,
        "paper_us": paper.TIME_US,
        "claims": claims,
        "good": all(claim["good"] for claim in claims),
    }
    data["targets"] = targets(data)
    data["seconds"] = round(time.perf_counter() - start, 1)
    return data
