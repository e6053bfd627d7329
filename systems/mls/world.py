"""A deck with a landing-system array: worlds for `mls_attitude` and `array_phases`.

`OnDeck` gives the sensors' records. `Landing` asks `array_phases` for beams about the angle at
which the receiver last found the pulse; what the phases that come back send to the receiver decides
where the next beams go.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from boresight import World
from boresight.model.arrays import FloatArray
from boresight.model.declarations import GRAVITY
from boresight.model.errors import require, require_choice
from boresight.sim.experiments.forms import run_forms
from boresight.sim.rotations.accuracy import attitude_of
from boresight.sim.rotations.rotation import quaternion_conjugate, rotate, turns_between
from boresight.sim.rotations.zyx import quaternions_of, wrapped
from boresight.systems.mls.estimator import MlsAttitude
from boresight.systems.mls.phases import Array, direction, lobe
from boresight.systems.worlds.ship import SEA_STATES, at_sea

RATE_HZ = 1000.0
JUMP_DEG, JUMP_S, JUMP_EVERY_S = 8.0, 0.06, 1.5
#: A table that jumps; a ship that turns by +-10 deg about each axis; the carrier at sea.
MOTIONS = ("table", "rolling", *(f"sea_{n}" for n in SEA_STATES))


@dataclass(frozen=True, eq=False)
class Deck:
    """Roll, pitch, heading (n, 3) [rad]; q, body to reference (n, 4); upward acceleration (n,)."""

    euler: FloatArray
    q: FloatArray
    lift: FloatArray


@dataclass(frozen=True)
class SensorErrors:
    """Noise of a sample, the gyro's bias and its spread over the runs, its delay in samples.

    In deg/s, g and shares of the field. The bias is the one that gives the figures of the
    specification's prototype.
    """

    gyro_noise: float = 0.3
    gyro_bias: tuple[float, float, float] = (0.06, 0.0765, 0.0143)
    bias_spread: float = 0.0
    acc_noise: float = 0.02
    mag_noise: float = 0.02
    gyro_lag: int = 0


def deck(name: str, seconds: float, seed: int, heading_deg: float = 0.0) -> Deck:
    """One of `MOTIONS` about a heading.

    `InputError`: no such motion.
    """
    require(name in MOTIONS, "motion", f"one of {', '.join(MOTIONS)}", name)
    t, rng = np.arange(round(seconds * RATE_HZ)) / RATE_HZ, np.random.default_rng([seed, 25])
    euler, lift = np.zeros((len(t), 3)), np.zeros_like(t)
    if name == "table":
        _swing(euler, t, rng)
    elif name == "rolling":
        phase = rng.uniform(0.0, 2.0 * np.pi, 3)
        euler += np.radians(10.0) * np.sin(2.0 * np.pi * t[:, None] / [11.0, 7.0, 17.0] + phase)
    else:
        euler[:, :2], lift = at_sea(t, rng, int(name.removeprefix("sea_")))
    euler[:, 2] += math.radians(heading_deg)
    return Deck(euler, quaternions_of(euler), lift)


def _swing(euler: FloatArray, t: FloatArray, rng: np.random.Generator) -> None:
    """A three-axis table: swings at random; one axis after the other jumps."""
    periods, phases = rng.uniform(2.0, 9.0, (4, 3)), rng.uniform(0.0, 2.0 * np.pi, (4, 3))
    size = np.radians(rng.uniform(0.5, 2.5, (4, 3)))
    euler += (size * np.sin(2.0 * np.pi * t[:, None, None] / periods + phases)).sum(axis=1)
    euler -= euler[0].copy()
    for k, at in enumerate(np.arange(JUMP_EVERY_S, t[-1], JUMP_EVERY_S)):
        passed = np.clip((t - at) / JUMP_S, 0.0, 1.0)
        sign = 1.0 if k // 3 % 2 == 0 else -1.0
        euler[:, k % 3] += sign * np.radians(JUMP_DEG) * 0.5 * (1.0 - np.cos(np.pi * passed))


def records(
    motion: Deck,
    seed: int,
    errors: SensorErrors = SensorErrors(),
    *,
    field_ut: float = 50.0,
    dip_deg: float = 54.0,
) -> FloatArray:
    """Records of `mls_attitude` (n, 10): dt, gyro, specific force, field; the first restarts."""
    n, rng = len(motion.q), np.random.default_rng([seed, 2018])
    rate = np.zeros((n, 3))
    rate[1:] = turns_between(motion.q[:-1], motion.q[1:]) * RATE_HZ
    rate = np.concatenate([rate[:1].repeat(errors.gyro_lag, axis=0), rate])[:n]
    white = rng.normal(size=(3, n, 3))
    bias = np.radians(errors.gyro_bias + errors.bias_spread * rng.normal(size=3))
    up = np.zeros((n, 3))
    up[:, 2] = GRAVITY + motion.lift
    dip, back = math.radians(dip_deg), quaternion_conjugate(motion.q)
    field = rotate(back, field_ut * np.array([math.cos(dip), 0.0, -math.sin(dip)]))
    dt = np.full((n, 1), 1.0 / RATE_HZ)
    dt[0] = -dt[0]
    gyro = rate + bias + np.radians(errors.gyro_noise) * white[0]
    field = field + errors.mag_noise * field_ut * white[1]
    force = rotate(back, up) + errors.acc_noise * GRAVITY * white[2]
    return np.concatenate([dt, gyro, force, field], axis=1)


SETTLED_S = 1.0  #: of the filter, before the first scan.


@dataclass(frozen=True)
class Scan:
    """A scan from ``low`` to ``high`` [deg] and back at 20,000 deg/s, as ICAO Annex 10 has it.

    ``axis``: number of the axis of its elements; ``pause`` [s] between to and fro; ``rate`` [Hz].
    """

    axis: int
    low: float
    high: float
    pause: float
    rate: float

    @property
    def middle(self) -> float:
        """Its middle [deg]."""
        return (self.low + self.high) / 2.0

    @property
    def half(self) -> float:
        """Half of its width [deg]."""
        return (self.high - self.low) / 2.0

    def times(self, angle_deg: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
        """When the beam passes an angle on its way to and fro [s]."""
        to = (np.asarray(angle_deg) - self.low) / SCAN_DEG_S
        return to, 4.0 * self.half / SCAN_DEG_S + self.pause - to

    def angle(self, to: npt.ArrayLike, fro: npt.ArrayLike) -> FloatArray:
        """(T0 - t) V/2 of the time t between both pulses [deg]; T0 is that of the angle 0."""
        before, after = self.times(0.0)
        return np.asarray((after - before - (np.asarray(fro) - np.asarray(to))) * SCAN_DEG_S / 2.0)

    def waveform(self, angle_deg: FloatArray, amplitude: FloatArray) -> tuple[FloatArray, ...]:
        """What a receiver gets over time [s], of its amplitude (m,) over a scan (m,) [deg]."""
        to, fro = self.times(angle_deg)
        silent = [to[-1], fro[-1]] if self.pause else []
        time = np.concatenate([to, silent, fro[::-1]])
        return time, np.concatenate([amplitude, np.zeros(len(silent)), amplitude[::-1]])


SCAN_DEG_S = 20_000.0  #: speed of the beam.
SCANS = {
    "azimuth": Scan(1, -62.0, 62.0, 600e-6, 13.0),
    "elevation": Scan(2, -1.5, 29.5, 400e-6, 39.0),
}


class OnDeck(World):
    """Sensors on a deck: ``OnDeck("sea_5", seed=3)``, a motion of `MOTIONS`."""

    name = "on_deck"

    def __init__(
        self, motion: str = "sea_5", seed: int = 1, seconds: float = 10.0, heading_deg: float = 0.0
    ) -> None:
        deck_motion = deck(motion, seconds, seed, heading_deg)
        names = [i.name for i in MlsAttitude.inputs]
        names += [f"{n}_true" for n in ("roll", "pitch", "heading", "qw", "qx", "qy", "qz")]
        angles = wrapped(deck_motion.euler / math.pi, 2.0)
        rows = np.concatenate([records(deck_motion, seed), angles, deck_motion.q], axis=1)
        self.columns = dict(zip(names, rows.T, strict=True))

    def pieces(self) -> Iterator[Mapping[str, FloatArray]]:
        yield self.columns


class Landing(World):
    """A receiver at an azimuth and elevation [deg]; the beams of an ``antenna`` follow it.

    ``beams`` of each scan are asked for: over the whole sector while the receiver has no pulse,
    then 64/(elements spacing) deg to each side, 2.5 half widths of the beam. ``compensated=False``:
    the array takes the deck for level. ``angles`` are those found from the times of the pulses to
    and fro [deg], of every scan with a whole pulse, 3 dB lower at both ends: of 64 elements none
    beyond 60 deg.

    `InputError`: a receiver outside the scan; fewer than 8 beams; see `Array` and `deck`.
    """

    name = "landing"

    def __init__(
        self,
        motion: str = "sea_5",
        seed: int = 1,
        azimuth_deg: float = 20.0,
        elevation_deg: float = 3.0,
        elements: int = 64,
        spacing: float = 0.5,
        seconds: float = 20.0,
        beams: int = 81,
        compensated: bool = True,
        antenna: str = "azimuth",
    ) -> None:
        require_choice("landing, antenna", antenna, SCANS)
        place = {"azimuth": azimuth_deg, "elevation": elevation_deg}
        for name, scan in SCANS.items():
            inside = scan.low <= place[name] <= scan.high
            require(inside, f"landing, {name}_deg", f"{scan.low:g} to {scan.high:g}", place[name])
        require(beams >= 8, "landing, beams", "8 or more", beams)
        self.place, self.beams, self.antenna, self.scan = place, beams, antenna, SCANS[antenna]
        self.array = Array(elements, spacing, self.scan.axis)
        self.near = min(64.0 / (elements * spacing), 0.4 * self.scan.half)
        deck_motion = deck(motion, seconds, seed)
        toward = quaternion_conjugate(deck_motion.q)
        self.receiver = rotate(toward, direction(azimuth_deg, elevation_deg))
        ((run,),) = run_forms(MlsAttitude(), [records(deck_motion, seed)], levels=("c",))
        self.q = attitude_of(run.outputs)
        if not compensated:
            self.q[:] = [1.0, 0.0, 0.0, 0.0]

    def start(self) -> None:
        self._count, self._beam = 0, 0
        self._centre, self._half = self.scan.middle, self.scan.half
        self._amplitude = np.zeros(self.beams)
        self.angles: list[float] = []

    @property
    def _sample(self) -> int:
        """Sample of the deck at this scan."""
        return round((SETTLED_S + self._count / self.scan.rate) * RATE_HZ)

    def _scanned(self) -> FloatArray:
        """Angles of this scan [deg]."""
        low, high = self._centre - self._half, self._centre + self._half
        return np.linspace(max(low, self.scan.low), min(high, self.scan.high), self.beams)

    def record(self, outputs: Mapping[str, float] | None) -> Mapping[str, float] | None:
        if outputs is not None:
            self._received(outputs)
        if self._sample >= len(self.q):
            return None
        place = self.place | {self.antenna: self._scanned()[self._beam]}
        beam = direction(place["azimuth"], place["elevation"])
        names = (*(f"q{a}" for a in "wxyz"), *(f"beam_{a}" for a in "xyz"))
        return dict(zip(names, [*self.q[self._sample].tolist(), *beam.tolist()], strict=True))

    def _received(self, outputs: Mapping[str, float]) -> None:
        """Receive the signal of the last beam; at the end of a scan, locate the receiver."""
        n = sum(name.startswith("phase_") for name in outputs)
        wanted = f"as many as the estimator has phases, {n}"
        fix = f"write Landing(elements={n}), or ArrayPhases of as many"
        require(n == self.array.elements, "landing, elements", wanted, self.array.elements, fix)
        phases = np.array([[outputs[f"phase_{k}"] for k in range(n)]])
        self._amplitude[self._beam] = abs(self.array.field(phases, self.receiver[self._sample])[0])
        self._beam += 1
        if self._beam < self.beams:
            return
        scan, top = self._scanned(), int(self._amplitude.argmax())
        pulse = lobe(scan, self._amplitude, 2.0 * self._half)
        # Of a pulse that the end of a scan cuts, the middle is elsewhere.
        whole = self._amplitude[[0, -1]].max() < np.sqrt(0.5) * pulse.peak
        if self._half < self.scan.half and pulse.peak > 0.5 and whole:
            self.angles.append(float(self.scan.angle(*self.scan.times(pulse.centre))))
            self._centre, self._half = self.angles[-1], self.near
        elif pulse.peak > 0.25:  # a sight of it: nearer
            self._centre, self._half = float(scan[top]), 2.0 * self.near
        else:
            self._centre, self._half = self.scan.middle, self.scan.half
        self._count, self._beam = self._count + 1, 0
