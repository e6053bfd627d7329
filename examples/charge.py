"""State of charge of a lithium cell from current and voltage: an extended Kalman filter.

After Plett, Journal of Power Sources 134 (2004), 252-292: the combined model of the open-circuit
voltage with one relaxation, 2.5 Ah, sampled every second.
"""

from boresight import Input, Output, ops
from boresight.kalman import Kalman, Measurement, State

K = (4.23, 3.86e-5, 0.24, 0.22, -0.04)  # V


class Charge(Kalman):
    """State of charge, and the voltage that relaxes."""

    inputs = (Input("i", -10.0, 10.0, "A"), Input("v", 2.0, 5.0, "V"))
    states = (State("soc", 0.05, 0.97, initial=0.7, sd=0.1), State("v1", -0.25, 0.25, "V", sd=0.01))
    outputs = (Output("soc", tolerance=1e-4), Output("v1", "V", tolerance=1e-5))

    def f(self, x, u, p):
        return {"soc": x.soc - u.i * (1.0 / 9000.0), "v1": 0.96 * x.v1 + 0.04 * 0.02 * u.i}

    def noise(self, x, u, p):
        return {"soc": 1e-9, "v1": 1e-8}

    def measure(self, x, u, p):
        """Voltage at the terminals: K0 - K1/z - K2 z + K3 ln z + K4 ln(1 - z) - v1 - R0 i."""
        z = x.soc
        h = K[0] - K[1] / z - K[2] * z + K[3] * ops.log(z) + K[4] * ops.log(1.0 - z)
        return [Measurement(u.v, h - x.v1 - 0.03 * u.i, 2.5e-5)]
