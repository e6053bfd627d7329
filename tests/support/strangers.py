"""Records of `tests/strangers/programs` and `examples`: what their sensors would give, seeded.

Every function gives columns by input name in the declared units, and the heads of a CSV in which
some columns stand in other units.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from boresight.sim.rotations.rotation import quaternion_running_product

Array: TypeAlias = npt.NDArray[np.float64]
Columns: TypeAlias = dict[str, Array]

#: Columns, and by input name: head in a CSV, values in its unit of those in the declared one.
Given: TypeAlias = tuple[Columns, dict[str, tuple[str, Callable[[Array], Array]]]]

EXAMPLES = Path(__file__).parents[2] / "examples"
_PROGRAMS = Path(__file__).parents[1] / "strangers" / "programs"
#: The files of all programs, by name.
PROGRAMS = {path.name: path for folder in (EXAMPLES, _PROGRAMS) for path in folder.glob("*.py")}
del PROGRAMS["gallery.py"]


def program(name: str) -> str:
    """What the command line calls a program: ``pi.py:Pi`` with its folder."""
    file, colon, rest = name.partition(":")
    return f"{PROGRAMS[file]}{colon}{rest}"


def scaled(head: str, factor: float) -> tuple[str, Callable[[Array], Array]]:
    """A head and the values that stand below it."""
    return head, lambda values: values * factor


def kalman(n: int, seed: int = 1) -> Given:
    """A cart that swings over 60 m; noise of half a metre, steps of 8 to 12 ms."""
    rng = np.random.default_rng(seed)
    dt = rng.uniform(0.008, 0.012, n)
    t = np.cumsum(dt)
    pos = 60.0 * np.sin(0.2 * t) * np.cos(0.031 * t)
    vel = 12.0 * np.cos(0.2 * t) * np.cos(0.031 * t) - 1.86 * np.sin(0.2 * t) * np.sin(0.031 * t)
    columns = {"dt": dt, "z": pos + rng.normal(0.0, 0.5, n), "pos_true": pos, "vel_true": vel}
    heads = {"dt": scaled("dt[ms]", 1e3), "z": scaled("z[cm]", 100.0)}
    return columns, heads | {"vel_true": scaled("vel_true[km/h]", 3.6)}


def pi(n: int) -> Given:
    """A motor that follows steps, recorded while another controller drove it."""
    rng = np.random.default_rng(2)
    steps = np.array([-200.0, -90.0, 0.0, 150.0, 220.0])
    target = np.repeat(rng.choice(steps, n // 400 + 1), 400)[:n]
    speed, v = np.empty(n), 0.0
    for k in range(n):
        v += 0.012 * (target[k] - v)
        speed[k] = v
    speed += rng.normal(0.0, 0.2, n)
    return {"target": target, "speed": speed}, {
        "target": scaled("target[rpm]", 30.0 / math.pi),
        "speed": scaled("speed[deg/s]", 180.0 / math.pi),
    }


def madgwick(n: int, seed: int = 3) -> Given:
    """A hand that turns a sensor at 100 Hz."""
    rng = np.random.default_rng(seed)
    t = 0.01 * np.arange(n)
    rate = np.stack(
        [a * np.sin(f * t + f) for a, f in ((1.5, 0.7), (1.0, 1.1), (2.0, 0.23))], axis=1
    )
    turns, start = Rotation.from_rotvec(0.01 * rate[:-1]).as_quat(scalar_first=True), np.eye(4)[0]
    attitude = np.vstack([start, quaternion_running_product(start, turns)])
    up = Rotation.from_quat(attitude, scalar_first=True).inv().apply([0.0, 0.0, 9.81])
    up += rng.normal(0.0, 0.15, up.shape)
    gyro = rate + 0.01 + rng.normal(0.0, 0.01, rate.shape)
    columns = {"dt": np.full(n, 0.01)}
    columns |= {f"g{a}": gyro[:, k] for k, a in enumerate("xyz")}
    columns |= {f"a{a}": up[:, k] for k, a in enumerate("xyz")}
    columns |= {f"q{a}_true": attitude[:, k] for k, a in enumerate("wxyz")}
    heads = {f"g{a}": scaled(f"g{a}[deg/s]", 180.0 / math.pi) for a in "xyz"}
    return columns, heads | {f"a{a}": scaled(f"a{a}[g0]", 1.0 / 9.80665) for a in "xyz"}


def biquad(n: int) -> Given:
    """Tones below and above the corner, and noise."""
    rng = np.random.default_rng(4)
    k = np.arange(n)
    x = 0.4 * np.sin(0.05 * k) + 0.3 * np.sin(1.3 * k) + rng.normal(0.0, 0.05, n)
    return {"x": x}, {"x": scaled("x[mV]", 1e3)}


def pendulum(n: int, seed: int = 5) -> Given:
    """A pendulum that is pushed now and then, seen with 2 cm of noise."""
    rng = np.random.default_rng(seed)
    angle, rate, truth = 0.6, 0.0, np.empty((n, 2))
    for k in range(n):
        if k % 900 == 899:
            rate += float(rng.uniform(-0.8, 0.8))
        rate += 0.01 * (-9.81 * math.sin(angle) - 0.1 * rate)
        angle += 0.01 * rate
        truth[k] = angle, rate
    columns = {"z": np.sin(truth[:, 0]) + rng.normal(0.0, 0.02, n)}
    columns |= {"angle_true": truth[:, 0], "rate_true": truth[:, 1]}
    heads = {"z": scaled("z[inch]", 1.0 / 0.0254)}
    return columns, heads | {"angle_true": scaled("angle_true[deg]", 180.0 / math.pi)}


def alphabeta(n: int, seed: int = 6) -> Given:
    """A target that flies to and fro; a fifth of the looks sees nothing, some gaps are long."""
    rng = np.random.default_rng(seed)
    dt = rng.uniform(0.045, 0.055, n)
    t = np.cumsum(dt)
    track, speed = 1000.0 + 700.0 * np.sin(0.05 * t), 35.0 * np.cos(0.05 * t)
    distance = track + rng.normal(0.0, 3.0, n)
    missed = rng.random(n) < 0.2
    for first in range(50, n, 400):
        missed[first : first + 20] = True
    missed[0] = False
    distance[missed] = np.nan
    columns = {"dt": dt, "range": distance, "track_true": track, "speed_true": speed}
    return columns, {"range": scaled("range[km]", 1e-3)}


def geometry(n: int) -> Given:
    """Points 20 to 1,000 m away, within 40 degrees of the horizon."""
    rng = np.random.default_rng(8)
    distance = np.exp(rng.uniform(np.log(20.0), np.log(1000.0), n))
    azimuth = rng.uniform(-math.pi, math.pi, n)
    elevation = np.radians(rng.uniform(-40.0, 40.0, n))
    columns = {
        "north": distance * np.cos(elevation) * np.cos(azimuth),
        "east": distance * np.cos(elevation) * np.sin(azimuth),
        "down": -distance * np.sin(elevation),
    }
    return columns, {"north": scaled("north[ft]", 1.0 / 0.3048), "down": scaled("down[km]", 1e-3)}


def fir(n: int) -> Given:
    """A room between day and night, in steps of a sixteenth of a degree."""
    rng = np.random.default_rng(9)
    warm = 15.0 + 12.0 * np.sin(np.arange(n) / 300.0) + rng.normal(0.0, 0.3, n)
    warm = np.round(warm * 16.0) / 16.0
    return {"temperature": warm}, {"temperature": ("temperature[K]", lambda v: v + 273.15)}


def strapdown(n: int) -> Given:
    """Increments of a gyro at 400 Hz on something that tumbles."""
    rng = np.random.default_rng(10)
    t = np.arange(n) / 400.0
    columns = {
        f"d{a}": amplitude * np.sin(f * t) / 400.0 + rng.normal(0.0, 1e-5, n)
        for a, amplitude, f in (("x", 3.0, 1.7), ("y", 5.0, 0.9), ("z", 8.0, 0.31))
    }
    return columns, {f"d{a}": scaled(f"d{a}[deg]", 180.0 / math.pi) for a in "xyz"}


def battery(n: int) -> Given:
    """A cell that is charged and drawn from, from frost to summer."""
    rng = np.random.default_rng(11)
    k = np.arange(n)
    current = 8.0 * np.sin(0.003 * k) + 3.0 * np.sin(0.11 * k) + rng.normal(0.0, 0.2, n)
    celsius = 10.0 + 25.0 * np.sin(0.01 * k)
    ohms = 1e4 * np.exp(3435.0 * (1.0 / (celsius + 273.15) - 1.0 / 298.15))
    heads = {"ohms": scaled("ohms[kohm]", 1e-3), "current": scaled("current[mA]", 1e3)}
    return {"ohms": ohms, "current": current}, heads


def attitude(n: int) -> Given:
    """The same hand, with a magnetometer."""
    columns, heads = madgwick(n)
    turned = Rotation.from_quat(np.stack([columns[f"q{a}_true"] for a in "xyzw"], axis=1))
    field = turned.inv().apply([0.0, 19.2, -44.0])
    field += np.random.default_rng(4).normal(0.0, 0.5, field.shape)
    return columns | {f"m{a}": field[:, k] for k, a in enumerate("xyz")}, heads


#: What the command line calls each program, and its records.
STRANGERS: dict[str, Callable[[int], Given]] = {
    "kalman.py": kalman,
    "pi.py:Pi": pi,
    "madgwick.py:Madgwick": madgwick,
    "biquad.py": biquad,
    "pendulum.py": pendulum,
    "attitude.py": attitude,
    "alphabeta.py": alphabeta,
    "geometry.py:Look": geometry,
    "fir.py:Fir(taps=7)": fir,
    "strapdown.py": strapdown,
    "battery.py": battery,
}


def csv(path: Path, inputs: Given) -> Path:
    """Write a record as CSV with units in its header; NaN becomes an empty field."""
    columns, heads = inputs
    table = {}
    for name, values in columns.items():
        head, of = heads.get(name, (name, lambda v: v))
        table[head] = of(values)
    rows = zip(*(v.tolist() for v in table.values()), strict=True)
    body = "".join(",".join("" if v != v else repr(v) for v in row) + "\n" for row in rows)
    path.write_text(",".join(table) + "\n" + body)
    return path
