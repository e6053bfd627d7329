"""Rates, force, field and reference attitude of a log against one another.

A vector v that is fixed in space turns in body axes by dv/dt = -w x v. Turned back by the rates,
R(t) v(t) with dR/dt = R [w x] is constant. Its scatter in windows of seconds shows a wrong unit,
sign, axis or time of a sensor, whatever the size of its values. Exchanged axes, a scale and a delay
are tried; a warning names the one that explains the windows better than the log as it is.

The force is the sum of gravity and an acceleration, whose mean over a window is the change of
velocity over its length. So its mean as a vector is judged, in long windows.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from itertools import permutations, product
from typing import NamedTuple

import numpy as np

from boresight.model.arrays import BoolArray, FloatArray, IntArray
from boresight.sim.rotations.rotation import (
    quaternion_conjugate,
    quaternion_multiply,
    rotate,
    rotation_vector_to_quaternion,
)

#: s: shortest block, whose mean is taken; shortest and longest window; a step that is a gap.
_BLOCK_S, _SHORT_S, _LONG_S, _GAP_S = 0.02, 1.0, 5.0, 0.5
#: Windows: parts of a short log, least number, most that are looked at, and blocks with a sample.
_PARTS, _FEWEST, _MOST, _FILLED = 12, 8, 64, 3
#: Scatter (mean square angle [rad^2]) that is noise, and that is a turn without doubt.
_NOISE, _TURN = 3e-4, 0.01
#: Share of the scatter that a cause explains; standard deviations of the count of windows.
_SHARE, _SURE = 0.1, 3.0
#: Scales of the rates, and delays [s], that are right.
_RIGHT, _ON_TIME_S = (0.9, 1.1), 0.05
#: What is tried: scales, finer ones around the best, and delays [s].
_SCALES, _FINE = np.geomspace(0.01, 100.0, 49), np.linspace(0.85, 1.15, 13)
_DELAYS_S = np.linspace(-1.0, 1.0, 51)
#: Share of the Earth's gravity, m/s^2, that a force has in most windows; shares of rates and their
#: changes in a turn that is steady.
_WEIGHT, _STEADY = 0.9 * 9.80665, 1e-3
#: An attitude that has left the rates: angle in a window, and number of windows.
_AWAY_DEG, _OFTEN = 30.0, 3
#: All matrices that exchange axes and signs; the first leaves them as they are.
_EXCHANGES = np.array(
    [
        np.eye(3)[list(order)] * np.array(signs)[:, None]
        for order in permutations(range(3))
        for signs in product((1.0, -1.0), repeat=3)
    ]
)
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
    """What makes rates fit: an exchange and a scale of theirs, or a delay [s] of the vector."""

    exchange: int = 0
    scale: float = 1.0
    late_s: float = 0.0


class _Finding(NamedTuple):
    """What a vector says about the rates; ``cause`` is None where it says that they are right.

    ``fits``: the rates explain how it turns. ``stuck``: it does not turn. ``unlike``: nothing that
    is known makes the rates fit.
    """

    names: str
    cause: _Cause | None
    fits: bool
    stuck: bool
    unlike: bool


class _Windows:
    """Blocks and windows of a log of rates, and the turn in each block."""

    def __init__(self, rates: Triad, dt: FloatArray, window_s: float) -> None:
        step = np.where((dt > 0.0) & (dt < _GAP_S), dt, 0.0)
        usual = float(np.median(step))
        self.block_s = max(_BLOCK_S, usual)
        time = np.cumsum(step) - 0.5 * usual  # ends of blocks lie between samples
        window_s = min(window_s, float(time[-1]) / _PARTS)
        self.blocks = max(2, round(window_s / self.block_s))
        self._block: IntArray = np.maximum(time / self.block_s, 0.0).astype(np.int64)
        self.count = (int(self._block[-1]) + 1) // self.blocks
        self._size = self.count * self.blocks
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
        """Turns (k, windows, blocks, 4) since a window's start, after each of k matrices."""
        halves = rotation_vector_to_quaternion(
            0.5 * np.einsum("kij,wbj->bkwi", matrices, self.steps[some])
        )
        turns, q = np.empty(halves.shape), np.broadcast_to([1.0, 0.0, 0.0, 0.0], halves.shape[1:])
        for k, half in enumerate(halves):
            turns[k] = quaternion_multiply(q, half)
            q = quaternion_multiply(turns[k], half)
        return np.moveaxis(turns, 0, 2)

    def turned_back(
        self, turns: FloatArray, v: FloatArray, some: IntArray, late: int = 0
    ) -> FloatArray:
        """Mean (k, windows, 3) of vectors (blocks, 3) that are late, turned back by turns."""
        index = some[:, None] * self.blocks + np.arange(self.blocks) + late
        inside = (index >= 0) & (index < self._size)
        values = np.where(inside[..., None], v[np.clip(index, 0, self._size - 1)], np.nan)
        known = np.isfinite(values[..., 0])
        count = np.where(known.sum(axis=1) < min(_FILLED, self.blocks), np.nan, known.sum(axis=1))
        back = rotate(turns, np.where(known[..., None], values, 0.0)).sum(axis=2)
        return np.asarray(back / count[:, None])


