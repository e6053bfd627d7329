"""Perturbations of a trial: from a nine-axis log to another one.

The truth goes along, so that every variant is judged by the same method. Chance is drawn from the
trial's name: the same trial and variant give the same log everywhere.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import replace
from itertools import permutations, product

import numpy as np
import numpy.typing as npt

from boresight.model.arrays import FloatArray
from boresight.model.declarations import GRAVITY
from boresight.sim.attitude.worlds.fast_turn import fast_turn
from boresight.sim.attitude.worlds.triad import misalignment, soft_iron
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.rotations.rotation import (
    matrix_to_quaternion,
    quaternion_conjugate,
    quaternion_multiply,
)

Variant = Callable[[NineAxis], NineAxis]

#: Gyro bias [deg/s] of the variants "bias": of size 0.71.
BIAS_DEG_S = (0.5, -0.4, 0.3)


def _rng(log: NineAxis, salt: int = 0) -> np.random.Generator:
    return np.random.default_rng([zlib.crc32(log.name.encode()), salt])


def _rows(log: NineAxis, rows: slice | npt.NDArray[np.intp]) -> NineAxis:
    """Some samples, with the time since the one before that is left."""
    t = log.t[rows]
    mov = None if log.mov is None else log.mov[rows]
    steps = np.diff(t, prepend=t[0] - log.dt[rows][0])
    q = None if log.q is None else log.q[rows]
    return NineAxis(log.name, t, log.gyr[rows], log.acc[rows], log.mag[rows], q, steps, mov)


def first_motion(log: NineAxis) -> int:
    """Row of the first sample that moves: 0 where the log does not say."""
    return int(np.argmax(log.counts))


def cut_in_motion(log: NineAxis, after_s: float = 2.0, place: int | None = None) -> NineAxis:
    """The log from ``after_s`` after its first movement; or from a random place of its movement.

    ``place`` numbers the draws, which lie in the first two thirds of the movement, at samples
    that move.
    """
    if place is None:
        start = log.t[first_motion(log)] + after_s
        return _rows(log, slice(int(np.searchsorted(log.t, start)), None))
    moving = np.flatnonzero(log.counts)
    return _rows(log, slice(int(moving[int(_rng(log, place).uniform() * len(moving) / 1.5)]), None))


def biased(log: NineAxis, scale: float = 1.0) -> NineAxis:
    """The gyro off by `BIAS_DEG_S` times ``scale``."""
    offset = np.radians(scale * np.asarray(BIAS_DEG_S))
    return replace(log, gyr=log.gyr + offset)


def warming(log: NineAxis, time_s: float = 60.0) -> NineAxis:
    """The gyro's bias grows to `BIAS_DEG_S` as it warms up, 1 - exp(-t/time_s)."""
    growth = -np.expm1(-(log.t - log.t[0]) / time_s)[:, None]
    return replace(log, gyr=log.gyr + growth * np.radians(BIAS_DEG_S))


def resampled(log: NineAxis, rate_hz: float) -> NineAxis:
    """At another rate: gyro, force and field are means over the new steps, held where it is higher.

    The integral of each sensor is read off at the new times, linearly between samples; the
    attitude is the chord between its neighbours.
    """
    start = log.t[0] - log.dt[0]
    edges = np.concatenate([[start], log.t])
    count = int((log.t[-1] - start) * rate_hz)
    times = start + np.arange(count + 1) / rate_hz

    def means(values: FloatArray) -> FloatArray:
        sums = np.concatenate([np.zeros((1, 3)), np.cumsum(values * log.dt[:, None], axis=0)])
        read = np.stack([np.interp(times, edges, column) for column in sums.T], axis=1)
        return np.diff(read, axis=0) * rate_hz

    t = times[1:]
    upper = np.clip(np.searchsorted(log.t, t - 1e-9), 1, len(log) - 1)
    share = ((t - log.t[upper - 1]) / (log.t[upper] - log.t[upper - 1]))[:, None]
    q = None
    if log.q is not None:
        low, high = log.q[upper - 1], log.q[upper]
        high = np.where((low * high).sum(axis=1, keepdims=True) < 0.0, -high, high)
        q = low + np.clip(share, 0.0, 1.0) * (high - low)
        q /= np.linalg.norm(q, axis=1, keepdims=True)
    mov = None if log.mov is None else log.mov[upper]
    steps = np.full(count, 1.0 / rate_hz)
    return NineAxis(log.name, t, means(log.gyr), means(log.acc), means(log.mag), q, steps, mov)


def slower(log: NineAxis, factor: float) -> NineAxis:
    """`resampled` at the log's own rate over a factor."""
    return resampled(log, 1.0 / (factor * float(np.median(log.dt))))


def scaled_field(log: NineAxis, factor: float) -> NineAxis:
    """The magnetometer's sensitivity off by a factor."""
    return replace(log, mag=log.mag * factor)


def hard_iron(log: NineAxis, share: float, draw: int = 0) -> NineAxis:
    """The magnetometer off by a constant vector, of so large a share of the field.

    ``draw`` numbers its directions.
    """
    direction = _rng(log, draw).standard_normal(3)
    size = share * np.nanmedian(np.linalg.norm(log.mag, axis=1))
    return replace(log, mag=log.mag + size * direction / np.linalg.norm(direction))


def mountings() -> FloatArray:
    """The 24 turns (24, 3, 3) of a cube into itself; the first turns nothing."""
    out = [
        np.eye(3)[list(order)] * np.array(signs, dtype=np.float64)[:, None]
        for order in permutations(range(3))
        for signs in product((1, -1), repeat=3)
    ]
    return np.array([m for m in out if np.linalg.det(m) > 0.0])


