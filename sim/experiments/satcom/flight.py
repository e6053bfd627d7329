"""A fleet of vehicles in closed loop with the integer C, many draws at once."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from boresight.firmware.build import CModel
from boresight.model.estimator import Estimator, input_words, with_params
from boresight.sim.worlds.satcom import Fleet

__all__ = ["Flight", "fly"]

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Flight:
    """What a fleet did.

    Errors of roll, pitch, heading and of the loop's heading (n, runs, 4) [deg]; estimated gyro bias
    (n, runs, 3) [deg/s]; status and loss of the beam [dB] (n, runs); updates with a word beyond its
    range; records (n, n_inputs) and outputs (n,) of the first run.
    """

    error: FloatArray
    bias: FloatArray
    status: npt.NDArray[np.int64]
    loss_db: FloatArray
    saturated: int
    inputs: FloatArray
    first: dict[str, FloatArray]


def fly(fleet: Fleet, estimator: Estimator, params: Mapping[str, float] | None = None) -> Flight:
    """Close the loop of a fleet and the integer C, record by record."""
    program = with_params(estimator.compile(), estimator, params)
    models = [CModel(program) for _ in fleet.seeds]
    fleet.start()
    formats = [program.format(number) for number in program.outputs]
    names = list(program.output_names)
    outputs: dict[str, FloatArray] | None = None
    rows: list[FloatArray] = []
    records: list[FloatArray] = []
    saturated = 0
    while (given := fleet.record(outputs)) is not None:
        tracked = ~np.isnan(given["e_psi"])
        given |= {"e_psi": np.nan_to_num(given["e_psi"]), "tracking": tracked.astype(float)}
        record = np.stack([given[i.name] for i in estimator.inputs])
        records.append(record[:, 0])
        words = input_words(program, record).astype(np.int32)
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
    first = dict(zip(names, table[:, :, 0].T, strict=True))
    losses = np.stack(fleet.losses_db)
    return Flight(error, bias, status, losses, saturated, np.stack(records), first)
