"""The beam against a numerical aperture, the link against its textbook figure."""

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import j0

from boresight.systems.satcom.dish import Link


def test_pattern_is_that_of_the_tapered_aperture() -> None:
    link = Link()
    angles = np.radians([0.05, 0.5, 1.0, 1.3, 2.0, 3.5, 6.0])
    area = quad(lambda r: r * math.sqrt(1 - r * r), 0, 1)[0]
    for angle in angles:
        u = link.aperture * math.sin(angle)
        field = quad(lambda r, u=u: r * math.sqrt(1 - r * r) * j0(u * r), 0, 1)[0] / area
        assert link.pattern(np.array(math.sin(angle))) == pytest.approx(field**2, abs=1e-8)
    assert link.pattern(np.array(0.0)) == pytest.approx(1.0, abs=1e-6)
    far = np.sin(np.linspace(math.radians(3.2), math.radians(5.0), 400))
    assert 10 * np.log10(link.pattern(far).max()) == pytest.approx(-21.3, abs=0.3)


def test_link_budget() -> None:
    """6 dBW - 205.8 dB + 35.8 dBi - 22.3 dBK + 228.6 dBW/K/Hz."""
    assert 10 * math.log10(Link().cn0) == pytest.approx(42.3, abs=0.2)
    twice = Link(diameter_m=1.2)
    assert twice.cn0 / Link().cn0 == pytest.approx(4.0)
