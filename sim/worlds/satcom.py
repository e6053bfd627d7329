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
from boresight.sim.attitude.rotation import (
    quaternion_conjugate,
    quaternion_multiply,
    rotate,
    rotation_vector_to_quaternion,
)
from boresight.sim.worlds.satcom_drive import RATE_HZ, Drive, drive
from boresight.sim.worlds.satcom_link import Link, Receiver, direction
from boresight.sim.worlds.world import World

__all__ = ["Fleet", "OnTheMove", "SensorErrors"]

FloatArray = npt.NDArray[np.float64]
_DEG = math.pi / 180.0


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
        if not 0.0 <= self.tracking_hz <= RATE_HZ:
            raise InputError.at(
                "tracking_hz",
                wanted=f"0 to {RATE_HZ:g} Hz",
                found=f"{self.tracking_hz!r}",
                fix="choose a rate inside the range",
            )
        if self.beam not in ("heading", "heading_pi"):
            raise InputError.at(
                "beam", wanted="heading or heading_pi", found=repr(self.beam), fix="choose one"
            )
        toward = direction(self.place[0], self.place[1], 0.0, self.place[2])
        self._up = toward / np.linalg.norm(toward)
        if self._up[2] >= 0.0:
            raise InputError.at(
                "place",
                wanted="a satellite above the horizon",
                found=f"elevation {-math.degrees(math.asin(self._up[2])):.1f} deg",
                fix="choose a satellite of a nearer longitude",
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
        turned = np.array(
            [math.cos(self.start_deg * _DEG / 2), 0, 0, math.sin(self.start_deg * _DEG / 2)]
        )
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
        data = {
            "dt": np.full(runs, (-1.0 if k == 0 else 1.0) / RATE_HZ),
            "e_psi": error,
            "beam": beam,
        }
        for axis, name in enumerate("xyz"):
            data[f"g{name}"], data[f"a{name}"] = self._gyro[k, :, axis], self._acc[k, :, axis]
        return data

    def truths(self, k: int) -> dict[str, float]:
        """Truths of record ``k``."""
        roll, pitch, _ = self.drive.euler[k] / math.pi
        return {
            "roll_true": roll,
            "pitch_true": pitch,
            "heading_true": (self.heading[k] / math.pi + 1.0) % 2.0 - 1.0,
            **{f"q{a}_true": v for a, v in zip("wxyz", self.truth[k], strict=True)},
        }

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
    """One vehicle: ``OnTheMove(drive="city", seed=3, tracking_hz=1.0)``.

    Parameters
    ----------
    drive : str
        One of `sim.worlds.satcom_drive.DRIVES`.
    seed, tracking_hz, beam
        As of `Fleet`.
    """

    name = "on_the_move"

    def __init__(
        self,
        drive_name: str = "specification",
        seed: int = 1,
        tracking_hz: float = 5.0,
        beam: str = "heading",
    ) -> None:
        self.fleet = Fleet(drive(drive_name), (seed,), tracking_hz, beam)

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
        self._k += 1
        return {n: float(v[0]) for n, v in found.items()} | self.fleet.truths(self._k - 1)
