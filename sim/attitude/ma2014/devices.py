"""The two devices of Ma Long et al. (2014), with the source of each number.

ADIS16385: gyro and accelerometer of three axes on one SPI port. HMR3300: magnetometer of three
axes that sends text lines. Of neither is a complete data sheet at hand; `FACTS` says for each
number where it comes from.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from boresight.model.declarations import GRAVITY
from boresight.sim.attitude.ma2014.paper import GAUSS_UT, TABLE_2
from boresight.sim.attitude.worlds.triad import Triad

__all__ = ["FACTS", "Fact", "accelerometer", "gyro", "magnetometer"]


@dataclass(frozen=True)
class Fact:
    """A number about a device.

    ``evidence``: "maker" (the maker's own table or page), "user" (code of a user of the
    device), "sibling" (documented for a part of the same family), "paper" (printed by Ma Long et
    al.), "inferred" (computed from other facts), "guess".
    """

    device: str
    name: str
    value: float
    unit: str
    evidence: str
    source: str


_REGISTERS = "register table of the maker's evaluation tool (iSensor-FX3-Eval)"

FACTS = (
    Fact("ADIS16385", "gyro_lsb", 0.0125, "deg/s", "maker", _REGISTERS),
    Fact(
        "ADIS16385",
        "gyro_range",
        300.0,
        "deg/s",
        "paper",
        "section 2.1; 24,000 counts, as in every range of the part",
    ),
    Fact("ADIS16385", "acc_lsb", 0.25, "mg", "maker", _REGISTERS),
    Fact("ADIS16385", "acc_range", 5.0, "g", "paper", "section 2.1; 20,000 counts"),
    Fact("ADIS16385", "rate", 1024.0, "Hz", "maker", "evaluation page of the part"),
    Fact(
        "ADIS16385",
        "read_rate",
        100.0,
        "Hz",
        "guess",
        "not printed; with 8 Hz it gives the 12.5 samples that Table 3's levelling asks for",
    ),
    Fact("HMR3300", "rate", 8.0, "Hz", "maker", "data sheet: lines per second"),
    Fact(
        "HMR3300",
        "counts_per_gauss",
        4500.0,
        "1/G",
        "guess",
        "the data sheet's example line has 2,285 counts, in a field of about 0.5 G",
    ),
    Fact("HMR3300", "range", 2.0, "G", "guess", "usual for bridges of this kind"),
)


def _value(device: str, name: str) -> float:
    return next(f.value for f in FACTS if (f.device, f.name) == (device, name))


def gyro() -> Triad:
    """ADIS16385, range 300 deg/s, [rad/s]: noise and bias of Table 2."""
    return Triad(
        _value("ADIS16385", "rate"),
        math.radians(_value("ADIS16385", "gyro_lsb")),
        math.radians(_value("ADIS16385", "gyro_range")),
        variance=TABLE_2.gyro,
        bias=TABLE_2.gyro_bias,
    )


def accelerometer() -> Triad:
    """ADIS16385, [m/s^2]: noise of Table 2."""
    return Triad(
        _value("ADIS16385", "rate"),
        1e-3 * GRAVITY * _value("ADIS16385", "acc_lsb"),
        GRAVITY * _value("ADIS16385", "acc_range"),
        variance=TABLE_2.accelerometer,
    )


def magnetometer() -> Triad:
    """HMR3300, [uT]: noise of Table 2."""
    return Triad(
        _value("HMR3300", "rate"),
        GAUSS_UT / _value("HMR3300", "counts_per_gauss"),
        GAUSS_UT * _value("HMR3300", "range"),
        variance=TABLE_2.magnetometer,
    )
