"""Patterns in closed form and summed, displacements, main lobes."""

import math

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.systems.mls.linear_array import Array, direction, lobe


def phases(array: Array, azimuth: float) -> np.ndarray:
    along = direction(azimuth, 0.0)[1]
    return (array.spacing * along * np.arange(array.elements))[None, :] % 1.0


@pytest.mark.parametrize("array", [Array(), Array(16), Array(24, 0.8)])
def test_summed_pattern_is_the_closed_form(array: Array) -> None:
    azimuth = np.linspace(-89.0, 89.0, 700)
    for beam in (-40.0, 0.0, 62.0):
        found = np.abs(array.field(phases(array, beam), direction(azimuth, 0.0)))[:, 0]
        of = math.sin(math.radians(beam))
        wanted = array.closed_form(np.sin(np.radians(azimuth)), of)
        assert np.abs(found - wanted).max() < 1e-12
        assert array.closed_form(of, of) == 1.0


def test_sinc_form_of_the_main_lobe() -> None:
    """(7): within 7.4e-5 in the main lobe of 64 elements, half a percent everywhere."""
    sine = np.linspace(-1.0, 1.0, 20001)
    apart = np.abs(Array().closed_form(sine) - np.abs(np.sinc(32.0 * sine)))
    assert apart[np.abs(sine) < 1 / 32].max() == pytest.approx(7.4e-5, rel=0.1)
    assert 4e-3 < apart.max() < 6e-3


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
    found = array.field(steer, e, q).mean()
    wanted = math.exp(-((2.0 * math.pi * b * 0.5 * e[axis]) ** 2) / 2.0)
    assert found.real == pytest.approx(wanted, abs=0.01) and abs(found.imag) < 0.01


def test_gate_of_a_known_pulse() -> None:
    """A triangle of half width 4 about 10.3: -3 dB at 1 - sqrt(1/2) of it to each side."""
    scan = np.linspace(-62.0, 62.0, 2481)
    shape = np.maximum(1.0 - np.abs(scan - 10.3) / 4.0, 0.02)
    shape[200] = 0.25
    found = lobe(scan, np.stack([0.5 * shape, shape[::-1]]), 4.0)
    assert found.centre == pytest.approx([10.3, -10.3], abs=1e-3)
    assert found.width == pytest.approx([8.0 * (1.0 - math.sqrt(0.5))] * 2, abs=2e-3)
    assert found.peak == pytest.approx([0.5, 1.0], abs=0.02)
    assert found.sidelobe_db == pytest.approx([-12.04] * 2, abs=0.02)
    single = lobe(scan, shape, 4.0)
    assert single.centre.shape == () and float(single.centre) == pytest.approx(10.3, abs=1e-3)


def test_a_pulse_at_the_end_of_the_scan_is_cut() -> None:
    scan = np.linspace(-62.0, 62.0, 1241)
    found = lobe(scan, np.maximum(1.0 - np.abs(scan - 62.0) / 4.0, 0.0), 4.0)
    assert found.centre == pytest.approx(62.0 - 2.0 * (1.0 - math.sqrt(0.5)), abs=0.01)


@pytest.mark.parametrize(
    "options, message",
    [
        ({"elements": 1}, "array, elements: wanted 2 or more, found 1"),
        ({"spacing": 0.0}, "array, spacing: wanted wavelengths above 0, found 0.0"),
        ({"spacing": math.nan}, "array, spacing: wanted wavelengths above 0, found nan"),
    ],
)
def test_mistakes(options: dict, message: str) -> None:
    with pytest.raises(InputError, match=f"^{message}"):
        Array(**options)