def contradictions(
    rates: Triad, force: Triad | None, field: Triad | None, attitude: Triad | None, dt: FloatArray
) -> tuple[list[str], bool]:
    """A line for each sensor, or reference attitude, that contradicts the others.

    The second result is whether the rates explain how one of the others turns.

    Parameters
    ----------
    rates, force, field : Triad
        rad/s, m/s^2, uT.
    attitude : Triad
        Quaternions from sensor to east, north, up.
    dt : (n,)
        Time steps [s].
    """
    speed = float(np.median(np.linalg.norm(rates.values[rates.new], axis=1)))
    short_s = min(max(1.0 / max(speed, 1e-9), _SHORT_S), _LONG_S)
    vectors = dict[str, tuple[_Windows, list[FloatArray]]]()
    short, long = (_Windows(rates, dt, s) for s in (short_s, _LONG_S))
    if force is not None:
        lengths = np.linalg.norm(force.values, axis=1)
        new = force.new & (lengths > 0.0)
        if new.any():
            vectors[force.names] = long, [long.means(force.values / np.median(lengths[new]), new)]
    if field is not None:
        lengths = np.linalg.norm(field.values, axis=1)
        new = field.new & (lengths > 0.0)
        units = field.values / np.where(new, lengths, 1.0)[:, None]
        vectors[field.names] = short, [short.means(units, new)]
    findings = [f for n, (w, v) in vectors.items() if (f := _finding(n, w, v, w is long))]
    own = None
    if attitude is not None:
        own = _finding(attitude.names, short, _axes(short, attitude.values, attitude.new), False)
        findings += [] if own is None else [own]
    lines = [*_rate_lines(rates.names, findings)]
    agree = any(f.fits and f.cause is None for f in findings)
    if own is not None and attitude is not None and not own.fits:
        for text, other in _OTHERS.items():
            turned = _axes(short, other(attitude.values), attitude.new)
            found = _finding(attitude.names, short, turned, False)
            if found is not None and found.fits and found.cause is None:
                line = f"{attitude.names}: turn otherwise than the rates {rates.names} say: {text}"
                others = [*_rate_lines(rates.names, [f for f in findings if f is not own])]
                return others or [line], agree
    if lines or force is None:
        return lines, agree
    if attitude is not None and attitude.new.any():
        lines = [*_by_attitude(force, field, attitude)]
    if not lines:
        lines = [*_weight(short, force)]
    if not lines and field is not None:
        lines = [*_dip(long, force, field)]
    return lines, agree


