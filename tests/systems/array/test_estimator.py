"""`array_attitude` against a matrix filter in SI units; index, alignment, restart, bad input."""

from functools import lru_cache, partial
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.systems.array.error_filter import KINDS, UNITS
from boresight.systems.array.estimator import ArrayAttitude
from tests.support.rotating_array import ARCSEC, EARTH, LATITUDE, body, counts, gravity, turning
from tests.support.rotating_array import increments as exact

SCALES = np.array([UNITS[k] for k in KINDS])
STILL, ERECTION, RATE = 20.0, 13.2, 36.0
#: Errors of the instruments: gyro and accelerometer, matrix and bias.
MISALIGNED = 20e-6 * (np.ones((3, 3)) - np.eye(3))
GYRO = (MISALIGNED + 1e-5 * np.eye(3), np.array([1.0, -1.0, 1.0]) * 0.003 * ARCSEC)
FORCE = (MISALIGNED - 1e-4 * np.eye(3), np.array([1.0, 1.0, -1.0]) * 1.96e-4)
START = (1.0 + 5.0 / 3600.0, 2.0 - 5.0 / 3600.0, 90.0 + 20.0 / 3600.0)
MOTION = turning(RATE, STILL, ERECTION)
#: The filter whose attitude before the first sample is right.
known = partial(ArrayAttitude, attitude=START, align=0.0)


@lru_cache(maxsize=4)
def records(seconds: float, index: bool = True) -> Any:
    """The array with errors of its instruments; an index at north, within a sample."""
    n = round(100.0 * (STILL + ERECTION + seconds))
    u = np.zeros((n, 10))
    clean = exact(MOTION, n)
    u[:, :3] = clean[:, :3] @ (np.eye(3) + GYRO[0]).T + 0.01 * GYRO[1]
    u[:, 3:6] = clean[:, 3:] @ (np.eye(3) + FORCE[0]).T + 0.01 * FORCE[1]
    u[:, :6] = counts(u[:, :6])
    t = 0.01 * np.arange(1, n + 1)
    u[:, 6] = np.where(t < STILL + 5e-3, 0.0, np.where(t < STILL + ERECTION + 5e-3, 1.0, 2.0))
    turns = (MOTION(t)[0][:, 2] + 1e-3) / (2.0 * np.pi)  # a mark a little before north
    before = (MOTION(t - 0.01)[0][:, 2] + 1e-3) / (2.0 * np.pi)
    hit = np.floor(turns) != np.floor(before)
    u[:, 7], u[hit, 9] = -1e-3 / np.pi, float(index)
    u[hit, 8] = (np.ceil(before[hit]) - before[hit]) / (turns - before)[hit]
    return u


@lru_cache(maxsize=4)
def made(name: str, reading: str) -> Any:
    return make_level(name, Build(known(reading=reading)))


def level(name: str, reading: str = "heading") -> Any:
    """From a reset, with the parameters of all tests."""
    level_object = made(name, reading)
    if name == "c":
        level_object.set_params(known().param_values({}))
    level_object.reset()
    return level_object


def run(u: Any, name: str = "float", reading: str = "heading", **params: float) -> Any:
    level_object = level(name, reading)
    if params:
        level_object.set_params(known().param_values(params))
    return level_object.run(u)


def errors(result: Any) -> Any:
    """(n, 3) arc seconds."""
    got = np.stack([result.outputs[a] for a in ("pitch", "roll", "heading")], axis=1)
    t = 0.01 * np.arange(1, len(got) + 1)
    return ((got - MOTION(t)[0] / np.pi + 1.0) % 2.0 - 1.0) * 648000.0


def status(result: Any) -> Any:
    return np.rint(result.outputs["status"]).astype(int)


def covariances(program: Any, states: Any) -> Any:
    """P (n, 13, 13), scaled."""
    p = np.zeros((len(states), 13, 13))
    for k, (number, _) in enumerate(program.states):
        name = program.values[number].name
        if name.startswith("p") and len(name) == 3:
            i, j = (int(c, 16) for c in name[1:])
            p[:, i, j] = p[:, j, i] = states[:, k] / 2.0**31
    return p


def skew(a: Any) -> Any:
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


