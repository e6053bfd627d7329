"""Inputs and outputs that all attitude filters share."""

from __future__ import annotations

from boresight.model.declarations import Input, Output

__all__ = ["INPUTS", "OUTPUTS"]

#: Time step (negative: begin anew, or what `model.front.inertial` says; a longer gap in a log
#: counts as a quarter of a second), body rate, magnetic flux density (the zero vector says "no
#: sample"), specific force, in body axes.
INPUTS = (
    Input("dt", -0.25, 0.2499, "s", clamp=True),
    *(Input(f"g{axis}", -40.0, 40.0, "rad/s") for axis in "xyz"),
    *(Input(f"m{axis}", -256.0, 255.9, "uT", missing=0.0) for axis in "xyz"),
    *(Input(f"a{axis}", -160.0, 160.0, "m/s^2") for axis in "xyz"),
)
#: Euler angles, and the quaternion b to n: it alone is judged, since angles near the vertical
#: differ by more than the attitudes do. 5e-5 of a component is 0.01 deg.
OUTPUTS = (
    *(Output(name, "ht") for name in ("pitch", "roll", "heading")),
    *(Output(f"q{axis}", "", tolerance=5e-5) for axis in "wxyz"),
    Output("status", "bits"),
)
