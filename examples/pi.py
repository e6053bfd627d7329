"""Speed control of a motor: a PI controller, and the motor that it drives.

The motor is a world: it gets the drive and returns the speed that an encoder measures::

    boresight run pi.py:Pi pi.py:Motor --levels fixed -o loop.csv
    boresight run pi.py:Pi pi.py:Motor --levels rtl --steps 300

The integral stops at the supply, so that it does not wind up while the drive is at its limit.
"""

from boresight import Estimator, Input, Output, Param, State, World, ops

DT = 1e-3


class Pi(Estimator):
    """Proportional and integral, with the integral stopped at the supply."""

    inputs = (Input("target", -300.0, 300.0, "rad/s"), Input("speed", -400.0, 400.0, "rad/s"))
    params = (
        Param("kp", 0.08, 0.0, 1.0, "V*s/rad", "share of the error that drives at once"),
        Param("ki", 1.5, 0.0, 8.0, "V/rad", "how fast what is left is taken away"),
    )
    states = (State("integral", -24.0, 24.0, "V"),)
    outputs = (Output("drive", "V", tolerance=1e-4),)

    def step(self, x, u, p):
        error = u.target - u.speed
        integral = ops.clip(x.integral + p.ki * (error * DT), -24.0, 24.0)
        drive = ops.clip(p.kp * error + integral, -24.0, 24.0)
        return {"integral": integral}, {"drive": drive}


class Motor(World):
    """First order, 12 rad/s per volt in 80 ms, with a load that comes and goes."""

    def __init__(self, steps=1500):
        self.steps = steps

    def start(self):
        self.speed, self.k = 0.0, 0

    def record(self, outputs):
        """Speed one period later, as an encoder of 0.05 rad/s shows it."""
        if self.k == self.steps:
            return None
        drive = 0.0 if outputs is None else outputs["drive"]
        load = 20.0 if self.k // 400 % 2 else 0.0
        self.speed += DT / 0.08 * (12.0 * drive - load - self.speed)
        target = 150.0 if self.k // 700 % 2 == 0 else -90.0
        self.k += 1
        return {"target": target, "speed": round(self.speed / 0.05) * 0.05}
