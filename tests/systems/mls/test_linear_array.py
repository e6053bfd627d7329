"""Antennas and decks."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.systems.mls.phases import Array, direction
from boresight.systems.mls.world import SensorErrors, deck, records

# -- patterns in closed form and summed, displacements, main lobes --------------------------------


def phases(array: Array, azimuth: float) -> np.ndarray:
    along = direction(azimuth, 0.0)[1]
    return (array.spacing * along * np.arange(array.elements))[None, :] % 1.0


@pytest.mark.parametrize("array", [Array(), Array(16), Array(24, 0.8)])
def test_summed_pattern_is_the_closed_form(array: Array) -> None:
    azimuth = np.linspace(-89.0, 89.0, 700)
    for beam in (-40.0, 0.0, 62.0):
        result = np.abs(array.field(phases(array, beam), direction(azimuth, 0.0)))[:, 0]
        of = math.sin(math.radians(beam))
        # (5), (6): |sin(N u/2) / (N sin(u/2))|
        half, n = np.pi * array.spacing * (np.sin(np.radians(azimuth)) - of), array.elements
        assert np.abs(result - np.abs(np.sin(n * half) / (n * np.sin(half)))).max() < 1e-12


def test_a_rigid_turn_is_a_turn_of_the_direction_and_a_displacement_is_not() -> None:
    array = Array(16)
    turn = math.radians(10.0)
    place = 0.5 * np.arange(16)
    moved = np.zeros((1, 16, 3))
    moved[0, :, 0], moved[0, :, 1] = -place * math.sin(turn), place * (math.cos(turn) - 1.0)
    e = direction(25.0, 0.0)
    as_displacement = array.field(phases(array, 25.0), e, moved)[0, 0]
    as_turn = array.field(phases(array, 25.0), direction(15.0, 0.0))[0]
    assert as_displacement == pytest.approx(as_turn, abs=1e-12)
    assert abs(as_turn) < 0.3
    again = array.field(phases(array, 15.0), e, moved)[0, 0]  # what compensation does
    assert abs(again) == pytest.approx(1.0)


@pytest.mark.parametrize("axis, b", [(0, 0.1), (0, 0.5), (1, 0.5), (2, 0.5)])
def test_mean_gain_of_displaced_elements(axis: int, b: float) -> None:
    """exp(-(2 pi b d c/lambda)^2/2), in the mean over draws of the field itself."""
    array, e = Array(), direction(50.0, 20.0)
    q = array.displacements(axis, b, 4000, np.random.default_rng(1))
    assert q[:, :, axis].std() == pytest.approx(0.5 * b, rel=0.01)
    assert not np.delete(q, axis, axis=2).any()
    steer = (0.5 * e[1] * np.arange(64))[None, :]
    result = array.field(steer, e, q).mean()
    wanted = math.exp(-((2.0 * math.pi * b * 0.5 * e[axis]) ** 2) / 2.0)
    assert result.real == pytest.approx(wanted, abs=0.01) and abs(result.imag) < 0.01


# -- decks and their sensors, against scipy's rotations -------------------------------------------

EXACT = SensorErrors(0.0, (0.0, 0.0, 0.0), 0.0, 0.0, 0.0)


def attitude(what) -> Rotation:
    return Rotation.from_euler("ZYX", what.euler[:, ::-1])


def test_exact_sensors() -> None:
    what = deck("sea_6", 1.0, 5, 130.0)
    u, r = records(what, 5, EXACT, dip_deg=30.0), attitude(what)
    assert u[0, 0] == -1e-3 and (u[1:, 0] == 1e-3).all()
    turns = (r[:-1].inv() * r[1:]).as_rotvec() * 1000.0
    assert u[1:, 1:4] == pytest.approx(turns, abs=1e-9)
    field = r.inv().apply(50.0 * np.array([np.cos(np.pi / 6), 0.0, -0.5]))
    assert u[:, 7:] == pytest.approx(field, abs=1e-9)
    force = r.inv().apply(np.stack([0.0 * what.lift, 0.0 * what.lift, 9.80665 + what.lift], 1))
    assert u[:, 4:7] == pytest.approx(force, abs=1e-9) and np.ptp(what.lift) > 1e-3
