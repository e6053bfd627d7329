"""The quaternion filters against a textbook: matrices, numerical Jacobians, batch updates.

Nothing here uses the filters' basis, scale, sequence or normalised gains. The textbook has the
additive quaternion error in fixed coordinates and float64 matrices of shape (runs, n, n); what must
agree is the attitude, the bias and, turned into the filter's basis, the whole covariance.
"""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats
from scipy.spatial.transform import Rotation

from boresight.model.attitude.ekf_bias import EkfBias
from boresight.model.attitude.ekf_quaternion import EkfQuaternion

GRAVITY = 9.80665
FIELD = np.array([0.0, 20.0, -44.0])  # uT, east north up
DT = 0.01
SCALE = 8.0
FLOOR = 2.0**-28 / SCALE**2


# -- algebra, independent of model.quaternion -----------------------------------------------------


def rotation(q: Any) -> Any:
    """scipy's rotation of quaternions (runs, 4), scalar first."""
    return Rotation.from_quat(np.roll(q, -1, axis=-1))


def quaternion(r: Any) -> Any:
    return np.roll(r.as_quat(), 1, axis=-1)


def product(p: Any, q: Any) -> Any:
    """Hamilton product."""
    v = p[:, :1] * q[:, 1:] + q[:, :1] * p[:, 1:] + np.cross(p[:, 1:], q[:, 1:])
    return np.concatenate([p[:, :1] * q[:, :1] - (p[:, 1:] * q[:, 1:]).sum(1, keepdims=True), v], 1)


def left(q: Any) -> Any:
    """(runs, 4, 4): q p = left(q) p."""
    return np.stack([product(q, np.tile(e, (len(q), 1))) for e in np.eye(4)], axis=2)


def right(q: Any) -> Any:
    """(runs, 4, 4): p q = right(q) p."""
    return np.stack([product(np.tile(e, (len(q), 1)), q) for e in np.eye(4)], axis=2)


def xi(q: Any) -> Any:
    return left(q)[:, :, 1:]


def body(q: Any, v: Any) -> Any:
    """C^T v as the quadratic form it is, for quaternions of any norm."""
    v4 = np.concatenate([np.zeros((len(q), 1)), np.broadcast_to(v, (len(q), 3))], axis=1)
    conjugate = q * [1.0, -1.0, -1.0, -1.0]
    return product(product(conjugate, v4), q)[:, 1:]


def jacobian(f: Any, x: Any) -> Any:
    """Central differences; exact to rounding for quadratic functions."""
    step = 1e-3
    return np.stack(
        [(f(x + step * e) - f(x - step * e)) / (2.0 * step) for e in np.eye(x.shape[1])], axis=2
    )


def transposed(m: Any) -> Any:
    return np.swapaxes(m, -1, -2)


class Textbook:
    """x and P of ``runs`` filters; x is the quaternion and, with seven states, the gyro's bias."""

    def __init__(self, x: Any, p: Any) -> None:
        self.x, self.p = x, p
        self.innovation = np.zeros((len(x), 0))
        self.s = np.zeros((len(x), 0, 0))

    def predict(self, gyr: Any, dt: float, q_gyro: Any, q_bias: float = 0.0) -> None:
        """x' = f(x), P' = F P F^T + Q; ``q_gyro`` variance of half a turn, per axis."""
        q = self.x[:, :4]
        half = 0.5 * dt * (gyr - self.x[:, 4:] if self.x.shape[1] == 7 else gyr)
        y = (half**2).sum(1, keepdims=True)
        dq = np.concatenate([1 - y / 2 + y**2 / 24, half * (1 - y / 6 + y**2 / 120)], axis=1)
        q = product(q, dq)
        n = self.x.shape[1]
        f = np.broadcast_to(np.eye(n), (len(q), n, n)).copy()
        f[:, :4, :4] = right(dq)
        noise = np.zeros_like(f)
        noise[:, :4, :4] = xi(q) @ np.diag(q_gyro) @ transposed(xi(q))
        if n == 7:
            f[:, :4, 4:] = -0.5 * dt * xi(q)
            noise[:, 4:, 4:] = q_bias * np.eye(3)
        self.x = np.concatenate([q, self.x[:, 4:]], axis=1)
        self.p = f @ self.p @ transposed(f) + noise

    def update(self, innovation: Any, h: Any, r: Any) -> None:
        """Batch update in Joseph's form, then normalisation."""
        self.innovation, self.s = innovation, h @ self.p @ transposed(h) + r
        k = self.p @ transposed(h) @ np.linalg.inv(self.s)
        self.x = self.x + (k @ innovation[:, :, None])[:, :, 0]
        a = np.eye(self.x.shape[1]) - k @ h
        self.p = a @ self.p @ transposed(a) + k @ r @ transposed(k)
        self.x[:, :4] /= np.linalg.norm(self.x[:, :4], axis=1, keepdims=True)
        # Not textbook: the filters' noise against rounding, on the quaternion and 16 s times bias.
        self.p[:, :4, :4] += FLOOR * np.eye(4)
        self.p[:, 4:, 4:] += FLOOR / 16**2 * np.eye(self.p.shape[1] - 4)


