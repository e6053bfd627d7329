"""The array on its turntable: its motion, what its unit reports, the mark's pulses, draws."""

import math

import numpy as np
import pytest

from boresight.systems.array.world import ALIGNED, DT, ERECTED, TurningArray

SHORT = {"hours": 30.0 / 3600.0}


def whole(world: TurningArray) -> dict[str, np.ndarray]:
    """All records as columns."""
    pieces = list(world.pieces())
    return {n: np.concatenate([p[n] for p in pieces]) for n in pieces[0]}


def vectors(columns: dict[str, np.ndarray], what: str) -> np.ndarray:
    return np.stack([columns[f"{what}_{a}"] for a in "xyz"], axis=1)


def test_motion() -> None:
    """Level for 300 s at 1, 2, 90 deg; erected to 66; then 36 deg/s counter-clockwise."""
    result = whole(TurningArray(36.0, **SHORT))
    angles = 180.0 * np.stack([result[f"{n}_true"] for n in ("pitch", "roll", "heading")], axis=1)
    np.testing.assert_allclose(angles[: ALIGNED + 1], [[1.0, 2.0, 90.0]] * 30001, atol=1e-12)
    k = np.arange(1301)
    wanted = np.stack([1.0 + 0.05 * k, 2.0 + 0.0 * k, 90.0 + 0.0 * k], axis=1)
    np.testing.assert_allclose(angles[ALIGNED : ERECTED + 1], wanted, atol=1e-10)
    k = np.arange(3001)
    heading = (90.0 + 0.36 * k + 180.0) % 360.0 - 180.0
    np.testing.assert_allclose(angles[ERECTED:, :2], [[66.0, 2.0]] * 3001, atol=1e-10)
    np.testing.assert_allclose((angles[ERECTED:, 2] - heading + 180.0) % 360.0, 180.0, atol=1e-9)
    phases, begins = np.unique(result["phase"], return_index=True)
    assert phases.tolist() == [-1.0, 0.0, 1.0, 2.0]
    assert begins.tolist() == [0, 1, ALIGNED + 1, ERECTED + 1]


def test_increments_of_a_perfect_unit() -> None:
    """Earth rate and gravity at rest; 36 deg/s about the vertical, which is 66 deg away."""
    world = TurningArray(36.0, errors=0.0, **SHORT)
    result = whole(world)
    turn, push = vectors(result, "dtheta") / DT, vectors(result, "dv") / DT
    latitude = math.radians(31.9521)
    rest, late = slice(1, ALIGNED), slice(ERECTED + 1, None)
    earth = np.linalg.norm(turn[rest].mean(axis=0))
    assert earth == pytest.approx(7.292115e-5, rel=1e-8)
    up = push[rest].mean(axis=0) / np.linalg.norm(push[rest].mean(axis=0))
    assert float(turn[rest].mean(axis=0) @ up) == pytest.approx(
        7.292115e-5 * math.sin(latitude), rel=1e-7
    )
    pitch, roll = np.radians([1.0, 2.0])
    vertical = [-np.cos(pitch) * np.sin(roll), np.sin(pitch), np.cos(pitch) * np.cos(roll)]
    np.testing.assert_allclose(up, vertical, atol=1e-9)
    assert np.linalg.norm(push[late], axis=1) == pytest.approx(9.79466, abs=1e-5)
    about = turn[late] @ (push[late].mean(axis=0) / 9.79466)
    assert about == pytest.approx(math.radians(36.0) + 7.292115e-5 * math.sin(latitude), abs=2e-6)


def test_counts_carry_what_they_leave() -> None:
    """Whole counts; their sum is that of what is felt, to a count."""
    world = TurningArray(36.0, counts_bits=20, **SHORT)
    result = whole(world)
    for k, (what, full) in enumerate((("dtheta", 2.0**-7), ("dv", 0.25))):
        count = full * 2.0**-19
        reading = vectors(result, what)[1:]
        np.testing.assert_array_equal(reading / count, np.rint(reading / count))
        bias, matrix = world.constant[k]
        felt = world.motion.increments(0, world.samples)[:, 3 * k : 3 * k + 3] @ matrix.T
        left = np.cumsum(reading - felt - bias * DT, axis=0)
        assert np.abs(left).max() <= 0.5 * count * (1.0 + 2e-3)


def test_pulses_tell_where_the_array_is() -> None:
    """At a pulse the truth, interpolated in its sample, is what the pulse tells."""
    result = whole(TurningArray(36.0, seed=2, mark_deg=120.0, hours=120.0 / 3600.0))
    at = np.flatnonzero(~np.isnan(result["azimuth"]))[1:]
    assert len(at) == 12 and (result["phase"][at] == 2.0).all()
    heading, share = result["heading_true"], result["index_time"][at]
    there = heading[at - 1] + share * (heading[at] - heading[at - 1])
    off = 180.0 * 3600.0 * (there - result["azimuth"][at])
    assert np.abs(off).max() < 5.0 and np.abs(off).max() > 0.2
    assert (np.isnan(result["index_time"]) == np.isnan(result["azimuth"])).all()
