"""The experiment of Ma Long et al. (2014) in simulation: its tables, its figures, its page.

A standard deviation over many runs is pooled, the root of the mean variance: variances add, and for
a random walk the pooled value has a closed form, which a single run is far from. Largest values and
lines of spectra are medians of the runs.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.attitude import ESTIMATORS
from boresight.model.attitude.complementary import Complementary
from boresight.model.attitude.ekf_quaternion import EkfQuaternion
from boresight.model.attitude.front import board_params
from boresight.model.attitude.ma2014 import Ma2014Cf
from boresight.model.declarations import GRAVITY
from boresight.model.estimator import Estimator
from boresight.sim.attitude.ma2014 import world
from boresight.sim.experiments.experiment import Experiment, ExperimentResult
from boresight.sim.experiments.forms import run_forms, schedules_of
from boresight.sim.experiments.seeds import Runs, figures_of, run_cases, spreads_of
from boresight.sim.experiments.targets import render, targets_of
from boresight.sim.levels.build import Run
from boresight.sim.plotting import Section
from boresight.sim.records.feed import feed
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Record
from boresight.sim.rotations.rotation import quaternion_to_euler
from boresight.sim.rotations.zyx import wrapped


class Method(NamedTuple):
    """One row of Table 3: an estimator with these parameters."""

    key: str
    title: str
    estimator: Estimator
    params: Mapping[str, float]


def gains(
    kp: Sequence[float] = world.KP, ki: Sequence[float] = world.KI, rate_hz: float | None = None
) -> dict[str, float]:
    """Parameters of `ma2014_cf`; with a rate those of `complementary`, whose gains are per s."""
    kp_unit, ki_unit = ("", "") if rate_hz is None else ("_per_s", "_per_s2")
    rate = rate_hz or 1.0
    return {
        **{f"kp_{axis}{kp_unit}": k * rate for axis, k in zip(world.AXES, kp, strict=True)},
        **{f"ki_{axis}{ki_unit}": k * rate * rate for axis, k in zip(world.AXES, ki, strict=True)},
    }


def kalman_parameters() -> dict[str, float]:
    """Table 2 in the parameters of `ekf_quaternion`.

    Noise of the angles at rest, level and at heading 0::

        pitch  sd(f_y) / g        roll  sd(f_x) / g
        heading^2 = (sd(m_x) / m_h)^2 + (roll m_z / m_h)^2
    """
    acc = [math.sqrt(v / world.AVERAGED) for v in world.ACC_VARIANCE]
    level = math.hypot(world.FIELD_UT[0], world.FIELD_UT[1])
    pitch, roll = acc[1] / GRAVITY, acc[0] / GRAVITY
    heading = math.hypot(math.sqrt(world.MAG_VARIANCE[0]), roll * world.FIELD_UT[2]) / level
    values = {"scale": 64.0, "p0_sd": 0.01}
    for axis, variance, angle in zip(
        "xyz", world.GYRO_VARIANCE, (pitch, roll, heading), strict=True
    ):
        values |= {f"gyro_sd_{axis}": math.sqrt(variance), f"angle_sd_{axis}": angle}
    return values


def _kalman_of_table_4() -> dict[str, float]:
    """Noises whose steady gains are those of Table 4, all measured angles with 0.2 deg.

    Of a scalar filter with gain K: q = r K^2 / (1 - K), in the angle that the gyro adds in a step.
    """
    values = kalman_parameters()
    angle = math.radians(0.2)
    for axis, k in zip("xyz", world.KP, strict=True):
        values[f"angle_sd_{axis}"] = angle
        values[f"gyro_sd_{axis}"] = angle * k / math.sqrt(1.0 - k) * world.LOOP_HZ
    return values


_NO_GAIN, _FULL_GAIN = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
_GYRO, _FIELD_FORCE = gains(_NO_GAIN, _NO_GAIN), gains(_FULL_GAIN, _NO_GAIN)
_TABLE_2, _TABLE_4, _PER_S = kalman_parameters(), _kalman_of_table_4(), gains(rate_hz=world.LOOP_HZ)
_PRINTED = Ma2014Cf(as_printed=True)
METHODS = (
    Method("gyro", "gyro alone", Ma2014Cf(), _GYRO),
    Method("mag_acc", "magnetometer and accelerometer alone", Ma2014Cf(), _FIELD_FORCE),
    Method("ekf_quaternion", "Kalman filter, noises of Table 2", EkfQuaternion(), _TABLE_2),
    Method("ekf_table_4", "Kalman filter, steady gains of Table 4", EkfQuaternion(), _TABLE_4),
    Method("ma2014_cf", "the paper's complementary filter", Ma2014Cf(), gains()),
    Method("complementary", "the improved complementary filter", Complementary(), _PER_S),
    Method("ma2014_cf_as_printed", "the paper's filter, eq. (3) as printed", _PRINTED, gains()),
    Method("gyro_as_printed", "gyro alone, eq. (3) as printed", _PRINTED, _GYRO),
)


def run_method(
    method: Method,
    logs: Sequence[Record],
    levels: Sequence[str] = ("float", "c"),
    params: Mapping[str, float] | None = None,
) -> list[tuple[FloatArray, int]]:
    """Angles [deg] of every log (steps, runs, 3) on each level, and the saturated updates.

    Parameters are the method's, or others.
    """
    return [
        (
            180.0
            * np.stack([np.column_stack([r.outputs[n] for n in world.AXES]) for r in runs], axis=1),
            sum(run.n_saturated for run in runs),
        )
        for runs in _runs(method, logs, levels, params)
    ]


def _runs(
    method: Method,
    logs: Sequence[Record],
    levels: Sequence[str],
    params: Mapping[str, float] | None = None,
) -> list[list[Run]]:
    """Runs of each level over every log."""
    estimator = method.estimator
    records = [feed(estimator, log).inputs for log in logs]
    params = {**board_params(estimator.params), **(method.params if params is None else params)}
    return run_forms(estimator, records, params=params, levels=levels)


def count_mismatches(method: Method, log: Record) -> int:
    """Updates in which C and the integer interpreter differ; one more if that stopped."""
    (expected,), (run,) = _runs(method, [log], ("fixed", "c"))
    assert run.words is not None and run.saturated is not None
    mismatches = (run.words != expected.words).any(axis=1) | (run.saturated != expected.saturated)
    return int(mismatches.sum()) + bool(expected.fault or not len(mismatches))


def score(angles: FloatArray, logs: Sequence[Record]) -> FloatArray:
    """Error [deg] of the samples from t = 0 on: (steps - LEAD, runs, 3)."""
    truth = [np.degrees(quaternion_to_euler(NineAxis.of(log).attitude)) for log in logs]
    return wrapped(angles - np.stack(truth, axis=1), 360.0)[world.LEAD :]


#: Section 3.2 with two sets of errors, and section 1.3, the heading test, with those of case C.
CASES = ("noise", "C", "heading")
_KALMAN = ("ekf_quaternion", "ekf_table_4")
#: Heading test [Hz]: its frequency, and below which the paper's gyro error lies.
_LINE_HZ, _SLOW_HZ = 1.0 / 6.0, 0.02
_INTRO = (
    "Ma Long, Zhang Rui, Su Zhigang (2014): magnetometer-aided attitude of MEMS sensors. Its two "
    "tests are repeated in simulation with the sensors of its Table 2: a heading that swings, and "
    "the stage of Table 1. Its filters run as the integer C of the core.",
    "{runs} runs, seeds {seed} to {last}: boresight experiment ma2014 --seed {seed}. Standard "
    "deviations are pooled over the runs; all else are medians.",
)


class Ma2014(Experiment):
    """Magnetometer-aided MEMS attitude: Ma Long, Zhang Rui, Su Zhigang (2014)."""

    pages = ("ma2014.html",)

    def run(self, *, seed: int, runs: int, say: Callable[[str], None]) -> ExperimentResult:
        """See `Experiment`: of the paper's targets only Figure 7 is binding, at equal gains."""
        cases = [(name, name, runs) for name in CASES]
        outcomes = run_cases(run_case, cases, seed=seed, at_once=25, jobs=self.jobs, say=say)
        say("kinematics, equality of C and integer interpreter, schedules")
        figures = figures_of(outcomes) | _noise_free() | _differing(seed) | _timing()
        for name in ("gyro", "mag_acc"):
            part = "slow" if name == "gyro" else "line"
            key = f"{part}_heading_median"
            over = figures[f"heading_ma2014_cf_{key}"] / figures[f"heading_{name}_{key}"]
            figures[f"heading_{part}_over_{name}"] = over
        judged = targets_of(
            "boresight.sim.attitude.ma2014", figures, spreads_of(outcomes), runs=runs
        )
        intro = [text.format(runs=runs, seed=seed, last=seed + runs - 1) for text in _INTRO]
        page = render("ma2014", intro, judged, _sections(figures))
        return ExperimentResult(figures=figures, targets=judged, pages={"ma2014.html": page})


