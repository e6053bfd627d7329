"""A vehicle in the plane by matrices, both coordinates measured at once: a Kalman filter.

After Bar-Shalom, Li and Kirubarajan, Estimation with Applications to Tracking and Navigation
(2001), section 5.2: x = F x, P = F P F' + Q, S = H P H' + R, K = P H' S^-1, P = (I - K H) P.
"""

import numpy as np

from boresight import Estimator, Input, Output, State, ops

DT, Q = 0.1, 0.5  # s, m^2/s^3
F, H = np.eye(4) + DT * np.eye(4, k=2), np.eye(4)[:2]
LARGEST = (6.0, 6.0, 6.0, 6.0)  # standard deviations, m and m/s
NAMES = ("px", "py", "vx", "vy")


class Matrices(Estimator):
    """Constant velocity with random acceleration."""

    inputs = (Input("zx", -500.0, 500.0, "m"), Input("zy", -500.0, 500.0, "m"))
    states = (
        *(State(n, -500.0, 500.0, "m") for n in NAMES[:2]),
        *(State(n, -50.0, 50.0, "m/s") for n in NAMES[2:]),
        *(State(f"p{i}{i}", 0.0, 36.0, initial=25.0) for i in range(4)),
        *(State(f"p{i}{j}", -36.0, 36.0) for i in range(4) for j in range(i)),
    )
    outputs = tuple(Output(n, "m" if n[0] == "p" else "m/s", tolerance=1e-3) for n in NAMES)

    def step(self, x, u, p):
        m = np.array([getattr(x, n) for n in NAMES])
        P = np.array([[getattr(x, f"p{max(i, j)}{min(i, j)}") for j in range(4)] for i in range(4)])
        m, P = F @ m, F @ P @ F.T + np.diag([0.0, 0.0, Q * DT, Q * DT])
        K = P @ H.T @ ops.inverse(H @ P @ H.T + 4.0 * np.eye(2), 4.0)
        m, P = m + K @ (np.array([u.zx, u.zy]) - H @ m), (np.eye(4) - K @ H) @ P
        after = dict(zip(NAMES, m, strict=True))
        return after | {f"p{i}{j}": P[i, j] for i in range(4) for j in range(i + 1)}, after