def mounted(log: NineAxis, number: int) -> NineAxis:
    """The sensor turned in its housing: one of `mountings`."""
    c = mountings()[number]
    rotation = quaternion_conjugate(matrix_to_quaternion(c))
    q = None if log.q is None else quaternion_multiply(log.q, rotation)
    return replace(log, gyr=log.gyr @ c.T, acc=log.acc @ c.T, mag=log.mag @ c.T, q=q)


def magnetometer_at(log: NineAxis, rate_hz: float) -> NineAxis:
    """New samples of the field at this rate only."""
    turn = np.floor((log.t - log.t[0]) * rate_hz + 1e-9)
    new = np.diff(turn, prepend=-1.0) > 0.0
    return replace(log, mag=np.where(new[:, None], log.mag, np.nan))


def without_field(log: NineAxis, seconds: float | None = None) -> NineAxis:
    """No field for so long, from the middle of the log on; or never any."""
    start = 0.5 * (log.t[0] + log.t[-1])
    blind = np.ones(len(log), dtype=np.bool_)
    if seconds is not None:
        blind = (log.t >= start) & (log.t < start + seconds)
    return replace(log, mag=np.where(blind[:, None], np.nan, log.mag))


def clipped(log: NineAxis, limit: float) -> NineAxis:
    """The accelerometer's range is this [m/s^2]."""
    return replace(log, acc=np.clip(log.acc, -limit, limit))


def clipped_to_share(log: NineAxis, sensor: str, share: float) -> NineAxis:
    """The full scale of a sensor, "gyr" or "acc", is a share of the log's largest component.

    Of the accelerometer it is gravity and a share of what the largest component has beyond it.
    """
    values = getattr(log, sensor)
    offset = GRAVITY if sensor == "acc" else 0.0
    limit = offset + share * max(float(np.abs(values).max()) - offset, 0.0)
    return replace(log, **{sensor: np.clip(values, -limit, limit)})


def fast_turns(log: NineAxis, count: int = 8) -> NineAxis:
    """So many times in its movement the sensor turns at 1 to 1.5 of its gyro's full scale.

    It does so for 20 to 200 ms about a random axis, with rise and fall (`fast_turn`); full scale
    is the largest component of the log's own rate. The turns begin in parts of equal length.
    """
    rng = _rng(log)
    full_scale = float(np.abs(log.gyr).max())
    moving = log.t[log.counts]
    edges = np.linspace(moving[0], moving[-1], count + 1)
    for begin, length in zip(edges[:-1], np.diff(edges), strict=True):
        direction = rng.standard_normal(3)
        rate = rng.uniform(1.0, 1.5) * full_scale / np.abs(direction).max()
        log = fast_turn(
            log,
            begin_s=begin + rng.uniform(0.0, 0.5) * length,
            rate_rad_s=rate * direction,
            seconds=rng.uniform(0.02, 0.2),
        )
    return replace(log, gyr=np.clip(log.gyr, -full_scale, full_scale))


def uncalibrated(log: NineAxis) -> NineAxis:
    """Sensors as they come: errors of axes, drawn with these standard deviations.

    Scale 1 % and misalignment 0.5 deg of gyro and accelerometer, 0.1 m/s^2 of the accelerometer's
    bias, 5 % of soft iron.
    """
    rng = _rng(log)

    def axes() -> FloatArray:
        scale = np.diag(1.0 + 0.01 * rng.standard_normal(3))
        return np.asarray(scale @ misalignment(rng, np.radians(0.5)))

    gyr, acc = log.gyr @ axes().T, log.acc @ axes().T
    acc = acc + 0.1 * rng.standard_normal(3)
    return replace(log, gyr=gyr, acc=acc, mag=log.mag @ soft_iron(rng, 0.05).T)


def gaps(log: NineAxis, share: float = 0.02, longest: int = 20) -> NineAxis:
    """A share of the samples never comes, in runs of up to ``longest``; times tell of it.

    The gyro's mean rate is lost with them.
    """
    rng = _rng(log)
    present = np.ones(len(log), dtype=np.bool_)
    count = round(2.0 * share * len(log) / (1 + longest))
    for first in rng.integers(1, len(log), count):
        present[first : first + int(rng.integers(1, longest + 1))] = False
    return _rows(log, np.flatnonzero(present))


def noisier(log: NineAxis, factor: float = 3.0) -> NineAxis:
    """White noise so many times as large, by adding the difference.

    The noise of a sensor is estimated from its second differences where they are small: the
    quietest tenth of the log in stretches of a tenth of a second.
    """
    rng = _rng(log)
    gyr, acc, mag = (_with_noise(v, factor, rng) for v in (log.gyr, log.acc, log.mag))
    return replace(log, gyr=gyr, acc=acc, mag=mag)


def _with_noise(values: FloatArray, factor: float, rng: np.random.Generator) -> FloatArray:
    second = np.diff(values[~np.isnan(values[:, 0])], n=2, axis=0)
    width = 32
    blocks = second[: len(second) // width * width].reshape(-1, width, 3)
    if not len(blocks):
        return values
    # the variance of a second difference of white noise is six times that of a sample
    variance = np.quantile(blocks.var(axis=1), 0.1, axis=0) / 6.0
    sd = np.sqrt((factor**2 - 1.0) * variance)
    return np.asarray(values + sd * rng.standard_normal(values.shape))
