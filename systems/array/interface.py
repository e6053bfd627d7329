"""Interface of `ArrayAttitude`: inputs, parameters, states, outputs, status bits."""

from __future__ import annotations

import math

from boresight import Input, Output, Param, State
from boresight.model.algebra import strapdown
from boresight.model.algebra.carried import BELOW
from boresight.model.algebra.covariance import covariance_states
from boresight.model.algebra.strapdown import AXES
from boresight.model.declarations import MICRO_G

ARCSEC = math.pi / 648000.0  #: rad; a degree an hour is as many rad/s.

#: Errors of the instruments: name, largest that is learnt, unit.
_LEARNT = (
    ("scale_up", 2.0**-11, ""),
    *((f"eps_{a}", 2.0**-17, "rad/s") for a in AXES),
    *((f"nabla_{a}", 2.0**-5, "m/s^2") for a in AXES),
)
#: Name and limit of those, by number of the filter's state.
LEARNT = {k: row[:2] for k, row in zip((3, *range(7, 13)), _LEARNT, strict=True)}

#: The states of the filter, by kind.
KINDS = (*["velocity"] * 3, "scale", "tilt", "tilt", "heading", *["gyro"] * 3, *["force"] * 3)
#: The unit that each kind is held in: variances stay below one.
UNITS = {
    "velocity": 2.0**-4,  # m/s
    "scale": 2.0**-15,
    "tilt": 64.0 * ARCSEC,  # rad
    "heading": 304.0 * ARCSEC,  # rad
    "gyro": 2.0**-23,  # rad/s
    "force": 2.0**-7,  # m/s^2
}
WIDEST = 0.7  #: largest first standard deviation, in these units.
#: Initial standard deviations, and their units.
FIRST = {
    "velocity": (0.01, "m/s"),
    "scale": (2e-5, ""),
    "tilt": (20.0 * ARCSEC, "rad"),
    "heading": (60.0 * ARCSEC, "rad"),
    "gyro": (0.006 * ARCSEC, "rad/s"),
    "force": (120.0 * MICRO_G, "m/s^2"),
}

#: Bits of the output ``status``.
STATUS_BITS = {
    0: "aligning: no index is used",
    1: "erection: no index is used, accelerometer biases are known no longer",
    2: "an index came before the array worked: not used",
    3: "an index was beyond the gate or too soon after another one: not used",
    4: "an increment is at or beyond full scale",
    5: "variance of the heading at its limit",
    6: "an index was used",
    7: "no index for one turn and a half, or none yet",
    8: "the attitude is not known yet: the array must rest",
}

INPUTS = (
    *strapdown.INPUTS,
    Input("phase", -1.0, 3.0, meaning="-1 begin anew, 0 at rest, 1 being erected, 2 turning"),
    Input("azimuth", -1.0, 1.0, "ht", missing="hold", meaning="of the turntable at its index"),
    Input("index_time", 0.0, 1.0, missing="hold", meaning="when: 0 begin, 1 end of the sample"),
    Input("index", 0.0, 1.0, valid_of=("azimuth", "index_time"), meaning="1: the index was passed"),
)


def filter_params(align: int) -> tuple[Param, ...]:
    """First covariance, noises, gates; ``align``: samples of the alignment."""
    first = FIRST | ({"tilt": (12.0 * ARCSEC, "rad")} if align else {})
    meaning = "error at first: large follows the first measurements"
    return (
        *(
            Param(f"p0_{k}", value, 0.0, WIDEST * UNITS[k], unit, f"{k} {meaning}")
            for k, (value, unit) in first.items()
        ),
        Param("erected_force", 300.0 * MICRO_G, 0.0, 5e-3, "m/s^2", "bias after the erection"),
        Param("gyro_noise", 1.5e-7, 0.0, 3e-5, "rad/sqrt(s)", "angle walk: small trusts the gyro"),
        Param("force_noise", 5e-5, 0.0, 2e-3, "m/s/sqrt(s)", "velocity walk"),
        Param("gyro_walk", 0.0, 0.0, 1e-9, "rad/s/sqrt(s)", "of the bias: small keeps it"),
        Param("force_walk", 0.0, 0.0, 1e-4, "m/s^2/sqrt(s)", "of the bias: small keeps it"),
        Param("zupt_sd", 2e-3, 5e-4, 2.0**-7, "m/s", "of the velocity zero"),
        Param("index_sd", 1.43 * ARCSEC, 0.5 * ARCSEC, UNITS["heading"], "rad", "of an index"),
        Param("index_gate", 20.0, 1.0, 100.0, "", "an index further off, in deviations, waits"),
        Param("index_turn", 1.0, 0.0, 2.0, "ht", "least turn between two indices"),
    )


def filter_states(
    start: list[float], first: list[float], rate: float, align: int, literal: bool
) -> tuple[State, ...]:
    """Instrument errors, covariance, and what the filter remembers from one second to the next.

    ``first``: variances, scaled, of the 13 states; ``align``: samples of the alignment.
    """
    return (
        *(State(name, -limit, limit * BELOW, unit) for name, limit, unit in _LEARNT),
        *covariance_states(13, lambda i: first[i]),
        State("count", -1.0 - align, rate, "", -1.0 - align if align else 0.0),
        State("late", 0.0, 1.0),  # P was last propagated at an index
        *(State(f"from_q{a}", -1.0, BELOW, "", c) for a, c in zip("wxyz", start, strict=True)),
        State("turned", -4.0, 4.0 * BELOW, "", 4.0 * BELOW),
        *([State("last_off", -1.0, BELOW, "ht")] if literal else []),
    )


#: Besides those of the strapdown.
OUTPUTS = (
    *(Output(f"eps_{a}", "rad/s", 2e-10) for a in AXES),
    *(Output(f"nabla_{a}", "m/s^2", 1e-5) for a in AXES),
    Output("scale_up", "", 5e-7),
    Output("status", "bits"),
)
