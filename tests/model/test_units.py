"""Conversions of units: by hand, and against pint's own."""

import math

import pytest

from boresight.model.units import UnitError, linear

pytestmark = pytest.mark.pythons


@pytest.mark.parametrize(
    "have, want, factor, offset",
    [
        ("deg/s", "rad/s", math.pi / 180, 0.0),
        ("rpm", "rad/s", math.pi / 30, 0.0),
        ("°/s", "rad/s", math.pi / 180, 0.0),
        ("g0", "m/s^2", 9.80665, 0.0),
        ("mg0", "m/s^2", 9.80665e-3, 0.0),
        ("m/s²", "cm/s^2", 100.0, 0.0),
        ("gauss", "uT", 100.0, 0.0),
        ("G", "uT", 100.0, 0.0),
        ("mG", "uT", 0.1, 0.0),
        ("milligauss", "µT", 0.1, 0.0),
        ("nT", "uT", 1e-3, 0.0),
        ("deg", "ht", 1 / 180, 0.0),
        ("ht", "deg", 180.0, 0.0),
        ("rad", "ht", 1 / math.pi, 0.0),
        ("ht", "rad", math.pi, 0.0),
        ("ms", "s", 1e-3, 0.0),
        ("us", "s", 1e-6, 0.0),
        ("N·m", "J", 1.0, 0.0),
        ("degC", "K", 1.0, 273.15),
        ("K", "degC", 1.0, -273.15),
        ("degF", "degC", 5 / 9, -160 / 9),
        ("percent", "", 0.01, 0.0),
        ("kHz", "1/s", 1000.0, 0.0),
        ("turn/s", "deg/s", 360.0, 0.0),
        ("rad*m/s", "m/s", 1.0, 0.0),
        ("xyzzy", "xyzzy", 1.0, 0.0),  # the same text needs no meaning
    ],
)
def test_by_hand(have: str, want: str, factor: float, offset: float) -> None:
    result = linear(have, want)
    assert result[0] == pytest.approx(factor, rel=1e-12, abs=0)
    assert result[1] == pytest.approx(offset, rel=1e-12, abs=0)


@pytest.mark.parametrize(
    "have, want, message",
    [
        ("g", "m/s^2", "g is not m/s^2"),
        ("deg/s", "uT", "deg/s is not uT"),
        ("m", "", "m is not a plain number"),
        ("deg/sec^2", "deg/s", "deg/sec^2 is not deg/s"),
        ("furlongs per", "m", "unit 'furlongs per' is not known"),
        ("m", "xyzzy", "unit 'xyzzy' is not known"),
        ("m +", "m", "unit 'm +' is not known"),
        ("mgaussian", "uT", "unit 'mgaussian' is not known"),
        ("Hz", "rad/s", "Hz is not rad/s: one counts cycles or events, one an angle"),
        ("deg/s", "Hz", "deg/s is not Hz: one counts cycles or events, one an angle"),
        ("kHz", "rpm", "kHz is not rpm: one counts cycles or events, one an angle"),
        ("rad/s^2", "1/s^2", "rad/s^2 is not 1/s^2: one counts cycles or events, one an angle"),
    ],
)
def test_units_refused(have: str, want: str, message: str) -> None:
    with pytest.raises(UnitError) as raised:
        linear(have, want)
    assert str(raised.value) == message
