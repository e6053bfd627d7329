"""The cases: each can be flown, and is what its name says."""

import pytest

from boresight.systems.satcom.cases import CASES, WHAT_IF
from boresight.systems.satcom.drive import DRIVES
from boresight.systems.satcom.estimator import Satcom


def test_parameters_and_options_are_those_of_the_filter() -> None:
    for case in (CASES | WHAT_IF).values():
        Satcom(**case.options).param_values(case.params)
        assert case.drive in DRIVES
    assert not any(case.params or case.options for case in WHAT_IF.values())
    assert not set(CASES) & set(WHAT_IF)


def test_fleets() -> None:
    fleet = WHAT_IF["hz_200"].fleet(range(3, 5))
    assert fleet.drive.ride.rate_hz == 200.0 and list(fleet.seeds) == [3, 4]
    assert CASES["no_tracking"].fleet(range(1)).tracking_hz == 0.0
    assert CASES["pi_alone"].fleet(range(1)).beam == "heading_pi"
    assert WHAT_IF["bias_1"].fleet(range(1)).errors.gyro_bias == (1.0, -1.0, 1.0)


@pytest.mark.parametrize(
    "name, elevation", [("equator", 85.0), ("north", 16.0), ("east", 28.0), ("west", 25.0)]
)
def test_places_are_where_they_say(name: str, elevation: float) -> None:
    import math

    fleet = WHAT_IF[name].fleet(range(1))
    assert -math.degrees(math.asin(fleet._up[2])) == pytest.approx(elevation, abs=2.0)
