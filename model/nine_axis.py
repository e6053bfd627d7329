"""Inputs and outputs that all attitude filters share."""

from __future__ import annotations

from boresight.model.declarations import Input, Output

_STEP = "time since the sample before; negative: begin anew; a longer gap in a log counts as 0.25 s"
_FORCE = "specific force, body axis {}"
_FIELD = "magnetic flux density, body axis {}; all three 0: no new sample"

#: Measurements of the sensors on one body, in body axes.
INPUTS = (
    Input("dt", -0.25, 0.2499, "s", clamp=True, meaning=_STEP),
    *(Input(f"g{c}", -40.0, 40.0, "rad/s", meaning=f"body rate, axis {c}") for c in "xyz"),
    *(Input(f"m{c}", -256.0, 255.9, "uT", missing=0.0, meaning=_FIELD.format(c)) for c in "xyz"),
    *(Input(f"a{c}", -160.0, 160.0, "m/s^2", meaning=_FORCE.format(c)) for c in "xyz"),
)
#: Euler angles, and the quaternion b to n: it alone is judged, since angles near the vertical
#: differ by more than the attitudes do. 5e-5 of a component is 0.01 deg.
OUTPUTS = (
    *(Output(name, "ht") for name in ("pitch", "roll", "heading")),
    *(Output(f"q{axis}", "", tolerance=5e-5) for axis in "wxyz"),
    Output("status", "bits"),
)
