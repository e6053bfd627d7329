"""Drives of a vehicle with a satellite antenna: its motion, and shadows on the satellite."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt

from boresight.model.arrays import FloatArray
from boresight.model.errors import require
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


def drive(name: str, rate_hz: float = 50.0) -> Drive:
    """One of `DRIVES`, at 10 to 1000 records a second.

    `InputError`: no such drive, another rate.
    """
    for valid, where, wanted, found in (
        (name in DRIVES, "drive", f"one of {', '.join(DRIVES)}", name),
        (10.0 <= rate_hz <= 1000.0, "drive, rate_hz", "10 to 1000 Hz", rate_hz),
    ):
        require(valid, where, wanted, found)
    return DRIVES[name](rate_hz)


def _wave(t: FloatArray, period: float) -> FloatArray:
    return np.sin(2.0 * np.pi * t / period)
