"""Interface of `Satcom`: inputs, parameters, states, outputs, status bits."""

from __future__ import annotations

from boresight import Input, Output, Param, State
from boresight.model.algebra.covariance import covariance_states

BIAS_UNIT = 4.0  #: s; the bias state of the covariance is bias times this.
P0_LIMIT = 0.5  #: largest initial standard deviation, scaled.
FINEST = 32.0  #: most by which the scale of the covariance grows.
BELOW = 1.0 - 2.0**-31
_DEG = 0.017453292519943295

#: Bits of the output ``status``.
STATUS_BITS = {
    0: "external acceleration: roll and pitch are measured with the enlarged noise",
    1: "no tracking sample",
    2: "tracking sample not used: error beyond its gate",
    3: "covariance at its limit",
}

INPUTS = (
    Input(
        "dt", -0.25, 0.2499, "s", clamp=True, meaning="time since the record before; below 0: anew"
    ),
    *(Input(f"g{c}", -40.0, 40.0, "rad/s", meaning=f"body rate, axis {c}") for c in "xyz"),
    *(
        Input(f"a{c}", -160.0, 160.0, "m/s^2", meaning=f"specific force, body axis {c}")
        for c in "xyz"
    ),
    Input("e_psi", -0.5, 0.5, "rad", missing=0.0, meaning="tracking error: estimate less truth"),
    Input("beam", -1.0, 1.0, "ht", missing="hold", meaning="heading that it was measured at"),
    Input(
        "tracking",
        0.0,
        1.0,
        "",
        valid_of=("e_psi", "beam"),
        meaning="1: there is a tracking sample",
    ),
)

PARAMS = (
    Param("scale", 8.0, 1.0, 64.0, "", "of the covariance at first: small allows large p0_sd, R"),
    Param("start_heading", 0.0, -1.0, 0.9999, "ht", "heading at a restart, of a found satellite"),
    Param("p0_sd", 0.063, 1e-4, 1.0, "rad", "attitude at first: large follows the first samples"),
    Param("bias_p0_sd", 0.015, 1e-5, 0.1, "rad/s", "bias at first; times 4 scale at most 0.5"),
    Param("gyro_sd", 0.05 * _DEG, 0.0, 0.1, "rad/s", "gyro sample (root of Q): small trusts it"),
    Param("bias_density", 5e-6, 0.0, 0.01, "rad/s/sqrt(s)", "walk of the bias: small keeps it"),
    Param("roll_sd", 0.5 * _DEG, 3e-4, 1.0, "rad", "noise of the measured roll (root of R)"),
    Param("pitch_sd", 0.5 * _DEG, 3e-4, 1.0, "rad", "noise of the measured pitch (root of R)"),
    Param("heading_sd", 0.3 * _DEG, 3e-4, 1.0, "rad", "noise of the loop's heading (root of R)"),
    Param("adapt", 100.0, 1.0, 1000.0, "", "roll_sd and pitch_sd grow so under acceleration"),
    Param("tilt_known_sd", 1.5 * _DEG, 0.0, 1.0, "rad", "tilt less sure finds no acceleration"),
    Param("delta_x", 0.2, 0.01, 60.0, "m/s^2", "north acceleration that counts as external"),
    Param("delta_y", 0.2, 0.01, 60.0, "m/s^2", "the same, east"),
    Param("delta_z", 0.5, 0.01, 60.0, "m/s^2", "the same, down"),
    Param("cutoff", 0.5, 0.0, 8.0, "rad/s", "of the heading loop: small smooths, large follows"),
    Param("damping", 0.707, 0.1, 4.0, "", "of the heading loop"),
    Param("tracking_gate", 0.1, 1e-3, 0.5, "rad", "tracking error beyond it is not used"),
)

STATES = (
    State("qw", -1.0, BELOW, "", BELOW),
    *(State(f"q{axis}", -1.0, BELOW) for axis in "xyz"),
    *(State(f"bias_{axis}", -0.125, 0.125 * BELOW, "rad/s") for axis in "xyz"),
    *covariance_states(6, lambda i: 0.063504 if i < 3 else 0.2304),
    State("finer", 1.0, FINEST, "", 1.0),
    State("coarser", 1.0 / FINEST, 1.0, "", 1.0),
    State("heading_pi", -1.0, BELOW, "ht"),
    State("drift", -0.125, 0.125 * BELOW, "ht/s"),
    State("since", 0.0, 1.0, "s"),
)

OUTPUTS = (
    *(Output(name, "ht", 2.7e-5) for name in ("roll", "pitch", "heading")),
    *(Output(f"q{axis}", "", 5e-5) for axis in "wxyz"),
    *(Output(f"bias_{axis}", "rad/s", 1e-5) for axis in "xyz"),
    *(Output(f"rate_{axis}", "rad/s", 1e-5) for axis in "xyz"),
    Output("heading_pi", "ht", 2.7e-5),
    Output("status", "bits"),
)
