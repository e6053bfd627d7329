"""A vehicle that points its antenna at a satellite with what the core answers.

The antenna is turned to where the satellite ought to be by the last attitude, led on with the last
rate; the receiver finds how far off the beam is, and whether there is a signal at all; that goes
into the next record.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from boresight.model.algebra.quaternion import matrix, multiply, turn
from boresight.model.arrays import FloatArray
from boresight.model.errors import require
from boresight.sim.rotations.rotation import (
    quaternion_conjugate,
    quaternion_multiply,
    rotate,
    rotation_vector_to_quaternion,
)
from boresight.sim.worlds.world import BatchedWorld
from boresight.systems.satcom.drive import drive
from boresight.systems.satcom.pointing import direction

_DEG = math.pi / 180.0
_TRUTHS = tuple(f"{n}_true" for n in ("roll", "pitch", "heading", "qw", "qx", "qy", "qz"))
BEAMS = ("heading", "heading_pi")  #: outputs that the antenna can be pointed with.
LIGHT = 299792458.0  #: m/s
DWELL_S, SQUINT = 0.005, math.radians(0.35)  #: of each position of the beam [s], [rad].
LOCK_DB = 6.0  #: power below the nominal one that still counts as tracking.


@dataclass(frozen=True)
class Link:
    """A beacon in Ku band, received with a small dish of tapered illumination.

    The aperture's field falls as sqrt(1 - r^2) to the rim, so the pattern is a closed form,
    first sidelobe -21 dB::

        E(u)/E(0) = 3 (sin u - u cos u)/u^3        u = pi D sin(angle)/lambda
    """

    eirp_dbw: float = 6.0
    frequency_hz: float = 12.5e9
    diameter_m: float = 0.6
    efficiency: float = 0.62
    noise_k: float = 170.0
    distance_m: float = 3.72e7

    @property
    def aperture(self) -> float:
        """pi D / lambda."""
        return math.pi * self.diameter_m * self.frequency_hz / LIGHT

    @property
    def cn0(self) -> float:
        """Carrier over noise density on the axis [Hz]."""
        gain = self.efficiency * self.aperture**2
        spread = (4.0 * math.pi * self.distance_m * self.frequency_hz / LIGHT) ** 2
        return float(10.0 ** (self.eirp_dbw / 10.0)) * gain / spread / (1.380649e-23 * self.noise_k)

    def pattern(self, sine: FloatArray) -> FloatArray:
        """Power at an angle off the axis, by its sine, over that on the axis."""
        u = np.maximum(self.aperture * np.abs(sine), 1e-3)
        field: FloatArray = 3.0 * (np.sin(u) - u * np.cos(u)) / u**3
        return field * field


class Receiver:
    """Conical scan: the beam squints right, left, up and down within every sample.

    Powers of the four are summed over a tracking interval; their differences over the sum give the
    error, the sum tells whether there is a signal. ``interval``: in samples, in the mean.
    """

    def __init__(self, link: Link, interval: float) -> None:
        self.link, self.interval = link, interval
        self.snr = link.cn0 * DWELL_S
        gain, next_gain = (float(link.pattern(np.array(s))) for s in (SQUINT, SQUINT + 1e-6))
        self.slope = (gain - next_gain) / 1e-6 / (2.0 * gain)  # of the difference over the sum
        self.lock_power = self.snr * gain * 10.0 ** (-LOCK_DB / 10.0)
        self.reset()

    def reset(self) -> None:
        """Begin an interval."""
        self._powers, self._count, self._age = np.zeros(()), 0, 0.0

    def sample(
        self, right: FloatArray, up: FloatArray, ahead: FloatArray, loss: float, noise: FloatArray
    ) -> FloatArray | None:
        """One sample.

        Direction cosines (runs,) of the satellite in the antenna's axes, the share of the power
        that arrives, and normal noise (4, 2, runs); at the end of an interval the error to the
        right (runs,) [rad], NaN where there is no signal.
        """
        across = right + SQUINT * np.array([[-1.0], [1.0], [0.0], [0.0]])
        along = up + SQUINT * np.array([[0.0], [0.0], [-1.0], [1.0]])
        sine = np.where(ahead > 0.0, np.hypot(across, along), 1.0)
        amplitude = np.sqrt(self.snr * loss * self.link.pattern(sine))
        noise = math.sqrt(0.5) * noise
        power = (amplitude + noise[:, 0]) ** 2 + noise[:, 1] ** 2 - 1.0
        self._powers = self._powers + power
        self._count, self._age = self._count + 1, self._age + 1.0
        if self._age < self.interval:
            return None
        total = self._powers.sum(axis=0)
        has_signal = total > 4.0 * self._count * self.lock_power
        difference = self._powers[0] - self._powers[1]
        with np.errstate(divide="ignore", invalid="ignore"):
            error = np.where(has_signal, difference / (total * self.slope), np.nan)
        over = self._age - self.interval
        self.reset()
        self._age = over
        return error


@dataclass(frozen=True)
class SensorErrors:
    """Biases, white noise of a sample [deg/s, m/s^2], walk of the gyro's bias [deg/s/sqrt(s)]."""

    gyro_bias: tuple[float, float, float] = (0.3, -0.4, 0.5)
    gyro_noise: float = 0.05
    gyro_walk: float = 0.0
    acc_bias: tuple[float, float, float] = (0.0, 0.0, 0.0)
    acc_noise: float = 0.05


