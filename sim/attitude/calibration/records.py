"""What records of raw counts hold: rests, the turns between them, lines of the compass.

A record has the columns of `boresight monitor --log`: ``t`` [s], ``gx_counts`` to ``az_counts``,
and ``mx_counts`` to ``mz_counts``, empty between lines of the compass. ``stamp`` [cycles, modulo
2^32] is the board's time, if it is there; ``computer`` [s], or else ``t``, is the computer's. A
sighted attitude stands in ``qw`` to ``qz``, or in ``heading``, ``pitch`` and ``roll`` [deg], in one
row of its rest or in all.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from boresight.model.arrays import BoolArray, FloatArray
from boresight.model.attitude.front.affine import AXES
from boresight.model.attitude.front.inertial import GAP_S, STAMP_BITS
from boresight.model.declarations import QUATERNION
from boresight.model.errors import InputError
from boresight.sim.records.record import Record, check_norm
from boresight.sim.rotations.rotation import euler_to_quaternion

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
    """Find rests, turns and lines in records.

    Raises
    ------
    InputError
        A missing column or value, a record that is too short.
    """
    raw = [_columns(record, INERTIAL) for record in records]
    lines = [_columns(record, LINE, gaps=True) for record in records]
    if np.isnan(np.concatenate(lines)).all():
        raise InputError.at(
            "records",
            wanted="lines of the compass with its counts",
            found="none",
            fix="record with --write compass_mode=counts --write magnetic_source=counts",
        )
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


def _columns(record: Record, names: Sequence[str], *, gaps: bool = False) -> FloatArray:
    """Columns of counts (n, k); raises InputError without one, or without a value."""
    for name in names:
        if name not in record.columns:
            raise InputError.at(
                record.where,
                wanted=f"raw counts {names[0]} to {names[-1]}",
                found=f"no column {name}",
                fix="take a log of boresight monitor --log",
            )
    values = np.column_stack([record.values(name, "counts") for name in names])
    missing = np.isnan(values)
    wrong = missing.any(axis=1) & ~missing.all(axis=1) if gaps else missing.any(axis=1)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise InputError.at(
            record.place(row, names[int(np.argmax(missing[row]))]),
            wanted="a value",
            found="none",
            fix="correct or remove the row",
        )
    return values


def _sights(record: Record) -> FloatArray:
    """Sighted attitudes (n, 4); NaN without one."""
    if all(name in record.columns for name in QUATERNION):
        q = np.column_stack([record.numbers(name) for name in QUATERNION])
        check_norm(record, q)
        return q
    if all(name in record.columns for name in SIGHT):
        angles = np.column_stack([record.values(name, "deg") for name in SIGHT])
        return euler_to_quaternion(np.radians(angles))
    return np.full((len(record), 4), np.nan)


def _clock(record: Record) -> tuple[FloatArray, Tick | None]:
    """Times [s], and the stamp's period against them."""
    t = np.cumsum(record.steps()) if "t" not in record.columns else record.values("t", "s")
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
        if len(counts) < size:
            raise InputError.at(
                record.where,
                wanted=f"{_WINDOW_S:g} s or more",
                found=f"{len(counts)} rows",
                fix="record for longer",
            )
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
