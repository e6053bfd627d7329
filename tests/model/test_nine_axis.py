"""The record that all attitude filters share, and the one that they give."""

import math

import pytest

from boresight.model.attitude import ESTIMATORS
from boresight.model.declarations import EXACT_UNITS, QUATERNION
from boresight.model.nine_axis import INPUTS, OUTPUTS


def test_order_and_units() -> None:
    assert [(i.name, i.unit) for i in INPUTS] == [
        ("dt", "s"),
        *((f"g{a}", "rad/s") for a in "xyz"),
        *((f"m{a}", "uT") for a in "xyz"),
        *((f"a{a}", "m/s^2") for a in "xyz"),
    ]
    assert [(o.name, o.unit) for o in OUTPUTS] == [
        *((name, "ht") for name in ("pitch", "roll", "heading")),
        *((name, "") for name in QUATERNION),
        ("status", EXACT_UNITS[1]),
    ]


def test_only_a_field_may_be_missing_and_only_time_is_clamped() -> None:
    assert {i.name: i.missing for i in INPUTS if i.missing is not None} == {
        f"m{a}": 0.0 for a in "xyz"
    }
    assert [i.name for i in INPUTS if i.clamp] == ["dt"]
    assert INPUTS[0].low == -0.25 and INPUTS[0].high < 0.25


def test_the_quaternion_alone_is_judged() -> None:
    judged = {o.name: o.tolerance for o in OUTPUTS if o.tolerance is not None}
    assert tuple(judged) == QUATERNION
    # Three components off by it, each half an angle: 0.01 deg of rotation.
    degrees = [math.degrees(2 * math.sqrt(3) * x) for x in judged.values()]
    assert degrees == [pytest.approx(0.01, rel=0.01)] * 4


@pytest.mark.parametrize("estimator", ESTIMATORS.values())
def test_every_filter_takes_and_gives_it(estimator) -> None:
    assert tuple(estimator.inputs) == INPUTS and tuple(estimator.outputs) == OUTPUTS
