"""A filter's covariance put to the test: millions of updates of the C model, positiveness, drift.

The stimulus is hostile on purpose: recorded motion, random motion, and manoeuvres at the limits
(full-scale spins, free fall, blows, a magnet at hand, samples missing, restarts, uneven steps), for
one initial covariance after the other. Watched are the diagonal after every update, the eigenvalues
at intervals, the saturation flag, and the difference to float64 runs on the same input.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from boresight.firmware.build import CModel
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, input_words, with_params
from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Kind, Program
from boresight.sim.attitude.accuracy import attitude_error
from boresight.sim.attitude.feed import attitude_of
from boresight.sim.attitude.rotation import (
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_normalise,
    rotate,
    rotation_vector_to_quaternion,
)

__all__ = ["MANOEUVRES", "CovarianceTrial", "covariance_trial", "manoeuvre"]

FloatArray = npt.NDArray[np.float64]

#: Stimuli that `manoeuvre` makes.
MANOEUVRES = (
    "still",
    "tumble",
    "spin",
    "blows",
    "free fall",
    "magnet",
    "gaps",
    "restarts",
    "uneven",
)
GRAVITY = 9.80665
_FIELD = np.array([0.0, 20.0, -44.0])  # uT
_ELEMENT = re.compile(r"p_?([0-9a-z])([0-9a-z])")


@dataclass(frozen=True)
class CovarianceTrial:
    """What `covariance_trial` found.

    Attributes
    ----------
    updates : int
        Updates of the C model.
    negative_diagonals : int
        Updates after which a variance was below zero.
    least_eigenvalue : float
        Smallest eigenvalue seen, in least significant bits of the covariance's words.
    eigenvalues_checked : int
        Covariances of which eigenvalues were taken.
    saturated : int
        Updates that raised the saturation flag.
    drift_deg : float
        Largest attitude difference to float64 at the end of a run of `compared` updates.
    compared : int
        Updates of each run that float64 repeated.
    """

    estimator: str
    updates: int
    negative_diagonals: int
    least_eigenvalue: float
    eigenvalues_checked: int
    saturated: int
    drift_deg: float
    compared: int

    @property
    def good(self) -> bool:
        """No variance below zero, no eigenvalue below the rounding of one word."""
        return self.negative_diagonals == 0 and self.least_eigenvalue >= -4.0

    def line(self) -> str:
        """One line for people."""
        return (
            f"{self.estimator}: {self.updates} updates, {self.negative_diagonals} with a "
            f"negative variance, least eigenvalue {self.least_eigenvalue:.1f} LSB of "
            f"{self.eigenvalues_checked}, {self.saturated} saturated, "
            f"{self.drift_deg:.5f} deg from float64 after {self.compared} updates"
        )


def manoeuvre(name: str, steps: int, rng: np.random.Generator, dt: float = 0.005) -> FloatArray:
    """Input records (steps, 10) in the order of every attitude estimator: dt, gyro, field, force.

    Raises
    ------
    InputError
        No such manoeuvre.
    """
    if name not in MANOEUVRES:
        raise InputError.at(
            "manoeuvre",
            wanted=f"one of {', '.join(MANOEUVRES)}",
            found=repr(name),
            fix="choose one of these",
        )
    t = dt * np.arange(steps)[:, None]
    rate = {"still": 0.0, "spin": 35.0}.get(name, 3.0)
    gyr = rate * np.sin(rng.uniform(0.2, 4.0, 3) * t + rng.uniform(0, 6.28, 3))
    if name == "spin":
        gyr[:] = rate * np.sign(gyr[:1])
    up, field = _turned(gyr, dt, rng)
    acc, mag = GRAVITY * up, field
    blow = rng.random((steps, 1)) < 0.05
    if name == "blows":
        acc = acc + blow * rng.uniform(-150.0, 150.0, (steps, 3))
    elif name == "free fall":
        acc = acc * (np.sin(0.5 * t) > 0.0)
    elif name == "magnet":
        mag = mag * (1.0 + 4.0 * blow) + 100.0 * rng.normal(size=3) * (np.sin(0.3 * t) > 0.5)
    elif name == "gaps":
        mag = mag * (rng.random((steps, 1)) < 0.1)
        mag[steps // 3 : 2 * steps // 3] = 0.0
    step = np.full((steps, 1), dt)
    if name == "restarts":
        step[rng.random(steps) < 0.002] = -dt
    elif name == "uneven":
        step = np.exp(rng.uniform(np.log(5e-4), np.log(0.24), (steps, 1)))
    noise = np.array([0.02] * 3 + [1.0] * 3 + [0.3] * 3)
    sensors = np.concatenate([gyr, mag, acc], axis=1)
    present = np.repeat([np.ones(steps), (mag != 0.0).any(axis=1), np.ones(steps)], 3, axis=0).T
    sensors = sensors + present * noise * rng.normal(size=sensors.shape)
    return np.concatenate([step, np.clip(sensors, -159.9, 159.9)], axis=1)


def _turned(gyr: FloatArray, dt: float, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Up and field in the body along a rotation."""
    turns = rotation_vector_to_quaternion(dt * gyr)
    q = np.empty((len(gyr), 4))
    at = quaternion_normalise(rng.normal(size=4))
    for k, turn in enumerate(turns):
        at = quaternion_multiply(at, turn)
        q[k] = at
    to_body = quaternion_conjugate(q)
    return rotate(to_body, np.array([0.0, 0.0, 1.0])), rotate(to_body, _FIELD)


