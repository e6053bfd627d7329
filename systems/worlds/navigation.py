"""Inertial navigation: readings of ideal sensors, errors of a filter around outages."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.model.arrays import FloatArray
from boresight.sim.rotations import rotation
from boresight.sim.rotations.accuracy import attitude_of, largest_turn_deg
from boresight.sim.worlds.loop import Loop


def rates_and_forces(
    q: FloatArray, v: FloatArray, gravity: npt.ArrayLike, dt: float
) -> tuple[FloatArray, FloatArray]:
    """Mean rates [rad/s] and specific forces [m/s^2] (n, 3) of each step of ``dt`` [s], body axes.

    Of attitudes (n + 1, 4), body to navigation; velocities (n + 1, 3) [m/s] and gravity (3,)
    [m/s^2] are in navigation axes. A rate is constant over its step; a force is that of the
    attitude in the middle of it.
    """
    rates = rotation.turns_between(q[:-1], q[1:]) / dt
    mid_attitude = rotation.quaternion_multiply(
        q[:-1], rotation.rotation_vector_to_quaternion(0.5 * dt * rates)
    )
    return rates, rotation.rotate(
        rotation.quaternion_conjugate(mid_attitude), np.diff(v, axis=0) / dt - np.asarray(gravity)
    )


def errors_of(
    loop: Loop,
    reference: Mapping[str, FloatArray],
    outages: Iterable[tuple[float, float]],
    dt: float,
    axes: str,
) -> tuple[dict[str, Any], dict[str, Any], slice]:
    """Figures and panels of `CasesExperiment`, and the records after half a minute.

    Velocity and position count outside the outages [s] and two seconds after each, ``drift`` is
    the largest error of the position within; degrees, m/s, m.
    """
    out, truth = loop.outputs, loop.truth
    late, t = slice(round(30.0 / dt), None), dt * np.arange(len(loop.inputs))
    attitude = np.degrees(rotation.angle_between(attitude_of(out), attitude_of(truth)))
    v, p = (np.sqrt(sum((out[k + c] - truth[k + c]) ** 2 for c in axes)) for k in "vp")
    blind = np.zeros(len(t), dtype=bool)
    for begin, end in outages:
        blind |= (begin <= t) & (t < end + 2.0) & (begin < end)
    blind, fixed = blind[late], {name: values[:, 0] for name, values in out.items()}
    figures = {
        "attitude_rms": np.sqrt(np.mean(attitude[late] ** 2, axis=0)),
        "attitude_max": attitude[late].max(axis=0),
        "velocity_rms": np.sqrt(np.mean(v[late][~blind] ** 2, axis=0)),
        "position_rms": np.sqrt(np.mean(p[late][~blind] ** 2, axis=0)),
        "drift_max": p[late][blind].max(axis=0, initial=0.0),
        "fixed_float_max": largest_turn_deg(attitude_of(fixed), attitude_of(reference)),
    }
    panels = {"attitude, deg": attitude, "velocity, m/s": v, "position, m": p}
    return figures, {label: {"": error[:, 0]} for label, error in panels.items()}, late
