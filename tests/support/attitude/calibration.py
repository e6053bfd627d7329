"""Simulated devices with known errors, their calibration, and what the attitude gains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.attitude.front import AXES, FRONT, STAMP_BITS
from boresight.model.attitude.mekf import Mekf
from boresight.model.declarations import GRAVITY
from boresight.sim.accuracy.figures import attitude_errors
from boresight.sim.attitude.calibration.files import calibrated
from boresight.sim.attitude.calibration.solve import INERTIAL, LINE, SIGHT
from boresight.sim.attitude.ma2014.world import ACCELEROMETER, GYRO, MAGNETOMETER
from boresight.sim.attitude.worlds import Triad, synthetic_log
from boresight.sim.experiments.forms import run_forms
from boresight.sim.records.feed import feed
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Column, Record
from boresight.sim.rotations.accuracy import attitude_of
from boresight.sim.rotations.rotation import (
    euler_to_quaternion,
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_euler,
    quaternion_to_matrix,
    rotate,
    rotation_vector_to_quaternion,
    turns_between,
)

#: Field of `sim.attitude.worlds`, east, north, up.
FIELD_UT = (0.0, 27.9, -46.2)
#: Standard deviations of what is drawn: mounting [rad]; scale and misalignment of gyro and
#: accelerometer, soft iron; biases [rad/s, m/s^2, uT]; the clock.
_MOUNTING, _SCALES, _BIASES = 0.05, (0.01, 0.01, 0.05), (0.01, 0.1, 10.0)
_CLOCK = 30e-6


@dataclass(frozen=True)
class Device:
    """Gyro, accelerometer and magnetometer as mounted, and the period of the board's clock [s]."""

    triads: Sequence[Triad]
    tick_s: float

    def registers(self) -> dict[str, dict[str, float]]:
        """The registers that undo the errors: ``M = lsb A^-1``."""
        values: dict[str, dict[str, float]] = {"calibrate_inertial": {}, "calibrate_field": {}}
        for triad, name in zip(self.triads, ("gyro", "acc", "field"), strict=True):
            some = values["calibrate_field" if name == "field" else "calibrate_inertial"]
            inverse = np.linalg.inv(np.array(triad.matrix))
            bias = np.array(triad.bias)
            bias = bias / triad.lsb if name == "field" else inverse @ bias
            for r, row in zip(AXES, triad.lsb * inverse, strict=True):
                some |= {f"{name}_{r}{c}": float(v) for c, v in zip(AXES, row, strict=True)}
            some |= {f"{name}_bias_{a}": float(v) for a, v in zip(AXES, bias, strict=True)}
        values["calibrate_inertial"]["tick_s"] = self.tick_s
        return values

    def counts(
        self, rates: FloatArray, forces: FloatArray, fields: FloatArray, rng: np.random.Generator
    ) -> tuple[FloatArray, FloatArray]:
        """Counts (n, 6) and (n, 3) for true vectors in body axes, (n, 3) each."""
        out = []
        for triad, true in zip(self.triads, (rates, forces, fields), strict=True):
            out.append(np.rint(triad.read(true, rng) / triad.lsb))
        return np.hstack(out[:2]), out[2]


def device(seed: int) -> Device:
    """Draw the errors of a device: noise of Table 2 of Ma Long et al. (2014), all else random."""
    rng = np.random.default_rng([seed, 57])
    turn = quaternion_to_matrix(rotation_vector_to_quaternion(_MOUNTING * rng.standard_normal(3)))
    triads = []
    for triad, scale, bias in zip(
        (GYRO, ACCELEROMETER, MAGNETOMETER), _SCALES, _BIASES, strict=True
    ):
        matrix = (np.eye(3) + scale * rng.standard_normal((3, 3))) @ turn
        triads.append(replace(triad, matrix=matrix, bias=bias * rng.standard_normal(3)))
    return Device(triads, 1e-8 * (1.0 + _CLOCK * float(rng.standard_normal())))


