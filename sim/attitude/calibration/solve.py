"""The calibration registers that explain all records best, and their uncertainties.

Each sensor has ``y = M c - d`` in body axes, from its counts c. Unknown are M and d of gyro,
accelerometer and magnetometer (36 numbers), and the attitude C (body to n) of every rest. Least
squares of what follows, each divided by its standard deviation (w: the counts' own noise)::

    rests     M_g c - d_g = w        M_a c - d_a = C^T (0, 0, g) + w      M_m c - d_m = C^T m + w
    sights    C = C_sighted exp(w)
    turns     C_k+1 = C_k prod exp((M_g c - d_g) dt) exp(w)
    swing     |M_m c - d_m| = |m| + w

The mounting that it begins with is the one of Ma Long et al. (2014), section 2.2: the matrix T from
directions b in body axes to directions s in sensor axes, and the orthogonal matrix next to it::

    T = S B^+        T0 = T (T^T T)^(-1/2)

For three directions, sighted ten times each, ``S B^+`` is the mean of ten ``[s_x s_y s_z]
[b_x b_y b_z]^-1``.

A record of raw counts has the columns of `boresight monitor --log`: ``t`` [s], ``gx_counts`` to
``az_counts``, and ``mx_counts`` to ``mz_counts``, empty between lines of the compass. ``stamp``
[cycles, modulo 2^32] is the board's time, if it is there; ``computer`` [s], or else ``t``, is the
computer's. A sighted attitude stands in ``qw`` to ``qz``, or in ``heading``, ``pitch`` and ``roll``
[deg], in one row of its rest or in all.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from boresight.model.arrays import BoolArray, FloatArray
from boresight.model.attitude.front import AXES, FRONT, GAP_S, GYRO_SCALE, STAMP_BITS
from boresight.model.declarations import QUATERNION
from boresight.model.errors import require
from boresight.model.tools.external import optional
from boresight.sim.records.nine_axis import stacked
from boresight.sim.records.record import Record, check_norm
from boresight.sim.rotations import rotation

INERTIAL = tuple(f"{s}{a}_counts" for s in "ga" for a in AXES)
LINE = tuple(f"m{a}_counts" for a in AXES)
SIGHT = ("pitch", "roll", "heading")

#: s: windows that are judged at rest or not; shortest rest.
_WINDOW_S, _REST_S = 0.25, 1.0
#: Largest variance of a window at rest, in variances of the quietest quarter of all windows.
_QUIET = 2.0
#: Parts of a record for the clocks.
_PARTS = 10
#: counts, 0.3 deg/s: largest difference of a rate from that of the quietest windows.
_SLOW = 24.0


class Rest(NamedTuple):
    """Means at rest.

    ``inertial`` (6,) are mean counts of gyro and accelerometer, of ``samples``; ``field`` (3,) of
    the magnetometer, of ``lines``; ``sight`` (4,) is a sighted attitude, body to east, north, up.
    """

    inertial: FloatArray
    samples: int
    field: FloatArray
    lines: int
    sight: FloatArray | None


class Turn(NamedTuple):
    """Counts (n, 3) of the gyro and times (n,) [s] from rest number ``first`` to the next."""

    first: int
    counts: FloatArray
    t: FloatArray


class Tick(NamedTuple):
    """Period of the stamps [s] by the computer's clock, and its standard uncertainty."""

    value: float
    sigma: float


class Observed(NamedTuple):
    """All records together.

    ``variance`` (9,) is that of one sample at rest, counts^2: gyro, accelerometer, magnetometer.
    ``swing`` (n, 3) are lines of the magnetometer that were not taken at rest, counts. ``tick`` is
    None without stamps, or if ``t`` is made of them.
    """

    rests: Sequence[Rest]
    turns: Sequence[Turn]
    variance: FloatArray
    swing: FloatArray
    tick: Tick | None


