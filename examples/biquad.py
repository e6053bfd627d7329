"""Butterworth low-pass of fourth order at a twentieth of the sample rate: two biquads.

``biquad.csv`` has tones below and above the corner, and noise; `scipy.signal.sosfilt` gives the
same output within the tolerance::

    boresight check biquad.py biquad.csv
    boresight run biquad.py biquad.csv --levels fixed -o out.csv

Sections of second order keep their bits. One filter of fourth order would have poles close
together, and coefficients that have to be far finer than its signal. The first section has the
whole gain, so that no signal grows on the way.
"""

from boresight import Estimator, Input, Output, State

# scipy.signal.butter(4, 0.1, output="sos")
SECTIONS = (
    (
        (0.00041659920440659937, 0.0008331984088131987, 0.00041659920440659937),
        (-1.4796742169311934, 0.5558215432824889),
    ),
    ((1.0, 2.0, 1.0), (-1.7009643319435257, 0.7884997398152979)),
)


class Biquad(Estimator):
    """Transposed direct form II."""

    inputs = (Input("x", -1.0, 1.0, "V"),)
    states = (
        State("a1", -0.25, 0.25, "V"),
        State("a2", -0.25, 0.25, "V"),
        State("b1", -4.0, 4.0, "V"),
        State("b2", -4.0, 4.0, "V"),
    )
    outputs = (Output("y", "V", tolerance=1e-6),)

    def step(self, x, u, p):
        signal, after = u.x, {}
        for name, ((b0, b1, b2), (a1, a2)) in zip("ab", SECTIONS, strict=True):
            z1, z2 = getattr(x, f"{name}1"), getattr(x, f"{name}2")
            out = b0 * signal + z1
            after[f"{name}1"] = b1 * signal - a1 * out + z2
            after[f"{name}2"] = b2 * signal - a2 * out
            signal = out
        return after, {"y": signal}
