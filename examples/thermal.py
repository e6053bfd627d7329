"""Temperature of a motor's winding from that of its housing: a Kalman filter of two bodies.

After Bergman, Lavine, Incropera and DeWitt, Fundamentals of Heat and Mass Transfer (2011), section
5.1: C1 T1' = P - G (T1 - T2), C2 T2' = G (T1 - T2) - H (T2 - 20).
"""

from boresight import Input, Output
from boresight.kalman import Kalman, Measurement, State

DT, C1, C2, G, H = 1.0, 60.0, 200.0, 1.5, 0.8  # s, J/K, W/K


class Thermal(Kalman):
    """Winding and housing, degrees Celsius."""

    inputs = (Input("power", 0.0, 200.0, "W"), Input("z", -40.0, 200.0, "degC"))
    states = (
        State("winding", -40.0, 250.0, "degC", initial=30.0, sd=10.0),
        State("housing", -40.0, 200.0, "degC", initial=25.0, sd=5.0),
    )
    outputs = tuple(Output(n, "degC", tolerance=1e-3) for n in ("winding", "housing"))
    rates_hz = {"dt": 1.0 / DT}

    def f(self, x, u, p):
        """Heat from winding to housing to air."""
        flow = G * (x.winding - x.housing)
        return {
            "winding": x.winding + DT / C1 * (u.power - flow),
            "housing": x.housing + DT / C2 * (flow - H * (x.housing - 20.0)),
        }

    def noise(self, x, u, p):
        return {"winding": 1e-2, "housing": 1e-4}

    def measure(self, x, u, p):
        return [Measurement(u.z, x.housing, 0.04)]
