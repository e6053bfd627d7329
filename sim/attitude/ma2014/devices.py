"""The two devices of Ma Long et al. (2014), with the sources of their numbers.

ADIS16385: gyro and accelerometer of three axes on one SPI port. HMR3300: magnetometer of three
axes that sends text lines. Of neither is a complete data sheet at hand.
"""

from __future__ import annotations

import math

from boresight.model.declarations import GRAVITY
from boresight.sim.attitude.ma2014.paper import GAUSS_UT, TABLE_2
from boresight.sim.attitude.worlds.triad import Triad

# The register table of the maker's evaluation tool has the gyro's and accelerometer's units; the
# paper's section 2.1 the ranges, 24,000 and 20,000 counts.
_GYRO_LSB, _GYRO_RANGE = 0.0125, 300.0  # deg/s
_ACC_LSB, _ACC_RANGE = 0.25e-3, 5.0  # g
# Guesses: the data sheet's example line has 2,285 counts, in a field of about 0.5 G; the range is
# usual for bridges of this kind.
_MAG_LSB, _MAG_RANGE = 1.0 / 4500.0, 2.0  # G


def gyro() -> Triad:
    """ADIS16385, range 300 deg/s, [rad/s]: noise and bias of Table 2."""
    return Triad(
        math.radians(_GYRO_LSB),
        math.radians(_GYRO_RANGE),
        variance=TABLE_2.gyro,
        bias=TABLE_2.gyro_bias,
    )


def accelerometer() -> Triad:
    """ADIS16385, [m/s^2]: noise of Table 2."""
    return Triad(GRAVITY * _ACC_LSB, GRAVITY * _ACC_RANGE, variance=TABLE_2.accelerometer)


def magnetometer() -> Triad:
    """HMR3300, [uT]: noise of Table 2."""
    return Triad(GAUSS_UT * _MAG_LSB, GAUSS_UT * _MAG_RANGE, variance=TABLE_2.magnetometer)
