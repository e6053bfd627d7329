"""An inverted pendulum on a cart, held by state feedback of estimated states: LQG.

After Åström and Murray, Feedback Systems (2008), chapters 6 and 7: x = A x + B u, corrected by
L (z - C x), u = -K x. K and L are the stationary gains of `scipy.linalg.solve_discrete_are`, with
Q = diag(10, 1, 100, 1), R = 0.1 and Q = diag(0, 1e-4, 0, 1e-4), R = diag(4e-6, 1e-6).
"""

import numpy as np

from boresight import Estimator, Input, Output, State

A = np.eye(4) + 0.01 * np.array(
    [[0.0, 1.0, 0.0, 0.0], [0.0, -0.2, -1.0, 0.0], [0.0, 0.0, 0.0, 1.0], [0.0, 0.2, 20.0, 0.0]]
)
B = 0.01 * np.array([0.0, 1.0, 0.0, -2.0])
C = np.eye(4)[[0, 2]]
K = np.array([-9.17503, -10.6598, -65.1382, -13.8168])
L = np.array([[0.27053, 0.0016269], [4.2163, 0.021579], [0.00040673, 0.36417], [0.033696, 8.1029]])


class Lqg(Estimator):
    """Position and angle are measured; the drive is limited to 30 m/s^2."""

    inputs = (Input("z", -2.0, 2.0, "m"), Input("phi", -0.5, 0.5, "rad"))
    states = tuple(State(f"x{n}", -b, b) for n, b in enumerate((2.0, 8.0, 0.5, 4.0)))
    outputs = (Output("drive", "m/s^2", tolerance=1e-3), Output("angle", "rad", tolerance=1e-5))

    def step(self, x, u, p):
        x = np.array([x.x0, x.x1, x.x2, x.x3])
        x = x + L @ (np.array([u.z, u.phi]) - C @ x)
        drive = np.clip(-K @ x, -30.0, 30.0)
        after = A @ x + B * drive
        return {f"x{n}": v for n, v in enumerate(after)}, {"drive": drive, "angle": x[2]}
