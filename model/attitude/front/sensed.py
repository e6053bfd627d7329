"""Words of a board's sensors for any estimator, by the names of its inputs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from boresight.model.attitude.front.affine import AXES
from boresight.model.attitude.front.inertial import ACC_SCALE, DT_LIMIT, GAP_S, GYRO_SCALE
from boresight.model.declarations import GRAVITY, Param

#: Full scale of the inertial sensor in counts, at any range: 300 deg/s and 5 g (the maker's).
GYRO_COUNTS, ACC_COUNTS = 24000, 20000
#: uT: full scale of the compass's magnetometer, 2 gauss (the maker's).
_FIELD = 200.0


@dataclass(frozen=True)
class Sensed:
    """An input that a sensor gives: its unit and the sensor's full scale.

    ``always``: with every sample; else the estimator declares its value in between
    (`Input.missing`).
    """

    unit: str
    low: float
    high: float
    always: bool = True


def _axes(letter: str, unit: str, limit: float, *, always: bool = True) -> dict[str, Sensed]:
    return {f"{letter}{a}": Sensed(unit, -limit, limit, always) for a in AXES}


#: By name. A ``dt`` below 0 restarts a filter; it is clamped where the filter's range excludes it.
SENSED = {
    "dt": Sensed("s", -DT_LIMIT, GAP_S),
    **_axes("g", "rad/s", GYRO_COUNTS * GYRO_SCALE),
    **_axes("a", "m/s^2", ACC_COUNTS * ACC_SCALE),
    **_axes("m", "uT", _FIELD, always=False),
}


def full_scale_params(
    params: Iterable[Param], *, rate: float | None = None, force: float | None = None
) -> dict[str, float]:
    """Values of those parameters that stand for a sensor's full scale.

    A little less than the full scale of each axis, since calibration moves it; of the force
    without gravity, which its mean holds. Values end at the limits of their parameters.

    Parameters
    ----------
    params : iterable of Param
        Of any estimator.
    rate, force : float, optional
        Full scale of the gyro [rad/s] and of the accelerometer [m/s^2].
    """
    values = {}
    if rate is not None:
        values["gyro_most_sq"] = values["gyro_max_sq"] = 0.98 * 0.98 * rate * rate
    if force is not None:
        limit = 0.98 * force - GRAVITY
        values["force_most_sq"] = limit * limit
    return {q.name: min(max(values[q.name], q.low), q.high) for q in params if q.name in values}


def board_params(params: Iterable[Param]) -> dict[str, float]:
    """`full_scale_params` of the board's own sensors, with which every board has its estimators."""
    return full_scale_params(params, rate=SENSED["gx"].high, force=SENSED["ax"].high)
