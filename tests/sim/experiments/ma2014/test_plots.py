"""Plots are SVG that names what it shows."""

import pytest

from boresight.sim.experiments.ma2014.plots import plots


@pytest.fixture(scope="module")
def drawn(data):
    return plots(data)


@pytest.mark.parametrize(
    ("name", "texts"),
    [
        ("motion", ("stage x", "stage angle, deg", "Euler angle, deg")),
        ("spectra", ("Figure 1: gyro alone", "Figure 5: complementary filter", "1/6 Hz")),
        ("error", ("eq. (3) as printed", "heading error, deg", "0.8 deg, paper")),
        ("difference", ("pitch, deg", "0.07 deg, paper")),
        ("difference_vector", ("roll, deg", "0.07 deg, paper")),
        ("table_3", ("gyro alone", "to the letter", "standard deviation of the error, deg")),
        ("timing", ("complementary, core fast", "Kalman, vectors, core small", "316 ")),
    ],
)
def test_plot(drawn, name, texts):
    assert drawn[name].startswith("<svg") and not [t for t in texts if t not in drawn[name]]


def test_the_two_differences_differ(drawn):
    assert drawn["difference"] != drawn["difference_vector"]