def run_case(name: str, seeds: range) -> Runs:
    """Errors [deg] of every method, by ``METHOD_FIGURE_AXIS_POOLING``."""
    if name == "heading":
        return _heading_test(seeds)
    logs = [world.make_log(world.E2, name, seed) for seed in seeds]
    figures: dict[str, FloatArray] = {}
    errors = {}
    for method in METHODS:
        floating, fixed = run_method(method, logs)
        errors[method.key] = error = score(fixed[0], logs)
        figures |= spread(method.key, error)
        saturated = floating[1] + fixed[1]
        figures[f"{method.key}_saturated_sum"] = np.array([saturated / len(logs)] * len(logs))
        apart = wrapped(error - score(floating[0], logs), 360.0).std(axis=0)
        for k, axis in enumerate(world.AXES):
            figures[f"{method.key}_fixed_{axis}_max"] = apart[:, k]
    for key in _KALMAN:
        figures |= spread(f"less_{key}", errors["ma2014_cf"] - errors[key])
    return Runs(figures)


def spread(name: str, error: FloatArray) -> dict[str, FloatArray]:
    """Errors (steps, runs, 3): standard deviation, largest, the same without the run's mean."""
    figures = {}
    for k, axis in enumerate(world.AXES):
        e = error[..., k]
        figures[f"{name}_sd_{axis}_rms"] = e.std(axis=0)
        figures[f"{name}_most_{axis}_median"] = np.abs(e).max(axis=0)
        figures[f"{name}_moving_{axis}_median"] = np.abs(e - e.mean(axis=0)).max(axis=0)
    return figures


