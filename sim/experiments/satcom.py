"""Figures of the satcom tracker: drives in closed loop with the integer C, many draws at once."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.firmware.build import CModel
from boresight.model.estimator import Estimator, input_words, with_params
from boresight.model.estimators.satcom import Satcom
from boresight.sim.worlds.satcom import Fleet
from boresight.sim.worlds.satcom_drive import RATE_HZ, drive

__all__ = ["CASES", "Case", "Flight", "figures", "fly"]

FloatArray = npt.NDArray[np.float64]

SETTLED = round(30.0 * RATE_HZ)  #: records before which nothing is judged.
#: Specified, and what a float prototype measured with four draws: roll, pitch, heading rms [deg].
PROTOTYPE = {
    "adaptive": (0.050, 0.031, 0.052),
    "fixed_r": (6.6, 16.0, 1.8),
    "no_tracking": (None, None, 7.6),
    "printed_roll": (5.7, None, None),
}


@dataclass(frozen=True)
class Case:
    """One configuration of the experiment."""

    meaning: str
    drive: str = "specification"
    params: Mapping[str, float] = field(default_factory=dict)
    options: Mapping[str, str] = field(default_factory=dict)
    world: Mapping[str, Any] = field(default_factory=dict)


_PI = {"beam": "heading_pi"}
CASES = {
    "adaptive": Case("adaptive R, tracking at 5 Hz"),
    "fixed_r": Case("R fixed", params={"adapt": 1.0}),
    "no_tracking": Case("receiver off", world={"tracking_hz": 0.0}),
    "tracking_1hz": Case("tracking at 1 Hz", world={"tracking_hz": 1.0}),
    "tracking_20hz": Case("tracking at 16.7 Hz, every third record", world={"tracking_hz": 17.0}),
    "pi_alone": Case("antenna on the heading of the loop alone", world=_PI),
    "pi_slow": Case("the same, cut-off 0.1 rad/s", params={"cutoff": 0.1}, world=_PI),
    "pi_fast": Case("the same, cut-off 2 rad/s", params={"cutoff": 2.0}, world=_PI),
    "pi_1hz": Case("the same, tracking at 1 Hz", world={**_PI, "tracking_hz": 1.0}),
    "printed_roll": Case("roll as printed", options={"roll": "printed"}),
    "printed_detector": Case("detector as printed", options={"detector": "printed"}),
    "city": Case("half an hour: tunnels, bridges, bumps", drive="city"),
}


@dataclass(frozen=True, eq=False)
class Flight:
    """What a fleet did.

    Attributes
    ----------
    error : float64 (n, runs, 4)
        Roll, pitch, heading, heading of the loop, less truth [deg].
    bias : float64 (n, runs, 3)
        Estimated gyro bias [deg/s].
    status : int64 (n, runs)
    loss_db : float64 (n, runs)
        Of the beam off the satellite.
    saturated : int
        Updates with a word beyond its range.
    """

    error: FloatArray
    bias: FloatArray
    status: npt.NDArray[np.int64]
    loss_db: FloatArray
    saturated: int


def fly(fleet: Fleet, estimator: Estimator, params: Mapping[str, float] | None = None) -> Flight:
    """Close the loop of a fleet and the integer C, record by record."""
    program = with_params(estimator.compile(), estimator, params)
    models = [CModel(program) for _ in fleet.seeds]
    fleet.start()
    formats = [program.format(number) for number in program.outputs]
    names = list(program.output_names)
    outputs: dict[str, FloatArray] | None = None
    rows: list[FloatArray] = []
    saturated = 0
    while (given := fleet.record(outputs)) is not None:
        tracked = ~np.isnan(given["e_psi"])
        given |= {"e_psi": np.nan_to_num(given["e_psi"]), "tracking": tracked.astype(float)}
        words = input_words(program, np.stack([given[i.name] for i in estimator.inputs]))
        found = [m.update(words[None, :, k]) for k, m in enumerate(models)]
        saturated += sum(int(s[0]) for _, s in found)
        row = np.stack(
            [f.real(w) for f, w in zip(formats, np.stack([w[0] for w, _ in found]).T, strict=True)]
        )
        outputs = dict(zip(names, row, strict=True))
        rows.append(row)
    table = np.stack(rows)
    place = {name: k for k, name in enumerate(names)}

    def of(*wanted: str) -> FloatArray:
        return np.stack([table[:, place[name]] for name in wanted], axis=2)

    angles = of("roll", "pitch", "heading", "heading_pi")
    euler = fleet.drive.euler / math.pi
    truth = np.stack([*euler[:, :2].T, *2 * [fleet.heading / math.pi]], axis=1)
    error = 180.0 * ((angles - truth[:, None] + 1.0) % 2.0 - 1.0)
    status = np.rint(table[:, place["status"]]).astype(np.int64)
    bias = np.degrees(of("bias_x", "bias_y", "bias_z"))
    return Flight(error, bias, status, np.stack(fleet.losses_db), saturated)


def figures(name: str, seeds: Sequence[int]) -> dict[str, Any]:
    """Figures of one of `CASES`, over all draws, after half a minute."""
    case = CASES[name]
    fleet = Fleet(drive(case.drive), seeds, **case.world)
    flight = fly(fleet, Satcom(**case.options), case.params)
    error = flight.error[SETTLED:]
    rms = np.sqrt(np.mean(error**2, axis=(0, 1)))
    moving, found = fleet.drive.accelerated[SETTLED:], (flight.status[SETTLED:] & 1) != 0
    loss = flight.loss_db[SETTLED:]
    return {
        "case": name,
        "meaning": case.meaning,
        "runs": len(seeds),
        **dict(
            zip(("roll_deg", "pitch_deg", "heading_deg", "loop_deg"), rms.tolist(), strict=True)
        ),
        "max_deg": np.abs(error).max(axis=(0, 1)).tolist(),
        "bias_deg_s": flight.bias[-1].mean(axis=0).tolist(),
        "bias_error_deg_s": float(np.abs(flight.bias[-1] - np.degrees(fleet.bias[-1])).max()),
        "hit_rate": float(found[moving].mean()),
        "false_rate": float(found[~moving].mean()),
        "tracked": float(((flight.status[SETTLED:] & 6) == 0).mean()),
        "loss_db_99": float(np.quantile(loss, 0.99)),
        "loss_db_max": float(loss.max()),
        "saturated": flight.saturated,
    }
