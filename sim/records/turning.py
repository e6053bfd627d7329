"""Rates, force, field and reference attitude of a log against one another.

A vector v that is fixed in space turns in body axes by dv/dt = -w x v. Turned back by the rates,
R(t) v(t) with dR/dt = R [w x] is constant. Its scatter in windows of seconds shows a wrong unit,
sign, axis or time of a sensor. Of exchanged axes, scales and delays, a warning names the one that
explains the windows better than the log as it is. The force is the sum of gravity and an
acceleration, whose mean vanishes in long windows.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import permutations, product
from operator import itemgetter
from typing import NamedTuple

import numpy as np

from boresight.model.arrays import BoolArray, FloatArray, IntArray
from boresight.sim.rotations.rotation import (
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_matrix,
    rotate,
    rotation_vector_to_quaternion,
)

#: s: shortest block, whose mean is taken; shortest and longest window; a step that is a gap.
_BLOCK_S, _SHORT_S, _LONG_S, _GAP_S = 0.02, 0.6, 5.0, 0.5
#: s: least window in which a force is weighed, or an estimate is followed.
_WEIGHT_S = 1.0
#: Windows: parts of a short log, of one that turns fast only at times, least number, most that are
#: looked at, and blocks with a sample.
_PARTS, _MANY, _FEWEST, _MOST, _FILLED = 12, 40, 8, 64, 3
#: Scatter (mean square angle [rad^2]) that is noise, and that is a turn without doubt.
_NOISE, _TURN = 3e-4, 0.01
#: rad/s: an offset of the rates that is usual. In a slow turn it looks like a scale, or other axes.
_BIAS = 0.05
#: Share of the scatter that a cause explains; standard deviations of the count of windows.
_SHARE, _SURE = 0.1, 3.0
#: Scales of the rates, and delays [s], that are right.
_RIGHT, _ON_TIME_S = (0.9, 1.1), 0.035
#: What is tried: scales, finer ones around the best, and delays [s].
_SCALES, _FINE = np.geomspace(0.01, 100.0, 49), np.linspace(0.85, 1.15, 13)
_DELAYS_S = np.linspace(-2.0, 2.0, 101)
#: m/s^2: least mean force, and most in a whole turn; share of rates that changes in a steady turn.
_LIGHT, _HEAVY, _STEADY = 0.9 * 9.80665, 1.15 * 9.80665, 1e-3
#: s, windows in which small errors are fitted, the share of them that is kept, and the least
#: scatter without an offset over that with it from which on the offset is known; turns about a
#: second axis that are none, as a share of those about the first.
_FIT_S, _KEPT, _KNOWN, _FLAT = 2.0, 0.7, 1.2, 0.2
#: Symmetric matrices without trace: what soft iron adds to a field of one length.
_SHAPES = [np.diag([1.0, -1.0, 0.0]), np.diag([1.0, 0.0, -1.0])]
_SHAPES += [np.eye(3)[[j, k]].T @ np.eye(3)[[k, j]] for j, k in ((0, 1), (0, 2), (1, 2))]
#: Small errors: least and most that is told, as a share of the vector or in rad/s; least scatter
#: without it over that with it, of field and force. Accelerations, and a sensor off the axis of the
#: turns, look like an offset of the force.
_ERRORS = {
    "offset": (0.2, 1.5, 2.0, 8.0),
    "bias": (0.1, 3.0, 2.0, 2.0),
    "scale": (0.1, 0.5, 2.0, 2.0),
    "scales": (0.15, 0.6, 2.0, 2.0),
    "iron": (0.1, 1.0, 2.5, math.inf),
}
#: Activity of force and rates: s of a block, least and longest delay, and from the best one to
#: others; least correlation in standard deviations, and of others as a share of the best.
_STEP_S, _LATE_S, _LATEST_S, _APART_S, _ALIKE, _OTHER = 0.01, 0.034, 0.4, 0.05, 8.0, 0.6
#: An attitude that has left the rates: angle in a window, and number of windows.
_AWAY_DEG, _OFTEN = 30.0, 3
#: What else files hold in place of w, x, y, z from sensor to earth.
_OTHERS: dict[str, Callable[[FloatArray], FloatArray]] = {
    "its conjugate fits": quaternion_conjugate,
    "it fits as x, y, z, w": lambda q: q[:, [3, 0, 1, 2]],
    "it fits as the conjugate of x, y, z, w": lambda q: quaternion_conjugate(q[:, [3, 0, 1, 2]]),
}


class Triad(NamedTuple):
    """A sensor, or a reference attitude: names, values (n, 3 or 4), rows with a sample (n,)."""

    names: str
    values: FloatArray
    new: BoolArray


class _Cause(NamedTuple):
    """What makes rates fit: a matrix, or a delay [s] of the vector.

    ``text`` is empty where the rates are right, or nearly. ``about`` is what the matrix does:
    exchange or turn axes, scale one of them, or scale all; empty for a delay.
    """

    text: str = ""
    about: str = ""
    matrix: FloatArray = np.eye(3)
    late_s: float = 0.0


def _scaled(scale: float) -> _Cause:
    text = f"the rates are {1.0 / scale:.2g} times as large as they should be"
    if is_degrees := 0.8 < math.degrees(scale) < 1.25:
        text = "the rates look like deg/s"
    is_right = _RIGHT[0] < scale < _RIGHT[1]
    about = "degrees" if is_degrees else "scales"
    return _Cause("" if is_right else text, about, scale * np.eye(3))


def _matrices() -> Iterator[_Cause]:
    """Exchanges of axes and signs, turns of the axes, and scales of one."""
    for order, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
        matrix = np.eye(3)[list(order)] * np.array(signs)[:, None]
        axes = [("-" if s < 0.0 else "") + "xyz"[k] for k, s in zip(order, signs, strict=True)]
        text = f"axes or signs are wrong (the rates fit as {', '.join(axes)})"
        text = "the sign is wrong" if axes == ["-x", "-y", "-z"] else text
        if axes != ["x", "y", "z"]:
            yield _Cause(text, "axes", matrix)
    for (k, axis), deg in product(enumerate("xyz"), (-60, -45, -30, 30, 45, 60)):
        turn = rotation_vector_to_quaternion(math.radians(deg) * np.eye(3)[k])
        text = f"the axes are turned by about {deg} deg about {axis}"
        yield _Cause(text, "axes", quaternion_to_matrix(turn))
    for (k, axis), scale in product(enumerate("xyz"), (0.5, 0.7, 1.4, 2.0)):
        text = f"{axis} is about {1.0 / scale:.2g} times as large as it should be"
        yield _Cause(text, "scale", np.diag(np.where(np.arange(3) == k, scale, 1.0)))


_MATRICES = [*_matrices()]


class _Finding(NamedTuple):
    """What a vector says about the rates; ``cause`` is None where it says that they are right.

    ``scatter``: of the log as it is; ``after``: with the cause. ``fits``: the rates explain how it
    turns. ``stuck``: it does not turn. ``unlike``: nothing that is known makes the rates fit.
    """

    names: str
    cause: _Cause | None
    scatter: float
    after: float
    fits: bool = False
    stuck: bool = False
    unlike: bool = False


def _error_line(name: str, value: FloatArray, rates: str, sensor: str, is_force: bool) -> str:
    """The warning about an error of `_ERRORS`, by its factors."""
    numbers = ", ".join(f"{x:.2g}" for x in np.where(np.abs(value) < 0.01, 0.0, value))
    if name == "bias":
        return f"{rates}: an offset of {numbers} rad/s explains how {sensor} turn: subtract it"
    if name == "iron":
        return f"{sensor}: longer in some directions than in others (soft iron): calibrate the axes"
    if name == "offset":
        how = "uT explains how they turn (iron): subtract it"
        how = "m/s^2 explains how they turn (has the device removed gravity?)" if is_force else how
        return f"{sensor}: an offset of {numbers} {how}"
    times = ", ".join(f"{1.0 / (1.0 - min(x, 0.9)):.2g}" for x in value)
    return f"{rates}: {times} times as large as {sensor} turn"


class _Windows:
    """Blocks and windows of a log of rates, and the turn in each block."""

    def __init__(self, rates: Triad, dt: FloatArray, window_s: float, parts: int = _PARTS) -> None:
        step = np.where((dt > 0.0) & (dt < _GAP_S), dt, 0.0)
        usual = float(np.median(step))
        self.block_s = max(_BLOCK_S, usual)
        time = np.cumsum(step) - 0.5 * usual  # ends of blocks lie between samples
        window_s = min(window_s, float(time[-1]) / parts)
        self.blocks = max(2, round(window_s / self.block_s))
        self._block: IntArray = np.maximum(time / self.block_s, 0.0).astype(np.int64)
        self.count = (int(self._block[-1]) + 1) // self.blocks
        self._size, self.seconds = self.count * self.blocks, self.blocks * self.block_s
        turn = self._sums(rates.values * np.where(rates.new, step, 0.0)[:, None])
        #: Turns (count, blocks, 3), rad.
        self.steps = turn.reshape(self.count, self.blocks, 3)

    def _sums(self, values: FloatArray) -> FloatArray:
        size = max(self._size, int(self._block[-1]) + 1)
        sums = [np.bincount(self._block, column, size) for column in values.T]
        return np.stack(sums, axis=1, dtype=np.float64)[: self._size]

    def means(self, values: FloatArray, new: BoolArray) -> FloatArray:
        """Mean (blocks, 3) in each block; NaN without a sample."""
        count = self._sums(new[:, None].astype(np.float64))
        sums = self._sums(np.where(new[:, None], values, 0.0))
        return np.asarray(sums / np.where(count > 0.0, count, np.nan))

    def turns(self, matrices: FloatArray, some: IntArray) -> FloatArray:
        """Turns (k, windows, blocks, 3, 3) since a window's start, after each of k matrices."""
        halves = rotation_vector_to_quaternion(
            0.5 * np.einsum("kij,wbj->bkwi", matrices, self.steps[some])
        )
        from_last = quaternion_multiply(halves[:-1], halves[1:])  # middle of a block to the next
        turns = [halves[0]]
        for turn in from_last:
            turns.append(quaternion_multiply(turns[-1], turn))
        turned = quaternion_to_matrix(np.stack(turns, axis=2))
        # In memory axes stand before blocks: `turned_back` multiplies by all blocks at once.
        return np.moveaxis(np.moveaxis(turned, 3, 2).copy(), 2, 3)

    def turned_back(
        self, turns: FloatArray, v: FloatArray, some: IntArray, late: int = 0
    ) -> FloatArray:
        """Mean (k, windows, 3) of vectors (blocks, 3) that are late, turned back by turns."""
        index = some[:, None] * self.blocks + np.arange(self.blocks) + late
        inside = (index >= 0) & (index < self._size)
        values = np.where(inside[..., None], v[np.clip(index, 0, self._size - 1)], np.nan)
        known = np.isfinite(values[..., 0])
        count = np.where(known.sum(axis=1) < min(_FILLED, self.blocks), np.nan, known.sum(axis=1))
        flat = np.where(known[..., None], values, 0.0).reshape(len(some), 3 * self.blocks, 1)
        back = np.moveaxis(turns, 3, 2).reshape(*turns.shape[:2], 3, 3 * self.blocks) @ flat
        return np.asarray(back[..., 0] / count[:, None])


