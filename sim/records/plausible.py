"""Warnings about sensor values that are implausible in their unit.

A wrong unit gives a bit-exact run without meaning, so the values are examined: a gyro that turns
ten times a second for minutes is probably in deg/s, a specific force of length one in g, and rates
that do not turn force and field have another unit, sign or axis. This is a guess, so it warns and
never refuses.

A vector v that is fixed in space turns in body axes by dv/dt = -w x v, so v x w dt is the change of
its direction. Unit, sign or axes of a sensor that are wrong show in a log whatever the size of its
values: the change is compared with v x (P w dt) for every matrix P that exchanges axes and signs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations, product
from typing import NamedTuple

import numpy as np

from boresight.model.arrays import BoolArray, FloatArray
from boresight.model.estimator import Estimator

__all__ = ["warnings_of"]

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


@dataclass(frozen=True)
class _Rule:
    """Plausible typical lengths for sensors with one unit, and what other lengths look like.

    ``others`` gives ends of lengths and a unit, or a cause, in rising order.
    """

    unit: str
    least: float
    most: float
    others: tuple[tuple[float, float, str], ...]
    wants_triple: bool = True
    #: Largest declared range of such a sensor.
    range_limit: float = math.inf


_RULES = (
    # 10 rad/s is 95 turns a minute, in half of all samples; motors turn faster than gyros measure.
    _Rule("rad/s", 0.0, 10.0, ((10.0, math.inf, "deg/s"),), False, 100.0),
    _Rule(
        "m/s^2",
        5.0,
        200.0,
        ((0.9, 1.1, "g (g0 in a header)"), (900.0, 1100.0, "mg (mg0 in a header)")),
    ),
    # The Earth's field is 22 to 67 uT.
    _Rule(
        "uT",
        7.0,
        150.0,
        (
            (1e-5, 1.5e-4, "tesla"),
            (1e-2, 0.15, "mT"),
            (0.15, 1.5, "gauss"),
            (150.0, 1500.0, "milligauss"),
            (1e4, 1.5e5, "nT"),
        ),
    ),
)
#: Largest over least length of the field, of 9 in 10 samples, without a magnet.
_UNEVEN = 2.5


def warnings_of(estimator: Estimator, inputs: FloatArray, new: BoolArray) -> tuple[str, ...]:
    """One line for each sensor with an implausible typical value, or with some axes missing.

    Parameters
    ----------
    inputs : (n, n_inputs)
        In the declared units.
    new : bool (n, n_inputs)
        New samples; others are ignored.
    """
    warnings, triads = list[str](), dict[str, _Triad]()
    for names, columns in _sensors(estimator):
        rows = new[:, columns].all(axis=1)
        incomplete = int((new[:, columns].any(axis=1) & ~rows).sum())
        if incomplete and len(columns) == 3:
            warnings.append(f"{' '.join(names)}: {incomplete} rows have some of them, not all")
        if not rows.any():
            continue
        declared = estimator.inputs[columns[0]]
        typical = float(np.median(np.linalg.norm(inputs[rows][:, columns], axis=1)))
        warnings += [
            f"{' '.join(names)}: typically {typical:.3g} {rule.unit}, {_looks(rule, typical)}"
            for rule in _RULES
            if rule.unit == declared.unit
            and (len(columns) == 3 or not rule.wants_triple)
            and not rule.least <= typical <= rule.most
            and (typical > 0.0 or rule.unit == "m/s^2")  # no field: no sample
            and rule.least < declared.high <= rule.range_limit
        ]
        if declared.unit == "uT" and len(columns) == 3 and typical > 0.0:
            lengths = np.linalg.norm(inputs[rows][:, columns], axis=1)
            low, high = np.percentile(lengths[lengths > 0.0], (5.0, 95.0))
            if high > _UNEVEN * low:
                warnings.append(
                    f"{' '.join(names)}: {low:.3g} to {high:.3g} uT in 9 of 10 samples: is there "
                    "a magnet or iron near, or an offset?"
                )
        if len(columns) == 3:
            triads[declared.unit] = _Triad(" ".join(names), inputs[:, columns], np.asarray(rows))
    dt = next((k for k, i in enumerate(estimator.inputs) if i.name == "dt"), None)
    if dt is not None and "rad/s" in triads:
        vectors = [triads[unit] for unit in ("m/s^2", "uT") if unit in triads]
        warnings += _contradictions(triads["rad/s"], vectors, inputs[:, dt])
    usual = 0.0 if dt is None else float(np.median(inputs[:, dt]))
    if dt is not None and (usual >= estimator.inputs[dt].high or usual < 0.0):
        warnings.append("dt: beyond its range in most rows; is t in seconds?")
    return tuple(warnings)


def _looks(rule: _Rule, typical: float) -> str:
    """What a typical length looks like that is none of the rule's sensor."""
    for low, high, unit in rule.others:
        if low <= typical < high:
            return f"which looks like {unit}"
    if rule.unit == "m/s^2" and typical < rule.least:
        return "too little for gravity: is the sensor dead, or has the device removed it?"
    return f"where {rule.least:g} to {rule.most:g} would be plausible"


def _sensors(estimator: Estimator) -> list[tuple[list[str], list[int]]]:
    """Groups of inputs with one unit whose names differ in a last x, y, z; others alone."""
    groups: dict[tuple[str, str], tuple[list[str], list[int]]] = {}
    for k, declared in enumerate(estimator.inputs):
        if declared.flags:
            continue
        is_axis = declared.name[-1:] in ("x", "y", "z")
        key = (declared.name[:-1] if is_axis else declared.name, declared.unit)
        names, columns = groups.setdefault(key, ([], []))
        names.append(declared.name)
        columns.append(k)
    return list(groups.values())


class _Triad(NamedTuple):
    """A sensor of three axes: names, values (n, 3), and rows with a sample (n,)."""

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


def _contradictions(rates: _Triad, vectors: Sequence[_Triad], dt: FloatArray) -> list[str]:
    """A line where rates [rad/s] and the turning of vectors contradict each other."""
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


def _fit(rates: _Triad, vector: _Triad, dt: FloatArray) -> _Fit | None:
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
