"""Warnings about rates that contradict how force and field turn in the sensor's axes.

A vector v that is fixed in space turns in body axes by dv/dt = -w x v, so v x w dt is the change of
its direction. Unit, sign or axes of a sensor that are wrong show in a log whatever the size of its
values: the change is compared with v x (P w dt) for every matrix P that exchanges axes and signs.
This is a guess, so it warns and never refuses.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations, product

import numpy as np

from boresight.model.arrays import BoolArray, FloatArray

__all__ = ["Triad", "contradictions"]

#: s, between two directions: slow enough for noise, fast enough for turns.
_STEP_S = 0.1
#: Pairs of directions from which on a comparison counts, and least share that it explains.
_PAIRS, _EXPLAINED = 40, 0.5
#: Ratios of rates that are taken as right.
_RIGHT = (0.6, 1.6)
_DEGREES = 180.0 / np.pi
#: All matrices that exchange axes and signs; the first leaves them as they are.
_EXCHANGES = [
    np.eye(3)[list(order)] * np.array(signs)[:, None]
    for order in permutations(range(3))
    for signs in product((1.0, -1.0), repeat=3)
]


@dataclass(frozen=True, eq=False)
class Triad:
    """Samples of a sensor with three axes.

    Attributes
    ----------
    names : str
        Of its three inputs.
    values : float64 (n, 3)
    new : bool (n,)
        Rows with a sample.
    """

    names: str
    values: FloatArray
    new: BoolArray


@dataclass(frozen=True, eq=False)
class _Fit:
    """How a vector turns: as the rates after an exchange of axes, times a factor."""

    names: str
    exchange: FloatArray
    factor: float
    fits: bool


def contradictions(rates: Triad, vectors: Sequence[Triad], dt: FloatArray) -> list[str]:
    """A line where rates and vectors contradict each other.

    Parameters
    ----------
    rates : Triad
        Angular rates [rad/s].
    vectors : sequence of Triad
        Specific force and magnetic field, as far as there are.
    dt : float64 (n,)
        Steps [s] that end at each row.
    """
    fits = [fit for v in vectors if (fit := _fit(rates, v, dt)) is not None]
    wrong = [fit for fit in fits if not fit.fits]
    if not wrong:
        return []
    names = " and ".join(fit.names for fit in wrong)
    cause = _cause(wrong[0])
    if len(wrong) < len(fits):
        return [f"{names}: turn otherwise than the rates {rates.names} say: wrong axes or signs"]
    if len(fits) > 1:
        return [f"{rates.names}: contradict how {names} turn: {cause}"]
    return [f"{rates.names} and {names} contradict each other: {cause}"]


def _fit(rates: Triad, vector: Triad, dt: FloatArray) -> _Fit | None:
    """How a vector turns; None where the log does not tell."""
    used = vector.new & rates.new & (np.linalg.norm(vector.values, axis=1) > 0.0)
    if not used.any():
        return None
    step = np.where((dt > 0.0) & (dt < 5.0 * _STEP_S), dt, 0.0)
    time, angle = np.cumsum(step), np.cumsum(rates.values * step[:, None], axis=0)
    _, block = np.unique(np.floor(time[used] / _STEP_S), return_inverse=True)
    count = np.bincount(block)

    def mean(x: FloatArray) -> FloatArray:
        return np.stack([np.bincount(block, column) / count for column in x[used].T], axis=1)

    v, turn = mean(vector.values), np.diff(mean(angle), axis=0)
    v /= np.maximum(np.linalg.norm(v, axis=1, keepdims=True), 1e-12)
    change, middle = np.diff(v, axis=0), 0.5 * (v[1:] + v[:-1])
    near = np.diff(mean(time[:, None])[:, 0]) < 4.0 * _STEP_S
    near &= np.linalg.norm(change, axis=1) < 0.7
    if near.sum() < _PAIRS:
        return None
    change, middle, turn = change[near], middle[near], turn[near]
    total, shares, factors = float((change**2).sum()), [], []
    for exchange in _EXCHANGES:
        expected = np.cross(middle, turn @ exchange.T)
        power, common = float((expected**2).sum()), float((expected * change).sum())
        factors.append(common / power if power else 0.0)
        shares.append(max(common, 0.0) ** 2 / (power * total) if power and total else 0.0)
    best = int(np.argmax(shares))
    if shares[best] < _EXPLAINED:
        return None
    if shares[0] > 0.5 * shares[best]:
        best = 0
    fits = best == 0 and _RIGHT[0] < factors[0] < _RIGHT[1]
    return _Fit(vector.names, _EXCHANGES[best], factors[best], fits)


def _cause(fit: _Fit) -> str:
    """What would make the rates fit."""
    causes = []
    if not (fit.exchange == np.eye(3)).all():
        signed = [
            f"{'-' if row.sum() < 0.0 else ''}{'xyz'[int(np.abs(row).argmax())]}"
            for row in fit.exchange
        ]
        causes.append(
            "the sign is wrong"
            if signed == ["-x", "-y", "-z"]
            else f"axes or signs are wrong (the rates fit as {', '.join(signed)})"
        )
    if not _RIGHT[0] < fit.factor < _RIGHT[1]:
        degrees = _RIGHT[0] < fit.factor * _DEGREES < _RIGHT[1]
        causes.append(
            "the rates look like deg/s"
            if degrees
            else f"the rates are {1.0 / fit.factor:.3g} times as large as they should be"
        )
    return "; ".join(causes)
