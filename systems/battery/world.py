"""Cells that are discharged, rest and are charged: the published circuit, and cells that differ."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.errors import require_choice
from boresight.sim.worlds.world import BatchedWorld
from boresight.systems.battery.estimator import A_0, A_1, A_2, A_3, CAPACITY, DT, B, C

STEPS = 7200
REST_S = (3600.0, 4200.0)  #: no current.
CHARGE_S = 6000.0  #: charged from here on, with half of its capacity an hour.
SUBSTEPS = 4
_PART = 256  #: steps that are computed as one array: as fast as all, in less memory.


@dataclass(frozen=True)
class Cell:
    """A cell and its sensors.

    What it is for; share of the published capacity and resistances, share of its time constants;
    white noise [A], offset [A] and error of scale of the measured current, white noise of the
    measured voltage [V]; the published curve with an error of this much [V] at half charge.
    """

    meaning: str
    capacity: float = 1.0
    resistance: float = 1.0
    slower: float = 1.0
    noise_a: float = 0.04
    offset_a: float = 0.0
    scale: float = 0.0
    noise_v: float = 0.003
    curve_v: float = 0.0


#: By name; the filter is not tuned for any.
CELLS = {
    "known": Cell("the published cell"),
    "aged": Cell("15 % less capacity, resistances 40 % higher", capacity=0.85, resistance=1.4),
    "cold": Cell("resistances doubled, elements half as slow again", resistance=2.0, slower=1.5),
    "offset": Cell("current sensor off by 20 mA", offset_a=0.02),
    "scale": Cell("current sensor 2 % high", scale=0.02),
    "noisy": Cell("three times the noise of both sensors", noise_a=0.12, noise_v=0.009),
    "curve": Cell("open-circuit voltage off by up to 5 mV", curve_v=0.005),
}


def open_voltage(z: FloatArray) -> FloatArray:
    """The published open-circuit voltage [V] of a charge."""
    curve: FloatArray = A_0 + z * (A_1 + z * (A_2 + z * A_3)) + B * np.exp(-C * z)
    return curve


class Discharge(BatchedWorld):
    """Two hours: loads that change every half minute or two, a rest, loads, a charge.

    ``cell`` is one of `CELLS`, any other is an `InputError`; ``seeds`` are of the loads, the noise,
    and the charge at first: 0.8 to 0.98, where the filter takes 0.5.
    """

    def __init__(
        self, cell: str = "known", seeds: Sequence[int] = (1,), steps: int = STEPS
    ) -> None:
        super().__init__(seeds)
        require_choice("world discharge, cell", cell, CELLS)
        self.cell, self.steps = CELLS[cell], steps

    def pieces(self) -> Iterator[Mapping[str, FloatArray]]:
        draws = [np.random.default_rng([seed, 24]) for seed in self.seeds]
        current = np.stack([self._loads(draw) for draw in draws], axis=1)
        truth = np.zeros((3, 1 + self.steps, self.runs))
        truth[0, 0] = [draw.uniform(0.8, 0.98) for draw in draws]
        noise = np.stack([draw.normal(size=(self.steps, 2)) for draw in draws], axis=2)
        for k in range(0, self.steps, _PART):
            truth[:, k + 1 : k + _PART + 1] = self._moved(truth[:, k], current[k : k + _PART])
        cell, (z, fast, slow) = self.cell, truth[:, 1:]
        r_0 = cell.resistance * (0.1562 * np.exp(-24.37 * z) + 0.07446)
        v = open_voltage(z) + 4.0 * cell.curve_v * z * (1.0 - z) - r_0 * current - fast - slow
        measured = (1.0 + cell.scale) * current + cell.offset_a + cell.noise_a * noise[:, 0]
        yield {
            "i": measured,
            "v": v + cell.noise_v * noise[:, 1],
            **{"z_true": z, "v_fast_true": fast, "v_slow_true": slow},
        }

    def _moved(self, start: FloatArray, current: FloatArray) -> list[FloatArray]:
        """The circuit from ``start`` on, after each current: in substeps, each element exactly."""
        resistance, slower, h = self.cell.resistance, self.cell.slower, DT / SUBSTEPS
        i = np.repeat(current, SUBSTEPS, axis=0)
        used = h / (3600.0 * CAPACITY * self.cell.capacity) * i
        z = np.subtract.accumulate([start[0], *used])
        r_fast = 0.3208 * np.exp(-29.14 * z[:-1]) + 0.04669
        r_slow = 6.603 * np.exp(-155.2 * z[:-1]) + 0.04984
        tau_fast = slower * r_fast * (703.6 - 752.9 * np.exp(-13.51 * z[:-1]))
        tau_slow = slower * r_slow * (4475.0 - 6056.0 * np.exp(-27.12 * z[:-1]))
        ends = np.stack([resistance * r_fast * i, resistance * r_slow * i], axis=1)
        keeps = np.exp(-h / np.stack([tau_fast, tau_slow], axis=1))
        voltages = [start[1:]]
        for end, keep in zip(ends, keeps, strict=True):
            voltages.append(end + (voltages[-1] - end) * keep)
        return [z[SUBSTEPS::SUBSTEPS], *np.stack(voltages[SUBSTEPS::SUBSTEPS], axis=1)]

    def _loads(self, draw: np.random.Generator) -> FloatArray:
        """Currents (n,) [A], positive out of the cell; constant within a step."""
        lengths = draw.integers(20, 120, STEPS // 20)
        current = np.repeat(draw.normal(0.34, 0.35, len(lengths)).clip(-0.4, 1.2), lengths)
        t, current = DT * np.arange(self.steps), current[: self.steps]
        current[(REST_S[0] <= t) & (t < REST_S[1])] = 0.0
        current[t >= CHARGE_S] = -0.5 * CAPACITY
        return current
