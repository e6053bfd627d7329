"""What the lists of cases hold."""

from __future__ import annotations

from boresight.sim.attitude.robustness.plan import LISTS, PLACES, RATES_HZ, cases_of


def test_every_case_has_a_name_of_its_own_and_a_figure() -> None:
    for name in LISTS:
        cases = cases_of(name)
        assert len({c.name for c in cases}) == len(cases)
        assert {c.judged for c in cases} == {"total", "inclination"}


def test_the_full_one_has_what_it_promises() -> None:
    groups = [c.group for c in cases_of("full")]
    assert groups.count("starts anywhere") == PLACES == 10
    assert groups.count("mounted 24 ways") == 24
    assert {f"{rate:g} Hz" for rate in RATES_HZ} <= set(groups)
    assert {c.name for p in LISTS for c in cases_of(p)} == {c.name for c in cases_of("full")}


def test_full_scales_are_those_of_the_sensor_that_is_clipped() -> None:
    results = {c.name: c.full_scale for c in cases_of("full") if c.full_scale}
    assert results == {
        "gyro clipped at 0.8": ("gyr",),
        "gyro clipped at 0.6": ("gyr",),
        "accelerometer clipped at 0.8": ("acc",),
        "accelerometer clipped at 0.6": ("acc",),
        "fast turns": ("gyr",),
    }