def observe(records: Sequence[Record]) -> Observed:
    """Find rests, turns and lines in records."""
    raw, lines = (
        [
            stacked(
                *(record, names, "counts"),
                wanted=f"raw counts {names[0]} to {names[-1]}",
                fix="take a log of boresight monitor --log",
                gaps=names is LINE,
            )
            for record in records
        ]
        for names in (INERTIAL, LINE)
    )
    some = bool(np.isfinite(np.concatenate(lines)).any())
    fix = "record with --write compass_mode=counts --write magnetic_source=counts"
    require(some, "records", "lines of the compass with its counts", None, fix)
    sights = [_sights(record) for record in records]
    clocks = [_clock(record) for record in records]
    still = _still(records, raw, [t for t, _ in clocks])
    rests, turns, scatter = list[Rest](), list[Turn](), list[FloatArray]()
    swing = list[FloatArray]()
    for counts, field, sight, (t, _), runs in zip(raw, lines, sights, clocks, still, strict=True):
        end, new = None, np.isfinite(field[:, 0])
        moving = new.copy()
        for start, stop in runs:
            moving[start:stop] = False
            rows = field[start:stop][new[start:stop]]
            if not len(rows):
                continue
            if end is not None and np.diff(t[end - 1 : start + 1]).max() < GAP_S:
                part = slice(end - 1, start + 1)
                turns.append(Turn(len(rests) - 1, counts[part, :3], t[part]))
            rests.append(_rest(counts[start:stop], rows, sight[start:stop]))
            scatter.append(_squares(counts[start:stop], rows))
            end = stop
        swing.append(field[moving])
    total = np.sum(scatter, axis=0) if scatter else np.ones((2, 9))
    ticks = [tick for _, tick in clocks if tick is not None]
    weight = sum(1.0 / k.sigma**2 for k in ticks)
    tick = Tick(sum(k.value / k.sigma**2 for k in ticks) / weight, weight**-0.5) if ticks else None
    variance = total[0] / np.maximum(total[1], 1.0)
    return Observed(rests, turns, variance, np.concatenate(swing), tick)


def _sights(record: Record) -> FloatArray:
    """Sighted attitudes (n, 4); NaN without one."""
    if all(name in record.columns for name in QUATERNION):
        q = np.column_stack([record.numbers(name) for name in QUATERNION])
        check_norm(record, q)
        return q
    if all(name in record.columns for name in SIGHT):
        angles = np.column_stack([record.values(name, "deg") for name in SIGHT])
        return rotation.euler_to_quaternion(np.radians(angles))
    return np.full((len(record), 4), np.nan)


def _clock(record: Record) -> tuple[FloatArray, Tick | None]:
    """Times [s], and the stamp's period against them."""
    t = record.times()
    t = t - t[0]
    if "stamp" not in record.columns or len(t) < 1000:
        return t, None
    stamp = record.numbers("stamp")
    cycles = np.concatenate([[0.0], np.cumsum(np.diff(stamp) % 2.0**STAMP_BITS)])
    clock = record.values("computer", "s") if "computer" in record.columns else t
    clock = clock - clock[0]
    # The computer hears of a row late, never early: of each part the row with the least delay.
    slope = clock[-1] / cycles[-1]
    for _ in range(3):
        late, parts = clock - slope * cycles, np.array_split(np.arange(len(t)), _PARTS)
        rows = [part[np.argmin(late[part])] for part in parts]
        (slope, start), covariance = np.polyfit(cycles[rows], clock[rows], 1, cov=True)
    if np.abs(clock - slope * cycles - start).max() < 2.0 * slope:
        return t, None
    # The upper limit of the scatter (95 %), which so few parts leave open.
    most = 1.0 + 2.0 / np.sqrt(2.0 * (_PARTS - 2))
    return cycles * slope, Tick(float(slope), float(most * np.sqrt(covariance[0, 0])))