def covariance_trial(
    estimator: Estimator,
    records: Mapping[str, FloatArray],
    *,
    updates: int,
    params: Sequence[Mapping[str, float]] = ({},),
    every: int = 50,
    compared: int = 2000,
    chunk: int = 20000,
    word: int = 32,
    progress: Callable[[str], None] | None = None,
) -> CovarianceTrial:
    """Run the C model over every stimulus with every parameter set.

    Parameters
    ----------
    records : mapping of (n, n_inputs) arrays
        Stimuli by name; each is repeated until its share of ``updates`` is done.
    params : sequence of mappings
        Parameter sets, for example one per initial covariance.
    every : int
        Updates between two covariances whose eigenvalues are taken.
    compared : int
        Leading updates of each stimulus that are repeated in float64; at most its length.

    Raises
    ------
    InputError
        The estimator has no states that are named as a covariance, ``p00``, ``p01``, ...
    """
    names = [s.name for s in estimator.states]
    keys = {m.group(1): None for m in map(_ELEMENT.fullmatch, names) if m}
    axes = list(keys)
    pairs = [
        (i, j, k)
        for k, m in enumerate(map(_ELEMENT.fullmatch, names))
        if m
        for i, j in [(axes.index(m.group(1)), axes.index(m.group(2)))]
    ]
    if len(pairs) < 3:
        raise InputError.at(
            estimator.name,
            wanted="states p00, p01, ...",
            found="no covariance",
            fix="choose a Kalman filter",
        )
    plain = estimator.compile(word=word)
    share = max(1, updates // (len(records) * len(params)))
    lsb = {k: plain.format(plain.states[k][0]).lsb for _, _, k in pairs}
    unit = min(lsb.values())
    total = negative = checked = saturated = 0
    least, drift = np.inf, 0.0
    model = CModel(plain)
    for values in params:
        given = with_params(plain, estimator, values)
        for number in given.of_kind(Kind.PARAM):
            model.set_param(given.values[number].name, given.values[number].initial)
        heads = {}
        for name, real in records.items():
            words = input_words(plain, real[:, :, None])[:, :, 0]
            model.reset()
            done = 0
            while done < share:
                at = done % len(words)
                part = words[at : at + min(chunk, share - done)]
                out, sat, states = model.trajectory(part)
                if done == 0:
                    heads[name] = out
                p = np.zeros((len(states), len(axes), len(axes)))
                for i, j, k in pairs:
                    p[:, i, j] = p[:, j, i] = states[:, k] * (lsb[k] / unit)
                negative += int((np.diagonal(p, axis1=1, axis2=2) < 0).any(axis=1).sum())
                some = p[::every]
                least = min(least, float(np.linalg.eigvalsh(some).min()))
                checked += len(some)
                saturated += int(sat.sum())
                done += len(part)
            total += done
            if progress is not None:
                progress(f"{estimator.name} {name} {dict(values)}: {total} of {updates}")
        n = min(compared, share, *(len(r) for r in records.values()))
        drift = max(
            drift, _drift(estimator, plain, values, {k: r[:n] for k, r in records.items()}, heads)
        )
    return CovarianceTrial(
        estimator.name, total, negative, least, checked, saturated, drift, compared
    )


def _drift(
    estimator: Estimator,
    program: Program,
    values: Mapping[str, float],
    records: Mapping[str, FloatArray],
    found: Mapping[str, IntArray],
) -> float:
    """Attitude difference [deg] to float64 over the last tenth of the records."""
    real = np.stack(list(records.values()), axis=2)
    n = len(real)
    tail = slice(n - max(1, n // 10), n)
    wanted = estimator.run_float(real, params=values).outputs
    worst = 0.0
    for k, out in enumerate(found.values()):
        fixed = {
            name: program.format(v).real(out[tail, c])
            for c, (name, v) in enumerate(zip(program.output_names, program.outputs, strict=True))
        }
        error = attitude_error(
            attitude_of(fixed), attitude_of({name: v[tail, k] for name, v in wanted.items()})
        )
        worst = max(worst, float(error.total.max()))
    return worst
