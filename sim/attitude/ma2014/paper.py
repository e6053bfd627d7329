"""What Ma Long, Zhang Rui and Su Zhigang (2014) print, what they leave open, and a prototype of it.

"A New Data Fusion Algorithm Based on Magnetometer and MEMS Inertial Device", Computer Measurement &
Control 22(8), 2014, 2518. Angles in degrees, in the order pitch, roll, heading.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias

__all__ = [
    "AXES",
    "BESIDE",
    "CLOCK_MHZ",
    "CYCLES",
    "FIG_6_DEG",
    "FIG_7_DEG",
    "FIXED_LIMIT_DEG",
    "GAUSS_UT",
    "KI",
    "KP",
    "OPEN",
    "PRINTED_SD_DEG",
    "PROTOTYPE",
    "PROTOTYPE_FIG_6_DEG",
    "RATIO",
    "TABLE_1",
    "TABLE_2",
    "TABLE_3",
    "TIME_US",
    "Table2",
]

Vector: TypeAlias = tuple[float, float, float]

AXES = ("pitch", "roll", "heading")

#: Table 1: stage, amplitude [deg], period [s], periods, end attitude [deg].
TABLE_1: tuple[dict[str, Any], ...] = tuple(
    {"stage": stage, "amplitude_deg": 15.0, "period_s": period, "periods": 4.25, "end_deg": end}
    for stage, period, end in (
        ("x", 25.0, (-15.0, 0.0, 0.0)),
        ("y", 14.0, (-15.0, 15.0, 0.0)),
        ("z", 5.0, (-15.0, 15.0, 15.0)),
        ("x", 25.0, (0.0, 15.0, 15.0)),
        ("y", 14.0, (0.0, 0.0, 15.0)),
        ("z", 5.0, (0.0, 0.0, 0.0)),
    )
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

#: Table 3: standard deviation of the difference to the reference unit [deg].
TABLE_3 = {
    "gyro": (0.624, 0.676, 0.566),
    "mag_acc": (0.197, 0.218, 0.536),
    "kalman": (0.095, 0.127, 0.246),
    "complementary": (0.104, 0.128, 0.242),
}

#: Table 4; a unit of time is not printed.
KP = (0.1414, 0.1414, 0.1)
KI = (0.0000005, 0.00005, 0.0000005)

FIG_6_DEG = (0.5, 0.5, 0.8)  #: largest difference of the filter to the reference unit.
FIG_7_DEG = 0.07  #: largest difference between the two filters, all angles.

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

#: What a float prototype of the specification measured for Table 3; one draw of the errors each.
PROTOTYPE = {
    "C": {
        "gyro": (0.70, 0.70, 0.43),
        "mag_acc": (0.192, 0.222, 0.547),
        "ekf_quaternion": (0.102, 0.107, 0.278),
        "ma2014_cf": (0.092, 0.097, 0.286),
    },
    "noise": {
        "gyro": (0.60, 0.64, 0.33),
        "mag_acc": (0.192, 0.222, 0.479),
        "ekf_quaternion": (0.072, 0.083, 0.079),
        "ma2014_cf": (0.070, 0.079, 0.112),
    },
}
PROTOTYPE_FIG_6_DEG = (0.28, 0.32, 0.47)
#: Its sd with eq. (3) as printed, without noise: gyro alone (False) and filtered (True).
PRINTED_SD_DEG = {False: (0.23, 0.22, 1.96), True: (0.18, 0.17, 1.72)}
#: Ratios to Table 3 that the specification takes as met, and its limit of fixed against float.
RATIO = (0.76, 1.18)
FIXED_LIMIT_DEG = 0.005

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
