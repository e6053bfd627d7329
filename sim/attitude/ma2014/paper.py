"""What Ma Long, Zhang Rui and Su Zhigang (2014) print, and what they leave open.

"A New Data Fusion Algorithm Based on Magnetometer and MEMS Inertial Device", Computer Measurement &
Control 22(8), 2014, 2518. Angles in degrees, in the order pitch, roll, heading.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

from boresight.model.declarations import GRAVITY
from boresight.sim.attitude.worlds import Triad

Vector: TypeAlias = tuple[float, float, float]

AXES = ("pitch", "roll", "heading")

#: Table 1: stage, amplitude [deg], period [s], periods, end attitude [deg].
TABLE_1 = (
    ("x", 15.0, 25.0, 4.25, (-15.0, 0.0, 0.0)),
    ("y", 15.0, 14.0, 4.25, (-15.0, 15.0, 0.0)),
    ("z", 15.0, 5.0, 4.25, (-15.0, 15.0, 15.0)),
    ("x", 15.0, 25.0, 4.25, (0.0, 15.0, 15.0)),
    ("y", 15.0, 14.0, 4.25, (0.0, 0.0, 15.0)),
    ("z", 15.0, 5.0, 4.25, (0.0, 0.0, 0.0)),
)

GAUSS_UT = 100.0  #: uT per gauss.


@dataclass(frozen=True)
class Table2:
    """Table 2: gyro bias and noise variances, axes x, y, z."""

    gyro_bias: Vector = (-0.0022, 0.006, 0.0006)  #: printed as rad; can only be rad/s
    gyro: Vector = (1.5669e-5, 1.7842e-5, 2.1155e-6)  #: (rad/s)^2
    accelerometer: Vector = (0.0179, 0.014, 1.0753e-4)  #: (m/s^2)^2
    magnetometer_g: Vector = (2.1e-6, 2.06e-5, 5.8e-6)  #: G^2

    @property
    def magnetometer(self) -> Vector:
        """The same in uT^2."""
        x, y, z = (v * GAUSS_UT**2 for v in self.magnetometer_g)
        return x, y, z


TABLE_2 = Table2()

# The two devices; of neither is a complete data sheet at hand.
# The register table of the maker's evaluation tool has the gyro's and accelerometer's units; the
# paper's section 2.1 the ranges, 24,000 and 20,000 counts.
_GYRO_LSB, _GYRO_RANGE = 0.0125, 300.0  # deg/s
_ACC_LSB, _ACC_RANGE = 0.25e-3, 5.0  # g
# Guesses: the data sheet's example line has 2,285 counts, in a field of about 0.5 G; the range is
# usual for bridges of this kind.
_MAG_LSB, _MAG_RANGE = 1.0 / 4500.0, 2.0  # G


#: ADIS16385, range 300 deg/s, [rad/s]: noise and bias of Table 2.
GYRO = Triad(math.radians(_GYRO_LSB), math.radians(_GYRO_RANGE), TABLE_2.gyro, TABLE_2.gyro_bias)
#: ADIS16385, [m/s^2], and HMR3300, [uT]: noise of Table 2.
ACCELEROMETER = Triad(GRAVITY * _ACC_LSB, GRAVITY * _ACC_RANGE, TABLE_2.accelerometer)
MAGNETOMETER = Triad(GAUSS_UT * _MAG_LSB, GAUSS_UT * _MAG_RANGE, TABLE_2.magnetometer)

#: Table 4; a unit of time is not printed.
KP = (0.1414, 0.1414, 0.1)
KI = (0.0000005, 0.00005, 0.0000005)

CLOCK_MHZ = 100.0
#: Figure 8 and the conclusion [us]; the abstract says 360 for the complementary filter.
TIME_US = {"complementary": 316.0, "kalman": 1140.0}
CYCLES = {name: round(us * CLOCK_MHZ) for name, us in TIME_US.items()}
#: The paper's filter beside which each estimator of ours stands.
BESIDE = {
    "ma2014_cf": "complementary",
    "complementary": "complementary",
    "ekf_quaternion": "kalman",
    "ekf_bias": "kalman",
    "mekf": "kalman",
}

#: What the paper does not print or prints twice, and what is taken here.
OPEN = (
    ("Sample rate of the loop", "8 Hz, the rate of the HMR3300"),
    (
        "Unit of time of Kp and Ki",
        "one sample: x -= Kp e. Per second at 100 Hz the "
        "levelling error of Table 3 would be three times the printed one",
    ),
    (
        "Site, and so the field",
        "Tianjin: (-3.45, 27.90, -46.20) uT east, north, up; heading counts from magnetic north",
    ),
    (
        "Euler sequence: eq. (3) is z-y'-x'', eq. (4)-(7) are z-x'-y''",
        "z-x'-y'' throughout; eq. (3) as printed is run beside it",
    ),
    ("Reference unit (AHRS): its own errors", "none: errors here are against exact truth"),
    (
        "Kalman filter: only cited (Marins 2001, Sabatini 2006)",
        "four quaternion states, noises of Table 2",
    ),
    ("Length of the heading test: 90 periods of 6 s, or 10 min", "90 periods, 540 s"),
    ("Time of the complementary filter: 316 us or 360 us (abstract)", "316 us"),
    ("Gyro bias of Table 2, printed in rad", "rad/s"),
    (
        "Accelerometer: samples per update",
        "12.5 averaged (100 Hz over 8 Hz), delay compensated; "
        "read off Table 3 itself, so mag/acc is a fit and no prediction",
    ),
    (
        "What is wrong with the sensors beside noise",
        "case C: gyro misaligned by 1 deg (sd, drawn "
        "for each axis and run), soft iron of 1 %: x too large, y too small. Found by search too; "
        "the form of the soft iron was chosen among nine as the one nearest to the mag/acc heading "
        "of Table 3 and the prototype (0.51 to 0.58 deg)",
    ),
)
