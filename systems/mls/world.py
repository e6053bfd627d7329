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
from boresight.model.errors import require, require_choice
from boresight.sim.experiments.forms import run_forms
from boresight.sim.rotations.accuracy import attitude_of
from boresight.sim.rotations.rotation import quaternion_conjugate, rotate
from boresight.sim.rotations.zyx import wrapped
from boresight.systems.mls.deck import RATE_HZ, deck, records
from boresight.systems.mls.estimator import MlsAttitude
from boresight.systems.mls.linear_array import Array, direction, lobe

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
    """Sensors on a deck: ``OnDeck("sea_5", seed=3)``, a motion of `mls_deck.MOTIONS`."""

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
        """All records; see `World`."""
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
        """Restart."""
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
        """The next beam; see `World`."""
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
