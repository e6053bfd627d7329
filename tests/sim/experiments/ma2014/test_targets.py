"""The targets of the specification: bands, and what three runs suffice for."""

from copy import deepcopy

import pytest

from boresight.sim.experiments.ma2014.targets import targets


def test_what_holds_whatever_the_draw(result, find):
    for name in (
        "magnetometer and accelerometer alone: sd, noise alone",
        "eq. (3) as printed: gyro integrated at 100 Hz",
        "eq. (3) as printed violates the heading",
        "complementary filter: fixed point against float",
        "gyro error: share",
    ):
        assert all(target.good for target in find(result.targets, name)), name
    (time,) = find(result.targets, "complementary on fast")
    assert time.value < 3.0 and time.high == 316.0 and time.beside == {"paper": 316.0}


def test_lines_and_ratios_are_those_of_the_spectra(data, find):
    methods = deepcopy(data["spectra"]["methods"])
    methods["mag_acc"]["line_deg"] |= {"median": 0.70, "p05": 0.6, "p95": 0.8}
    methods["complementary"]["line_deg"]["median"] = 0.35
    changed = targets(data | {"spectra": data["spectra"] | {"methods": methods}})
    (line,) = find(changed, "mag/acc error: line")
    assert (line.value, line.low, line.high) == (0.70, pytest.approx(0.621), pytest.approx(0.759))
    assert line.good and line.spread == (0.6, 0.8) and line.beside == {"prototype": 0.69}
    (ratio,) = find(changed, "line at 1/6 Hz: complementary over mag/acc")
    assert ratio.value == pytest.approx(0.5) and ratio.good
    (own,) = find(changed, "complementary error: line")
    assert not own.good


def test_nothing_of_the_paper_binds(data):
    assert not any(target.binding for target in targets(data))
