"""A deck with a landing-system array: worlds for `mls_attitude` and `array_phases`.

`OnDeck` gives the sensors' records. `Landing` asks `array_phases` for beams about the angle at
which the receiver last found the pulse; what the phases that come back send to the receiver decides
where the next beams go.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from boresight.model.errors import InputError
from boresight.model.estimators.mls_attitude import MlsAttitude
from boresight.sim.attitude.rotation import quaternion_conjugate, rotate
from boresight.sim.levels.build import Build
from boresight.sim.levels.integer import Emitted
from boresight.sim.worlds.mls_array import SCAN_DEG, Array, angle_of, direction, pulse, scan_times
from boresight.sim.worlds.mls_deck import RATE_HZ, deck, records
from boresight.sim.worlds.world import World

__all__ = ["Landing", "OnDeck"]

SCANS_HZ = 13.5  #: how often the azimuth is scanned.
SETTLED_S = 1.0  #: of the filter, before the first scan.


class OnDeck(World):
    """Sensors on a deck: ``OnDeck("sea_5", seed=3)``, a motion of `mls_deck.MOTIONS`."""

    name = "on_deck"

    def __init__(
        self, motion: str = "sea_5", seed: int = 1, seconds: float = 10.0, heading_deg: float = 0.0
    ) -> None:
        what = deck(motion, seconds, seed, heading_deg)
        angles = (what.euler / math.pi + 1.0) % 2.0 - 1.0
        names = [i.name for i in MlsAttitude.inputs]
        names += [f"{n}_true" for n in ("roll", "pitch", "heading", "qw", "qx", "qy", "qz")]
        rows = np.concatenate([records(what, seed), angles, what.q], axis=1)
        self.records = [dict(zip(names, row, strict=True)) for row in rows.tolist()]

    def start(self) -> None:
        """Begin anew."""
        self._left = iter(self.records)

    def record(self, outputs: Mapping[str, float] | None) -> Mapping[str, float] | None:
        """The next record; see `World`."""
        return next(self._left, None)


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
        for good, where, wanted, found in (
            (abs(azimuth_deg) <= SCAN_DEG, "azimuth_deg", "-62 to 62", azimuth_deg),
            (abs(elevation_deg) <= 45.0, "elevation_deg", "-45 to 45", elevation_deg),
            (beams >= 8, "beams", "8 or more", beams),
        ):
            if not good:
                raise InputError.at(
                    f"landing, {where}", wanted=wanted, found=repr(found), fix="correct it"
                )
        self.array, self.beams, self.elevation = Array(elements, spacing), beams, elevation_deg
        what = deck(motion, seconds, seed)
        toward = direction(azimuth_deg, elevation_deg)
        self.receiver = rotate(quaternion_conjugate(what.q), toward)
        told = Emitted(Build(MlsAttitude())).run(records(what, seed)).outputs
        self.told = np.stack([told[f"q{a}"] for a in "wxyz"], axis=1)
        if not compensated:
            self.told[:] = [1.0, 0.0, 0.0, 0.0]

    def start(self) -> None:
        """Begin anew."""
        self._scan, self._beam, self._centre, self._half = 0, 0, 0.0, SCAN_DEG
        self._amplitude = np.zeros(self.beams)
        self.angles: list[float] = []

    @property
    def _now(self) -> int:
        """Sample of the deck at this scan."""
        return round((SETTLED_S + self._scan / SCANS_HZ) * RATE_HZ)

    def _scanned(self) -> npt.NDArray[np.float64]:
        """Azimuths of this scan [deg]."""
        low, high = self._centre - self._half, self._centre + self._half
        return np.linspace(max(low, -SCAN_DEG), min(high, SCAN_DEG), self.beams)

    def record(self, outputs: Mapping[str, float] | None) -> Mapping[str, float] | None:
        """The next beam; see `World`."""
        if outputs is not None:
            self._received(outputs)
        if self._now >= len(self.told):
            return None
        beam = direction(self._scanned()[self._beam], self.elevation)
        names = (*(f"q{a}" for a in "wxyz"), *(f"beam_{a}" for a in "xyz"))
        return dict(zip(names, [*self.told[self._now].tolist(), *beam.tolist()], strict=True))

    def _received(self, outputs: Mapping[str, float]) -> None:
        """What the last beam's phases sent to the receiver; at the end of a scan, where it is."""
        n = sum(name.startswith("phase_") for name in outputs)
        if n != self.array.elements:
            raise InputError.at(
                "landing, elements",
                wanted=f"as many as the estimator has phases, {n}",
                found=str(self.array.elements),
                fix=f"write Landing(elements={n}), or ArrayPhases of as many",
            )
        phases = np.array([[outputs[f"phase_{k}"] for k in range(n)]])
        self._amplitude[self._beam] = abs(self.array.field(phases, self.receiver[self._now])[0])
        self._beam += 1
        if self._beam < self.beams:
            return
        scan, top = self._scanned(), int(self._amplitude.argmax())
        found = pulse(scan, self._amplitude, 2.0 * self._half)
        if self._half < SCAN_DEG and found.peak > 0.5 and 0 < top < self.beams - 1:
            self.angles.append(float(angle_of(*scan_times(found.centre))))
            self._centre, self._half = self.angles[-1], 2.0
        elif found.peak > 0.25:  # a sight of it: nearer
            self._centre, self._half = float(scan[top]), 4.0
        else:
            self._centre, self._half = 0.0, SCAN_DEG
        self._scan, self._beam = self._scan + 1, 0
