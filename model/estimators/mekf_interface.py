"""What the `Mekf` reads, keeps and tells: inputs, parameters, states, outputs, status bits."""

from __future__ import annotations

from boresight.model.estimator import Param, State
from boresight.model.estimators.nine_axis import INPUTS, OUTPUTS

__all__ = [
    "AXES",
    "BIAS_SCALE",
    "INPUTS",
    "OUTPUTS",
    "PAIRS",
    "PARAMS",
    "START",
    "STATES",
    "STATUS_BITS",
    "covariance_name",
]

#: The bias error is carried as b times this, so that its covariance and that of the attitude are
#: of a size.
BIAS_SCALE = 128.0
#: Error states: attitude error about east, north, up [rad]; bias error in body axes, scaled.
AXES = ("e", "n", "u", "x", "y", "z")
PAIRS = tuple((i, j) for i in range(6) for j in range(i, 6))

#: Attitude from which every alignment starts: half a turn away from none that people stand at.
START = (0.5377, 0.3126, -0.2871, 0.7285)

#: Bits of the output ``status``.
STATUS_BITS = {
    0: "aligning: no attitude yet",
    1: "heading not aligned: no magnetometer sample so far",
    2: "accelerometer not used: no specific force",
    3: "no magnetometer sample",
    4: "field odd: it counts less than half as much as the undisturbed one",
    5: "at rest: the gyro's bias is measured",
}


def covariance_name(i: int, j: int) -> str:
    """Name of the stored element (i, j), i <= j."""
    return f"p_{AXES[i]}{AXES[j]}"


PARAMS = (
    Param(
        "gyro_var",
        3.6e-5,
        1e-6,
        0.0156,
        "rad^2/s",
        "random walk of the attitude: small trusts "
        "the gyro, large the accelerometer and the magnetometer",
    ),
    Param(
        "gyro_scale_var",
        4e-5,
        0.0,
        0.0039,
        "s",
        "more of it per (rad/s)^2 of rotation: scale and alignment errors of the gyro",
    ),
    Param(
        "bias_var",
        1e-10,
        3e-11,
        1e-7,
        "(rad/s)^2/s",
        "random walk of the gyro's bias: small holds the learnt bias, large follows its drift",
    ),
    Param(
        "tilt_var",
        8e-4,
        1e-4,
        1.0,
        "rad^2*s",
        "noise of the low-passed vertical, variance times time: small trusts the accelerometer",
    ),
    Param(
        "heading_var",
        0.032,
        1e-4,
        3.6,
        "rad^2*s",
        "noise of the magnetic heading in the "
        "reference field, variance times time: small trusts the magnetometer",
    ),
    Param(
        "rest_rate_per_s",
        0.3,
        0.0,
        4.0,
        "1/s",
        "how fast the bias goes to the gyro's mean at rest; 0 never",
    ),
    Param("rest_var", 3e-8, 1e-9, 6e-5, "(rad/s)^2", "twice the variance of the bias learnt so"),
    Param(
        "force_rate_per_s",
        0.7,
        0.01,
        30.0,
        "1/s",
        "corner of the low-pass of the specific "
        "force in navigation axes: small averages longer accelerations",
    ),
    Param("field_rate_per_s", 12.0, 0.1, 63.0, "1/s", "corner of the low-pass of the field"),
    Param(
        "field_trust_s",
        1.0,
        0.0,
        1e3,
        "s",
        "how much the squared relative deviation of the "
        "field from its reference adds to heading_var: 0 trusts every field",
    ),
    Param(
        "field_forget_per_s",
        1.0,
        0.0,
        30.0,
        "1/s",
        "how fast a deviation of the field is forgotten once it is over",
    ),
    Param(
        "field_follow_per_s",
        0.05,
        0.0,
        30.0,
        "1/s",
        "how fast the reference follows the field: large adopts a new place soon, 0 never",
    ),
    Param("field_min_sq", 4.0, 0.1, 4e3, "uT^2", "squared field below which there is no sample"),
    Param(
        "force_min_sq",
        4.0,
        0.1,
        8e4,
        "(m/s^2)^2",
        "squared low-passed specific force below which it is not used",
    ),
    Param("gyro_rate_per_s", 2.0, 0.01, 30.0, "1/s", "corner of the low-pass of the gyro"),
    Param(
        "rest_motion_sq",
        0.25,
        0.0,
        900.0,
        "(m/s^2)^2",
        "most squared motion at rest: the "
        "force's deviation from its mean; 16 m/s^2 stand for 1 rad/s of the rate's deviation "
        "from its mean, 5.7 for 1 rad/s of that mean",
    ),
    Param("rest_time_s", 1.5, 0.0, 30.0, "s", "how long that must last"),
    Param("p0_tilt", 1.2e-3, 1e-8, 1.0, "rad^2", "variance of the first tilt"),
    Param("p0_heading", 7.6e-3, 1e-8, 1.0, "rad^2", "variance of the first heading"),
    Param("p0_bias", 3e-6, 1e-11, 6e-5, "(rad/s)^2", "variance of the gyro's bias at the start"),
    Param("update_s", 0.0087, 0.004, 0.24, "s", "least time between two scalar updates"),
)

STATES = (
    *(State(f"q{a}", -1.0, 1.0 - 2.0**-31, "", v) for a, v in zip("wxyz", START, strict=True)),
    *(State(f"bias_{a}", -0.25, 0.25 * (1 - 2.0**-31), "rad/s") for a in "xyz"),
    *(State(covariance_name(i, j), -3.9, 3.9, "") for i, j in PAIRS),
    *(State(f"force_{a}", -256.0, 256.0 * (1 - 2.0**-31), "m/s^2") for a in "enu"),
    *(State(f"field_{a}", -444.0, 444.0, "uT") for a in "enu"),
    *(State(f"rate_{a}", -4.0, 4.0 * (1 - 2.0**-31), "rad/s") for a in "xyz"),
    State("horizontal", -1.0, 450.0, "uT", -1.0),  # of the reference field; -1: not known
    State("vertical", -450.0, 450.0, "uT"),
    State("odd_sq", 0.0, 32.0, ""),
    State("since_update", 0.0, 0.5, "s"),
    State("axis", -1.0, 1.0, "", -1.0),  # whose turn it is: -1, 0, 1 first, second, third
    State("rest_s", -1.0, 32.0, "s", -1.0),  # for how long at rest; -1: tilt not known
    State("since_field", 0.0, 0.999, "s", 0.999),
)
