"""`site` against the closed formulas and another package, up to 89 deg and 10 km."""

import numpy as np
import pymap3d
import pytest

from boresight.model.algebra.ellipsoid import E2, EARTH, EQUATOR, site
from tests.support.rotating_array import gravity

PLACES = [(31.9521, 45.0), (-89.0, 0.0), (89.0, 10e3), (0.0, 10e3), (45.0, -400.0), (-33.0, 3e3)]


@pytest.mark.parametrize("latitude, height", PLACES)
def test_a_site(latitude: float, height: float) -> None:
    dt = 0.01
    found = site(latitude / 180.0, height, dt)
    sine, cosine = np.sin(np.radians(latitude)), np.cos(np.radians(latitude))
    assert np.array(found.earth) / dt == pytest.approx([EARTH * cosine, EARTH * sine], rel=1e-12)
    assert found.gravity / dt == pytest.approx(gravity(latitude, height), abs=2e-8)
    along = 1.0 / (pymap3d.rcurve.meridian(latitude) + height)
    across = 1.0 / (pymap3d.rcurve.transverse(latitude) + height)
    assert np.array(found.curvature) / dt == pytest.approx(
        [along, across, across * sine / cosine], rel=4e-6
    )


def test_the_ellipsoid_is_that_of_another_package() -> None:
    e = pymap3d.Ellipsoid.from_name("wgs84")
    assert pytest.approx(e.semimajor_axis) == EQUATOR
    assert pytest.approx(e.eccentricity**2, rel=1e-11) == E2
