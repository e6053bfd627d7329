"""Warnings about sensor values that are implausible in their unit.

A wrong unit gives a bit-exact run without meaning, so the values are examined: a gyro that turns
ten times a second for minutes is probably in deg/s, a specific force of length one in g. This is a
guess, so it warns and never refuses.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from boresight.model.arrays import BoolArray, FloatArray
from boresight.model.estimator import Estimator

__all__ = ["warnings_of"]


@dataclass(frozen=True)
class _Rule:
    """Implausible typical lengths for sensors with one unit, and the probable unit."""

    unit: str
    implausible: Callable[[float], bool]
    looks: str
    wants_triple: bool = False
    #: Largest declared range of such a sensor.
    range_limit: float = math.inf


_RULES = (
    # 10 rad/s is 95 turns a minute, in half of all samples; motors turn faster than gyros measure.
    _Rule("rad/s", lambda typical: typical > 10.0, "deg/s", range_limit=100.0),
    _Rule("m/s^2", lambda typical: 0.9 < typical < 1.1, "g (g0 in a header)", wants_triple=True),
    _Rule(
        "m/s^2", lambda typical: 900.0 < typical < 1100.0, "mg (mg0 in a header)", wants_triple=True
    ),
    # The Earth's field is 22 to 67 uT.
    _Rule("uT", lambda typical: 0.15 < typical < 1.0, "gauss", wants_triple=True),
    _Rule("uT", lambda typical: 150.0 < typical < 1000.0, "milligauss", wants_triple=True),
    _Rule("uT", lambda typical: typical > 1e4, "nT", wants_triple=True),
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
        unit = estimator.inputs[columns[0]].unit
        typical = float(np.median(np.linalg.norm(inputs[rows][:, columns], axis=1)))
        warnings += [
            f"{' '.join(names)}: typically {typical:.3g} {unit}, which looks like {rule.looks}"
            for rule in _RULES
            if rule.unit == unit
            and (len(columns) == 3 or not rule.wants_triple)
            and rule.implausible(typical)
            and estimator.inputs[columns[0]].high <= rule.range_limit
        ]
    dt = next((k for k, i in enumerate(estimator.inputs) if i.name == "dt"), None)
    if dt is not None and np.median(inputs[:, dt]) >= estimator.inputs[dt].high:
        warnings.append("dt: at the end of its range in most rows; is t in seconds?")
    return tuple(warnings)


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
