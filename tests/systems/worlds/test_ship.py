"""Sea states against their definition, responses against limits that hold for any hull."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from boresight.model.errors import InputError
from boresight.systems.worlds.ship import SEA_STATES, Ship, at_sea, spectrum


@pytest.mark.parametrize("state", SEA_STATES)
def test_height_and_period_are_those_of_the_sea_state(state: int) -> None:
    height, period = SEA_STATES[state]
    m0 = quad(lambda w: float(spectrum(np.array(w), state)), 0.05, 20.0, limit=200)[0]
    assert 4.0 * math.sqrt(m0) == pytest.approx(height, rel=1e-3)
    w = np.linspace(0.2, 2.0, 2000)
    assert 2.0 * math.pi / w[spectrum(w, state).argmax()] == pytest.approx(period, rel=0.01)


def test_long_waves_are_followed_and_short_ones_are_not() -> None:
    ship = Ship(speed=0.0)
    k = np.array([0.05, 2.0]) ** 2 / 9.80665
    heave, pitch, roll, met = ship.responses(np.array([0.05, 2.0]))
    assert heave[0] == pytest.approx(1.0, abs=0.01) and heave[1] < 0.02
    # The deck lies on the wave: its slope along and across the ship.
    slope = k[0] * np.array([0.5, math.sin(math.radians(120.0))])
    assert [pitch[0], roll[0]] == pytest.approx(slope, rel=0.05)
    assert pitch[1] < 0.01 * k[1] and met.tolist() == [0.05, 2.0]
    assert Ship(waves_deg=180.0).responses(np.array([0.5]))[3] > 0.5  # against the waves
    resonance = np.array([2.0 * math.pi / 18.0])
    assert ship.responses(resonance)[2] * 9.80665 / resonance**2 == pytest.approx(
        math.sin(math.radians(120.0)) / 0.2
    )


def test_motion_has_the_energy_of_its_spectrum() -> None:
    t = np.arange(0.0, 4000.0, 0.5)
    angles, lift = at_sea(t, np.random.default_rng(1), 6)
    w = np.linspace(0.2, 1.8, 4000)
    heave, pitch, roll, met = Ship().responses(w)
    for value, response in ((angles[:, 0], roll), (angles[:, 1], pitch), (lift, heave * met**2)):
        wanted = math.sqrt(np.trapezoid(spectrum(w, 6) * response**2, w))
        assert value.std() == pytest.approx(wanted, rel=0.1)


def test_no_such_sea_state() -> None:
    with pytest.raises(InputError, match=r"^sea state: wanted one of 3, 4, 5, 6, found 9"):
        at_sea(np.zeros(3), np.random.default_rng(1), 9)