def measured_quaternion(acc: Any, mag: Any, like: Any) -> Any:
    """TRIAD: rows east, north, up in the body; of the two signs the one near ``like``."""
    up = acc / np.linalg.norm(acc, axis=1, keepdims=True)
    east = np.cross(mag, up)
    east /= np.linalg.norm(east, axis=1, keepdims=True)
    q = quaternion(Rotation.from_matrix(np.stack([east, np.cross(up, east), up], axis=1)))
    return q * np.sign((q * like).sum(1, keepdims=True))


# -- the world: a rotating body, noise exactly as declared ----------------------------------------


class World:
    """Attitudes (steps, runs, 4) and noisy sensors; one seed, one world."""

    def __init__(self, steps: int, runs: int, gyro_sd: Any, seed: int = 7) -> None:
        self.rng = rng = np.random.default_rng(seed)
        self.steps, self.runs = steps, runs
        t = DT * np.arange(steps)[:, None, None]
        amplitude, phase = rng.normal(0, 0.7, (1, runs, 3)), rng.uniform(0, 6.28, (1, runs, 3))
        self.rate = amplitude * np.sin(rng.uniform(0.5, 2.0, (1, runs, 3)) * t + phase)
        q = quaternion(Rotation.random(runs, random_state=seed))
        self.q = []
        for k in range(steps):
            q = product(q, quaternion(Rotation.from_rotvec(DT * self.rate[k])))
            self.q.append(q)
        self.gyr = self.rate + gyro_sd * rng.normal(size=self.rate.shape)


def records(gyr: Any, mag: Any, acc: Any, dt: float = DT) -> Any:
    """Input records (10, runs)."""
    return np.concatenate([np.full((1, len(gyr)), dt), gyr.T, mag.T, acc.T])


class Filter:
    """An estimator run step by step, with its states in sight."""

    def __init__(self, estimator: Any, runs: int, params: Any, **states: Any) -> None:
        self.e = estimator
        self.p = SimpleNamespace(**estimator.param_values(params))
        self.x = {s.name: np.full(runs, s.initial) for s in estimator.states}
        for name, value in states.items():
            assert name in self.x
            self.x[name] = np.broadcast_to(value, (runs,)).astype(float)
        self.out: Any = {}

    def step(self, record: Any) -> None:
        u = SimpleNamespace(**{i.name: v for i, v in zip(self.e.inputs, record, strict=True)})
        self.x, self.out = self.e.step(SimpleNamespace(**self.x), u, self.p)

    @property
    def q(self) -> Any:
        return np.stack([self.x[f"q{axis}"] for axis in "wxyz"], axis=1)

    def covariance(self, n: int) -> Any:
        """The scaled covariance in the filter's basis (runs, n, n)."""
        p = np.empty((len(self.q), n, n))
        for i in range(n):
            for j in range(n):
                p[:, i, j] = self.x[f"p{min(i, j)}{max(i, j)}"]
        return p


def isotropic(runs: int, n: int, variances: Any) -> Any:
    return np.broadcast_to(np.diag(np.resize(variances, n)), (runs, n, n)).copy()


def near(result: Any, wanted: Any, tolerance: float) -> None:
    scale = np.abs(wanted).max()
    assert np.abs(result - wanted).max() < tolerance * scale


COMMON = {"scale": SCALE, "p0_sd": 0.2, "gyro_sd_x": 0.05, "gyro_sd_y": 0.08, "gyro_sd_z": 0.03}
GYRO_SD = np.array([0.05, 0.08, 0.03])
ANGLE_SD = np.array([0.03, 0.05, 0.09])
ACC_SD, MAG_SD = np.array([0.3, 0.5, 0.4]), np.array([1.5, 2.5, 2.0])


