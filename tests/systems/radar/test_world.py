"""Two radars and their flights."""

import math

import numpy as np
import pytest

from boresight.systems.radar.world import (
    BIAS,
    EARTH_RATE,
    GM,
    NOISE,
    TwoRadars,
    ballistic,
    seen_from,
)

# -- two radars: what they report and miss; draws -------------------------------------------------

DEG = math.pi / 180.0


def reported(world: TwoRadars) -> np.ndarray:
    """Everything the world says of positions, (n, 6)."""
    world.start()
    rows = []
    while (r := world.record(None)) is not None:
        rows.append([r[f"{a}{i}"] for i in "12" for a in "xyz"])
    return np.array(rows)


def test_biases_and_noise_are_those_asked_for() -> None:
    world = TwoRadars(seconds=100.0, seed=5)
    data = reported(world)
    assert data.shape == (1001, 6)
    for i in range(2):
        off = seen_from(world.sites[i], data[:, 3 * i : 3 * i + 3]) - world.seen[i]
        off[:, 2] = (off[:, 2] + math.pi) % (2.0 * math.pi) - math.pi
        unit = np.array([1.0, DEG, DEG])
        own = slice(3 * i, 3 * i + 3)
        assert off.std(axis=0) / unit == pytest.approx(NOISE[own], rel=0.08)
        error = np.array(NOISE[own]) / math.sqrt(len(off))
        assert (np.abs(off.mean(axis=0) / unit - BIAS[own]) < 4.0 * error).all()


def test_missed_samples() -> None:
    world = TwoRadars(seconds=100.0, missed=0.2)
    missing = np.isnan(reported(world)[:, ::3])
    assert missing.mean(axis=0) == pytest.approx([0.2, 0.2], abs=0.04)
    assert (missing[:, 0] != missing[:, 1]).any()
    exact = TwoRadars(seconds=10.0, noise=0.0, bias=(0.0,) * 6)
    assert reported(exact) == pytest.approx(np.hstack([exact.place] * 2), abs=1e-6)


# -- flights: an orbit and energy against closed forms, lines, the ground -------------------------

T = 0.1 * np.arange(1701)


def test_free_fall_keeps_what_it_must() -> None:
    """Energy in turning axes, v^2/2 - GM/r (1 + flattening) - |w x p|^2/2; no drift by the step."""
    p = ballistic((-2664e3, 5350e3, 2870e3), (1700.0, 104.0, 1100.0), T)
    v = np.gradient(p, T, axis=0, edge_order=2)
    r = np.linalg.norm(p, axis=1)
    flat = 1.08262668e-3 * (6378137.0 / r) ** 2 * (0.5 - 1.5 * (p[:, 2] / r) ** 2)
    spun = 0.5 * EARTH_RATE**2 * (p[:, 0] ** 2 + p[:, 1] ** 2)
    energy = 0.5 * (v**2).sum(axis=1) - GM / r * (1.0 + flat) - spun
    assert np.ptp(energy[1:-1]) < 1e-6 * abs(energy[0])
    fine = ballistic((-2664e3, 5350e3, 2870e3), (1700.0, 104.0, 1100.0), T[::10])
    assert fine[-1] == pytest.approx(p[-1], abs=1e-3)
