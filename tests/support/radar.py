"""Records of two radars for tests, by pymap3d alone: no code of the worlds or the estimator."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pymap3d

from boresight.systems.radar.estimator import Registration
from tests.support.compiled_float import compiled_float

FILTER = Registration()

#: Longitude, latitude [deg], height [m].
RADARS = ((115.74, 29.43, 5.0), (114.11, 30.71, 5.0))
_DEG = math.pi / 180.0
BIAS = np.array([20.0, 0.1 * _DEG, 0.2 * _DEG])
NOISE = np.array([10.0, 0.07 * _DEG, 0.15 * _DEG])


def polar(place: Any, radar: Any) -> Any:
    """Range, elevation, azimuth [m, rad] of ECEF positions (..., 3)."""
    longitude, latitude, height = radar
    e, n, u = pymap3d.ecef2enu(*np.moveaxis(np.asarray(place), -1, 0), latitude, longitude, height)
    r = np.sqrt(e * e + n * n + u * u)
    return np.stack([r, np.arcsin(u / r), np.arctan2(e, n)], axis=-1)


def ecef(point: Any, radar: Any) -> Any:
    """ECEF positions of (..., 3) range, elevation, azimuth."""
    longitude, latitude, height = radar
    r, e, n = np.moveaxis(np.asarray(point), -1, 0)
    local = (r * np.cos(e) * np.sin(n), r * np.cos(e) * np.cos(n), r * np.sin(e))
    return np.stack(pymap3d.enu2ecef(*local, latitude, longitude, height), axis=-1)


def _flight() -> Any:
    """A falling body on a parabola, as seen from the earth: near enough to the paper's target."""
    t = 0.1 * np.arange(1701)[:, None]
    place, speed = np.array([-2664e3, 5350e3, 2870e3]), np.array([1700.0, 104.0, 1100.0])
    down = -8.9 * place / np.linalg.norm(place)
    return place + speed * t + 0.5 * down * t * t


TRUTH = _flight()


def records(*, noise: float, steps: int, seed: int = 1) -> Any:
    """Inputs (steps, 9) of `Registration`; ``noise`` scales that of the paper."""
    rng = np.random.default_rng(seed)
    u = np.zeros((steps, 9))
    u[:, 0], u[:, 7:] = 0.1, 1.0
    u[0, 0] = -0.1
    for k, radar in enumerate(RADARS):
        seen = polar(TRUTH[:steps], radar) + BIAS + noise * NOISE * rng.normal(size=(steps, 3))
        u[:, 1 + 3 * k : 4 + 3 * k] = ecef(seen, radar)
    return u


def first(range_m: float, angle_deg: float) -> dict[str, float]:
    """Parameters of a P0."""
    over = {"range": range_m / 10.0, "elevation": angle_deg / 0.07, "azimuth": angle_deg / 0.15}
    return {f"p0_{n}_{i}": v for i in "12" for n, v in over.items()}


def float_outputs(u: Any, params: Sequence[dict[str, float]]) -> dict[str, Any]:
    """Outputs (steps, runs) in float64, a run for each set of parameters."""
    runs = [compiled_float(FILTER, u[:, :, None], p)[0] for p in params]
    return {o.name: np.concatenate([r[o.name] for r in runs], axis=1) for o in FILTER.outputs}


def float_states(u: Any, params: dict[str, float]) -> dict[str, Any]:
    """States (steps,) after every record, in float64; ``wide``: its rows were not used."""
    states = {n: v[:, 0] for n, v in compiled_float(FILTER, u[:, :, None], params)[1].items()}
    (weight,) = (s.initial for s in FILTER.states if s.name == "weight")
    return {**states, "wide": np.diff(states["weight"], prepend=weight) < 0.0}
