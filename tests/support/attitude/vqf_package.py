"""The `vqf` package as an oracle, and a motion that takes VQF through all of its decisions."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from boresight.model.attitude.vqf import Vqf
from boresight.sim.rotations.rotation import (
    quaternion_conjugate,
    quaternion_running_product,
    rotate,
    rotation_vector_to_quaternion,
)

FloatArray = npt.NDArray[np.float64]

COLUMNS = ("dt", "gx", "gy", "gz", "mx", "my", "mz", "ax", "ay", "az")
_FIELD = np.array([0.0, 20.0, -44.0])  # uT


def by_package(estimator: Vqf, inputs: FloatArray) -> dict[str, Any]:
    """Attitudes (n, 4), rest (n,) and disturbance (n,) of the package's filter for real time."""
    at = {i.name: k for k, i in enumerate(estimator.inputs)}
    triads = [
        np.ascontiguousarray(inputs[:, [at[f"{kind}{a}"] for a in "xyz"]])
        for kind in ("gam" if estimator.settings.magnetic else "ga")
    ]
    settings = estimator.settings
    vqf = pytest.importorskip("vqf")
    out = vqf.VQF(settings.step_s, magTs=settings.mag_step_s).updateBatch(*triads)
    return {
        "q": out["quat9D" if settings.magnetic else "quat6D"],
        "rest": out["restDetected"],
        "disturbed": out.get("magDistDetected"),
    }


def angle_deg(a: FloatArray, b: FloatArray) -> FloatArray:
    """Angle (n,) between attitudes (n, 4), of either sign, to the last digits of small ones."""
    chord = np.minimum(np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1))
    angle: FloatArray = np.degrees(4.0 * np.arcsin(np.minimum(chord / 2.0, 1.0)))
    return angle


def inputs_of(estimator: Vqf, records: FloatArray) -> FloatArray:
    """Columns of `COLUMNS` in the order of an estimator's inputs."""
    return records[:, [COLUMNS.index(i.name) for i in estimator.inputs]]


def journey(rate_hz: float, seconds: float = 190.0, every: int = 1, seed: int = 1) -> FloatArray:
    """Records (n, 10): rests and turns with a biased gyro, among magnets.

    Rest up to 5 s and from 40 to 46 s. A magnet from 25 to 40 s; another field from 50 s on, in
    which the body turns slowly until 115 s, so that it is rejected for more than a minute, and
    then fast enough to make it the reference. ``every``: of how many samples one has a field.
    """
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds * rate_hz)) / rate_hz
    moving = (t > 5.0) & ~((t > 40.0) & (t < 46.0))
    fast = np.where((t > 50.0) & (t < 115.0), 0.15, 1.2) * moving
    waves = np.sin(2.0 * np.pi * rng.uniform(0.05, 0.3, 3) * t[:, None] + rng.uniform(0, 6.28, 3))
    rate = fast[:, None] * waves
    start = np.array([0.6, -0.3, 0.64, 0.37]) / np.linalg.norm([0.6, -0.3, 0.64, 0.37])
    turns = rotation_vector_to_quaternion(rate[1:] / rate_hz)
    q = np.vstack([start, quaternion_running_product(start, turns)])
    field = np.tile(_FIELD, (len(t), 1))
    field[(t > 25.0) & (t < 40.0)] += [30.0, 0.0, 10.0]
    field[t > 50.0] = [9.0, 30.0, -20.0]
    force = np.array([0.0, 0.0, 9.81]) + 0.8 * moving[:, None] * waves[:, ::-1]
    to_body = quaternion_conjugate(q)
    noises = (rng.normal(0.0, sd, (len(t), 3)) for sd in (0.003, 0.3, 0.02))
    triads = [
        value + noise
        for value, noise in zip(
            (rate + [0.006, -0.009, 0.004], rotate(to_body, field), rotate(to_body, force)),
            noises,
            strict=True,
        )
    ]
    triads[1][np.arange(len(t)) % every != 0] = 0.0
    return np.column_stack([np.full(len(t), 1.0 / rate_hz), *triads])
