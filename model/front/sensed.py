"""What the sensors of a board give to any estimator, by the names of its inputs."""

from __future__ import annotations

from dataclasses import dataclass

from boresight.model.front.affine import AXES
from boresight.model.front.inertial import ACC_SCALE, DT_LIMIT, GAP_S, GYRO_SCALE

__all__ = ["ACC_COUNTS", "GYRO_COUNTS", "SENSED", "Sensed"]

#: Full scale of the inertial sensor in counts, at any range: 300 deg/s and 5 g (the maker's).
GYRO_COUNTS, ACC_COUNTS = 24000, 20000
#: uT: full scale of the compass's magnetometer, 2 gauss (the maker's).
_FIELD = 200.0


@dataclass(frozen=True)
class Sensed:
    """An input that a sensor gives: its unit and the sensor's full scale.

    ``always``: with every sample; else the estimator has to say what it reads in between
    (`Input.missing`).
    """

    unit: str
    low: float
    high: float
    always: bool = True


def _axes(letter: str, unit: str, limit: float, *, always: bool = True) -> dict[str, Sensed]:
    return {f"{letter}{a}": Sensed(unit, -limit, limit, always) for a in AXES}


#: By name. A ``dt`` below 0 restarts a filter whose range has it; others read the least they have.
SENSED = {
    "dt": Sensed("s", -DT_LIMIT, GAP_S),
    **_axes("g", "rad/s", GYRO_COUNTS * GYRO_SCALE),
    **_axes("a", "m/s^2", ACC_COUNTS * ACC_SCALE),
    **_axes("m", "uT", _FIELD, always=False),
}
