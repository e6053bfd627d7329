"""A vehicle that points its antenna at a satellite with what the core answers.

The antenna is turned to where the satellite ought to be by the last attitude, led on with the last
rate; the receiver finds how far off the beam is, and whether there is a signal at all; that goes
into the next record.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt

from boresight.model.algebra.quaternion import matrix, multiply, turn
from boresight.model.arrays import FloatArray
from boresight.model.errors import require, require_choice
from boresight.sim.rotations import rotation
from boresight.sim.worlds.world import BatchedWorld
from boresight.systems.satcom.pointing import direction
from boresight.systems.worlds.road import Ride, profile, ride

SHADOW_DB = 60.0  #: loss of a tunnel and of a bridge.
#: Duration [s], acceleration [m/s^2], turn to the right [deg/s].
_SPECIFIED = (
    *((20, 0, 0), (8, 2, 0), (25, 0, 0), (10, 0, 12), (30, 0, 0), (6, -2, 0), (20, 0, 0)),
    *((10, 1.5, 0), (25, 0, 0), (12, 0, -8), (30, 0, 0), (15, -1, 0), (25, 0, 0), (5, 1, 0)),
    *((24, 0, 0), (15, 0, 6), (20, 0, 0)),
)


@dataclass(frozen=True, eq=False)
class Drive:
    """A ride, and the loss of bridges and tunnels (n,) [dB]."""

    ride: Ride
    loss_db: FloatArray

    @property
    def accelerated(self) -> npt.NDArray[np.bool_]:
        """Whether the acceleration is beyond (0.3, 0.3, 0.5) m/s^2 (n,)."""
        return np.asarray((np.abs(self.ride.acceleration) > [0.3, 0.3, 0.5]).any(axis=1))


def specification_drive(
    rate_hz: float = 50.0, *, turns: float = 1.0, road: float = 1.0, slope: float = 0.0
) -> Drive:
    """Five minutes: accelerations of 2, -2, 1.5, -1, 1 m/s^2, turns of 12, -8, 6 deg/s, road.

    ``turns`` and ``road`` times as fast and as rough, the road ``slope`` degrees aslant.
    """
    accel, turn = profile(_SPECIFIED, rate_hz)
    t = np.arange(len(accel)) / rate_hz
    roll = slope + road * (3.0 * _wave(t, 7.0) + 1.5 * _wave(t, 1.9))
    pitch = road * (2.0 * _wave(t, 5.0) + 2.0 * _wave(t, 60.0))
    return Drive(
        ride(rate_hz, accel, turns * turn, roll_deg=roll, pitch_deg=pitch), np.zeros_like(t)
    )


def city_drive(rate_hz: float = 50.0, seed: int = 1) -> Drive:
    """Half an hour: junctions, roundabouts, speed bumps, hills, bridges, and four tunnels."""
    rng = np.random.default_rng([seed, 30])
    parts: list[tuple[float, float, float]] = [(30.0, 0.0, 0.0)]
    bumps: list[float] = []
    while (start := sum(p[0] for p in parts)) < 1780.0:
        a, gain = rng.uniform(0.8, 2.2), rng.uniform(8.0, 18.0)
        side = float(rng.choice(np.array([-1.0, 1.0])))
        corner = {
            "junction": [(7.5, 0.0, 12.0 * side)],
            "roundabout": [(2.5, 0.0, 18.0), (rng.uniform(6, 14), 0.0, -20.0), (2.5, 0.0, 18.0)],
            "bend": [(rng.uniform(6, 12), 0.0, 4.0 * side)],
            "bump": [(3.0, 0.0, 0.0)],
        }
        kind = str(rng.choice(list(corner)))
        slow = 0.7 * gain if kind != "bend" else 0.0
        cruise, rise = rng.uniform(8.0, 40.0), gain / a
        parts += [(rise, a, 0.0), (cruise, 0.0, 0.0), (max(slow, 0.1) / 2.0, -2.0, 0.0)]
        if kind == "bump":
            bumps.append(start + rise + cruise + slow / 2.0 + 1.5)
        parts += [*corner[kind], ((gain - slow) / 2.0, -2.0, 0.0), (rng.uniform(1, 10), 0.0, 0.0)]
    accel, turn = profile(parts, rate_hz)[:, : int(1800 * rate_hz)]
    t = np.arange(len(accel)) / rate_hz
    moving = np.minimum(np.cumsum(accel) / rate_hz / 5.0, 1.0).clip(0.0)
    roll = moving * (1.5 * _wave(t, 7.3) + 0.8 * _wave(t, 1.7)) + 2.0 * _wave(t, 83.0)
    pitch = moving * (1.0 * _wave(t, 5.1) + 0.5 * _wave(t, 1.3)) + 3.0 * _wave(t, 110.0)
    lift = np.zeros_like(t)
    for at in bumps:
        since = (t - at) / 0.15
        nod = -1.6487 * since * np.exp(-0.5 * since**2)  # from 1 to -1
        pitch, lift = pitch + 3.0 * nod, lift - 4.0 * nod
    loss = np.zeros_like(t)
    for at, length in [
        *zip((300.0, 700.0, 1150.0, 1550.0), (15.0, 30.0, 60.0, 25.0), strict=True),
        *zip(rng.uniform(40.0, 1780.0, 25), rng.uniform(0.4, 2.0, 25), strict=True),
    ]:
        loss[(t >= at) & (t < at + length)] = SHADOW_DB
    return Drive(ride(rate_hz, accel, turn, roll_deg=roll, pitch_deg=pitch, lift=lift), loss)


#: Drives by name.
DRIVES: dict[str, Callable[[float], Drive]] = {
    "specification": specification_drive,
    "rough": partial(specification_drive, turns=3.0, road=2.0, slope=12.0),
    "city": city_drive,
}


def _wave(t: FloatArray, period: float) -> FloatArray:
    return np.sin(2.0 * np.pi * t / period)


_DEG = math.pi / 180.0
_TRUTHS = tuple(f"{n}_true" for n in ("roll", "pitch", "heading", "qw", "qx", "qy", "qz"))
BEAMS = ("heading", "heading_pi")  #: outputs that the antenna can be pointed with.
LIGHT = 299792458.0  #: m/s
DWELL_S, SQUINT = 0.005, math.radians(0.35)  #: of each position of the beam [s], [rad].
LOCK_DB = 6.0  #: power below the nominal one that still counts as tracking.


#: pi D / lambda of a dish of 0.6 m in Ku band, 12.5 GHz.
APERTURE = math.pi * 0.6 * 12.5e9 / LIGHT
#: Carrier over noise density on the axis [Hz]: a beacon of 6 dBW, 37,200 km away, an efficiency of
#: the dish of 0.62, noise of 170 K.
CN0 = 10.0**0.6 * 0.62 * APERTURE**2 / (4.0 * math.pi * 3.72e7 * 12.5e9 / LIGHT) ** 2
CN0 /= 1.380649e-23 * 170.0


def pattern(sine: FloatArray) -> FloatArray:
    """Power at an angle off the axis, by its sine, over that on the axis.

    The aperture's field falls as sqrt(1 - r^2) to the rim, first sidelobe -21 dB::

        E(u)/E(0) = 3 (sin u - u cos u)/u^3        u = pi D sin(angle)/lambda
    """
    u = np.maximum(APERTURE * np.abs(sine), 1e-3)
    field: FloatArray = 3.0 * (np.sin(u) - u * np.cos(u)) / u**3
    return field * field


class Receiver:
    """Conical scan: the beam squints right, left, up and down within every sample.

    Powers of the four are summed over a tracking interval; their differences over the sum give the
    error, the sum tells whether there is a signal. ``interval``: in samples, in the mean.
    """

    def __init__(self, interval: float) -> None:
        self.interval, self.snr = interval, CN0 * DWELL_S
        gain, next_gain = (float(pattern(np.array(s))) for s in (SQUINT, SQUINT + 1e-6))
        self.slope = (gain - next_gain) / 1e-6 / (2.0 * gain)  # of the difference over the sum
        self.lock_power = self.snr * gain * 10.0 ** (-LOCK_DB / 10.0)
        self.reset()

    def reset(self) -> None:
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
        amplitude = np.sqrt(self.snr * loss * pattern(sine))
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

    * ``on``: one of `DRIVES`; ``seeds`` of the noise, a run for each;
    * ``tracking_hz``: rate of the tracking error, up to ``rate_hz``, that of the records; 0: the
      receiver is off;
    * ``beam``: output that the antenna is pointed with, heading or heading_pi;
    * ``start_deg``: error of the heading 0 that the estimator starts with;
    * ``errors`` of the sensors; ``place``: latitude, longitude, that of the satellite [deg].

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
        place: tuple[float, float, float] = (34.2, 108.9, 110.5),
    ) -> None:
        super().__init__(seeds)
        require_choice("drive", on, DRIVES)
        require(10.0 <= rate_hz <= 1000.0, "drive, rate_hz", "10 to 1000 Hz", rate_hz)
        self.drive, self.tracking_hz, self.beam = DRIVES[on](rate_hz), tracking_hz, beam
        self.start_deg, self.errors = start_deg, errors
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
        self.receiver = Receiver(rate_hz / tracking_hz if tracking_hz else 1.0)
        self.start()

    def start(self) -> None:
        ride, e = self.drive.ride, self.errors
        n = len(ride.q)
        draws = [np.random.default_rng([seed, 2015]) for seed in self.seeds]
        white = np.stack([g.normal(size=(n, 3)) for g in draws], axis=1)
        walk = np.stack([g.normal(size=(n, 3)) for g in draws], axis=1).cumsum(axis=0)
        bias = np.array(e.gyro_bias) + e.gyro_walk / math.sqrt(ride.rate_hz) * walk
        self.bias = bias * _DEG
        gyro = ride.rate[:, None] + self.bias + e.gyro_noise * _DEG * white
        white = np.stack([g.normal(size=(n, 3)) for g in draws], axis=1)
        force = ride.force[:, None] + e.acc_bias + e.acc_noise * white
        self._sensed = np.concatenate([gyro, force], axis=2).swapaxes(1, 2).copy()
        if self.tracking_hz:
            draws = [np.random.default_rng([seed, 2016]) for seed in self.seeds]
            self._radio = np.stack([g.normal(size=(n, 4, 2)) for g in draws], axis=3)
        turned = rotation.rotation_vector_to_quaternion([0.0, 0.0, self.start_deg * _DEG])
        self.truth = rotation.quaternion_multiply(turned, ride.q)
        self.heading = ride.euler[:, 2] + self.start_deg * _DEG
        angles = np.stack([*ride.euler[:, :2].T, self.heading], axis=1) / math.pi
        self._truths = np.concatenate([(angles + 1.0) % 2.0 - 1.0, self.truth], axis=1)[:, :, None]
        # The satellite in body axes, which are the antenna's but for what the estimator believes.
        self._toward = rotation.rotate(rotation.quaternion_conjugate(self.truth), self._up)
        self.losses_db: list[FloatArray] = []
        self.receiver.reset()
        self._level = np.repeat([[1.0], *3 * [[0.0]]], len(self.seeds), axis=1)
        self._k = 0

    def record(self, outputs: Mapping[str, FloatArray] | None) -> dict[str, FloatArray] | None:
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
        self.losses_db.append(-10.0 * np.log10(np.maximum(pattern(off), 1e-9)))
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