def departures(rates: Triad, attitude: Triad, dt: FloatArray) -> list[str]:
    """A line where an estimated attitude often turns otherwise than the rates."""
    windows = _Windows(rates, dt, _SHORT_S)
    some = np.arange(windows.count)
    turns = windows.turns(np.eye(3)[None], some)
    axes = _axes(windows, attitude.values, attitude.new)
    squares = [(windows.turned_back(turns, axis, some)[0] ** 2).sum(axis=-1) for axis in axes]
    away = int((1.0 - np.mean(squares, axis=0) > math.radians(_AWAY_DEG) ** 2).sum())
    if away < _OFTEN:
        return []
    seconds = windows.block_s * windows.blocks
    return [
        f"{attitude.names}: turn {_AWAY_DEG:.0f} deg or more otherwise than {rates.names} within "
        f"{seconds:.2g} s, in {away / len(some):.0%} of the log: the estimate diverges there "
        "(Euler angles past the vertical, gains, a range); compare another filter"
    ]


def _axes(windows: _Windows, q: FloatArray, new: BoolArray) -> list[FloatArray]:
    """East, north and up in body axes."""
    q = np.where(new[:, None], q, [1.0, 0.0, 0.0, 0.0])
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
    if without < 1e-3 * before and before > _TURN and not (is_force and steady):
        return _Finding(names, None, False, True, False)
    fits = before < 0.5 * without
    turns = windows.turns(np.eye(3)[None], some)
    delays = sorted({round(delay / windows.block_s) for delay in _DELAYS_S})
    causes = [_Cause(late_s=late * windows.block_s) for late in delays]
    scatters = [x for late in delays for x in scatter(turns, late)]
    exchanges = range(len(_EXCHANGES) if before > 0.1 * without else 0)
    causes += [_Cause(exchange=k) for k in exchanges] + [_Cause(scale=float(s)) for s in _SCALES]
    matrices = [_EXCHANGES[: len(exchanges)], _SCALES[:, None, None] * np.eye(3)]
    scatters += [*scatter(windows.turns(np.concatenate(matrices), some))]

    def best() -> int:
        enough = [np.isfinite(x).sum() >= _FEWEST for x in scatters]
        return int(
            np.argmin(
                [np.nanmean(x) if e else np.inf for x, e in zip(scatters, enough, strict=True)]
            )
        )

    if (scale := causes[best()].scale) != 1.0:
        causes += [_Cause(scale=float(s)) for s in scale * _FINE]
        scatters += [*scatter(windows.turns((scale * _FINE)[:, None, None] * np.eye(3), some))]
    late = round(causes[best()].late_s / windows.block_s)
    for near in (late - 1, late + 1) if late else ():
        causes.append(_Cause(late_s=near * windows.block_s))
        scatters += [*scatter(turns, near)]
    k = best()
    cause, after = causes[k], float(np.nanmean(scatters[k]))
    right = (
        cause.exchange == 0
        and _RIGHT[0] < cause.scale < _RIGHT[1]
        and abs(cause.late_s) < _ON_TIME_S
    )
    explains = after < 0.5 * without and (not is_force or after < 0.5 * before)
    if is_force and (cause.late_s or (cause.scale != 1.0 and not _is_degrees(cause.scale))):
        right = True  # turns with an acceleration, and sensors off the axis, look like it
    if not right and explains and _is_sure(scatters[k], as_is):
        return _Finding(names, cause, fits, False, False)
    unlike = not is_force and without > _TURN and before > 0.8 * without
    return _Finding(names, None, fits, False, unlike)


def _is_sure(after: FloatArray, before: FloatArray) -> bool:
    """Whether the scatter is less in surely more than half of the windows that differ."""
    less = before - after
    differ = np.abs(less) > np.maximum(0.05 * before, _NOISE)  # false for NaN
    count, fewer = int(differ.sum()), int((less[differ] > 0.0).sum())
    mean = float(np.nanmean(less))
    return mean > max(_NOISE, _SHARE * float(before.mean())) and (
        fewer - 0.5 * count > 0.5 * _SURE * math.sqrt(count)
    )


