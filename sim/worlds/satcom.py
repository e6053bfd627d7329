"""A vehicle that points its antenna at a satellite with what the core answers.

The antenna is turned to where the satellite ought to be by the last attitude, led on with the last
rate; the receiver finds how far off the beam is, and whether there is a signal at all; that goes
into the next record. `Fleet` runs many draws at once, `OnTheMove` one of them as a `World`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from boresight.model.errors import InputError
from boresight.model.estimators.satcom_pointing import direction
from boresight.sim.attitude.rotation import (
    quaternion_conjugate,
    quaternion_multiply,
    rotate,
    rotation_vector_to_quaternion,
)
from boresight.sim.worlds.satcom_drive import RATE_HZ, Drive, drive
from boresight.sim.worlds.satcom_link import Link, Receiver
from boresight.sim.worlds.world import World

__all__ = ["Fleet", "OnTheMove", "SensorErrors"]

FloatArray = npt.NDArray[np.float64]
_DEG = math.pi / 180.0
BEAMS = ("heading", "heading_pi")  #: outputs that the antenna can be pointed with.


@dataclass(frozen=True)
class SensorErrors:
    """What gyro and accelerometer add: biases, white noise of a sample, walk of the gyro's bias.

    In deg/s, deg/s/sqrt(s) and m/s^2.
    """

    gyro_bias: tuple[float, float, float] = (0.3, -0.4, 0.5)
    gyro_noise: float = 0.05
    gyro_walk: float = 0.0
    acc_bias: tuple[float, float, float] = (0.0, 0.0, 0.0)
    acc_noise: float = 0.05


@dataclass
class Fleet:
    """Many vehicles on one drive, each with errors and noise of its own.

    Parameters
    ----------
    drive : Drive
    seeds : sequence of int
        One for each run.
    tracking_hz : float
        Rate of the tracking error, up to `RATE_HZ`; 0: the receiver is off.
    beam : str
        Output that the antenna is pointed with: heading or heading_pi.
    start_deg : float
        Error of the heading 0 that the estimator starts with.
    place : (latitude, longitude, satellite)
        [deg]

    Raises
    ------
    InputError
        A rate or output that there is not; the satellite is below the horizon.
    """

    drive: Drive
    seeds: Sequence[int]
    tracking_hz: float = 5.0
    beam: str = "heading"
    start_deg: float = 2.0
    errors: SensorErrors = SensorErrors()
    link: Link = Link()
    place: tuple[float, float, float] = (34.2, 108.9, 110.5)
    losses_db: list[FloatArray] = field(default_factory=list)

    def __post_init__(self) -> None:
        latitude, longitude, satellite = (angle / 180.0 for angle in self.place)
        toward = np.array(direction(latitude, longitude, 0.0, satellite)[0])
        self._up = toward / np.linalg.norm(toward)
        elevation = -math.degrees(math.asin(self._up[2]))
        for good, where, wanted, found in (
            (0.0 <= self.tracking_hz <= RATE_HZ, "tracking_hz", "0 to 50 Hz", self.tracking_hz),
            (self.beam in BEAMS, "beam", " or ".join(BEAMS), self.beam),
            (elevation > 0.0, "place", "a satellite above the horizon", f"{elevation:.1f} deg"),
        ):
            if not good:
                raise InputError.at(
                    f"fleet, {where}", wanted=wanted, found=repr(found), fix="correct it"
                )
        every = max(1, round(RATE_HZ / self.tracking_hz)) if self.tracking_hz else 1
        self.receiver = Receiver(self.link, every)
        self.start()

    def start(self) -> None:
        """Begin anew."""
        n, runs = len(self.drive.q), len(self.seeds)
        draws = [np.random.default_rng([seed, 2015]) for seed in self.seeds]
        e = self.errors
        white = np.stack([g.normal(size=(n, 3)) for g in draws], axis=1)
        walk = np.stack([g.normal(size=(n, 3)) for g in draws], axis=1).cumsum(axis=0)
        self.bias = (np.array(e.gyro_bias) + e.gyro_walk / math.sqrt(RATE_HZ) * walk) * _DEG
        self._gyro = self.drive.rate[:, None] + self.bias + e.gyro_noise * _DEG * white
        white = np.stack([g.normal(size=(n, 3)) for g in draws], axis=1)
        self._acc = self.drive.force[:, None] + e.acc_bias + e.acc_noise * white
        self._radio = [np.random.default_rng([seed, 2016]) for seed in self.seeds]
        turned = rotation_vector_to_quaternion([0.0, 0.0, self.start_deg * _DEG])
        self.truth = quaternion_multiply(turned, self.drive.q)
        self.heading = self.drive.euler[:, 2] + self.start_deg * _DEG
        self.losses_db.clear()
        self.receiver.reset()
        self._k = 0
        self._level = np.tile([1.0, 0.0, 0.0, 0.0], (runs, 1))

    def record(self, outputs: Mapping[str, FloatArray] | None) -> dict[str, FloatArray] | None:
        """The next records (runs,) by name, of the last outputs (runs,); None at the end."""
        k, runs = self._k, len(self.seeds)
        if k >= len(self.drive.q):
            return None
        self._k += 1
        told = self._level if outputs is None else self._pointed(outputs)
        # The satellite in the antenna's axes: right and up, by the attitude that it believes.
        seen = rotate(told, rotate(quaternion_conjugate(self.truth[k]), self._up))
        north, east, down = self._up
        level = math.hypot(north, east)
        right = (seen[:, 1] * north - seen[:, 0] * east) / level
        above = (-seen[:, 2] - (seen @ self._up) * -down) / level
        ahead = seen @ self._up
        loss = 10.0 ** (-self.drive.loss_db[k] / 10.0)
        off = np.where(ahead > 0.0, np.hypot(right, above), 1.0)
        self.losses_db.append(-10.0 * np.log10(np.maximum(self.link.pattern(off), 1e-9)))
        error = np.full(runs, np.nan)
        if self.tracking_hz:
            noise = np.stack([g.normal(size=(4, 2)) for g in self._radio], axis=2)
            found = self.receiver.sample(right, above, ahead, loss, noise)
            if found is not None:
                error = np.arctan2(found[0][0], level)
        w, x, y, z = told.T
        beam = np.arctan2(2.0 * (x * y + w * z), 1.0 - 2.0 * (y * y + z * z)) / math.pi
        dt = np.full(runs, (1.0 if k else -1.0) / RATE_HZ)
        data = {"dt": dt, "e_psi": error, "beam": beam}
        for axis, name in enumerate("xyz"):
            data[f"g{name}"], data[f"a{name}"] = self._gyro[k, :, axis], self._acc[k, :, axis]
        return data

    def _pointed(self, outputs: Mapping[str, FloatArray]) -> FloatArray:
        """The attitude that the antenna is pointed with (runs, 4), led on to this record."""
        q = np.stack([outputs[f"q{a}"] for a in "wxyz"], axis=1)
        if self.beam == "heading_pi":
            half = 0.5 * math.pi * (outputs["heading_pi"] - outputs["heading"])
            zero = np.zeros_like(half)
            q = quaternion_multiply(np.stack([np.cos(half), zero, zero, np.sin(half)], axis=1), q)
        rate = np.stack([outputs[f"rate_{a}"] for a in "xyz"], axis=1)
        return quaternion_multiply(q, rotation_vector_to_quaternion(rate / RATE_HZ))


class OnTheMove(World):
    """One vehicle, ``OnTheMove("city", seed=3, tracking_hz=1.0)``: see `drive` and `Fleet`."""

    name = "on_the_move"

    def __init__(
        self,
        on: str = "specification",
        seed: int = 1,
        tracking_hz: float = 5.0,
        beam: str = BEAMS[0],
    ) -> None:
        self.fleet = Fleet(drive(on), (seed,), tracking_hz, beam)

    def start(self) -> None:
        """Begin anew."""
        self.fleet.start()
        self._k = 0

    def record(self, outputs: Mapping[str, float] | None) -> Mapping[str, float] | None:
        """The next record; see `World`."""
        told = None if outputs is None else {n: np.array([v]) for n, v in outputs.items()}
        found = self.fleet.record(told)
        if found is None:
            return None
        data = {n: float(v[0]) for n, v in found.items()}
        angles = (self.fleet.drive.euler[self._k] / math.pi).tolist()
        angles[2] = (self.fleet.heading[self._k] / math.pi + 1.0) % 2.0 - 1.0
        names = ("roll", "pitch", "heading", "qw", "qx", "qy", "qz")
        truth = (*angles, *self.fleet.truth[self._k])
        self._k += 1
        return data | {f"{n}_true": v for n, v in zip(names, truth, strict=True)}