def contradictions(
    rates: Triad, force: Triad | None, field: Triad | None, attitude: Triad | None, dt: FloatArray
) -> tuple[list[str], bool]:
    """A line for each sensor, or reference attitude, that contradicts the others.

    The second result is whether the rates [rad/s] explain how one of the others turns: force
    [m/s^2], field [uT], attitude from sensor to east, north, up. ``dt`` are the time steps [s].
    """
    speed = float(np.median(np.linalg.norm(rates.values[rates.new], axis=1)))
    short_s = min(0.7 / max(speed, 1e-9), _LONG_S, float(dt.clip(0.0, _GAP_S).sum()) / _MANY)
    short_s = max(short_s, _SHORT_S)
    lengths_s = (short_s, max(short_s, _WEIGHT_S), _FIT_S, _LONG_S)
    short, weighed, fitted, long = (_Windows(rates, dt, s) for s in lengths_s)
    findings, line = list[_Finding | None](), ""
    if force is not None:
        usual = np.median(np.linalg.norm(force.values[force.new], axis=1))
        means = long.means(force.values / max(float(usual), 1e-9), force.new)
        findings.append(_finding(force.names, long, [means], True))
    if field is not None:
        finding, line = _field_finding(rates, field, short, fitted)
        findings.append(finding)
    own = None
    if attitude is not None:
        own = _finding(attitude.names, short, _axes(short, attitude.values, attitude.new), False)
        findings.append(own)
    if force is not None and not line:
        _, line = _errors(fitted, rates, force, True)
        # Accelerations turn forces, too: rates that a field or an attitude confirms are right.
        confirmed = any(f and f.fits and not f.cause for f in findings[1:])
        line = "" if confirmed and line.startswith(rates.names) else line
    lines = [*_rate_lines(rates.names, findings)]
    is_scale = all(f is None or not f.cause or "scale" in f.cause.about for f in findings)
    if line and (not lines or (line.startswith(f"{rates.names}: an offset") and is_scale)):
        lines = [line]
    agree = any(f is not None and f.fits and f.cause is None for f in findings)
    if own is not None and attitude is not None and not own.fits:
        for text, other in _OTHERS.items():
            turned = _axes(short, other(attitude.values), attitude.new)
            found = _finding(attitude.names, short, turned, False)
            if found is not None and found.fits and found.cause is None:
                line = f"{attitude.names}: do not turn as the rates {rates.names} say: {text}"
                others = [*_rate_lines(rates.names, [f for f in findings if f is not own])]
                return others or [line], agree
    if lines or force is None:
        return lines, agree
    if attitude is not None and attitude.new.any():
        lines = [*_by_attitude(force, field, attitude)]
    lines = lines or [*_late_force(rates, force, dt)] or [*_weight(weighed, rates, force, dt)]
    if not lines and field is not None:
        lines = [*_dip(long, force, field)]
    return lines, agree