def _rate_lines(rates: str, findings: Sequence[_Finding]) -> Iterator[str]:
    """Lines about the rates, or about a vector where another one agrees with the rates."""
    for f in findings:
        if f.stuck:
            yield f"{f.names}: do not turn as the rates {rates} say: a dead or held sensor?"
    agree = any(f.fits and f.cause is None for f in findings)
    wrong = [f for f in findings if f.cause is not None]
    names = " and ".join(f.names for f in wrong)
    if not wrong:
        unlike = [f.names for f in findings if f.unlike]
        if unlike and not agree:
            yield (
                f"{rates}: do not explain how {' and '.join(unlike)} turn: is a sensor dead, "
                "held or in another unit, or are its times wrong?"
            )
        return
    cause = wrong[-1].cause  # of the attitude, or the field: nothing accelerates them
    assert cause is not None
    if cause.late_s:
        is_vector = agree and len(wrong) == 1
        how = "late" if (cause.late_s > 0.0) == is_vector else "early"
        what, other = (names, rates) if is_vector else (rates, names)
        yield f"{what}: {abs(cause.late_s):.2g} s {how} beside {other}: correct the times of one"
    elif cause.exchange and agree:
        yield f"{names}: turn otherwise than the rates {rates} say: wrong axes or signs"
    elif len(findings) > 1 and len(wrong) > 1:
        yield f"{rates}: contradict how {names} turn: {_text(cause)}"
    else:
        yield f"{rates} and {names} contradict each other: {_text(cause)}"


def _is_degrees(scale: float) -> bool:
    return 0.8 < math.degrees(scale) < 1.25


def _text(cause: _Cause) -> str:
    """What would make the rates fit."""
    if cause.exchange:
        signed = [
            f"{'-' if row.sum() < 0.0 else ''}{'xyz'[int(np.abs(row).argmax())]}"
            for row in _EXCHANGES[cause.exchange]
        ]
        if signed == ["-x", "-y", "-z"]:
            return "the sign is wrong"
        return f"axes or signs are wrong (the rates fit as {', '.join(signed)})"
    if _is_degrees(cause.scale):
        return "the rates look like deg/s"
    return f"the rates are {1.0 / cause.scale:.2g} times as large as they should be"


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
        yield (
            f"{attitude.names}: take the force {math.degrees(math.acos(up)):.0f} deg from up: "
            "wanted the attitude from sensor to east, north, up"
        )
    elif abs(north) > 150.0:
        yield f"{field.names if field else ''}: point south by {attitude.names}: a wrong sign?"
    elif abs(north) > 60.0:
        yield (
            f"{attitude.names}: take the field {abs(north):.0f} deg from north: wanted axes east, "
            "north, up; --align heading removes a constant turn"
        )


def _turned_back(windows: _Windows, sensor: Triad) -> FloatArray:
    """Mean (windows, 3) of a sensor, turned back by the rates."""
    every = np.arange(windows.count)
    new = sensor.new & (sensor.values != 0.0).any(axis=1)
    means = windows.means(sensor.values, new)
    turns = windows.turns(np.eye(3)[None], every)
    return np.asarray(windows.turned_back(turns, means, every)[0])


def _weight(windows: _Windows, force: Triad) -> Iterator[str]:
    """A force whose mean, turned back, is less than gravity: nothing falls most of the time."""
    means = np.linalg.norm(_turned_back(windows, force), axis=1)
    seconds = windows.block_s * windows.blocks
    if np.isfinite(means).sum() < _FEWEST or seconds < 0.9 * _SHORT_S:
        return
    if (usual := float(np.nanmedian(means))) < _WEIGHT:
        yield (
            f"{force.names}: a mean of {usual:.2g} m/s^2 over {seconds:.2g} s, too little for "
            "gravity: is the scale wrong, or has the device removed it?"
        )


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
        yield (
            f"{field.names}: point {dip:.0f} deg up by {force.names}: right south of the magnetic "
            "equator; elsewhere the sign of one is wrong"
        )
