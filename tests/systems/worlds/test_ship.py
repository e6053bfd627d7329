"""Sea states against their definition, responses against limits that hold for any hull."""

import math

import numpy as np
import pytest

from boresight.systems.worlds.ship import Ship, at_sea, spectrum


def test_motion_has_the_energy_of_its_spectrum() -> None:
    t = np.arange(0.0, 4000.0, 0.5)
    angles, lift = at_sea(t, np.random.default_rng(1), 6)
    w = np.linspace(0.2, 1.8, 4000)
    heave, pitch, roll, met = Ship().responses(w)
    for value, response in ((angles[:, 0], roll), (angles[:, 1], pitch), (lift, heave * met**2)):
        wanted = math.sqrt(np.trapezoid(spectrum(w, 6) * response**2, w))
        assert value.std() == pytest.approx(wanted, rel=0.1)
