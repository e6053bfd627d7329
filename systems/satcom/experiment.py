"""The satcom tracker: the patent's claims, variations of their assumptions, and all figures."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.declarations import GRAVITY
from boresight.sim.compare.difference import differences
from boresight.sim.experiments.cases import Case, CasesExperiment
from boresight.sim.experiments.forms import run_forms
from boresight.sim.experiments.seeds import Runs
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.rotations.zyx import wrapped
from boresight.sim.worlds.loop import Loop, close_loop
from boresight.systems.satcom.estimator import INNOVATIONS
from boresight.systems.satcom.estimator import Satcom as Filter
from boresight.systems.satcom.world import OnTheMove, SensorErrors

SETTLED_S = 30.0  #: time before which nothing is judged.
ANGLES = ("roll", "pitch", "heading")
BIASES = tuple(f"bias_{axis}" for axis in "xyz")
_DEG = 0.017453292519943295
_PI = {"beam": "heading_pi"}
#: The heading measured by each tracking sample alone, with the receiver's noise; R as it is.
_DECLARED = {
    **{"cutoff": 0.625, "damping": 4.0, "heading_sd": 0.2 * _DEG},
    **{"roll_sd": 0.05 / GRAVITY, "pitch_sd": 0.05 / GRAVITY},
}


CASES = {
    "adaptive": Case("adaptive R, tracking at 5 Hz"),
    "fixed_r": Case("R fixed", params={"adapt": 1.0}),
    "no_tracking": Case("receiver off", {"tracking_hz": 0.0}),
    "tracking_1hz": Case("tracking at 1 Hz", {"tracking_hz": 1.0}),
    "tracking_20hz": Case("tracking at 20 Hz", {"tracking_hz": 20.0}),
    "pi_alone": Case("antenna on the heading of the PI loop alone", _PI),
    "pi_slow": Case("PI loop alone, cut-off 0.1 rad/s", _PI, {"cutoff": 0.1}),
    "pi_fast": Case("PI loop alone, cut-off 2 rad/s", _PI, {"cutoff": 2.0}),
    "pi_1hz": Case("PI loop alone, tracking at 1 Hz", {**_PI, "tracking_hz": 1.0}),
    "printed_roll": Case("roll as printed, -atan(fy/fz)", options={"roll": "printed"}),
    "printed_detector": Case("detector as printed, a_z - g", options={"detector": "printed"}),
    "declared": Case("each tracking sample a heading, R as the noise is", params=_DECLARED),
    "city": Case("half an hour: tunnels, bridges, roundabouts, bumps", {"on": "city"}),
    "acc_bias": Case(
        "accelerometer off by 0.18 deg", {"errors": SensorErrors(acc_bias=(0.03, -0.03, 0.03))}
    ),
    "hz_200": Case("records at 200 Hz, the same noise a sample", {"rate_hz": 200.0}),
}


class Satcom(CasesExperiment):
    """Satcom on the move: adaptive R and heading from tracking, patent CN104880189 (2015)."""

    estimator, step_s = Filter, 0.02
    cases, most_runs = CASES, {"acc_bias": 25, "hz_200": 25}
    intro = """
        Claims of patent CN104880189 (2015), and equations that it misprints as printed: the
        integer program of the core in closed loop with a 0.6 m antenna in Ku band. {runs} runs,
        seeds {seed} to {last}, at most 25 of the last two cases; figures after half a minute.
        The prototype, in float, had ideal tracking errors of 0.2 deg.
    """
    columns = {
        **{f"{a}, deg": f"{a}_rms" for a in ANGLES},
        **{"PI loop, deg": "loop_rms", "bias, worst, deg/s": "bias_error_max"},
        **{"hits": "hit_rate", "false alarms": "false_rate", "loss 99 %, dB": "loss_db_99_max"},
        "fixed less float, most, deg": "fixed_float_max",
        "other decisions": "status_differs_sum",
    }
    shown = ("adaptive", "fixed_r", "no_tracking", "city")
    shown_text = "Error of roll, pitch and heading, error of the gyro bias, loss of the beam."

    def run_case(self, name: str, seeds: range) -> Runs:
        """Fly a case; figures after half a minute, in degrees and degrees per second."""
        case = self.cases[name]
        vehicles = OnTheMove(seeds=seeds, **case.world)
        build = Build(Filter(**case.options), params=[case.params])
        keep = (*ANGLES, "heading_pi", *BIASES, "status")
        loops = close_loop(vehicles, make_level("c", build, runs=vehicles.runs), keep=keep)
        assert loops.run.saturated is not None
        start = round(SETTLED_S * vehicles.drive.ride.rate_hz)
        out, truth = loops.outputs, vehicles.drive.ride.euler / math.pi
        truth = np.stack([*truth[:, :2].T, *2 * [vehicles.heading / math.pi]], axis=1)
        angles = np.stack([out[n] for n in (*ANGLES, "heading_pi")], axis=2)
        error = 180.0 * wrapped(angles - truth[:, None], 2.0)
        bias = np.degrees(np.stack([out[n] for n in BIASES], axis=2))
        off, loss = bias - np.degrees(vehicles.bias), np.stack(vehicles.losses_db)
        settled, moving = error[start:], vehicles.drive.accelerated[start:]
        status = np.rint(out["status"]).astype(int)[start:]
        rms, largest = np.sqrt(np.mean(settled**2, axis=0)), np.abs(settled).max(axis=0)
        figures = {f"{n}_end": bias[-1, :, k] for k, n in enumerate(BIASES)}
        for k, n in enumerate((*ANGLES, "loop")):
            figures |= {f"{n}_rms": rms[:, k], f"{n}_max": largest[:, k]}
        figures |= {
            "worst_rms": rms[:, :3].max(axis=1),
            "bias_error_max": np.abs(off[-1]).max(axis=1),
            "hit_rate": (status & 1)[moving].mean(axis=0),
            "false_rate": (status & 1)[~moving].mean(axis=0),
            "loss_db_99_max": np.quantile(loss[start:], 0.99, axis=0),
            "saturated_sum": loops.run.saturated.sum(axis=0).astype(float),
        }
        filter = Filter(**case.options, innovations=True)
        (floats,) = run_forms(
            filter, loops.inputs.swapaxes(0, 1), params=case.params, levels=("float",)
        )
        runs = [_float_errors(loops, k, run.outputs, start) for k, run in enumerate(floats)]
        figures |= {n: np.array([run[n] for run in runs]) for n in runs[0]}
        panels = {
            "error, deg": dict(zip(ANGLES, error[:, 0].T, strict=False)),
            "bias, deg/s": dict(zip("xyz", off[:, 0].T, strict=True)),
            "loss, dB": {"": loss[:, 0]},
        }
        return Runs(figures, panels)


def _float_errors(
    loops: Loop, run: int, reference: Mapping[str, FloatArray], start: int
) -> dict[str, float]:
    """Float64 on the records of a run: how far it is, and whether Q and R fit its innovations.

    Innovations over the root of their variance are white, of variance one, where the filter's model
    is the truth (Bar-Shalom, Li, Kirubarajan 2001, section 5.4): ``nis``, the mean square, is one,
    ``rho``, the correlation of successive ones, zero.
    """
    outputs = {n: values[:, run] for n, values in loops.outputs.items()}
    judged = {n: reference[n] for n in (*ANGLES, "status")}
    *angles, words = differences(Filter.outputs, outputs, judged)
    error, status = 180.0 * np.stack([d.apart for d in angles]), reference["status"].astype(int)
    assert words.decided is not None
    figures = {
        "fixed_float_max": float(error.max()),
        "fixed_float_rms": float(np.sqrt(np.mean(error**2, axis=1)).max()),
        "agreed_max": 180.0 * max(d.largest for d in angles),
        "status_differs_sum": float(words.decided.differing),
        "status_share": words.decided.differing / words.decided.of,
    }
    measured = [(status[start:] & 1) == 0] * 2 + [(status[start:] & 6) == 0]
    for axis, output, valid in zip(ANGLES, INNOVATIONS, measured, strict=True):
        nu = reference[output.name][start:]
        if axis == "heading":  # a tracking sample is now and then: successive are those that came
            nu, valid = nu[valid], valid[valid]
        both = valid[1:] & valid[:-1]
        square = nu[valid] ** 2
        successive = nu[1:][both] * nu[:-1][both]
        figures[f"nis_{axis}"] = float(square.sum()) / max(len(square), 1)
        covariance = float(successive.sum()) / max(len(successive), 1)
        figures[f"rho_{axis}"] = covariance / (figures[f"nis_{axis}"] or 1.0)
    return figures