def _field_finding(
    rates: Triad, field: Triad, short: _Windows, fitted: _Windows
) -> tuple[_Finding | None, str]:
    """What the field says, without its offset where that is known, and the line of an error."""
    means = short.means(field.values, field.new)
    offset, line = _errors(fitted, rates, field, False)
    as_is = _finding(field.names, short, [_units(means)], False)
    if not offset.any():
        return as_is, line
    found = _finding(field.names, short, [_units(means - offset)], False)
    is_offset = line.startswith(f"{field.names}: an offset")
    other = "" if is_offset else line
    if found is None:
        return as_is, other
    is_told = is_offset and found.fits
    if as_is is not None:
        is_axes = as_is.cause is not None and as_is.cause.about in ("axes", "degrees")
        most = 0.5 * as_is.after if is_axes else 1.2 * as_is.scatter
        is_news = is_told or (found.cause and not as_is.cause)
        if found.scatter > most or as_is.stuck or not is_news:
            return as_is, other
    return found, line if is_told else other


def _turned(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("...ij,...j->...i", matrices, vectors))


def _units(vectors: FloatArray) -> FloatArray:
    """Vectors (n, 3) of length one; NaN for zero."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.where(lengths > 0.0, lengths, np.nan))


def departures(rates: Triad, attitude: Triad, dt: FloatArray) -> list[str]:
    """A line where an estimated attitude often turns otherwise than the rates."""
    windows = _Windows(rates, dt, _WEIGHT_S)
    some = np.arange(windows.count)
    turns = windows.turns(np.eye(3)[None], some)
    axes = _axes(windows, attitude.values, attitude.new)
    squares = [(windows.turned_back(turns, axis, some)[0] ** 2).sum(axis=-1) for axis in axes]
    away = int((1.0 - np.mean(squares, axis=0) > math.radians(_AWAY_DEG) ** 2).sum())
    if away < _OFTEN:
        return []
    where = f"within {windows.seconds:.2g} s, in {away / len(some):.0%} of the log"
    text = f"{attitude.names}: turn {_AWAY_DEG:.0f} deg or more away from {rates.names} {where}"
    return [f"{text}: it diverges there (Euler angles past the vertical, gains, a range)"]


def _axes(windows: _Windows, q: FloatArray, new: BoolArray) -> list[FloatArray]:
    """East, north and up in body axes."""
    return [windows.means(rotate(quaternion_conjugate(q), axis), new) for axis in np.eye(3)]


def _finding(
    names: str, windows: _Windows, vectors: Sequence[FloatArray], is_force: bool
) -> _Finding | None:
    """What a vector says; None where the log does not tell."""

    def scatter(turns: FloatArray, late: int = 0) -> FloatArray:
        squares = [(windows.turned_back(turns, v, some, late) ** 2).sum(axis=-1) for v in vectors]
        return np.asarray(np.abs(1.0 - np.mean(squares, axis=0)))

    some = np.arange(windows.count)
    as_is, still = scatter(windows.turns(np.stack([np.eye(3), np.zeros((3, 3))]), some))
    size = np.fmax(as_is, still)
    some = np.flatnonzero(np.isfinite(size))
    if len(some) < _FEWEST or float(size[some].mean()) < _NOISE:
        return None
    some = np.sort(some[np.argsort(size[some])[-_MOST:]])
    as_is, still = as_is[some], still[some]
    before, without = float(as_is.mean()), float(still.mean())
    turn = windows.steps[some]
    steady = float(np.std(turn, axis=(0, 1)).max()) < _STEADY * float(np.abs(turn).max())
    if without < 3e-4 * before and before > _TURN and not (is_force and steady):
        return _Finding(names, None, before, before, stuck=True)
    turns = windows.turns(np.eye(3)[None], some)
    tried = list[tuple[float, _Cause, FloatArray]]()

    def attempt(causes: list[_Cause]) -> _Cause:
        """Try delays, or matrices; the best one of all up to now."""
        if causes[0].about:
            afters = [*scatter(windows.turns(np.stack([c.matrix for c in causes]), some))]
        else:
            afters = [scatter(turns, round(c.late_s / windows.block_s))[0] for c in causes]
        for cause, after in zip(causes, afters, strict=True):
            enough = np.isfinite(after).sum() >= _FEWEST
            tried.append((float(np.nanmean(after)) if enough else math.inf, cause, after))
        return min(tried, key=itemgetter(0))[1]

    blocks = sorted({round(delay / windows.block_s) for delay in _DELAYS_S})
    attempt([_Cause("delay", late_s=k * windows.block_s) for k in blocks])
    if before > 0.1 * without:
        attempt(_MATRICES)
    best = attempt([_scaled(float(s)) for s in _SCALES])
    if best.about in ("scales", "degrees"):
        best = attempt([_scaled(float(s)) for s in best.matrix[0, 0] * _FINE])
    if best.late_s:
        attempt([_Cause("delay", late_s=best.late_s + k * windows.block_s) for k in (-1, 1)])
    best_scatter, cause, after = min(tried, key=itemgetter(0))
    # Turns with an acceleration, and sensors off the axis, look like a scale or a delay of a force.
    is_small = not cause.text or (not cause.about and abs(cause.late_s) < _ON_TIME_S)
    is_right = is_small or (is_force and cause.about not in ("axes", "degrees"))
    explains = best_scatter < 0.5 * without and (not is_force or best_scatter < 0.5 * before)
    fits = before < 0.5 * without
    noise = max(_NOISE, (_BIAS * windows.seconds) ** 2 / 12.0)  # of the turn by a usual offset
    is_inside = abs(cause.late_s) < 0.95 * float(_DELAYS_S[-1])  # the best one of all, not an end
    # The scatter is less in surely more than half of the windows that differ.
    less = as_is - after
    differ = np.abs(less) > np.maximum(0.05 * as_is, _NOISE)  # false for NaN
    count, fewer = int(differ.sum()), int((less[differ] > 0.0).sum())
    is_less = float(np.nanmean(less)) > max(noise, _SHARE * before)
    is_sure = is_less and fewer - 0.5 * count > 0.5 * _SURE * math.sqrt(count)
    if not is_right and explains and is_inside and is_sure:
        return _Finding(names, cause, before, best_scatter, fits)
    unlike = not is_force and without > _TURN and before > 0.8 * without
    return _Finding(names, None, before, before, fits, unlike=unlike)


def _errors(
    windows: _Windows, rates: Triad, sensor: Triad, is_force: bool
) -> tuple[FloatArray, str]:
    """The offset of a vector, and a line about the small error that best explains how it turns.

    Several are fitted at once. One is told if it is large, and the scatter without it much more.
    """
    v = windows.means(sensor.values, sensor.new).reshape(windows.count, windows.blocks, 3)
    known = np.isfinite(v[..., :1])
    some = np.flatnonzero(known.sum(axis=(1, 2)) >= _FILLED)
    if len(some) < _FEWEST:
        return np.zeros(3), ""
    extents = np.linalg.svd(windows.steps[some].reshape(-1, 3), compute_uv=False)
    is_short = windows.seconds < 0.9 * _WEIGHT_S
    is_flat = is_short or bool(extents[1] < _FLAT * extents[0])
    if is_flat and is_force:  # a steady acceleration is an offset there
        return np.zeros(3), ""
    v, known, steps = v[some], known[some], windows.steps[some]
    count = known.sum(axis=1, keepdims=True)
    turns = windows.turns(np.eye(3)[None], some)[0]
    back = _turned(turns, np.where(known, v, 0.0))
    mean = back.sum(axis=1, keepdims=True) / count
    body = _turned(np.swapaxes(turns, -1, -2), mean)
    axes = np.eye(3)[:, None, None]

    def drift(turn: FloatArray) -> FloatArray:
        # Rates w + e turn a vector back by R: d(R v)/dt = R (e x v) = (R e) x (R v).
        return np.cross(np.cumsum(_turned(turns, turn), axis=-2), mean)

    columns = {
        "offset": _turned(turns, axes),
        "bias": drift(windows.block_s * axes * np.ones(v.shape)),
        "scale": drift(steps[None]),
        "scales": drift(steps * axes),
        "iron": _turned(turns, np.stack([body @ shape for shape in _SHAPES])),
    }

    def centred(x: FloatArray) -> FloatArray:
        return np.where(known, x - np.where(known, x, 0.0).sum(-2, keepdims=True) / count, 0.0)

    y = centred(back)
    columns = {name: centred(x) for name, x in columns.items()}
    used = np.ones(len(y), dtype=bool)

    def fit(names: Iterable[str]) -> tuple[FloatArray, FloatArray]:
        """Factors of columns, and the scatter in each window."""
        parts = [column for name in names for column in columns[name]]
        x = np.stack(parts, axis=-1) if parts else np.zeros((*y.shape, 0))
        flat, rcond = x[used].reshape(y[used].size, len(parts)), 1e-6 if len(parts) > 3 else 0.1
        normal = np.linalg.pinv(flat.T @ flat, rcond=rcond * rcond, hermitian=True)
        factors = normal @ (flat.T @ y[used].ravel())
        return factors, ((y - x @ factors) ** 2).sum(axis=(1, 2)) / count[:, 0, 0]

    usual = float(np.nanmedian(np.linalg.norm(v, axis=-1)))
    still = (centred(v) ** 2).sum(axis=(1, 2)) / count[:, 0, 0]  # as if nothing turned
    offset, line = np.zeros(3), ""
    # Turns about one axis, and short ones, do not tell other errors from an offset.
    together = ["offset bias scale iron", "offset bias scales"]
    for names in map(str.split, ["offset"] if is_flat else together):
        names = [n for n in names if not is_force or n != "iron"]
        used = np.ones(len(y), dtype=bool)
        for _ in range(2):  # without what fits least
            used = (scatter := fit(names)[1]) <= np.quantile(scatter, _KEPT)
        factors, scatter = fit(names)
        least, start = max(float(scatter[used].mean()), 1e-12), 0
        best = 1.0 if least < 0.5 * still[used].mean() else math.inf
        # Alone, an offset also stands for a usual one of the rates.
        least += (usual * _BIAS * windows.seconds) ** 2 / 12.0 if is_flat else 0.0
        for name in names:
            smallest, largest, times, of_force = _ERRORS[name]
            value = factors[start : start + len(columns[name])]
            start += len(value)
            if "scales" in names and name != "scales":
                continue
            size = float(np.abs(value).max()) / (usual if name == "offset" else 1.0)
            ratio = float(fit([n for n in names if n != name])[1][used].mean()) / least
            share = ratio / (of_force if is_force else times)
            if size >= largest:  # the others make up for it
                best, line = math.inf, ""
            elif size > smallest and share > best:
                best = share
                line = _error_line(name, value, rates.names, sensor.names, is_force)
            if name == "offset" and ratio > _KNOWN:
                offset = value
        if line:
            break
    return offset, line


def _late_force(rates: Triad, force: Triad, dt: FloatArray) -> Iterator[str]:
    """A force whose sudden changes come later, or earlier, than those of the rates."""
    usual = float(np.median(dt))
    count = max(1, round(_STEP_S / max(usual, 1e-9)))
    block_s = count * usual
    if not (rates.new.all() and force.new.all()) or not 0.0 < block_s < _LATE_S:
        return

    def activity(values: FloatArray) -> FloatArray:
        end, width = len(values) // count * count, round(0.5 / block_s)
        means = values[:end].reshape(-1, count, 3).mean(axis=1)
        sizes = np.linalg.norm(np.diff(means, 2, axis=0), axis=1)
        sizes = np.log(sizes + np.percentile(sizes, 20.0) + 1e-12)
        sizes -= np.convolve(sizes, np.ones(width) / width, "same")
        return np.asarray(sizes / max(float(sizes.std()), 1e-12))

    span = round(_LATEST_S / block_s)
    if len(dt) // count < 10 * span:
        return
    inner = activity(rates.values)[span:-span]
    likeness = np.correlate(activity(force.values), inner, "valid") / len(inner)
    best, late_s = likeness.max(), np.arange(-span, span + 1) * block_s
    delay = late_s[likeness.argmax()]
    others = likeness[np.abs(late_s - delay) > _APART_S]
    is_clear = best * math.sqrt(len(inner)) > _ALIKE and others.max() < _OTHER * best
    if abs(delay) > _LATE_S and is_clear:
        how = "late" if delay > 0.0 else "early"
        text = f"{force.names}: {abs(delay):.2g} s {how} beside {rates.names}"
        yield f"{text}: correct the times of one"


def _rate_lines(rates: str, found: Sequence[_Finding | None]) -> Iterator[str]:
    """Lines about the rates, or about a vector where another one agrees with the rates."""
    findings = [f for f in found if f is not None]
    for f in findings:
        if f.stuck:
            yield f"{f.names}: do not turn as the rates {rates} say: a dead or held sensor?"
    agree = any(f.fits and f.cause is None for f in findings)
    wrong = [f for f in findings if f.cause is not None]
    names = " and ".join(f.names for f in wrong)
    if not wrong:
        unlike = " and ".join(f.names for f in findings if f.unlike)
        if unlike and not agree:
            text = "is a sensor dead, held or in another unit, or are its times wrong?"
            yield f"{rates}: do not explain how {unlike} turn: {text}"
        return
    cause = wrong[-1].cause or _Cause()  # of attitude, or field: nothing accelerates them
    if cause.late_s:
        is_vector = agree and len(wrong) == 1
        how = "late" if (cause.late_s > 0.0) == is_vector else "early"
        what, other = (names, rates) if is_vector else (rates, names)
        yield f"{what}: {abs(cause.late_s):.2g} s {how} beside {other}: correct the times of one"
    elif cause.about == "axes" and agree:
        yield f"{names}: do not turn as the rates {rates} say: wrong axes or signs"
    elif len(wrong) > 1:
        yield f"{rates}: contradict how {names} turn: {cause.text}"
    else:
        yield f"{rates} and {names} contradict each other: {cause.text}"


def _by_attitude(force: Triad, field: Triad | None, attitude: Triad) -> Iterator[str]:
    """Where the reference attitude does not take gravity up and the field north."""

    def mean(sensor: Triad) -> FloatArray:
        rows = sensor.new & attitude.new
        total = rotate(attitude.values[rows], sensor.values[rows]).sum(axis=0)
        length = float(np.linalg.norm(total))
        least = 0.3 * float(np.linalg.norm(sensor.values[rows], axis=1).sum())
        return np.asarray(total / length if length > least else np.full(3, np.nan))

    up, north = mean(force)[2], math.nan
    if field is not None and (field.new & attitude.new).any():
        m = mean(field)
        north = math.degrees(math.atan2(m[0], m[1]))
    if up < -0.5 and abs(north) < 60.0:
        yield f"{force.names}: point down by {attitude.names}: at rest a force points up"
    elif up < 0.5:
        text = f"{attitude.names}: take the force {math.degrees(math.acos(up)):.0f} deg from up"
        yield f"{text}: wanted the attitude from sensor to east, north, up"
    elif abs(north) > 150.0:
        yield f"{field.names if field else ''}: point south by {attitude.names}: a wrong sign?"
    elif abs(north) > 60.0:
        text = f"{attitude.names}: take the field {abs(north):.0f} deg from north: wanted axes"
        yield f"{text} east, north, up; --align heading removes a constant turn"


def _turned_back(windows: _Windows, sensor: Triad) -> FloatArray:
    """Mean (windows, 3) of a sensor, turned back by the rates."""
    every = np.arange(windows.count)
    means = windows.means(sensor.values, sensor.new)
    turns = windows.turns(np.eye(3)[None], every)
    return np.asarray(windows.turned_back(turns, means, every)[0])


def _weight(windows: _Windows, rates: Triad, force: Triad, dt: FloatArray) -> Iterator[str]:
    """A force whose mean, turned back, is not gravity: nothing falls, or climbs, all the time."""
    means = np.linalg.norm(_turned_back(windows, force), axis=1)
    if np.isfinite(means).sum() < _FEWEST or windows.seconds < 0.9 * _WEIGHT_S:
        return
    # The acceleration of a curve vanishes in a whole turn only.
    turns = np.linalg.norm(windows.steps.sum(axis=1), axis=1)
    speed = max(float(np.median(turns)) / windows.seconds, _BIAS)
    whole = _Windows(rates, dt, 2.0 * math.pi / speed, parts=1)
    usual, least = np.nanmedian(means), np.linalg.norm(_turned_back(whole, force), axis=1).min()
    if usual < _LIGHT:
        cause = "too little for gravity: are scale or rates wrong, or has the device removed it"
        yield f"{force.names}: a mean of {usual:.2g} m/s^2 over {windows.seconds:.2g} s, {cause}?"
    elif least > _HEAVY and (speed == _BIAS or whole.seconds > min(6.0 / speed, 60.0)):
        cause = "too much for gravity: is the scale wrong, or does it have an offset"
        yield f"{force.names}: a mean of {least:.2g} m/s^2 over {whole.seconds:.2g} s, {cause}?"


def _dip(windows: _Windows, force: Triad, field: Triad) -> Iterator[str]:
    """A field that points up, as in the southern hemisphere, or with a wrong sign."""
    f, m = (_turned_back(windows, sensor) for sensor in (force, field))
    size = np.linalg.norm(f, axis=1) * np.linalg.norm(m, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        sines = (f * m).sum(axis=1) / size
    if np.isfinite(sines).sum() < _FEWEST:
        return
    dip = math.degrees(math.asin(float(np.clip(np.nanmedian(sines), -1.0, 1.0))))
    if dip > 15.0:
        text = "right south of the magnetic equator; elsewhere the sign of one is wrong"
        yield f"{field.names}: point {dip:.0f} deg up by {force.names}: {text}"
