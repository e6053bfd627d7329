"""Phase and frequency of a carrier from its two quadratures: a phase-locked loop.

After Gardner, Phaselock Techniques (2005): a loop of second order and type 2.
"""

from boresight import Estimator, Input, Output, Param, State, ops

DT = 1e-3


class Pll(Estimator):
    """Second order, at 1 kHz."""

    inputs = (Input("i", -2.0, 2.0, "V"), Input("q", -2.0, 2.0, "V"))
    params = (
        Param("kp", 0.06, 0.0, 0.5, "", "half turns per half turn of error"),
        Param("ki", 1.0, 0.0, 16.0, "1/s", "how fast the frequency follows"),
    )
    states = (State("phase", -1.0, 1.0, "ht"), State("frequency", -200.0, 200.0, "Hz", 30.0))
    outputs = (
        Output("phase", "ht", tolerance=1e-5),
        Output("frequency", "Hz", tolerance=1e-4),
        Output("locked", "V", tolerance=1e-4, meaning="carrier in phase"),
    )

    def step(self, x, u, p):
        """The angle of the carrier against the loop's own phase drives the loop."""
        sine, cosine = ops.sincos_ht(x.phase)
        along = u.i * cosine + u.q * sine
        across = u.q * cosine - u.i * sine
        error = ops.atan2_ht(across, along)
        frequency = ops.clip(x.frequency + p.ki * error, -200.0, 200.0)
        phase = ops.wrap_ht(x.phase + 2.0 * DT * frequency + p.kp * error)
        after = {"phase": phase, "frequency": frequency}
        return after, {**after, "locked": along}
