"""Synchronous machines, inverter and current sensors, driven with the voltage of the core."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.errors import require_choice
from boresight.sim.worlds.world import BatchedWorld
from boresight.systems.pmsm.estimator import DT, PI, PSI, VOLTAGE, L, R

START_S, REVERSAL_S = 0.2, 0.5  #: end of the forced start, reversal.
SPEED = 900.0  #: electrical rad/s, forth and back.
LOADS_S = ((0.3, 0.45), (0.65, 0.75))  #: when the load is on.
STEPS = 16_000
SUBSTEPS = 10
PAIRS = 4
PWM_V, ADC_A = 0.05, 0.02  #: steps of voltage and measured current.


@dataclass(frozen=True)
class Machine:
    """A machine with surface magnets, its inverter and its sensors.

    What it is for; resistance [ohm], inductance [H], flux of the magnets [Wb], inertia [kg m^2],
    load torque of either direction [N m], white noise and offset of a measured current [A],
    voltage that the inverter loses against the current [V].
    """

    meaning: str
    r: float = R
    l: float = L  # noqa: E741
    psi: float = PSI
    inertia: float = 1e-3
    load: float = 1.0
    noise: float = 0.1
    offset: float = 0.0
    dead_time: float = 0.0


#: By name; the filter is not tuned for any.
MACHINES = {
    "known": Machine("the machine that the filter knows"),
    "warm": Machine("resistance 30 % higher, magnets 5 % weaker", r=0.65, psi=0.0475),
    "saturated": Machine("inductance 20 % lower", l=0.8e-3),
    "dead_time": Machine("inverter that loses 0.4 V against the current", dead_time=0.4),
    "offsets": Machine("current sensors off by 0.1 A", offset=0.1),
    "noisy": Machine("three times the noise of the currents", noise=0.3),
    "heavy": Machine("three times the inertia", inertia=3e-3),
    "loaded": Machine("twice the load", load=2.0),
}


class Motor(BatchedWorld):
    """Start, load, reversal through standstill, load: 0.8 s at 20 kHz, a run for each seed.

    ``machine`` is one of `MACHINES`, any other is an `InputError`; ``seeds`` are of the noise, and
    of where the rotor stands at first (any angle).
    """

    def __init__(
        self, machine: str = "known", seeds: Sequence[int] = (1,), steps: int = STEPS
    ) -> None:
        super().__init__(seeds)
        require_choice("world motor, machine", machine, MACHINES)
        self.machine, self.steps = MACHINES[machine], steps

    def start(self) -> None:
        draws = [np.random.default_rng([seed, 20]) for seed in self.seeds]
        self.theta = np.array([PI * draw.uniform(-1.0, 1.0) for draw in draws])
        self.omega = np.zeros(self.runs)
        self.i, self.v = np.zeros((2, self.runs)), np.zeros((2, self.runs))
        m = self.machine
        self._noise = m.noise * np.stack([g.normal(size=(self.steps, 2)) for g in draws], axis=2)
        self._k = 0

    def record(self, outputs: Mapping[str, FloatArray] | None) -> dict[str, FloatArray] | None:
        """Voltage of the last period, currents at its end."""
        if self._k == self.steps:
            return None
        if outputs is not None:
            wanted = np.stack([outputs["u_a"], outputs["u_b"]])
            self.v = np.clip(np.rint(wanted / PWM_V) * PWM_V, -VOLTAGE, VOLTAGE)
        t = self._k * DT
        self._turn(t)
        measured = self.i + self.machine.offset + self._noise[self._k]
        measured = np.clip(np.rint(measured / ADC_A) * ADC_A, -40.0, 40.0)
        self._k += 1
        return {
            **{"v_a": self.v[0], "v_b": self.v[1], "i_a": measured[0], "i_b": measured[1]},
            "target": np.array([SPEED if t < REVERSAL_S else -SPEED]),
            "forced": np.array([float(t < START_S)]),
            **{"ia_true": self.i[0], "ib_true": self.i[1], "omega_true": self.omega},
            "theta_true": ((self.theta + 0.5 * DT * self.omega) / PI + 1.0) % 2.0 - 1.0,
        }

    def _turn(self, t: float) -> None:
        """One period of the machine, in `SUBSTEPS`."""
        m, h = self.machine, DT / SUBSTEPS
        load = m.load if any(begin < t < end for begin, end in LOADS_S) else 0.0
        v, emf = self.v - m.dead_time * np.tanh(10.0 * self.i), np.empty_like(self.v)
        for _ in range(SUBSTEPS):
            sine, cosine = np.sin(self.theta), np.cos(self.theta)
            emf[0], emf[1] = -sine, cosine
            emf *= self.omega * m.psi
            torque = 1.5 * PAIRS * m.psi * (cosine * self.i[1] - sine * self.i[0])
            load_torque = load * np.tanh(self.omega) + 2e-4 * self.omega
            self.i = self.i + h / m.l * (v - m.r * self.i - emf)
            self.theta = self.theta + h * self.omega
            self.omega = self.omega + h * PAIRS / m.inertia * (torque - load_torque)
