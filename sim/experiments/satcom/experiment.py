"""The satcom tracker: what the patent claims, with the figures that it does not print."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from boresight.gateware.core import build_core
from boresight.gateware.machine import CONFIGS
from boresight.model.estimators.satcom import Satcom as Filter
from boresight.sim.experiments.experiment import Experiment, Result, Target
from boresight.sim.experiments.satcom.flight import Flight, fly
from boresight.sim.experiments.satcom.page import render
from boresight.sim.levels.build import Build
from boresight.sim.levels.floating import CompiledFloat
from boresight.sim.worlds.satcom import Fleet
from boresight.sim.worlds.satcom_drive import RATE_HZ, drive

__all__ = ["CASES", "Case", "Satcom", "case_figures"]

SETTLED = round(30.0 * RATE_HZ)  #: records before which nothing is judged.
FEW = 10  #: most runs of cases that only illustrate.
AXES = ("roll", "pitch", "heading", "loop")


@dataclass(frozen=True)
class Case:
    """One configuration; ``full``: with all runs."""

    meaning: str
    drive: str = "specification"
    params: Mapping[str, float] = field(default_factory=dict)
    options: Mapping[str, str] = field(default_factory=dict)
    world: Mapping[str, Any] = field(default_factory=dict)
    full: bool = False


_PI = {"beam": "heading_pi"}
CASES = {
    "adaptive": Case("adaptive R, tracking at 5 Hz", full=True),
    "fixed_r": Case("R fixed", params={"adapt": 1.0}, full=True),
    "no_tracking": Case("receiver off", world={"tracking_hz": 0.0}, full=True),
    "tracking_1hz": Case("tracking at 1 Hz", world={"tracking_hz": 1.0}),
    "tracking_20hz": Case("tracking at 16.7 Hz, every third record", world={"tracking_hz": 17.0}),
    "pi_alone": Case("antenna on the heading of the PI loop alone", world=_PI),
    "pi_slow": Case("the same, cut-off 0.1 rad/s", params={"cutoff": 0.1}, world=_PI),
    "pi_fast": Case("the same, cut-off 2 rad/s", params={"cutoff": 2.0}, world=_PI),
    "pi_1hz": Case("the same, tracking at 1 Hz", world={**_PI, "tracking_hz": 1.0}),
    "printed_roll": Case("roll as printed, -atan(fy/fz)", options={"roll": "printed"}),
    "printed_detector": Case("detector as printed, a_z - g", options={"detector": "printed"}),
    "city": Case("half an hour: tunnels, bridges, roundabouts, bumps", drive="city"),
}

#: Case, figure, least and greatest good value, what a float prototype measured, who asks, name.
_TARGETS: tuple[tuple[str, str, float | None, float | None, float | None, str, str], ...] = (
    *(
        ("adaptive", f"{axis}_deg", None, 0.06, prototype, "claim", f"adaptive R, tracking: {axis}")
        for axis, prototype in zip(AXES, (0.050, 0.031, 0.052), strict=False)
    ),
    ("fixed_r", "worst_deg", 1.0, None, 16.0, "[0002]", "fixed R diverges under manoeuvre"),
    ("no_tracking", "heading_deg", 1.0, None, 7.6, "[0003]", "no tracking: heading drifts"),
    ("adaptive", "bias_error_deg_s", None, 0.02, 0.001, "state 5-7", "gyro bias found, worst"),
    ("pi_alone", "loop_deg", None, 0.1, 0.066, "claim, step 3", "PI heading alone"),
    ("adaptive", "hit_rate", 0.99, None, 1.0, "step 4", "detector: hits"),
    ("adaptive", "false_rate", None, 0.01, 0.0, "step 4", "detector: false alarms"),
    ("printed_roll", "worst_deg", 1.0, None, 5.7, "claim, H1", "printed roll fails"),
    ("printed_detector", "worst_deg", 1.0, None, None, "claim, step 4", "printed detector fails"),
    ("adaptive", "loss_db_99", None, 0.5, None, "ours", "pointing loss, 99 %"),
    ("city", "loss_db_99", None, 0.5, None, "ours", "pointing loss in town, 99 %"),
    ("city", "worst_deg", None, 0.1, None, "ours", "angles in town, worst axis"),
    ("adaptive", "fixed_float_deg", None, 0.005, 0.001, "ours", "fixed less float64, most"),
    ("adaptive", "fixed_float_rms_deg", None, 0.001, 0.0002, "ours", "fixed less float64, rms"),
    ("adaptive", "saturated", None, 0.0, None, "ours", "words beyond their range"),
)


class Satcom(Experiment):
    """Satcom on the move: adaptive R and heading from tracking, patent CN104880189 (2015)."""

    pages = ("satcom.html",)

    def run(self, *, seed: int, runs: int, say: Callable[[str], None]) -> Result:
        """See `Experiment`; cases that only illustrate have at most ten runs."""
        found, shown = {}, {}
        for name, case in CASES.items():
            some = runs if case.full else min(runs, FEW)
            say(f"{name}: {case.meaning}, {some} runs")
            fleet = Fleet(drive(case.drive), range(seed, seed + some), **case.world)
            flight = fly(fleet, Filter(**case.options), case.params)
            found[name] = case_figures(case, fleet, flight)
            shown[name] = (flight.error[:, 0, :3], flight.loss_db[:, 0])
        figures = {
            f"satcom_{name}_{key}": value for name, f in found.items() for key, value in f.items()
        }
        for key in ("roll_deg", "pitch_deg", "heading_deg", "fixed_float_deg"):
            figures[f"satcom_{key}"] = found["adaptive"][key]
        figures["satcom_pointing_loss_db"] = found["adaptive"]["loss_db_99"]
        for config in CONFIGS:
            core = build_core(Filter().compile(), config)
            figures[f"satcom_interval_cycles_{config}"] = float(core.schedule.interval)
        targets = tuple(
            Target(
                name=name,
                source=source,
                value=found[case][key],
                low=low,
                high=high,
                unit="deg" if key.endswith("_deg") else "",
                beside={} if prototype is None else {"prototype": prototype},
            )
            for case, key, low, high, prototype, source, name in _TARGETS
        )
        return Result(
            figures=figures,
            targets=targets,
            details={name: case.meaning for name, case in CASES.items()},
            pages={"satcom.html": render(CASES, found, shown, targets)},
        )


def case_figures(case: Case, fleet: Fleet, flight: Flight) -> dict[str, float]:
    """Figures of a case after half a minute, over all its runs."""
    error, loss = flight.error[SETTLED:], flight.loss_db[SETTLED:]
    rms = dict(zip(AXES, np.sqrt(np.mean(error**2, axis=(0, 1))).tolist(), strict=True))
    moving, said = fleet.drive.accelerated[SETTLED:], (flight.status[SETTLED:] & 1) != 0
    build = Build(Filter(**case.options), params=[case.params])
    reference = CompiledFloat(build).run(flight.inputs).outputs
    apart = np.stack([flight.first[n] - reference[n] for n in AXES[:3]])
    apart = 180.0 * ((apart + 1.0) % 2.0 - 1.0)
    return {
        **{f"{axis}_deg": value for axis, value in rms.items()},
        "worst_deg": max(rms[axis] for axis in AXES[:3]),
        "max_deg": float(np.abs(error[:, :, :3]).max()),
        "bias_error_deg_s": float(np.abs(flight.bias[-1] - np.degrees(fleet.bias[-1])).max()),
        "hit_rate": float(said[moving].mean()),
        "false_rate": float(said[~moving].mean()),
        "tracking_used": float(((flight.status[SETTLED:] & 6) == 0).mean()),
        "loss_db_99": float(np.quantile(loss, 0.99)),
        "loss_db_max": float(loss.max()),
        "fixed_float_deg": float(np.abs(apart).max()),
        "fixed_float_rms_deg": float(np.sqrt(np.mean(apart**2, axis=1)).max()),
        "saturated": float(flight.saturated),
    }