def start(q: Any) -> Any:
    """States: aligned at q, with P of a standard deviation of 0.1 for half a turn and the norm."""
    return {
        "unaligned": 0.0,
        **{f"q{axis}": q[:, k] for k, axis in enumerate("wxyz")},
        **{
            f"p{i}{j}": (0.1 * SCALE) ** 2 / 4 if i == j else 0.0
            for i in range(4)
            for j in range(i, 4)
        },
    }


def perturbed(q: Any, rng: Any, sd: float) -> Any:
    """q with errors of standard deviation ``sd`` of half a turn about the body's axes."""
    return product(q, quaternion(Rotation.from_rotvec(2 * sd * rng.normal(size=(len(q), 3)))))


def quaternion_runs(steps: int, runs: int) -> Any:
    """Option (b): yields filter, textbook, truth after each step."""
    w = World(steps, runs, GYRO_SD)
    q0 = perturbed(w.q[0], w.rng, 0.05)
    f = Filter(
        EkfQuaternion(),
        runs,
        {**COMMON, **{f"angle_sd_{a}": s for a, s in zip("xyz", ANGLE_SD, strict=True)}},
        **start(q0),
    )
    book = Textbook(q0, isotropic(runs, 4, [0.05**2]))
    for k in range(1, steps):
        seen = perturbed(w.q[k], w.rng, 0.5 * ANGLE_SD)
        acc, mag = (rotation(seen).inv().apply(v) for v in ((0, 0, GRAVITY), FIELD))
        f.step(records(w.gyr[k], mag, acc))
        book.predict(w.gyr[k], DT, (0.5 * DT * GYRO_SD) ** 2)
        q = book.x
        h = transposed(xi(q))
        e = (h @ (measured_quaternion(acc, mag, q) - q)[:, :, None])[:, :, 0]
        book.update(e, h, np.diag((0.5 * ANGLE_SD) ** 2))
        yield f, book, w.q[k]


BIAS_SD, DENSITY, WALK = 3e-3, 0.005, 2e-4
ACC_G, MAG_F = 0.03, 0.05


def bias_runs(steps: int, runs: int, adaptive: float = 0.0) -> Any:
    """Seven states: yields filter, textbook, (attitude, bias)."""
    w = World(steps, runs, DENSITY / np.sqrt(DT))
    bias = BIAS_SD * w.rng.normal(size=(runs, 3))
    q0 = perturbed(w.q[0], w.rng, 0.05)
    strength = np.linalg.norm(FIELD)
    p0 = start(q0) | {
        f"p{i}{j}": (16 * BIAS_SD * SCALE) ** 2 if i == j else 0.0
        for i in range(7)
        for j in range(max(i, 4), 7)
    }
    f = Filter(
        EkfBias(),
        runs,
        {
            "scale": SCALE,
            "gyro_density": DENSITY,
            "bias_density": WALK,
            "acc_sd": ACC_G,
            "acc_sd_per_g": adaptive,
            "mag_sd": MAG_F,
            "mag_gate": 3.9,
            "mag_rate_per_s": 0.0,
        },
        heading_unknown=0.0,
        field_h=FIELD[1],
        field_v=FIELD[2],
        **p0,
    )
    book = Textbook(
        np.concatenate([q0, np.zeros((runs, 3))], axis=1),
        isotropic(runs, 7, [0.05**2] * 4 + [BIAS_SD**2] * 3),
    )

    def h(x: Any) -> Any:
        return np.concatenate([body(x[:, :4], [0, 0, 1]), body(x[:, :4], FIELD / strength)], axis=1)

    for k in range(1, steps):
        bias = bias + WALK * np.sqrt(DT) * w.rng.normal(size=bias.shape)
        truth = np.concatenate([w.q[k], bias], axis=1)
        sd = np.repeat([ACC_G, MAG_F], 3)
        z = h(truth) + sd * w.rng.normal(size=(runs, 6))
        missing = k % 3 != 0  # a magnetometer at a third of the rate
        f.step(
            records(
                w.gyr[k] + bias,
                0 * z[:, 3:] if missing else z[:, 3:] * strength,
                z[:, :3] * GRAVITY,
            )
        )
        uneven = np.minimum(np.abs((z[:, :3] ** 2).sum(1) - 1), 0.5)
        r = isotropic(runs, 6, sd**2)
        r[:, range(3), range(3)] = ((ACC_G + adaptive * uneven) ** 2)[:, None]
        used = slice(0, 3) if missing else slice(0, 6)
        book.predict(w.gyr[k] + bias, DT, np.full(3, 0.25 * DENSITY**2 * DT), WALK**2 * DT)
        book.update((z - h(book.x))[:, used], jacobian(h, book.x)[:, used], r[:, used, used])
        yield f, book, truth


