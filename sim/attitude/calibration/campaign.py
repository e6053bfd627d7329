"""Is every register recovered within its uncertainty, and what does the attitude gain?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.attitude.front import FRONT
from boresight.model.attitude.front.affine import AXES
from boresight.model.attitude.mekf import Mekf
from boresight.sim.accuracy.figures import attitude_errors
from boresight.sim.attitude.calibration.files import calibrated
from boresight.sim.attitude.calibration.world import FIELD_UT, Device, calibration_records, device
from boresight.sim.attitude.worlds.synthetic import synthetic_log
from boresight.sim.experiments.forms import run_forms
from boresight.sim.records.feed import feed
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.rotations.outputs import attitude_of

#: s, of a flight; of its beginning, which is not judged.
_FLIGHT_S, _ALIGNED_S = 60.0, 20.0
#: Standard deviation of a sight about each axis, simulated and stated [deg].
_SIGHT_DEG = 0.05


@dataclass(frozen=True)
class Trial:
    """A device, calibrated from its records.

    Attributes
    ----------
    errors : mapping of str to float
        Of each register, in its stated uncertainty.
    attitude : mapping of str to float
        rms error of an attitude [deg] with the registers as declared, as found and as they are.
    """

    errors: dict[str, float]
    attitude: dict[str, float]


def trial(seed: int, **size: float) -> Trial:
    """Calibrate the device of a seed, and fly with it.

    Parameters
    ----------
    size : numbers
        Size of the records, of `world.calibration_records`.
    """
    drawn = device(seed)
    records = calibration_records(drawn, seed, sight_deg=_SIGHT_DEG, **size)  # type: ignore[arg-type]
    found = calibrated(*records, field_ut=FIELD_UT, sight_deg=_SIGHT_DEG)
    true = drawn.registers()
    errors = {
        name: (value - true[program][name]) / found.sigma[program][name]
        for program, values in found.registers.items()
        for name, value in values.items()
    }
    kinds = {"declared": {}, "found": found.registers, "true": true}
    attitude = {kind: attitude_error(drawn, values, seed) for kind, values in kinds.items()}
    return Trial(errors, attitude)


def attitude_error(of: Device, registers: Mapping[str, Mapping[str, float]], seed: int) -> float:
    """The rms error [deg] of `mekf`, fixed point, on a random motion with these registers."""
    log = synthetic_log(seconds=_FLIGHT_S, rate_hz=256.0, seed=seed, acceleration=0.3, mag_every=32)
    true = NineAxis.of(log)
    rng = np.random.default_rng([seed, 59])
    fields = np.where(true.mag_new[:, None], true.mag, 0.0)
    inertial, lines = of.counts(true.gyr, true.acc, fields, rng)
    front = {n: FRONT[n]().param_values(registers.get(n)) for n in FRONT}
    inertial_p, field_p = front["calibrate_inertial"], front["calibrate_field"]
    gyr = inertial[:, :3] @ _matrix(inertial_p, "gyro").T - _vector(inertial_p, "gyro_bias")
    acc = inertial[:, 3:] @ _matrix(inertial_p, "acc").T - _vector(inertial_p, "acc_bias")
    mag = (lines - _vector(field_p, "field_bias")) @ _matrix(field_p, "field").T
    mag[~true.mag_new] = np.nan
    seen = NineAxis(log.name, true.t, gyr, acc, mag, true.q).record()
    filter = Mekf()
    (run,), *_ = run_forms(filter, [feed(filter, seen).inputs], levels=("c",))
    q = attitude_of(run.outputs)
    return attitude_errors(q, true.attitude, true.t > _ALIGNED_S)["total"]


def _matrix(p: Mapping[str, float], name: str) -> FloatArray:
    return np.array([[p[f"{name}_{r}{c}"] for c in AXES] for r in AXES])


def _vector(p: Mapping[str, float], name: str) -> FloatArray:
    return np.array([p[f"{name}_{a}"] for a in AXES])