@dataclass(frozen=True)
class Course:
    """Attitudes (n, 4) one after the other: at rest in each, then a smooth turn to the next."""

    attitudes: FloatArray
    rest_s: float
    turn_s: float

    @property
    def seconds(self) -> float:
        """How long it takes."""
        return len(self.attitudes) * self.rest_s + (len(self.attitudes) - 1) * self.turn_s

    def at(self, t: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Attitudes (n, 4) and body rates (n, 3) [rad/s] at times t (n,) [s].

        The turn is ``phi s``, ``s = u - sin(2 pi u) / (2 pi)`` for u from 0 to 1.
        """
        leg = np.minimum((t / (self.rest_s + self.turn_s)).astype(int), len(self.attitudes) - 1)
        u = (t - leg * (self.rest_s + self.turn_s) - self.rest_s) / self.turn_s
        u = np.clip(u, 0.0, 1.0)[:, None]
        turns = turns_between(self.attitudes[:-1], self.attitudes[1:])
        phi = np.vstack([turns, np.zeros((1, 3))])[leg]
        part = rotation_vector_to_quaternion(phi * (u - np.sin(2.0 * np.pi * u) / (2.0 * np.pi)))
        rate = phi * (1.0 - np.cos(2.0 * np.pi * u)) / self.turn_s
        return quaternion_multiply(self.attitudes[leg], part), rate


def _random(rng: np.random.Generator, n: int) -> FloatArray:
    q = rng.standard_normal((n, 4))
    return np.asarray(q / np.linalg.norm(q, axis=1, keepdims=True))


def calibration_records(
    of: Device,
    seed: int,
    *,
    rate_hz: float = 1024.0,
    lines_hz: float = 8.0,
    positions: int = 24,
    repetitions: int = 10,
    rest_s: float = 4.0,
    sight_deg: float = 0.05,
    seconds: float = 60.0,
) -> list[Record]:
    """A rest, positions with turns between them, a swing, and sighted directions.

    There are ``positions`` rests in random attitudes, and each of three attitudes is sighted
    ``repetitions`` times, with the standard deviation ``sight_deg`` about each axis. These rests
    last ``rest_s``, the first rest and the swing ``seconds``.
    """
    rng = np.random.default_rng([seed, 58])
    three = np.radians([[0.0, 0.0, 0.0], [60.0, 0.0, 90.0], [0.0, 60.0, -90.0]])
    level = euler_to_quaternion(three)
    paths = {
        "rest": Course(level[:1], seconds, 1.0),
        "positions": Course(_random(rng, positions), rest_s, 2.5),
        "swing": Course(_random(rng, round(seconds / 2.5) + 1), 0.0, 2.5),
        "sights": Course(np.tile(level, (repetitions, 1)), rest_s, 2.5),
    }
    records = []
    for name, path in paths.items():
        n = int(path.seconds * rate_hz)
        t = np.arange(n) / rate_hz
        q, rates = path.at(t)
        to_body = quaternion_conjugate(q)
        forces, fields = rotate(to_body, (0.0, 0.0, GRAVITY)), rotate(to_body, FIELD_UT)
        inertial, lines = of.counts(rates, forces, fields, rng)
        lines[np.arange(n) % round(rate_hz / lines_hz) != 0] = np.nan
        stamp = np.rint(rng.uniform(0.0, 40.0) / of.tick_s + t / of.tick_s) % 2.0**STAMP_BITS
        # The computer reads its clock a little late.
        late = rng.uniform(0.0, 0.9 / rate_hz, n)
        columns = {"t": Column(t + late, "s"), "stamp": Column(stamp)}
        columns |= _columns(INERTIAL, inertial) | _columns(LINE, lines)
        if name == "sights":
            columns |= _columns(SIGHT, _sighted(path, t, rng, sight_deg), "deg")
        records.append(Record(name, columns))
    return records


def _columns(
    names: Sequence[str], values: FloatArray, unit: str | None = None
) -> dict[str, Column]:
    return {name: Column(v, unit) for name, v in zip(names, values.T, strict=True)}


def _sighted(path: Course, t: FloatArray, rng: np.random.Generator, sight_deg: float) -> FloatArray:
    """Pitch, roll, heading [deg] in the row in the middle of each rest."""
    n, period = len(path.attitudes), path.rest_s + path.turn_s
    error = rotation_vector_to_quaternion(np.radians(sight_deg) * rng.standard_normal((n, 3)))
    rows = np.searchsorted(t, period * np.arange(n) + 0.5 * path.rest_s)
    angles = np.full((len(t), 3), np.nan)
    seen = quaternion_multiply(path.attitudes, error)
    angles[rows] = np.degrees(quaternion_to_euler(seen))
    return angles


#: s, of a flight; of its beginning, which is not judged.
_FLIGHT_S, _ALIGNED_S = 60.0, 20.0
#: Standard deviation of a sight about each axis, simulated and stated [deg].
_SIGHT_DEG = 0.05


class Trial(NamedTuple):
    """A device, calibrated from its records.

    ``errors`` of each register, in its stated uncertainty; ``attitude`` holds the rms error of an
    attitude [deg] with the registers as declared, as found and as they are.
    """

    errors: dict[str, float]
    attitude: dict[str, float]


def trial(seed: int, **size: Any) -> Trial:
    """Calibrate the device of a seed, and fly with it; ``size`` is of `calibration_records`."""
    drawn = device(seed)
    records = calibration_records(drawn, seed, sight_deg=_SIGHT_DEG, **size)
    found = calibrated(*records, field_ut=FIELD_UT, sight_deg=_SIGHT_DEG)
    true = drawn.registers()
    errors = {
        name: (value - true[program][name]) / found.sigma[program][name]
        for program, values in found.registers.items()
        for name, value in values.items()
    }
    kinds = {"declared": {}, "found": found.registers, "true": true}
    return Trial(errors, {k: attitude_error(drawn, values, seed) for k, values in kinds.items()})


def attitude_error(of: Device, registers: Mapping[str, Mapping[str, float]], seed: int) -> float:
    """The rms error [deg] of `mekf`, fixed point, on a random motion with these registers."""
    log = synthetic_log(seconds=_FLIGHT_S, rate_hz=256.0, seed=seed, acceleration=0.3, mag_every=32)
    true = NineAxis.of(log)
    fields = np.where(true.mag_new[:, None], true.mag, 0.0)
    rng = np.random.default_rng([seed, 59])
    inertial, lines = of.counts(true.gyr, true.acc, fields, rng)
    p = dict[str, float]()
    for name, front in FRONT.items():
        p |= front().param_values(registers.get(name))

    def matrix(name: str) -> FloatArray:
        return np.array([[p[f"{name}_{r}{c}"] for c in AXES] for r in AXES])

    def vector(name: str) -> FloatArray:
        return np.array([p[f"{name}_{a}"] for a in AXES])

    gyr = inertial[:, :3] @ matrix("gyro").T - vector("gyro_bias")
    acc = inertial[:, 3:] @ matrix("acc").T - vector("acc_bias")
    mag = (lines - vector("field_bias")) @ matrix("field").T
    mag[~true.mag_new] = np.nan
    seen = NineAxis(log.name, true.t, gyr, acc, mag, true.q).record()
    filter = Mekf()
    (run,), *_ = run_forms(filter, [feed(filter, seen).inputs], levels=("c",))
    return attitude_errors(attitude_of(run.outputs), true.attitude, true.t > _ALIGNED_S)["total"]
