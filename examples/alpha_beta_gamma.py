"""A manoeuvring target by fixed gains: the alpha-beta-gamma filter.

After Kalata, IEEE Transactions on Aerospace and Electronic Systems 20 (1984), 174-182: the tracking
index, manoeuvre over noise, fixes the gains; here 1 m/s^2 a sample and 3 m at T = 50 ms.
"""

from boresight import Estimator, Input, Output, Param, State, ops

T = 0.05  # s


class AlphaBetaGamma(Estimator):
    """Constant acceleration."""

    inputs = (Input("z", -100.0, 3000.0, "m"),)
    params = (
        Param("alpha", 0.172, 0.0, 1.0),
        Param("beta", 0.0161, 0.0, 1.0),
        Param("gamma", 0.00038, 0.0, 1.0),
    )
    states = (
        State("r", -100.0, 3000.0, "m", 1000.0),
        State("v", -200.0, 200.0, "m/s", 60.0),
        State("a", -60.0, 60.0, "m/s^2"),
    )
    outputs = (
        Output("r", "m", tolerance=1e-3),
        Output("v", "m/s", tolerance=1e-3),
        Output("a", "m/s^2", tolerance=1e-3),
    )

    def step(self, x, u, p):
        r, v = x.r + T * x.v + 0.5 * T**2 * x.a, x.v + T * x.a
        residual = ops.clip(u.z - r, -50.0, 50.0)
        after = {
            "r": r + p.alpha * residual,
            "v": v + p.beta * (residual * (1.0 / T)),
            "a": x.a + p.gamma * (residual * (2.0 / T**2)),
        }
        return after, after
