"""One case, flown by some vehicles in closed loop with the integer C, and its figures."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.sim.compare.difference import differences
from boresight.sim.experiments.forms import run_forms
from boresight.sim.experiments.seeds import Runs
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.rotations.zyx import wrapped
from boresight.sim.worlds.loop import Loop, close_loop
from boresight.systems.satcom import interface
from boresight.systems.satcom.cases import Case
from boresight.systems.satcom.estimator import INNOVATIONS
from boresight.systems.satcom.estimator import Satcom as Filter
from boresight.systems.satcom.innovations import Innovations, innovations
from boresight.systems.satcom.world import Vehicles

SETTLED_S = 30.0  #: time before which nothing is judged.
ANGLES = ("roll", "pitch", "heading")
BIASES = tuple(f"bias_{axis}" for axis in "xyz")


def fly(case: Case, seeds: range) -> Runs:
    """Fly a case with these seeds."""
    fleet, build = case.fleet(seeds), Build(Filter(**case.options), params=[case.params])
    level = make_level("c", build, runs=fleet.runs)
    keep = (*ANGLES, "heading_pi", *BIASES, "status")
    return figures_of(case, fleet, close_loop(fleet, level, keep=keep))


def figures_of(case: Case, fleet: Vehicles, loops: Loop) -> Runs:
    """Figures of each run after half a minute, in degrees and degrees per second.

    Shown of the first run: errors of angles and bias (n, 3), loss (n,) [dB]. Kept of each run:
    `Innovations` of roll, pitch and heading.
    """
    assert loops.run.saturated is not None
    start = round(SETTLED_S * case.rate_hz)
    out, truth = loops.outputs, fleet.drive.ride.euler / math.pi
    truth = np.stack([*truth[:, :2].T, *2 * [fleet.heading / math.pi]], axis=1)
    angles = np.stack([out[n] for n in (*ANGLES, "heading_pi")], axis=2)
    error = 180.0 * wrapped(angles - truth[:, None], 2.0)
    bias = np.degrees(np.stack([out[n] for n in BIASES], axis=2))
    off, loss = bias - np.degrees(fleet.bias), np.stack(fleet.losses_db)
    settled, moving = error[start:], fleet.drive.accelerated[start:]
    status = np.rint(out["status"]).astype(int)[start:]
    rms, largest = np.sqrt(np.mean(settled**2, axis=0)), np.abs(settled).max(axis=0)
    names = (*ANGLES, "loop")
    figures = {f"{n}_rms": rms[:, k] for k, n in enumerate(names)}
    figures |= {f"{n}_max": largest[:, k] for k, n in enumerate(names)}
    figures |= {f"{n}_end": bias[-1, :, k] for k, n in enumerate(BIASES)}
    figures |= {
        "worst_rms": rms[:, :3].max(axis=1),
        "bias_error_max": np.abs(off[-1]).max(axis=1),
        "hit_rate": (status & 1)[moving].mean(axis=0),
        "false_rate": (status & 1)[~moving].mean(axis=0),
        "tracking_used": ((status & 6) == 0).mean(axis=0),
        "loss_db_99_max": np.quantile(loss[start:], 0.99, axis=0),
        "loss_db_max": loss[start:].max(axis=0),
        "saturated_sum": loops.run.saturated.sum(axis=0).astype(float),
    }
    filter = Filter(**case.options, innovations=True)
    (floats,) = run_forms(
        filter, loops.inputs.swapaxes(0, 1), params=case.params, levels=("float",)
    )
    results, each = zip(
        *(_float_errors(loops, k, run.outputs, start) for k, run in enumerate(floats)), strict=True
    )
    figures |= {name: np.array([run[name] for run in results]) for name in results[0]}
    return Runs(figures, {"error": error[:, 0, :3], "off": off[:, 0], "loss": loss[:, 0]}, [*each])


def _float_errors(
    loops: Loop, run: int, reference: Mapping[str, FloatArray], start: int
) -> tuple[dict[str, float], list[Innovations]]:
    """Float64 on the records of a run: how far it is, and its innovations."""
    outputs = {n: values[:, run] for n, values in loops.outputs.items()}
    judged = {n: reference[n] for n in (*ANGLES, "status")}
    *angles, words = differences(interface.OUTPUTS, outputs, judged)
    error, status = 180.0 * np.stack([d.apart for d in angles]), reference["status"].astype(int)
    nu = [reference[o.name][start:] for o in INNOVATIONS]
    tilt, heading = (status[start:] & 1) == 0, (status[start:] & 6) == 0
    assert words.decided is not None
    results = [innovations(nu[0], tilt), innovations(nu[1], tilt)]
    results.append(innovations(nu[2][heading], heading[heading]))
    return {
        **{f"nis_{name}": result.nis for name, result in zip(ANGLES, results, strict=True)},
        **{
            f"rho_{name}": float(result.correlation[0])
            for name, result in zip(ANGLES, results, strict=True)
        },
        "fixed_float_max": float(error.max()),
        "fixed_float_rms": float(np.sqrt(np.mean(error**2, axis=1)).max()),
        "agreed_max": 180.0 * max(d.largest for d in angles),
        "status_differs_sum": float(words.decided.differing),
        "status_share": words.decided.share,
    }, results
