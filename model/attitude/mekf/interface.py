"""Interface of the `Mekf`: inputs, parameters, states, outputs, status bits."""

from __future__ import annotations

from boresight.model.attitude.table import params_of
from boresight.model.estimator import State

#: The bias error is carried as b times this, so that its covariance and that of the attitude are
#: of a size.
BIAS_SCALE = 64.0
#: Error states: attitude error about east, north, up [rad]; bias error in body axes, scaled.
AXES = ("e", "n", "u", "x", "y", "z")
PAIRS = tuple((i, j) for i in range(6) for j in range(i, 6))

#: No attitude yet, which status bit 0 says.
START = (("w", 1.0 - 2.0**-31), ("x", 0.0), ("y", 0.0), ("z", 0.0))

#: Bits of the output ``status``.
STATUS_BITS = {
    0: "no attitude yet: no specific force so far",
    1: "heading not aligned: no magnetometer sample so far, or a field along the vertical",
    2: "accelerometer not used: no specific force",
    3: "no magnetometer sample",
    4: "field odd: it counts less than half as much as the undisturbed one",
    5: "at rest: the gyro's bias is measured",
    6: "the rate was at full scale within the last seconds: the attitude may be off",
}


def covariance_name(i: int, j: int) -> str:
    """Name of the stored element (i, j), i <= j."""
    return f"p_{AXES[i]}{AXES[j]}"


PARAMS = params_of(
    """
    gyro_var 3e-05 1e-06 0.0156 rad^2/s
        random walk of the attitude: small trusts the gyro, large the accelerometer and the
        magnetometer
    gyro_scale_var 2.4e-05 0 0.0039 s
        more of it per (rad/s)^2 of rotation: scale and alignment errors of the gyro
    bias_var 1.2e-07 3e-11 4e-07 (rad/s)^2/s
        random walk of the gyro's bias: small holds the learnt bias, large follows its drift
    tilt_var 0.00075 0.0001 1 rad^2*s
        noise of the low-passed vertical, variance times time: small trusts the
        accelerometer
    heading_var 0.001 0.0001 3.6 rad^2*s
        noise of the magnetic heading in the reference field, variance times time: small
        trusts the magnetometer
    rest_rate_per_s 0.3 0 4 1/s
        how fast the bias goes to the gyro's mean at rest; 0 never
    rest_var 1e-07 1e-09 6e-05 (rad/s)^2
        twice the variance of the bias learnt so
    force_rate_per_s 0.6 0.01 30 1/s
        corner of the low-pass of the specific force in navigation axes: small averages
        longer accelerations
    field_trust_s 0.28 0 1000 s
        how much the squared relative deviation of the field from its reference adds to
        heading_var: 0 trusts every field
    field_forget_per_s 0.4 0 30 1/s
        how fast a deviation of the field is forgotten once it is over
    field_follow_per_s 0.04 0 30 1/s
        how fast the reference follows the field: large adopts a new place soon, 0 never
    dip_trust_s 0.6 0 1000 s
        how much the variance of the tilt, times the squared tangent of the dip, adds to
        heading_var
    start_var 0.12 0 0.25 rad^2*s
        more random walk of the attitude while the means are young, over their squared age:
        large follows accelerometer and magnetometer at the start
    field_min_sq 4 0.1 4000 uT^2
        squared field below which there is no sample
    force_min_sq 4 0.1 80000 (m/s^2)^2
        squared low-passed specific force below which it is not used
    gyro_most_sq 1500 0.25 4800 (rad/s)^2
        square of a rate a little less than the gyro's full scale: what an axis misses
        beyond it is extrapolated, and the attitude follows the other sensors faster; one
        that jumps there from far below is not believed
    force_most_sq 12000 1 12000 (m/s^2)^2
        squared deviation of the specific force from its mean beyond which it says nothing:
        that of an accelerometer at full scale
    gyro_rate_per_s 30 0.01 60 1/s
        corner of the gyro's low-pass, which stops at full scale: its distance from the rate
        tells the slope there
    rest_motion_sq 0.4 0 900 (m/s^2)^2
        most squared motion at rest: the force's deviation from its mean; 23 m/s^2 stand for
        1 rad/s of the low-passed rate less the bias
    rest_time_s 0.4985 0 30 s
        how long that must last
    p0_bias 4.5e-05 1e-11 6e-05 (rad/s)^2
        variance of the gyro's bias at the start
    update_s 0.0087 0.004 0.24 s
        least time between two scalar updates
    """
)

STATES = (
    *(State(f"q{a}", -1.0, 1.0 - 2.0**-31, "", v) for a, v in START),
    *(State(f"bias_{a}", -0.25, 0.25 * (1 - 2.0**-31), "rad/s") for a in "xyz"),
    *(State(covariance_name(i, j), -1.95, 1.95, "") for i, j in PAIRS),
    *(State(f"force_{a}", -128.0, 128.0 * (1 - 2.0**-31), "m/s^2") for a in "enu"),
    *(State(f"field_{a}", -128.0, 128.0 * (1 - 2.0**-31), "uT") for a in "en"),
    State("field_u", -444.0, 444.0, "uT"),
    *(State(f"rate_{a}", -64.0, 64.0 * (1 - 2.0**-31), "rad/s") for a in "xyz"),
    State("horizontal", -1.0, 450.0, "uT", -1.0),  # of the reference field; -1: not known
    State("vertical", -450.0, 450.0, "uT"),
    State("youth", 0.0, 63.9, "1/s", 63.0),  # one over the age of the means
    State("odd_sq", 0.0, 2.0, ""),
    # whose turn it is, -1, 0, 1 first, second, third, and on top the time since the last one
    State("turn", -1.0, 1.5, "s", -1.0),
    # of the slope at full scale, the part that is missed by now
    State("beyond", 0.0, 1.0 - 2.0**-31, ""),
    State("fastest_sq", 0.0, 4800.0, "(rad/s)^2"),  # largest squared rate of late
    State("rest_s", -1.0, 32.0, "s", -1.0),  # for how long at rest; -1: tilt not known
    State("field_left", -0.25, 0.2499, "s"),  # for how long the field's direction is still used
)

#: Inputs, states and parameters that only a field needs, with their values without one.
FIELD_ONLY = {
    **{f"m{a}": 0.0 for a in "xyz"},
    **{f"field_{a}": 0.0 for a in "enu"},
    **{"horizontal": -1.0, "vertical": 0.0, "odd_sq": 0.0, "field_left": -1.0},
    **{
        q.name: q.default
        for q in PARAMS
        if q.name.startswith(("field_", "heading_")) or q.name == "dip_trust_s"
    },
}
