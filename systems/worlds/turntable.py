"""A mark on a turntable that gives an azimuth once a turn, and its faults."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from boresight.model.arrays import FloatArray, IntArray
from boresight.model.errors import require

STEP = 2.0 * math.pi / 2**18  #: of an encoder of 18 bits [rad], 4.94".


@dataclass(frozen=True)
class Mark:
    """Position of the mark, its sensor, and faults.

    * ``at_deg``: azimuth of the mark, counter-clockwise as the heading;
    * ``index`` "hall": a pulse at the mark, timed, as far off as an encoder's step (standard
      deviation 1.43"); "encoder": one of 18 bits, read with every sample, the first angle after the
      mark is told; "none";
    * ``missed``, ``doubled``, ``wrong``: shares of the turns with no pulse; another one of the same
      mark up to five samples later; one of the mark anywhere in the turn.

    `InputError`: no such index, a share that is none.
    """

    at_deg: float = 90.0
    index: str = "hall"
    missed: float = 0.0
    doubled: float = 0.0
    wrong: float = 0.0

    def __post_init__(self) -> None:
        kinds = ("hall", "encoder", "none")
        require(self.index in kinds, "mark, index", f"one of {', '.join(kinds)}", self.index)
        for name in ("missed", "doubled", "wrong"):
            value = getattr(self, name)
            require(0.0 <= value <= 1.0, f"mark, {name}", "a share, 0 to 1", value)


class Pulses(NamedTuple):
    """Pulses in order of time, each (n,)."""

    sample: IntArray  #: in which each comes, one at most in each.
    share: FloatArray  #: when in it, 0 (its begin) to 1 (its end).
    azimuth: FloatArray  #: of the mark [rad], 0 to 2 pi.


def pulses(
    mark: Mark, heading: float, rate: float, samples: int, dt: float, rng: np.random.Generator
) -> Pulses:
    """Pulses of a turntable that turns at a rate [rad/s], above 0, from a heading [rad] on."""
    turn, mark_angle, step = 2.0 * math.pi, math.radians(mark.at_deg), rate * dt
    count = math.ceil(samples * step / turn) + 1
    noise, draws = rng.normal(size=count), rng.random((4, count))
    delay = 1.0 + 4.0 * rng.random(count)
    # Times are in samples, of which k ends at k + 1.
    marks = ((mark_angle - heading) % turn + turn * np.arange(count)) / step
    readings = np.full(count, mark_angle)
    if mark.index == "encoder":
        times = np.ceil(marks)
        readings = mark_angle + STEP * np.rint(step * (times - marks) / STEP)
    else:
        times = marks + STEP / math.sqrt(12.0) * noise / step
    present = (draws[0] >= mark.missed) & (mark.index != "none")
    repeated = present & (draws[1] < mark.doubled)
    misplaced = (draws[2] < mark.wrong) & (mark.index != "none")
    parts = (present, times), (repeated, times + delay), (misplaced, marks + draws[3] * turn / step)
    t = np.concatenate([times[selected] for selected, times in parts])
    azimuth = np.concatenate([readings[selected] for selected, _ in parts]) % turn
    inside = (t > 0.0) & (t <= samples)
    t, azimuth = t[inside], azimuth[inside]
    sample, first = np.unique(np.ceil(t).astype(np.int64) - 1, return_index=True)
    return Pulses(sample, t[first] - sample, azimuth[first])
