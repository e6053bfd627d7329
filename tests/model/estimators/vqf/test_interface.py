"""What VQF declares, with and without a magnetometer."""

from __future__ import annotations

from boresight.model.estimators.mekf.interface import STATUS_BITS as MEKF_BITS
from boresight.model.estimators.nine_axis import INPUTS
from boresight.model.estimators.vqf.interface import STATUS_BITS, interface_of
from boresight.model.estimators.vqf.settings import Settings


def test_with_and_without_magnetometer() -> None:
    inputs, params, states = interface_of(Settings())
    assert inputs == INPUTS and len(states) == 68 and len(params) == 6
    inputs, params, states = interface_of(Settings(magnetic=False))
    assert [i for i in INPUTS if i not in inputs] == [i for i in INPUTS if i.name[0] == "m"]
    assert len(states) == 55 and {p.name for p in params} == {"rest_gyr", "rest_acc"}


def test_bits_are_those_of_the_flagship() -> None:
    assert sorted(STATUS_BITS) == sorted(MEKF_BITS)


def test_gains_follow_the_rates() -> None:
    slow, quick = (
        {p.name: p.default for p in interface_of(Settings(rate, rate))[1]} for rate in (50.0, 500.0)
    )
    for name in ("mag_gain", "field_gain"):
        assert 9.9 < slow[name] / quick[name] < 10.0