class OnTheMove(BatchedWorld):
    """Vehicles on one drive, each with noise of its own, ``OnTheMove("city", seeds=(3,))``.

    Parameters
    ----------
    on : str
        One of `DRIVES`.
    seeds : sequence of int
        Of the noise; a run for each.
    tracking_hz : float
        Rate of the tracking error, up to that of the records; 0: the receiver is off.
    beam : str
        Output that the antenna is pointed with: heading or heading_pi.
    rate_hz : float
        Records a second.
    start_deg : float
        Error of the heading 0 that the estimator starts with.
    errors : SensorErrors
    link : Link
    place : (latitude, longitude, satellite)
        [deg]

    `InputError`: no such drive, rate or output; no place on earth; the satellite is below the
    horizon.
    """

    name = "on_the_move"

    def __init__(
        self,
        on: str = "specification",
        seeds: Sequence[int] = (1,),
        tracking_hz: float = 5.0,
        beam: str = BEAMS[0],
        rate_hz: float = 50.0,
        *,
        start_deg: float = 2.0,
        errors: SensorErrors = SensorErrors(),
        link: Link = Link(),
        place: tuple[float, float, float] = (34.2, 108.9, 110.5),
    ) -> None:
        super().__init__(seeds)
        self.drive, self.tracking_hz, self.beam = drive(on, rate_hz), tracking_hz, beam
        self.start_deg, self.errors, self.link, self.place = start_deg, errors, link, place
        latitude, longitude, satellite = (angle / 180.0 for angle in place)
        toward = np.array(direction(latitude, longitude, 0.0, satellite)[0])
        self._up = toward / np.linalg.norm(toward)
        elevation = -math.degrees(math.asin(self._up[2]))
        inside = abs(latitude) <= 0.5 and abs(longitude) <= 1.0 and abs(satellite) <= 1.0
        for valid, where, wanted, found in (
            (0.0 <= tracking_hz <= rate_hz, "tracking_hz", f"0 to {rate_hz:g} Hz", tracking_hz),
            (beam in BEAMS, "beam", " or ".join(BEAMS), beam),
            (inside, "place", "up to 90 deg of latitude, 180 of both longitudes", place),
            (elevation > 0.0, "place", "a satellite above the horizon", f"{elevation:.1f} deg"),
        ):
            require(valid, f"on_the_move, {where}", wanted, found)
        self.receiver = Receiver(link, rate_hz / tracking_hz if tracking_hz else 1.0)
        self.start()

    def start(self) -> None:
        """Restart."""
        ride, e = self.drive.ride, self.errors
        n = len(ride.q)
        draws = [np.random.default_rng([seed, 2015]) for seed in self.seeds]
        white = np.stack([g.normal(size=(n, 3)) for g in draws], axis=1)
        walk = np.stack([g.normal(size=(n, 3)) for g in draws], axis=1).cumsum(axis=0)
        self.bias = (np.array(e.gyro_bias) + e.gyro_walk / math.sqrt(ride.rate_hz) * walk) * _DEG
        gyro = ride.rate[:, None] + self.bias + e.gyro_noise * _DEG * white
        white = np.stack([g.normal(size=(n, 3)) for g in draws], axis=1)
        force = ride.force[:, None] + e.acc_bias + e.acc_noise * white
        self._sensed = np.concatenate([gyro, force], axis=2).swapaxes(1, 2).copy()
        if self.tracking_hz:
            draws = [np.random.default_rng([seed, 2016]) for seed in self.seeds]
            self._radio = np.stack([g.normal(size=(n, 4, 2)) for g in draws], axis=3)
        turned = rotation_vector_to_quaternion([0.0, 0.0, self.start_deg * _DEG])
        self.truth = quaternion_multiply(turned, ride.q)
        self.heading = ride.euler[:, 2] + self.start_deg * _DEG
        angles = np.stack([*ride.euler[:, :2].T, self.heading], axis=1) / math.pi
        self._truths = np.concatenate([(angles + 1.0) % 2.0 - 1.0, self.truth], axis=1)[:, :, None]
        # The satellite in body axes, which are the antenna's but for what the estimator believes.
        self._toward = rotate(quaternion_conjugate(self.truth), self._up)
        self.losses_db: list[FloatArray] = []
        self.receiver.reset()
        self._level = np.repeat([[1.0], *3 * [[0.0]]], len(self.seeds), axis=1)
        self._k = 0

    def record(self, outputs: Mapping[str, FloatArray] | None) -> dict[str, FloatArray] | None:
        """See `World.record`; with true values."""
        k = self._k
        if k >= len(self.truth):
            return None
        self._k += 1
        columns = self._level if outputs is None else self._led(outputs)
        # Where the satellite is, right of the beam, above and ahead, by the attitude believed.
        north, east, down = self._up
        level = math.hypot(north, east)
        x, y, z = turn(matrix(list(columns)), self._toward[k].tolist())
        ahead = x * north + y * east + z * down
        right, above = (y * north - x * east) / level, (ahead * down - z) / level
        off = np.where(ahead > 0.0, np.hypot(right, above), 1.0)
        self.losses_db.append(-10.0 * np.log10(np.maximum(self.link.pattern(off), 1e-9)))
        error = np.full(len(self.seeds), np.nan)
        if self.tracking_hz:
            loss = 10.0 ** (-self.drive.loss_db[k] / 10.0)
            signal = self.receiver.sample(right, above, ahead, loss, self._radio[k])
            if signal is not None:
                error = np.arctan2(signal, level)
        w, x, y, z = columns
        return {
            "dt": np.full(1, (1.0 if k else -1.0) / self.drive.ride.rate_hz),
            "e_psi": error,
            "beam": np.arctan2(2.0 * (x * y + w * z), 1.0 - 2.0 * (y * y + z * z)) / math.pi,
            **dict(zip(("gx", "gy", "gz", "ax", "ay", "az"), self._sensed[k], strict=True)),
            **dict(zip(_TRUTHS, self._truths[k], strict=True)),
        }

    def _led(self, outputs: Mapping[str, FloatArray]) -> FloatArray:
        """The attitude that the antenna is pointed with (4, runs), led on to this record."""
        q = [outputs[f"q{a}"] for a in "wxyz"]
        if self.beam == "heading_pi":
            half = 0.5 * math.pi * (outputs["heading_pi"] - outputs["heading"])
            zero = np.zeros_like(half)
            q = multiply([np.cos(half), zero, zero, np.sin(half)], q)
        x, y, z = (outputs[f"rate_{a}"] * (0.5 / self.drive.ride.rate_hz) for a in "xyz")
        half = np.sqrt(x * x + y * y + z * z)
        share = np.sinc(half / math.pi)
        return np.stack(multiply(q, [np.cos(half), x * share, y * share, z * share]))
