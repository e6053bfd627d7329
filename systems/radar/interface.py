"""Interface of `Registration`: inputs, parameters, states, outputs, status bits."""

from __future__ import annotations

from boresight import Input, Output, Param, State
from boresight.model.algebra.carried import BELOW

AXES = "xyz"
BIASES = ("range_1", "elevation_1", "azimuth_1", "range_2", "elevation_2", "azimuth_2")
WIDEST = 1024.0  #: largest first standard deviation of a bias, over the noise.
ECEF = 2.0**23  #: m, full scale of a position: words of 4 mm.
FASTEST = 32.0  #: Hz, largest rate of records.
REACH = 2.0**20  #: m, full scale of a position in a radar's axes.
_DEG = 0.017453292519943295

#: Bits of the output ``status``.
STATUS_BITS = {
    0: "a radar has no sample: no measurement",
    1: "no track of both radars yet, or none any more: no measurement",
    2: "target below a radar's horizon or near its zenith: no measurement",
    3: "the tracks are further apart than the gate: no measurement",
    4: "a bias is at the limit of its word, eight first standard deviations",
    5: "the outputs are corrected",
}

INPUTS = (
    Input("dt", -1.0, 1.0, "s", clamp=True, meaning="time since the record before; below 0: anew"),
    *(
        Input(
            f"{a}{i}", -ECEF, ECEF, "m", missing="hold", meaning=f"ECEF {a} that radar {i} reports"
        )
        for i in "12"
        for a in AXES
    ),
    *(
        Input(
            f"seen_{i}",
            0.0,
            1.0,
            valid_of=tuple(f"{a}{i}" for a in AXES),
            meaning=f"1: radar {i} has a sample",
        )
        for i in "12"
    ),
)

_NOISE = (
    ("range", 10.0, 1.0, 1000.0, "m"),
    ("elevation", 0.07 * _DEG, 1e-5, 0.1, "rad"),
    ("azimuth", 0.15 * _DEG, 1e-5, 0.1, "rad"),
)
_FIRST = {"range": 100.0, "elevation": 1.0 / 0.07, "azimuth": 1.0 / 0.15}
PARAMS = (
    *(
        Param(f"{name}_sd_{i}", value, low, high, unit, f"noise of the {name} of radar {i}")
        for i in "12"
        for name, value, low, high, unit in _NOISE
    ),
    *(
        Param(f"p0_{b}", _FIRST[b[:-2]], 0.0, WIDEST, "", f"bias {b} at first, over its noise")
        for b in BIASES
    ),
    Param("rate", 10.0, 0.1, FASTEST, "Hz", "of the records, for the gains of the tracks"),
    Param("forgetting", 0.1, 1e-3, 0.5, "", "of the tracks: 1 - theta of the fading memory"),
    Param("correct_from", 80.0, 0.0, 1000.0, "s", "since the restart: then tracks are corrected"),
    Param("gate", 1e5, 1.0, 1.3e5, "m", "component of the difference beyond it is not used"),
    Param("gap", 2.0, 0.1, 100.0, "s", "after so long without a pair the tracks begin anew"),
)

STATES = (
    *(State(f"bias_{k}", -8.0, 8.0 * BELOW) for k in range(6)),
    *(State(f"rest_{k}", -(2.0**-12), 2.0**-12 * BELOW) for k in range(6)),
    *(
        State(f"s{i}{j}", -1.0, BELOW, "", BELOW if i == j else 0.0)
        for i in range(6)
        for j in range(6)
    ),
    # Before the first track: anywhere but at the radar itself.
    *(State(f"pos_{i}{a}", -REACH, REACH * BELOW, "m", 1e5) for i in "12" for a in "enu"),
    *(State(f"vel_{i}{a}", -(2.0**16), 2.0**16 * BELOW, "m/s") for i in "12" for a in "enu"),
    *(State(f"acc_{i}{a}", -(2.0**18), 2.0**18 * BELOW, "m/s^2") for i in "12" for a in "enu"),
    State("memory", 0.0, 1.0, "", 1.0),
    State("weight", 0.0, 1.0, "", 1.0),
    State("unpaired", 0.0, 128.0, "s"),
    State("time", 0.0, 1024.0, "s"),
)

OUTPUTS = (
    *(
        Output(f"{b}_bias", "m" if b[0] == "r" else "rad", 0.05 if b[0] == "r" else 1e-6)
        for b in BIASES
    ),
    *(Output(f"{a}{i}_corrected", "m", 0.05) for i in "12" for a in AXES),
    Output("nis", "", 0.05, "normalised innovation squared, three degrees of freedom"),
    Output("status", "bits"),
)
