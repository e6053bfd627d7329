"""A small aeroplane in the wind: inertial sensors, and one measurement in each step."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.model.arrays import FloatArray
from boresight.model.errors import require_choice
from boresight.sim.rotations import rotation
from boresight.sim.rotations.zyx import quaternions_of
from boresight.sim.worlds.world import BatchedWorld
from boresight.systems.ekf2.estimator import DT, GRAVITY_NED, KINDS, LOWEST, SLOWEST, UNITS, Ekf2
from boresight.systems.worlds.navigation import rates_and_forces

START_RAD = (0.02, 0.02, 0.1)  #: standard deviations of the attitude at first, north to down.
GYRO_BIAS, ACC_BIAS = 0.004, 0.05  #: standard deviations [rad/s], [m/s^2].
GYRO_NOISE, ACC_NOISE = 0.01, 0.2  #: of a sample.
FIELD, FIELD_SD, BODY_SD = (0.2, 0.02, 0.43), 0.01, 0.02  #: gauss, north, east, down.
WIND, WIND_SD = (2.5, -1.5), 1.0  #: m/s at height, north and east.
#: Standard deviation of a measurement, SI units and gauss, and of position down (barometer).
NOISE = {
    **{"velocity": 0.15, "position": 0.7, "range": 0.15, "heading": 0.1, "airspeed": 0.5},
    **{"field": 0.02, "declination": 0.1, "sideslip": 0.05, "drag": 0.3, "flow": 0.15},
}
BARO = 0.5
_X, _Y, _Z = np.eye(3)
_NONE = np.zeros(3)
#: A second's rows: kind, axis, how often.
ROWS = (
    *(("velocity", axis, 5) for axis in (_X, _Y, _Z)),
    *(("position", axis, 5) for axis in (_X, _Y)),
    ("position", _Z, 10),
    *(("field", axis, 8) for axis in (_X, _Y, _Z)),
    *((("range", _NONE, 5), ("airspeed", _NONE, 8), ("sideslip", _Y, 5))),
    *(("drag", axis, 3) for axis in (_X, _Y)),
    *(("flow", axis, 2) for axis in (_Y, -_X)),
    *((("heading", _NONE, 1), ("declination", _NONE, 1))),
)


def _timetable() -> list[tuple[str, FloatArray]]:
    """Row of each of the steps of a second, each spread evenly; the steps left have none."""
    entries = sorted(
        ((k + 0.5) / count, n) for n, (_, _, count) in enumerate(ROWS) for k in range(count)
    )
    steps = round(1.0 / DT)
    table: list[tuple[str, FloatArray]] = [("nothing", _NONE)] * steps
    for k, (_, n) in enumerate(entries):
        table[k * steps // len(entries)] = ROWS[n][:2]
    return table


class Flight(BatchedWorld):
    """A take-off and turns at 10 m/s through the air, 100 Hz, a run for each seed.

    Measurements come one in a step, in the order of a timetable of one second, each measured in the
    step in which it comes.

    ``seeds`` are of noise, biases, wind, fields and the error of the attitude at first; ``without``
    are kinds of measurements that are never there, any other is an `InputError`; in the ``outage``
    [s] there is no velocity nor horizontal position.
    """

    def __init__(
        self,
        seeds: Sequence[int] = (1,),
        without: Sequence[str] = (),
        outage: tuple[float, float] = (0.0, 0.0),
        steps: int = 9_000,
    ) -> None:
        super().__init__(seeds)
        for kind in without:
            require_choice("world flight, without", kind, KINDS[1:])
        self.without, self.outage, self.steps = tuple(without), outage, steps

    def pieces(self) -> Iterator[Mapping[str, FloatArray]]:
        runs = [self._run(seed) for seed in self.seeds]
        yield {name: np.stack([run[name] for run in runs], axis=1) for name in runs[0]}

    def _run(self, seed: int) -> dict[str, FloatArray]:
        """Columns (n,) of one run."""
        draw, n = np.random.default_rng([seed, 24]), self.steps
        t = DT * np.arange(n + 1)
        full = np.array([*(WIND + draw.normal(0.0, WIND_SD, 2)), 0.0])
        wind = full * (1.0 - np.exp(-t / 4.0))[:, None]
        speed = (10.0 + 0.5 * np.sin(0.3 * t)) * (1.0 - np.exp(-t / 2.5))
        heading = 0.9 * np.sin(0.15 * t) + 0.12 * np.maximum(t - 6.0, 0.0)
        climb = 0.15 * np.sin(0.11 * t) + 0.15 * np.exp(-t / 30.0)
        roll = np.arctan(speed * np.gradient(heading, DT) / GRAVITY_NED[2])
        air = speed[:, None] * np.stack(
            [np.cos(climb) * np.cos(heading), np.cos(climb) * np.sin(heading), -np.sin(climb)],
            axis=1,
        )
        # not where the filter begins: the whole flight is turned a little
        start = rotation.rotation_vector_to_quaternion(draw.normal(0.0, START_RAD))
        q = rotation.quaternion_multiply(
            start, quaternions_of(np.stack([roll, climb, heading], axis=1))
        )
        air = rotation.rotate(start, air)
        v = air + wind
        rate, force = rates_and_forces(q, v, GRAVITY_NED, DT)
        truth = {
            **{"q": q[1:], "v": v[1:], "p": np.cumsum(DT * v[:-1], axis=0), "air": air[1:]},
            **{"wind_": wind[1:, :2], "terrain": 1.5 * np.sin(0.05 * t[1:, None])},
            "m": FIELD + draw.normal(0.0, FIELD_SD, 3),
            "mb": draw.normal(0.0, BODY_SD, 3),
        }
        gyro = rate + draw.normal(0.0, GYRO_BIAS, 3) + draw.normal(0.0, GYRO_NOISE, (n, 3))
        acc = force + draw.normal(0.0, ACC_BIAS, 3) + draw.normal(0.0, ACC_NOISE, (n, 3))
        named = {f"g{c}": gyro[:, i] for i, c in enumerate("xyz")}
        named |= {f"a{c}": acc[:, i] for i, c in enumerate("xyz")}
        named |= self._rows(truth, draw)
        axes = {"q": "wxyz", "v": "ned", "p": "ned", "wind_": "ne", "terrain": ("",)}
        return named | {
            f"{name}{c}_true": truth[name][:, i] for name in axes for i, c in enumerate(axes[name])
        }

    def _rows(self, truth: Mapping[str, FloatArray], draw: np.random.Generator) -> dict[str, Any]:
        """Columns of the measurement of each step."""
        n = self.steps
        columns = {name: np.zeros(n) for name in ("kind", "axis_x", "axis_y", "axis_z", "z")}
        columns["r"] = np.ones(n)
        table = _timetable()
        for place, (kind, axis) in enumerate(table):
            at = np.arange(place, n, len(table)) if kind not in self.without else np.arange(0)
            if kind == "velocity" or (kind == "position" and not axis[2]):
                begin, end = self.outage
                at = at[(DT * at < begin) | (DT * at >= end)]
            value, valid = measured(
                {k: x[at] if len(x) == n else x for k, x in truth.items()}, kind, axis
            )
            at, value = at[valid], value[valid]
            sd = BARO if kind == "position" and axis[2] else NOISE.get(kind, 1.0)
            columns["kind"][at] = float(KINDS.index(kind))
            for c, part in zip("xyz", axis, strict=True):
                columns["axis_" + c][at] = part
            columns["z"][at] = UNITS[kind] * (value + draw.normal(0.0, sd, len(at)))
            columns["r"][at] = (UNITS[kind] * sd) ** 2
        return columns


def measured(
    truth: Mapping[str, FloatArray], kind: str, axis: FloatArray
) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """Measurements of a kind without noise (n,), and when there is one."""
    q, air = truth["q"], truth["air"]
    always = np.ones(len(q), dtype=bool)
    nose, wing, along = (rotation.rotate(q, a) for a in (_X, _Y, axis))
    speed = np.linalg.norm(air, axis=1)
    if kind in ("velocity", "position"):
        return truth[kind[0]] @ axis, always
    if kind == "heading":
        return np.arctan2(nose[:, 1], nose[:, 0]), always
    if kind == "airspeed":
        return speed, speed > 3.0
    if kind == "field":
        return along @ truth["m"] + axis @ truth["mb"], always
    if kind == "declination":
        return always * np.arctan2(truth["m"][1], truth["m"][0]), always
    if kind == "sideslip":
        across, forward = np.sum(wing * air, axis=1), np.sum(nose * air, axis=1)
        return np.arctan2(across, forward), forward > SLOWEST + 1.0
    if kind == "drag":
        drag, rotor = (p.default for p in Ekf2.params if p.name in ("drag", "rotor"))
        return -(drag * speed + rotor) * np.sum(along * air, axis=1), always
    above = truth["terrain"][:, 0] - truth["p"][:, 2]
    if kind == "range":
        return above, always
    if kind == "flow":
        upright = rotation.rotate(q, _Z)[:, 2]
        rate = np.sum(along * truth["v"], axis=1) * upright / np.maximum(above, LOWEST)
        return rate, above > LOWEST + 2.0
    return 0.0 * speed, ~always
