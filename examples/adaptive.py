"""A cart whose sensor's noise changes: a Kalman filter that estimates r from its innovations.

After Mehra, IEEE Transactions on Automatic Control 15 (1970), 175-184: the mean square of the
innovations is H P H' + r; here it is a sliding mean over some 50 samples.
"""

from boresight import Input, Output, State, ops
from boresight.kalman import Kalman, Measurement
from boresight.kalman import State as Estimated

DT, Q = 0.02, 2.0  # s, m^2/s^3


class Adaptive(Kalman):
    """Position, velocity, and the variance of the measurement."""

    inputs = (Input("z", -100.0, 100.0, "m"),)
    states = (
        Estimated("pos", -64.0, 64.0, "m", sd=2.0),
        Estimated("vel", -32.0, 32.0, "m/s", initial=8.0, sd=4.0),
    )
    memory = (State("r", 0.01, 16.0, "m^2", initial=1.0),)
    outputs = (
        Output("pos", "m", tolerance=1e-3),
        Output("vel", "m/s", tolerance=1e-3),
        Output("r", "m^2", tolerance=1e-3),
    )
    rates_hz = {"dt": 1.0 / DT}

    def f(self, x, u, p):
        """A step, and r from this sample's innovation."""
        ahead = x.pos + DT * x.vel
        innovation = ops.clip(u.z - ahead, -8.0, 8.0)
        expected = x.p_pos_pos + 2.0 * DT * x.p_pos_vel + DT**2 * x.p_vel_vel
        r = x.r + 0.02 * (innovation * innovation - expected - x.r)
        return {"pos": ahead, "r": ops.clip(r, 0.01, 16.0)}

    def noise(self, x, u, p):
        return {"vel": DT * Q}

    def measure(self, x, u, p):
        return [Measurement(u.z, x.pos, x.r)]