class Textbook:
    """Strapdown and filter as matrices in SI units, Joseph updates, attitude by scipy."""

    def __init__(self) -> None:
        p = known().param_values()
        self.param, self.c = p, body(np.radians([START]))[0]
        self.v, self.eps, self.nabla, self.dku = np.zeros(3), np.zeros(3), np.zeros(3), 0.0
        self.P = np.diag([p[f"p0_{k}"] for k in KINDS]) ** 2
        lat = np.radians(LATITUDE)
        self.earth = EARTH * np.array([0.0, np.cos(lat), np.sin(lat)])
        self.count, self.last, self.arc, self.up = 0, np.zeros(6), np.zeros((3, 3)), 0.0

    def step(self, u: Any) -> None:
        a, d, a1, d1 = u[:3], u[3:6] - 0.01 * self.nabla, self.last[:3], self.last[3:]
        self.last = u[:6].copy()
        turn = a + np.cross(a1, a) / 12.0
        force = d + np.cross(a, d) / 2.0 + (np.cross(a1, d) + np.cross(d1, a)) / 12.0
        c = self.c.as_matrix()
        self.v = self.v + c @ force - 0.01 * np.array([0.0, 0.0, gravity(LATITUDE, 45.0)])
        self.v = self.v - 0.01 * np.cross(2.0 * self.earth, self.v)
        up = c[2] @ turn
        slow = 0.01 * (self.earth + c @ self.eps) + np.array([0.0, 0.0, self.dku * up])
        self.c = Rotation.from_rotvec(-slow) * self.c * Rotation.from_rotvec(turn)
        self.arc, self.up, self.count = self.arc + c, self.up + up, self.count + 1
        if self.count == 100 or u[9] > 0.5:
            self.propagate(u[6])
        if u[9] > 0.5:
            m, r = self.c.as_matrix(), self.param["index_sd"]
            level = m[0, 1] ** 2 + m[1, 1] ** 2
            h = np.zeros(13)
            h[4:7] = [m[0, 1] * m[2, 1] / level, m[1, 1] * m[2, 1] / level, -1.0]
            then = self.c * Rotation.from_rotvec(-(1.0 - u[8]) * turn)
            heading = then.as_euler("ZXY")[0]
            z = (heading - np.pi * u[7] + np.pi) % (2.0 * np.pi) - np.pi
            self.update(h, z, r)
        elif self.count in (1, 2, 3):
            self.update(np.eye(13)[self.count - 1], self.v[self.count - 1], self.param["zupt_sd"])

    def propagate(self, phase: float) -> None:
        seconds = 0.01 * self.count
        f, c = np.zeros((13, 13)), self.arc / self.count
        f[0:3, 4:7], f[0:3, 10:13] = skew([0.0, 0.0, 9.8]), c
        f[4:7, 4:7], f[4:7, 7:10] = -skew(self.earth), -c
        phi = np.eye(13) + seconds * f
        phi[6, 3] = -self.up
        noise = 2.0**-27 * SCALES**2
        noise[:3] += seconds * self.param["force_noise"] ** 2
        noise[4:7] += seconds * self.param["gyro_noise"] ** 2
        self.P = phi @ self.P @ phi.T + np.diag(noise)
        if phase == 1.0:
            self.P[10:], self.P[:, 10:] = 0.0, 0.0
            self.P[10:, 10:] = np.eye(3) * self.param["erected_force"] ** 2
        self.count, self.arc, self.up = 0, 0.0 * self.arc, 0.0

    def update(self, h: Any, z: float, r: float) -> None:
        k = self.P @ h / (h @ self.P @ h + r * r)
        a = np.eye(13) - np.outer(k, h)
        self.P = a @ self.P @ a.T + r * r * np.outer(k, k)
        x = k * z
        self.v, self.dku, self.eps = self.v - x[:3], self.dku + x[3], self.eps + x[7:10]
        self.c, self.nabla = Rotation.from_rotvec(x[4:7]) * self.c, self.nabla + x[10:13]


def test_is_the_kalman_filter() -> None:
    """State and covariance at the end of the erection, and after an index."""
    u = records(16.0)
    book, result, c = Textbook(), run(u), run(u, "c")
    p = covariances(level("c").program, c.states)
    for k, row in enumerate(u):
        book.step(row)
        if k + 1 in (1990, 3320, len(u)):
            sd = np.sqrt(np.diag(book.P))
            out = {n: v[k] for n, v in result.outputs.items()}
            assert np.sqrt(np.diagonal(p[k])) * SCALES == pytest.approx(sd, rel=0.03)
            for i, name in ((3, "scale_up"), (7, "eps_x"), (9, "eps_z"), (11, "nabla_y")):
                wanted = {3: book.dku, 7: book.eps[0], 9: book.eps[2], 11: book.nabla[1]}[i]
                assert abs(out[name] - wanted) < (0.3 if i == 3 else 0.05) * sd[i], (k, name)
            q = Rotation.from_quat([out[f"q{a}"] for a in "xyzw"])
            error = (q * book.c.inv()).as_rotvec()
            assert np.abs(error).max() < 0.3 * ARCSEC
    assert np.count_nonzero(status(result) & 64) == 1