# -- the same numbers -----------------------------------------------------------------------------

RUNS = {"quaternion": quaternion_runs}


@pytest.mark.parametrize("runs", RUNS.values(), ids=RUNS.keys())
def test_four_states_are_the_textbooks(runs: Any) -> None:
    """Attitude and all of P after every one of 60 steps; P in the basis L(q), times scale^2."""
    for f, book, _ in runs(60, 5):
        near(f.q, book.x, 1e-9)
        near(f.covariance(4), SCALE**2 * transposed(left(book.x)) @ book.p @ left(book.x), 1e-7)


@pytest.mark.parametrize("adaptive", [0.0, 0.6])
def test_seven_states_are_the_textbooks(adaptive: float) -> None:
    """P in the basis diag(R(q), 1/16 s); a magnetometer at a third of the rate."""
    for f, book, _ in bias_runs(90, 5, adaptive):
        near(f.q, book.x[:, :4], 1e-9)
        near(np.stack([f.x[f"bias_{a}"] for a in "xyz"], axis=1), book.x[:, 4:], 1e-9)
        basis = isotropic(5, 7, [1] * 4 + [16.0] * 3)
        basis[:, :4, :4] = right(book.x[:, :4])
        near(f.covariance(7), SCALE**2 * transposed(basis) @ book.p @ basis, 1e-7)


# -- consistent and white where the noise is the declared one -------------------------------------


def half_turn_error(f: Any, q: Any, nav: bool) -> Any:
    """Half the rotation vector between estimate and truth, body or navigation axes."""
    conjugate = f.q * [1, -1, -1, -1]
    e = product(q, conjugate) if nav else product(conjugate, q)
    return e[:, 1:] * np.sign(e[:, :1])


def mean_within(values: Any, freedom: int, independent: int) -> None:
    """The mean of chi-square values with ``freedom`` degrees, of which so many are independent."""
    low, high = stats.chi2.ppf([5e-4, 1 - 5e-4], freedom * independent) / independent
    assert low < np.mean(values) < high


CONSISTENT = {"quaternion": (quaternion_runs, 3, False), "bias": (bias_runs, 6, True)}


@pytest.mark.parametrize(("runs", "freedom", "nav"), CONSISTENT.values(), ids=CONSISTENT.keys())
def test_errors_and_innovations_are_consistent_and_white(
    runs: Any, freedom: int, nav: bool
) -> None:
    """NEES at the end over 400 runs, NIS and lag-one correlation over steps and runs.

    The innovations are the textbook's, which the tests above have shown to be the filter's.
    """
    count, steps, skip = 400, 151, 90
    nis, white = [], []
    for k, now in enumerate(runs(steps, count)):
        f, book, truth = now
        size = book.innovation.shape[1]
        if k < skip or (freedom == 6 and size == 3):
            continue
        root = np.linalg.cholesky(np.linalg.inv(book.s))
        white.append((transposed(root) @ book.innovation[:, :, None])[:, :, 0])
        nis.append((white[-1] ** 2).sum(1))
    e = half_turn_error(f, truth[:, :4], nav)
    if freedom == 6:
        e = np.concatenate([e, 16 * (truth[:, 4:] - book.x[:, 4:])], axis=1)
    p = f.covariance(1 + freedom)[:, 1:, 1:] / SCALE**2
    nees = (e * np.linalg.solve(p, e[:, :, None])[:, :, 0]).sum(1)
    mean_within(nees, freedom, count)
    mean_within(nis, size, np.size(nis))
    w = np.stack(white)
    lag = (w[1:] * w[:-1]).mean()
    assert abs(lag) < 4.0 / np.sqrt(w[1:].size)
    assert abs(w.mean()) < 4.0 / np.sqrt(w.size)
