"""Sensorless motor drive: currents, speed and angle of a synchronous machine from its currents.

An extended Kalman filter of four states at 20 kHz, and the drive that is controlled with its speed
and angle: forced start, load steps, reversal through standstill::

    boresight simulate pmsm.py:Drive pmsm.py:Pmsm --on fixed -o loop.csv
    boresight covariance pmsm.py:Pmsm --updates 200000

The outputs are those of the predicted state: they leave the core before the correction begins,
which runs while the controller computes the next voltage. Angles are in half turns.
"""

import math

from boresight import Input, Output, Param, World, ops
from boresight.kalman import Kalman, Measurement, State

DT = 50e-6  # s
PI = 3.141592653589793
R, L, PSI = 0.5, 1e-3, 0.05  # ohm, H, Wb
PAIRS, INERTIA = 4, 1e-3  # poles; kg m^2


class Pmsm(Kalman):
    """Currents in stator axes, electrical speed and angle of a synchronous machine."""

    inputs = (
        Input("v_a", -100.0, 100.0, "V"),
        Input("v_b", -100.0, 100.0, "V"),
        Input("i_a", -40.0, 40.0, "A"),
        Input("i_b", -40.0, 40.0, "A"),
    )
    params = (
        Param("r_i", 0.01, 1e-3, 1.0, "A^2", "variance of a current"),
        Param("q_i", 4e-3, 1e-4, 1.0, "A^2", "noise of a current in a step: dead time, ripple"),
        Param("q_w", 2.0, 1e-2, 1e2, "(rad/s)^2", "noise of the speed in a step: torque"),
        Param("q_t", 1e-8, 1e-10, 1e-4, "ht^2", "noise of the angle in a step"),
    )
    states = (
        State("ia", -40.0, 40.0, "A", sd=1.0, sd_max=2.0),
        State("ib", -40.0, 40.0, "A", sd=1.0, sd_max=2.0),
        State("omega", -3000.0, 3000.0, "rad/s", sd=100.0, sd_max=512.0),
        State("theta", -1.0, 1.0, "ht", sd=0.3, sd_max=1.0),
    )
    outputs = (
        Output("theta", "ht", tolerance=2e-5),
        Output("omega", "rad/s", tolerance=0.02),
        Output("ia", "A", tolerance=1e-4),
        Output("ib", "A", tolerance=1e-4),
    )
    prior = True
    urgent = 2

    def f(self, x, u, p):
        """One period: the voltage is that of the period before the measured currents."""
        sine, cosine = ops.sincos_ht(x.theta)
        emf = (DT * PSI / L) * x.omega
        return {
            "ia": (1.0 - DT * R / L) * x.ia + emf * sine + (DT / L) * u.v_a,
            "ib": (1.0 - DT * R / L) * x.ib - emf * cosine + (DT / L) * u.v_b,
            "theta": ops.wrap_ht(x.theta + (DT / PI) * x.omega),
        }

    def noise(self, x, u, p):
        """Variances that a period adds."""
        return {"ia": p.q_i, "ib": p.q_i, "omega": p.q_w, "theta": p.q_t}

    def measure(self, x, u, p):
        """Two currents."""
        return [Measurement(u.i_a, x.ia, p.r_i), Measurement(u.i_b, x.ib, p.r_i)]


class Drive(World):
    """Motor, inverter and controller; the controller has the filter's speed and angle."""

    def __init__(self, steps=16000):
        self.steps = steps
        self.seed = 1

    def draw(self, seed):
        """Noise of the currents."""
        self.seed = seed

    def start(self):
        """At rest, the rotor somewhere."""
        self.k, self.word = 0, self.seed
        self.i, self.v = [0.0, 0.0], [0.0, 0.0]
        self.omega, self.theta = 0.0, 0.4  # electrical rad/s, rad
        self.wanted, self.iq_sum, self.sums = 0.0, 0.0, [0.0, 0.0]

    def record(self, outputs):
        """Voltage of the last period, currents at its end."""
        if self.k == self.steps:
            return None
        if outputs is not None:
            self.v = self._controlled(outputs)
        self._turn()
        self.k += 1
        noisy = [i + 0.1 * self._normal() for i in self.i]
        angle = (self.theta / PI + 1.0) % 2.0 - 1.0
        return {
            **{"v_a": self.v[0], "v_b": self.v[1], "i_a": noisy[0], "i_b": noisy[1]},
            **{"ia_true": self.i[0], "ib_true": self.i[1]},
            **{"omega_true": self.omega, "theta_true": angle},
        }

    def _controlled(self, outputs):
        """Voltage of speed and current controllers, in rotor axes of the estimated angle."""
        t = self.k * DT
        speed, angle = outputs["omega"], PI * outputs["theta"] + DT * outputs["omega"]
        if t < 0.15:  # forced start: a current that turns, faster and faster
            angle, wanted = 0.5 * 1500.0 * t * t, [6.0, 0.0]
            self.wanted, self.iq_sum = speed, 0.0
        else:
            target = 900.0 if t < 0.5 else -900.0
            self.wanted += max(-0.3, min(0.3, target - self.wanted))
            error = self.wanted - speed
            self.iq_sum = max(-15.0, min(15.0, self.iq_sum + 1e-4 * error))
            wanted = [0.0, max(-15.0, min(15.0, 0.03 * error + self.iq_sum))]
        sine, cosine = math.sin(angle), math.cos(angle)
        seen = [outputs["ia"], outputs["ib"]]
        own = [cosine * seen[0] + sine * seen[1], cosine * seen[1] - sine * seen[0]]
        v = []
        for k in (0, 1):
            error = wanted[k] - own[k]
            self.sums[k] = max(-80.0, min(80.0, self.sums[k] + 0.1 * error))
            v.append(3.0 * error + self.sums[k])
        v = [cosine * v[0] - sine * v[1], sine * v[0] + cosine * v[1]]
        return [max(-96.0, min(96.0, round(c / 0.05) * 0.05)) for c in v]

    def _turn(self):
        """One period of the motor, in ten steps."""
        t = self.k * DT
        load = 1.0 if 0.3 < t < 0.45 or 0.65 < t < 0.75 else 0.0
        for _ in range(10):
            sine, cosine = math.sin(self.theta), math.cos(self.theta)
            emf = [-self.omega * PSI * sine, self.omega * PSI * cosine]
            torque = 1.5 * PAIRS * PSI * (cosine * self.i[1] - sine * self.i[0])
            friction = 2e-4 * self.omega
            change = [(v - R * i - e) / L for v, i, e in zip(self.v, self.i, emf, strict=True)]
            self.i = [i + 0.1 * DT * c for i, c in zip(self.i, change, strict=True)]
            self.theta += 0.1 * DT * self.omega
            self.omega += 0.1 * DT * PAIRS / INERTIA * (torque - load - friction)

    def _normal(self):
        """Near to a normal deviate: twelve numbers of a congruential generator."""
        total = -6.0
        for _ in range(12):
            self.word = (1664525 * self.word + 1013904223) % 2**32
            total += self.word / 2**32
        return total
