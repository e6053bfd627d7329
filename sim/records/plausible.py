"""Warnings about sensor values that are implausible in their unit.

A wrong unit gives a bit-exact run without meaning, so the values are examined: a gyro that turns
ten times a second for minutes is probably in deg/s, a specific force of length one in g, and rates
that do not turn force and field have another unit, sign or axis (`turning`). This is a guess, so it
warns and never refuses.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from boresight.model.arrays import BoolArray, FloatArray
from boresight.model.estimator import Estimator
from boresight.sim.records.turning import Triad, contradictions

__all__ = ["warnings_of"]


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


def warnings_of(estimator: Estimator, inputs: FloatArray, new: BoolArray) -> tuple[str, ...]:
    """One line for each sensor with an implausible typical value, or with some axes missing.

    Parameters
    ----------
    inputs : (n, n_inputs)
        In the declared units.
    new : bool (n, n_inputs)
        New samples; others are ignored.
    """
    warnings = []
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
    warnings += _contradictions(estimator, inputs, new)
    dt = next((k for k, i in enumerate(estimator.inputs) if i.name == "dt"), None)
    if dt is not None and np.median(inputs[:, dt]) >= estimator.inputs[dt].high:
        warnings.append("dt: at the end of its range in most rows; is t in seconds?")
    return tuple(warnings)


def _looks(rule: _Rule, typical: float) -> str:
    """What a typical length looks like that is none of the rule's sensor."""
    for low, high, unit in rule.others:
        if low <= typical < high:
            return f"which looks like {unit}"
    if rule.unit == "m/s^2" and typical < rule.least:
        return "too little for gravity: is the sensor dead, or has the device removed it?"
    return f"where {rule.least:g} to {rule.most:g} would be plausible"


def _contradictions(estimator: Estimator, inputs: FloatArray, new: BoolArray) -> list[str]:
    """Rates against the turning of force and field, where the inputs have all of them."""
    triads = {
        estimator.inputs[columns[0]].unit: Triad(
            " ".join(names), inputs[:, columns], np.asarray(new[:, columns].all(axis=1))
        )
        for names, columns in _sensors(estimator)
        if len(columns) == 3
    }
    dt = next((k for k, i in enumerate(estimator.inputs) if i.name == "dt"), None)
    vectors = [triads[unit] for unit in ("m/s^2", "uT") if unit in triads]
    if dt is None or "rad/s" not in triads:
        return []
    return contradictions(triads["rad/s"], vectors, inputs[:, dt])


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