def _heading_test(seeds: range) -> Runs:
    """Section 1.3: spectra of the heading error [deg], in whole periods."""
    logs = [world.make_log(world.E1, "C", seed) for seed in seeds]
    figures = {}
    for method in METHODS:
        if not method.key.endswith("_as_printed"):
            ((angles, _),) = run_method(method, logs, ("c",))
            error = score(angles, logs)[: round(world.E1.seconds * world.LOOP_HZ), :, 2]
            slow, line = slow_and_line(error)
            figures[f"{method.key}_share_heading_median"] = slow
            figures[f"{method.key}_slow_heading_median"] = error.std(axis=0) * np.sqrt(slow)
            figures[f"{method.key}_line_heading_median"] = line
    return Runs(figures)


def slow_and_line(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Share of the energy of signals (n, ...) below 0.02 Hz, 0 to 1; amplitude at 1/6 Hz.

    At the loop's rate, without the mean. Amplitudes are one-sided: a sine of amplitude A that fits
    whole periods into the record stands as one line of height A.
    """
    n = len(x)
    lines = np.fft.rfft(x - x.mean(axis=0), axis=0)[: (n + 1) // 2]
    frequency, amplitude = np.arange(len(lines)) * world.LOOP_HZ / n, 2.0 * np.abs(lines) / n
    energy = np.square(amplitude)
    slow = energy[frequency < _SLOW_HZ].sum(axis=0) / energy.sum(axis=0)
    return slow, amplitude[np.abs(frequency - _LINE_HZ).argmin()]


def _noise_free() -> dict[str, float]:
    """Eq. (3) as printed against the consistent set, without any noise, in fixed point."""
    out: dict[str, float] = {}
    for name, rate, of_sample in (
        ("gyro_8", world.LOOP_HZ, 0.0),
        ("gyro_100", 100.0, 0.0),
        ("filter_8", world.LOOP_HZ, 1.0),
        ("filter_100", 100.0, 1.0 / 100.0),  # gains per second
    ):
        log = world.noise_free_log(world.E2, rate)
        ki = [k * of_sample * of_sample for k in world.KI]
        params = gains([k * of_sample for k in world.KP], ki)
        for method in METHODS:
            if method.key in ("ma2014_cf", "ma2014_cf_as_printed"):
                ((angles, _),) = run_method(method, [log], ("c",), params)
                sd = score(angles, [log])[:, 0].std(axis=0)
                out |= {
                    f"{name}_{method.key}_{a}": float(v)
                    for a, v in zip(world.AXES, sd, strict=True)
                }
    return out


def _differing(seed: int) -> dict[str, float]:
    """Updates in which C differs from the integer interpreter, of each estimator."""
    log = world.make_log(world.E2, "C", seed)
    ours = [m for m in METHODS if m.key == m.estimator.name]
    return {f"{m.key}_differing": float(count_mismatches(m, log)) for m in ours}


def _timing() -> dict[str, float]:
    """Cycles to the attitude and microseconds at 100 MHz, from the schedules."""
    out = {}
    for key in ("ma2014_cf", "ekf_quaternion", "complementary"):
        for config, (schedule,) in schedules_of(ESTIMATORS[key]()).items():
            out[f"{key}_{config}_cycles"] = float(schedule.latency)
            out[f"{key}_{config}_us"] = schedule.latency / world.CLOCK_MHZ
    return out


def _sections(figures: dict[str, float]) -> list[Section]:
    """Table 3."""
    judged = [(case, axis) for case in ("noise", "C") for axis in world.AXES]
    return [
        Section(
            title="Table 3: standard deviations",
            columns=("", *(f"{axis}, {case}, deg" for case, axis in judged)),
            rows=[
                (m.title, *(figures[f"{case}_{m.key}_sd_{axis}_rms"] for case, axis in judged))
                for m in METHODS
            ],
        )
    ]
