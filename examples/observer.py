"""Speed and current of a servo motor from its angle: Luenberger's observer of a state space.

After Franklin, Powell and Workman, Digital Control of Dynamic Systems (1998), section 8.2:
x = A x + B u + L (z - C x). L puts the observer's poles at 0.8, 0.75 and 0.7
(`scipy.signal.place_poles` of A' and (C A)').
"""

import numpy as np

from boresight import Estimator, Input, Output, State, ops

A = np.array([[1.0, 1e-3, 0.0], [0.0, 0.998, 5e-3], [0.0, -5e-3, 0.95]])
B = np.array([0.0, 0.0, 0.1])
C = np.array([1.0, 0.0, 0.0])
L = np.array([0.55702, 140.98, 1576.28])


class Observer(Estimator):
    """Angle, speed and current."""

    inputs = (Input("volts", -12.0, 12.0, "V"), Input("z", -16.0, 16.0, "rad"))
    states = (
        State("angle", -16.0, 16.0, "rad"),
        State("speed", -128.0, 128.0, "rad/s"),
        State("current", -64.0, 64.0, "A"),
    )
    outputs = (
        Output("angle", "rad", tolerance=1e-5),
        Output("speed", "rad/s", tolerance=1e-3),
        Output("current", "A", tolerance=1e-2),
    )

    def step(self, x, u, p):
        x = A @ np.array([x.angle, x.speed, x.current]) + B * u.volts
        angle, speed, current = x + L * ops.clip(u.z - C @ x, -0.1, 0.1)
        after = {"angle": angle, "speed": speed, "current": current}
        return after, after