def _still(
    records: Sequence[Record], raw: Sequence[FloatArray], times: Sequence[FloatArray]
) -> list[list[tuple[int, int]]]:
    """Rows (start, stop) of the rests of each record, without their first and last window."""
    windows = []
    for record, counts, t in zip(records, raw, times, strict=True):
        size = max(2, round(_WINDOW_S * (len(t) - 1) / float(t[-1]))) if len(t) > 1 else 2
        found, fix = f"{len(counts)} rows", "record for longer"
        require(len(counts) >= size, record.where, f"{_WINDOW_S:g} s or more", found, fix)
        blocks = counts[: len(counts) // size * size].reshape(-1, size, len(INERTIAL))
        windows.append((size, blocks.mean(axis=1), blocks.var(axis=1, ddof=1)))
    mean, variance = (np.concatenate([w[k] for w in windows]) for k in (1, 2))
    # The quietest quarter by all axes together.
    order = np.argsort(np.log(variance + 1.0 / 12.0).sum(axis=1))[: max(1, len(mean) // 4)]
    floor, rate = np.median(variance[order], axis=0) + 1.0 / 12.0, np.median(mean[order], axis=0)
    out = []
    for size, mean, variance in windows:
        slow = _SLOW + 5.0 * np.sqrt(floor[:3] / size)
        quiet = np.stack([variance[:, k] / floor[k] for k in range(6)]).reshape(2, 3, -1)
        still = (quiet.mean(axis=1) < _QUIET).all(axis=0)
        still &= (np.abs(mean[:, :3] - rate[:3]) < slow).all(axis=1)
        least = int(np.ceil(_REST_S / _WINDOW_S)) + 2
        runs = [(a, b) for a, b in _runs(still) if b - a >= least]
        out.append([((a + 1) * size, (b - 1) * size) for a, b in runs])
    return out


def _runs(flags: BoolArray) -> list[tuple[int, int]]:
    """Starts and ends of the runs of true flags."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(np.int8), [0]])))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def _rest(counts: FloatArray, rows: FloatArray, sights: FloatArray) -> Rest:
    sighted = sights[np.isfinite(sights).all(axis=1)]
    sight = None
    if len(sighted):
        sight = np.mean(sighted * np.sign(sighted @ sighted[0])[:, None], axis=0)
        sight /= np.linalg.norm(sight)
    return Rest(counts.mean(axis=0), len(counts), rows.mean(axis=0), len(rows), sight)


def _squares(counts: FloatArray, rows: FloatArray) -> FloatArray:
    """Sums of squares about the means, and degrees of freedom: (2, 9)."""
    parts = [((v - v.mean(axis=0)) ** 2).sum(axis=0) for v in (counts, rows)]
    freedom = [len(counts) - 1] * 6 + [len(rows) - 1] * 3
    return np.stack([np.concatenate(parts), np.array(freedom, dtype=np.float64)])


#: Sensors by their place among the unknowns: the registers' program, matrix and bias.
_SENSORS = (
    ("calibrate_inertial", "gyro", "gyro_bias"),
    ("calibrate_inertial", "acc", "acc_bias"),
    ("calibrate_field", "field", "field_bias"),
)
#: Unknowns of the sensors.
_N = 36
#: Fewest rests; passes of the fit, and most evaluations in each.
_RESTS, _PASSES, _EVALUATIONS = 6, 3, 40
#: Step of the differences: a part of one, rad/s, m/s^2, uT or rad.
_STEP = 1e-7
#: Remedy for angles, a field and counts that contradict one another.
_SIGNS = (
    "check signs and order: of sights, heading to the left, nose up and right side down are "
    "positive; field_ut is east, north, up; counts are as the sensor gave them"
)
#: Smallest singular value, of the largest, of data that determine every unknown.
_DETERMINED = 1e-7


@dataclass(frozen=True)
class Misfit:
    """Residuals of one kind: how many, and their rms in stated standard deviations."""

    kind: str
    count: int
    rms: float


class Solution(NamedTuple):
    """Registers and what was found beside them.

    ``registers`` and ``sigma`` are values and standard uncertainties by program and parameter, in
    the parameter's unit; ``sensor_mounting`` and ``mounting`` (3, 3) T and T0 of the accelerometer,
    from body axes to the sensor's; ``variance`` (3, 3) the noise of one sample at rest in body
    axes, for each sensor (rad/s, m/s^2, uT, squared).
    """

    registers: dict[str, dict[str, float]]
    sigma: dict[str, dict[str, float]]
    sensor_mounting: FloatArray
    mounting: FloatArray
    variance: FloatArray
    misfits: Sequence[Misfit]


def mounting(s: FloatArray, b: FloatArray, what: str = "sights") -> tuple[FloatArray, FloatArray]:
    """T and T0 from directions (n, 3) in sensor axes and in body axes; ``what`` gave the latter."""
    singular = np.linalg.svd(b, compute_uv=False)
    good = len(b) >= 3 and bool(singular[2] >= 0.02 * singular[0])
    wanted = "three or more sighted rests, with the vertical in three directions of the body"
    fix = "sight it level, nose up and on its side"
    require(good, "sights", wanted, f"{len(b)}, in one plane", fix)
    t = np.linalg.lstsq(b, s, rcond=None)[0].T  # T = S B^+
    u, _, v = np.linalg.svd(t)
    t0 = np.asarray(u @ v)  # T (T^T T)^(-1/2)
    right = bool(np.linalg.det(t0) >= 0.0)
    require(right, what, "axes of a right-handed sensor", "its mirror image", _SIGNS)
    return np.asarray(t), t0


def solve(
    data: Observed, *, field_ut: Sequence[float], gravity: float, sight_deg: float
) -> Solution:
    """Fit the registers.

    ``field_ut`` is the local field, east, north, up [uT]; the sights' headings are from the same
    north; ``gravity`` is in m/s^2; ``sight_deg`` is the standard uncertainty of a sighted attitude
    about each axis [deg].

    `InputError`: too few rests or sights; records that leave a register open; a register beyond its
    range.
    """
    fit = _Fit(data, np.asarray(field_ut, dtype=np.float64), gravity, math.radians(sight_deg))
    for _ in range(_PASSES):
        fit.improve()
    return fit.solution()


class _Fit:
    """The unknowns, and the residuals as a function of small changes of them."""

    def __init__(self, data: Observed, field: FloatArray, gravity: float, sight_sd: float) -> None:
        rests = data.rests
        enough, fix = len(rests) >= _RESTS, "add a record of positions"
        wanted = f"{_RESTS} or more rests of more than 1.5 s with lines of the compass"
        require(enough, "records", wanted, len(rests), fix)
        self.data, self.gravity, self.m_n, self.sight_sd = data, gravity, field, sight_sd
        self.least_squares = optional("scipy.optimize").least_squares
        seen = [(k, r.sight) for k, r in enumerate(rests) if r.sight is not None]
        self.sighted = np.array([k for k, _ in seen], dtype=np.int64)
        self.sights = np.array([sight for _, sight in seen]).reshape(-1, 4)
        self.means = [
            np.array([r.inertial[:3] for r in rests]),
            np.array([r.inertial[3:] for r in rests]),
            np.array([r.field for r in rests]),
        ]
        samples, lines = ([getattr(r, n) for r in rests] for n in ("samples", "lines"))
        self.counted = [np.array(n, dtype=np.float64) for n in (samples, samples, lines)]
        variance = data.variance.reshape(3, 3)
        # What quantisation without enough noise leaves of a mean (Widrow), counts^2.
        self.coarse = np.exp(-4.0 * np.pi**2 * variance) / 12.0
        self.counts_variance = variance
        self.scale: dict[str, float] = {}
        self._begin()

    def _begin(self) -> None:
        """First values, from spheres and the mounting."""
        c_bn = np.swapaxes(rotation.quaternion_to_matrix(self.sights), 1, 2)
        up, m = np.array([0.0, 0.0, 1.0]), self.m_n / np.linalg.norm(self.m_n)
        matrices, offsets = [], []
        for k, (points, n, norm) in enumerate(
            (
                (self.means[1], up, self.gravity),
                (np.vstack([self.data.swing, self.means[2]]), m, float(np.linalg.norm(self.m_n))),
            )
        ):
            centre, radius = _sphere(points, ("positions", "swing")[k])
            seen = (self.means[k + 1][self.sighted] - centre) / radius
            t, t0 = mounting(seen, c_bn @ n, ("sights", "sights, field_ut")[k])
            if k == 0:
                self.t, self.t0 = t, t0
            matrices.append(norm / radius * t0.T)
            offsets.append(matrices[-1] @ centre)
        gyro = GYRO_SCALE * self.t0.T
        self.m = np.stack([gyro, *matrices])
        self.d = np.stack([gyro @ np.average(self.means[0], axis=0), *offsets])
        force, field = (self.means[k] @ self.m[k].T - self.d[k] for k in (1, 2))
        nav = _triad(up[None], self.m_n[None])
        self.q = rotation.matrix_to_quaternion(nav @ np.swapaxes(_triad(force, field), 1, 2))
        self.q[self.sighted] = self.sights

    def improve(self) -> None:
        """One fit, about which the unknowns are then taken anew."""
        self._linearise()
        x = np.zeros(_N + 3 * len(self.q))
        _factors(self.jacobian(x))
        found = self.least_squares(
            self.residuals, x, self.jacobian, method="lm", ftol=1e-6, max_nfev=_EVALUATIONS
        )
        wanted, what = "counts, sights and a field that agree", "a fit that does not converge"
        require(found.success, "records", wanted, what, _SIGNS)
        for k, part in enumerate(found.x[:_N].reshape(3, 12)):
            self.m[k] = (np.eye(3) + part[:9].reshape(3, 3)) @ self.m[k]
            self.d[k] = self.d[k] + part[9:]
        self.q = rotation.quaternion_multiply(self.q, self._turned(found.x))
        self._uncertainty(found.jac, found.fun)

    def _linearise(self) -> None:
        """Weights and turns about the unknowns as they are."""
        self.weights = []
        for k in range(3):
            sd = np.sqrt(self.counts_variance[k] / self.counted[k][:, None] + self.coarse[k])
            self.weights.append(np.linalg.inv(self.m[k]) / sd[:, :, None])
        turns = [self._turn(turn) for turn in self.data.turns]
        shapes = ((4,), (3, 9), (3, 3), (3, 3))
        self.turns = [
            np.array([turn[k] for turn in turns]).reshape(-1, *shape)
            for k, shape in enumerate(shapes)
        ]
        # The point of the sphere that a line stands for, by its noise: what is left of the noise
        # there does not depend on the distance. A mean distance comes from noise along the sphere.
        y = self.data.swing @ self.m[2].T - self.d[2]
        norm = np.linalg.norm(self.m_n)
        covariance = self.m[2] * self.counts_variance[2] @ self.m[2].T
        beyond = np.linalg.norm(y, axis=1) - norm
        out = y / (norm + beyond)[:, None]
        along = out @ covariance
        self.foot = y - along * (beyond / (along * out).sum(axis=1))[:, None]
        out = self.foot / np.linalg.norm(self.foot, axis=1, keepdims=True)
        across = ((out @ covariance) * out).sum(axis=1)
        self.line_sd = np.sqrt(across)
        self.beyond = beyond - (np.trace(covariance) - across) / (2.0 * norm)

    def _turn(self, turn: Turn) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """A turn as quaternion, its change with E and with d, and its weight.

        With ``M = (I + E) M_0``: the turn is ``turn_0 exp(a E - b d)``, by the sums of ``Q w^T dt``
        and ``Q dt``, where Q is the matrix from the body at a step to the body at the end.
        """
        dt = np.diff(turn.t)[:, None]
        mean = 0.5 * (turn.counts[1:] + turn.counts[:-1]) @ self.m[0].T
        turns = rotation.rotation_vector_to_quaternion((mean - self.d[0]) * dt)
        q = rotation.quaternion_running_product((1.0, 0.0, 0.0, 0.0), turns)
        to_end = rotation.quaternion_to_matrix(
            rotation.quaternion_multiply(rotation.quaternion_conjugate(q[-1]), q)
        )
        by_matrix = np.einsum("nar,ns->ars", to_end * dt[:, :, None], mean).reshape(3, 9)
        noise = to_end @ (self.m[0] * np.sqrt(self.counts_variance[0])) * dt[:, :, None]
        covariance = np.einsum("nij,nkj->ik", noise, noise)
        weight = np.linalg.inv(np.linalg.cholesky(covariance))
        return q[-1], by_matrix, (to_end * dt[:, :, None]).sum(axis=0), weight

    def _turned(self, x: FloatArray) -> FloatArray:
        return rotation.rotation_vector_to_quaternion(x[_N:].reshape(-1, 3))

    def residuals(self, x: FloatArray) -> FloatArray:
        """All residuals in their standard deviations."""
        return np.concatenate([v.ravel() for v in self._parts(x).values()])

    def jacobian(self, x: FloatArray) -> FloatArray:
        """Derivatives of the residuals by the unknowns.

        Differences; no residual has two attitudes of even numbers, or two of odd ones, so those of
        three axes take six of them.
        """
        base, count = self.residuals(x), len(self.q)
        first = np.array([t.first for t in self.data.turns], dtype=np.int64)
        numbers = [*[np.arange(count)] * 3, self.sighted, first]
        rows = np.repeat(np.concatenate(numbers), 3)
        others = np.repeat(np.concatenate([*numbers[:-1], first + 1]), 3)
        out = np.zeros((len(base), len(x)))
        steps = _STEP * np.eye(_N, len(x))
        for column, step in enumerate(steps):
            out[:, column] = (self.residuals(x + step) - base) / _STEP
        for axis in range(3):
            for parity in range(2):
                step = np.zeros(len(x))
                step[_N + 3 * np.arange(parity, count, 2) + axis] = _STEP
                change = (self.residuals(x + step) - base) / _STEP
                for attitudes in (rows, others):
                    here = np.flatnonzero(attitudes % 2 == parity)
                    out[here, _N + 3 * attitudes[here] + axis] = change[here]
        return out

    def _parts(self, x: FloatArray) -> dict[str, FloatArray]:
        sensors = x[:_N].reshape(3, 12)
        e, d = sensors[:, :9].reshape(3, 3, 3), sensors[:, 9:]
        q = rotation.quaternion_multiply(self.q, self._turned(x))
        c_nb = rotation.quaternion_to_matrix(q)
        true = [np.zeros((len(q), 3)), self.gravity * c_nb[:, 2, :], self.m_n @ c_nb]
        parts = {}
        for k, (_, name, _) in enumerate(_SENSORS):
            y = self.means[k] @ ((np.eye(3) + e[k]) @ self.m[k]).T - self.d[k] - d[k]
            parts[f"{name} at rest"] = np.einsum("nij,nj->ni", self.weights[k], y - true[k])
        parts["sights"] = rotation.turns_between(self.sights, q[self.sighted]) / self.sight_sd
        turn, by_matrix, by_bias, weight = self.turns
        first = np.array([t.first for t in self.data.turns], dtype=np.int64)
        change = by_matrix @ e[0].ravel() - by_bias @ d[0]
        moved = rotation.quaternion_multiply(q[first], turn)
        moved = rotation.quaternion_multiply(moved, rotation.rotation_vector_to_quaternion(change))
        parts["turns"] = np.einsum(
            "nij,nj->ni", weight, rotation.turns_between(moved, q[first + 1])
        )
        moved = self.foot + (self.foot + self.d[2]) @ e[2].T - d[2]
        change = np.linalg.norm(moved, axis=1) - np.linalg.norm(self.foot, axis=1)
        parts["swing"] = (self.beyond + change) / self.line_sd
        return {name: part / self.scale.get(name, 1.0) for name, part in parts.items()}

    def _uncertainty(self, jacobian: FloatArray, residuals: FloatArray) -> None:
        """Covariance of the sensors' unknowns; the scatter of each kind, which scales it from 1 on.

        The expected square of a residual is one less its leverage.
        """
        scaled, size, s, v = _factors(jacobian)
        root = v.T / s
        leverage = ((scaled @ root) ** 2).sum(axis=1)
        root /= size[:, None]
        self.covariance = (root @ root.T)[:_N, :_N]
        self.misfits, start = [], 0
        for name, part in self._parts(np.zeros(jacobian.shape[1])).items():
            rows = slice(start, start + part.size)
            start += part.size
            free = float((1.0 - leverage[rows]).sum())
            if free < 1.0:
                continue
            rms = self.scale.get(name, 1.0) * math.sqrt(float((residuals[rows] ** 2).sum()) / free)
            self.misfits.append(Misfit(name, part.size, rms))
            # The upper limit of the scatter (95 %), which so many residuals leave open.
            self.scale[name] = max(1.0, rms * (1.0 + 2.0 / math.sqrt(2.0 * free)))

    def solution(self) -> Solution:
        """The registers, checked against their ranges."""
        values: dict[str, dict[str, float]] = {}
        sigma: dict[str, dict[str, float]] = {}
        for k, (program, _, _) in enumerate(_SENSORS):
            # dM = E M, of the magnetometer's bias b = M^-1 d: db = M^-1 (dd - E d).
            change = np.eye(12)
            change[:9, :9] = np.kron(np.eye(3), self.m[k].T)
            bias = self.d[k]
            if k == 2:
                inverse = np.linalg.inv(self.m[k])
                bias = inverse @ self.d[k]
                change[9:, 9:] = inverse
                change[9:, :9] = -np.kron(inverse, self.d[k])
            rows = slice(12 * k, 12 * k + 12)
            sd = np.sqrt(np.diag(change @ self.covariance[rows, rows] @ change.T))
            found = [*self.m[k].ravel(), *bias]
            if k == 0 and (tick := self.data.tick) is not None:
                # A turn is M_g c times the clock's period.
                sd = np.hypot(sd, np.array(found) * tick.sigma / tick.value)
            for name, value, uncertain in zip(_names(k), found, sd, strict=True):
                values.setdefault(program, {})[name] = float(value)
                sigma.setdefault(program, {})[name] = float(uncertain)
        if (tick := self.data.tick) is not None:
            values["calibrate_inertial"]["tick_s"] = tick.value
            sigma["calibrate_inertial"]["tick_s"] = tick.sigma
        for program, some in values.items():
            FRONT[program]().param_values(some)
        variance = np.einsum("kij,kj->ki", self.m**2, self.counts_variance)
        return Solution(values, sigma, self.t, self.t0, variance, self.misfits)


def _factors(jacobian: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Columns of norm 1, their norms, singular values and right vectors."""
    size = np.linalg.norm(jacobian, axis=0)
    scaled = jacobian / np.where(size > 0.0, size, 1.0)
    _, s, v = np.linalg.svd(np.linalg.qr(scaled, mode="r"))
    sensor, place = divmod(int(np.argmax(np.abs(v[-1, :_N]))), 12)
    where = f"register {_names(sensor)[place]}"
    fix = "add positions with turns between them, and a swing about all axes"
    good = bool(s[-1] >= _DETERMINED * s[0])
    require(good, where, "records that determine it", "none that do", fix)
    return scaled, size, s, v


def _names(sensor: int) -> list[str]:
    """Registers of a sensor in the order of its unknowns."""
    _, matrix, bias = _SENSORS[sensor]
    return [*(f"{matrix}_{r}{c}" for r in AXES for c in AXES), *(f"{bias}_{a}" for a in AXES)]


def _sphere(points: FloatArray, what: str) -> tuple[FloatArray, float]:
    """Centre and radius of the sphere through points (n, 3): ``|c|^2 = 2 b c + r^2 - |b|^2``."""
    size = float(np.abs(points).max()) or 1.0
    rows = np.column_stack([points / size, np.ones(len(points))])
    singular = np.linalg.svd(rows, compute_uv=False)
    half, *_ = np.linalg.lstsq(rows, (points**2).sum(axis=1) / size**2, rcond=None)
    centre = 0.5 * half[:3]
    good = len(points) >= 4 and singular[-1] >= 1e-3 * singular[0]
    good = bool(good and half[3] + centre @ centre > 0.0)
    found = f"{len(points)} that do not span a sphere"
    require(good, what, "directions all round", found, "turn every axis up and down")
    return centre * size, size * math.sqrt(half[3] + centre @ centre)


def _triad(a: FloatArray, b: FloatArray) -> FloatArray:
    """Orthonormal columns (n, 3, 3) from two vectors (n, 3): along a, across both, the third."""
    first = a / np.linalg.norm(a, axis=1, keepdims=True)
    second = np.cross(a, b)
    second /= np.linalg.norm(second, axis=1, keepdims=True)
    return np.stack([first, second, np.cross(first, second)], axis=2)
