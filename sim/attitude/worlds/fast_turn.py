"""A quick turn of the sensor in its housing, put on a log: the truth turns with it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.rotations.rotation import (
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_rotation_vector,
    rotate,
    rotation_vector_to_quaternion,
)

RAMP_S = 0.1  #: s, in which the rate of the turn rises, and in which it falls.


def fast_turn(
    log: NineAxis, *, begin_s: float, rate_rad_s: npt.ArrayLike, seconds: float
) -> NineAxis:
    """The log of a sensor that turns in its housing and stays there.

    From then on its axes are others: v_sensor = r* v_body r, with the turn r so far. The steps
    of gyro and truth agree as well as those of the log. Nothing is clipped.

    Parameters
    ----------
    begin_s : float
        Time of the log [s] at which the rate begins to rise.
    rate_rad_s : three floats
        Rate about sensor axes [rad/s] between rise and fall; less than half a turn in a step.
    seconds : float
        Time at that rate [s].
    """
    corners = begin_s + np.cumsum([0.0, RAMP_S, seconds, RAMP_S])
    share = np.interp(log.t - 0.5 * log.dt, corners, [0.0, 1.0, 1.0, 0.0])
    turn_time = np.cumsum(share * log.dt)[:, None]
    r = rotation_vector_to_quaternion(turn_time * np.asarray(rate_rad_s, dtype=np.float64))
    # A step of the sensor: back by the turn before it, the step of the housing, the turn after it.
    turn_back = quaternion_conjugate(np.concatenate([[[1.0, 0.0, 0.0, 0.0]], r[:-1]]))
    housing = rotation_vector_to_quaternion(log.gyr * log.dt[:, None])
    step = quaternion_multiply(quaternion_multiply(turn_back, housing), r)
    to_sensor = quaternion_conjugate(r)
    return replace(
        log,
        gyr=quaternion_to_rotation_vector(step) / log.dt[:, None],
        acc=rotate(to_sensor, log.acc),
        mag=rotate(to_sensor, log.mag),
        q=None if log.q is None else quaternion_multiply(log.q, r),
    )