@pytest.fixture(scope="module")
def faulty() -> Any:
    """Faults of the index, and the runs without and with them."""
    u = records(60.0).copy()
    hits = np.flatnonzero(u[:, 9])
    wrong, double, missed, early = hits[2], hits[1] + 8, hits[3], 1200
    u[wrong, 7] += 0.1  # 18 deg
    u[double, 9], u[missed, 9], u[early, 9] = 1.0, 0.0, 1.0
    return (wrong, double, missed, early), run(u), hits


def test_wrong_double_missed_and_early_indices(faulty: Any) -> None:
    (wrong, double, missed, early), result, hits = faulty
    bits = status(result)
    assert bits[wrong] & 8 and not bits[wrong] & 64
    assert bits[double] & 8 and not bits[double] & 64
    assert bits[early] & 4 and not bits[early] & (8 | 64)
    assert np.flatnonzero(bits & 8).tolist() == [double, wrong]
    # two turns without: told from one turn and a half on
    assert bits[hits[1] + 1490] & 128 == 0 != bits[hits[1] + 1520] & 128
    assert not bits[hits[4]] & 8 and bits[hits[4]] & 64
    assert np.abs(errors(result)[hits[1] : hits[4], 2]).max() < 25.0
    assert np.abs(errors(result)[hits[4] + 1 :, 2]).max() < 4.0


def test_a_heading_that_did_jump_is_believed_in_the_end() -> None:
    """The mark is 1,000 arc seconds elsewhere from the third index on: refused twice."""
    u = records(60.0).copy()
    hits = np.flatnonzero(u[:, 9])
    u[hits[1] + 1 :, 7] += 1000.0 / 648000.0
    result = run(u)
    assert [status(result)[k] & (8 | 64) for k in hits] == [64, 64, 8, 8, 64, 64]
    assert np.abs(errors(result)[-1, 2] - 1000.0) < 20.0


def test_a_restart_is_a_start() -> None:
    u = records(16.0)[:4500]
    again = np.concatenate([u[:4000], u[:1], u])
    again[4000, 6] = -1.0
    again[4000, :6] = 0.0
    first, second = run(u, "c"), run(again, "c")
    after = type(second)({n: v[4001:] for n, v in second.outputs.items()})
    assert np.abs(errors(after) - errors(first)).max() < 8e-3
    assert (status(after) == status(first)).all()
    program = level("c").program
    p, wanted = (covariances(program, s) for s in (second.states[4001:], first.states))
    assert np.abs(p - wanted).max() < 1e-7


def test_calibration_undoes_the_errors_of_the_instruments() -> None:
    """Errors a hundred times the paper's, in registers; the index and the filter have no part."""
    n = round(100.0 * (STILL + ERECTION + 20.0))
    clean, rng, registers = exact(MOTION, n), np.random.default_rng(1), {}
    u = np.zeros((n, 10))
    for k, (name, bias) in enumerate((("gyro", 2e-6), ("force", 0.02))):
        matrix, drift = np.eye(3) + rng.uniform(-1e-3, 1e-3, (3, 3)), rng.uniform(-bias, bias, 3)
        columns = slice(3 * k, 3 * k + 3)
        u[:, columns] = (clean[:, columns] + 0.01 * drift) @ np.linalg.inv(matrix).T
        cells = [(r, c) for r in range(3) for c in range(3)]
        registers |= {f"{name}_{'xyz'[r]}{'xyz'[c]}": matrix[r, c] for r, c in cells}
        registers |= {f"{name}_bias_{a}": drift[i] for i, a in enumerate("xyz")}
    estimator, perfect = ArrayAttitude(aided=False), u.copy()
    perfect[:, :6] = clean
    for name in ("float", "c"):
        form, both = make_level(name, Build(estimator)), []
        for record, values in ((perfect, {}), (u, registers)):
            form.set_params(estimator.param_values(values))
            both.append(form.run_anew(record).outputs)
        difference = {n: both[1][n] - both[0][n] for n in both[0]}
        for angle in ("pitch", "roll", "heading"):
            assert np.abs(648000.0 * difference[angle]).max() < 0.05, (name, angle)
        assert max(np.abs(difference[f"v{a}"]).max() for a in "enu") < 5e-4, name


def test_full_scale_is_flagged_and_bounded() -> None:
    u = records(16.0)[:400].copy()
    u[100:200, 1], u[100:200, 5] = 2.0**-7, -0.25
    result = run(u, "c")
    bits = status(result) & 16
    assert bits[100:200].all() and not bits[:100].any() and not bits[200:].any()
    assert not result.saturated.any()
    assert max(np.abs(result.outputs[f"v{a}"]).max() for a in "enu") <= 4.0
    q = np.stack([result.outputs[f"q{a}"] for a in "wxyz"])
    assert np.abs((q * q).sum(axis=0) - 1.0).max() < 1e-6
