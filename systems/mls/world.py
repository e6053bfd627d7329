"""A deck with a landing-system array: worlds for `mls_attitude` and `array_phases`.

`OnDeck` gives the sensors' records. `Landing` asks `array_phases` for beams about the angle at
which the receiver last found the pulse; what the phases that come back send to the receiver decides
where the next beams go.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np
import numpy.typing as npt

from boresight import World
from boresight.model.errors import require
from boresight.sim.experiments.forms import run_forms
from boresight.sim.rotations.outputs import attitude_of
from boresight.sim.rotations.rotation import quaternion_conjugate, rotate
from boresight.sim.rotations.zyx import wrapped
from boresight.systems.mls.deck import RATE_HZ, deck, records
from boresight.systems.mls.estimator import MlsAttitude
from boresight.systems.mls.linear_array import Array, direction, lobe

__all__ = ["SCAN_DEG", "SCAN_DEG_S", "Landing", "OnDeck", "angle_of", "scan_times"]

FloatArray = npt.NDArray[np.float64]
SCAN_DEG_S = 20_000.0  #: speed of the scan, to and fro, as the ICAO has it.
SCAN_DEG = 62.0  #: it goes from minus this to this, and back.
_PAUSE_S = 0.002  #: between to and fro.
SCANS_HZ = 13.5  #: how often the azimuth is scanned.
SETTLED_S = 1.0  #: of the filter, before the first scan.


def scan_times(scan_deg: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    """When a beam passes an angle on its way to and fro [s]."""
    to = (np.asarray(scan_deg) + SCAN_DEG) / SCAN_DEG_S
    return to, 4.0 * SCAN_DEG / SCAN_DEG_S + _PAUSE_S - to


def angle_of(to: npt.ArrayLike, fro: npt.ArrayLike) -> FloatArray:
    """(T0 - t) V/2 of the time t between both pulses [deg]; T0 is that of the angle 0."""
    at_zero = 2.0 * SCAN_DEG / SCAN_DEG_S + _PAUSE_S
    return np.asarray((at_zero - (np.asarray(fro) - np.asarray(to))) * SCAN_DEG_S / 2.0)


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
    """A receiver at an azimuth and elevation [deg]; the array's beams follow it.

    ``beams`` of each scan are asked for: over the whole sector while the receiver has no pulse,
    then 2 deg to each side. ``compensated=False``: the array takes the deck for level. ``angles``
    are those found from the times of the pulses to and fro [deg], of every scan with a pulse.

    Raises
    ------
    InputError
        A receiver outside the sector; fewer than 8 beams; see `Array` and `deck`.
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
    ) -> None:
        inside = abs(azimuth_deg) <= SCAN_DEG
        require(inside, "landing, azimuth_deg", "-62 to 62", azimuth_deg)
        require(abs(elevation_deg) <= 45.0, "landing, elevation_deg", "-45 to 45", elevation_deg)
        require(beams >= 8, "landing, beams", "8 or more", beams)
        self.array, self.beams, self.elevation = Array(elements, spacing), beams, elevation_deg
        deck_motion = deck(motion, seconds, seed)
        toward = quaternion_conjugate(deck_motion.q)
        self.receiver = rotate(toward, direction(azimuth_deg, elevation_deg))
        ((run,),) = run_forms(MlsAttitude(), [records(deck_motion, seed)], levels=("c",))
        self.q = attitude_of(run.outputs)
        if not compensated:
            self.q[:] = [1.0, 0.0, 0.0, 0.0]

    def start(self) -> None:
        """Restart."""
        self._scan, self._beam, self._centre, self._half = 0, 0, 0.0, SCAN_DEG
        self._amplitude = np.zeros(self.beams)
        self.angles: list[float] = []

    @property
    def _sample(self) -> int:
        """Sample of the deck at this scan."""
        return round((SETTLED_S + self._scan / SCANS_HZ) * RATE_HZ)

    def _scanned(self) -> FloatArray:
        """Azimuths of this scan [deg]."""
        low, high = self._centre - self._half, self._centre + self._half
        return np.linspace(max(low, -SCAN_DEG), min(high, SCAN_DEG), self.beams)

    def record(self, outputs: Mapping[str, float] | None) -> Mapping[str, float] | None:
        """The next beam; see `World`."""
        if outputs is not None:
            self._received(outputs)
        if self._sample >= len(self.q):
            return None
        beam = direction(self._scanned()[self._beam], self.elevation)
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
        if self._half < SCAN_DEG and pulse.peak > 0.5 and 0 < top < self.beams - 1:
            self.angles.append(float(angle_of(*scan_times(pulse.centre))))
            self._centre, self._half = self.angles[-1], 2.0
        elif pulse.peak > 0.25:  # a sight of it: nearer
            self._centre, self._half = float(scan[top]), 4.0
        else:
            self._centre, self._half = 0.0, SCAN_DEG
        self._scan, self._beam = self._scan + 1, 0
