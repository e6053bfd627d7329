"""Warnings about sensor values that are implausible in their unit.

A wrong unit gives a bit-exact run without meaning, so values are examined: a gyro that turns ten
times a second for minutes is probably in deg/s. So are samples that repeat, or pile up at an end,
and how the sensors turn (`turning`). This is a guess, so it warns and never refuses.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from itertools import chain, combinations

import numpy as np

from boresight.model.arrays import BoolArray, FloatArray, is_held
from boresight.model.declarations import QUATERNION, Input
from boresight.model.estimator import Estimator
from boresight.model.units import UnitError, linear
from boresight.sim.records.turning import Triad, contradictions, departures

#: Least samples of a sensor that is said to have stopped.
_SOME = 20
#: Samples at an end of the values: least number, times those in the 2 % beside it, and least finest
#: steps from end to end.
_AT_END, _CROWD, _STEPS = 5, 2.0, 200.0
#: Least share of the log that a sensor lacks at the end.
_ENDED = 0.05


#: By unit: least and most plausible typical length, largest declared range, and what other lengths
#: look like. 10 rad/s is 95 turns a minute, in half of all samples; motors turn faster than gyros
#: measure. The Earth's field is 22 to 67 uT.
_RULES: dict[str, tuple[float, float, float, dict[str, tuple[float, float]]]] = {
    "rad/s": (0.0, 10.0, 100.0, {"deg/s": (10.0, math.inf)}),
    "m/s^2": (
        *(5.0, 200.0, math.inf),
        {"g (g0 in a header)": (0.9, 1.1), "mg (mg0 in a header)": (900.0, 1100.0)},
    ),
    "uT": (
        *(7.0, 150.0, math.inf),
        {
            "tesla": (1e-5, 1.5e-4),
            "mT": (1e-2, 0.15),
            "gauss": (0.15, 1.5),
            "milligauss": (150.0, 1500.0),
            "nT": (1e4, 1.5e5),
        },
    ),
}
#: Largest over least length of the field, of 9 in 10 samples, without a magnet.
_UNEVEN = 4.0
#: s: shortest time step of a gyro.
_FASTEST_S = 2e-5
#: s, and share of the samples around: an axis that stands still for so long, but changes otherwise.
_STILL_S, _CHANGING = 1.0, 0.5


def warnings_of(
    estimator: Estimator,
    inputs: FloatArray,
    new: BoolArray,
    truth: Mapping[str, FloatArray] | None = None,
    clamped: Mapping[str, int] | None = None,
    units: Mapping[str, str | None] | None = None,
) -> tuple[str, ...]:
    """One line for each sensor with implausible values, or with some axes missing.

    ``inputs`` are in the declared units, ``units`` those that the log states; samples that are not
    ``new`` are ignored. ``truth``: the log's attitude, among others, NaN where it has none.
    ``clamped``: samples beyond their range.
    """
    steps_s, warnings, uneven = _steps_s(estimator, inputs), list[str](), False
    triads = dict[str, Triad]()
    implausible, still = dict[str, list[str]](), dict[str, list[str]]()
    for columns in _sensors(estimator):
        declared, is_triad = estimator.inputs[columns[0]], len(columns) == 3
        sensor = _triad(estimator, columns, inputs, new)
        names, values, rows = sensor
        incomplete = int((new[:, columns].any(axis=1) & ~rows).sum())
        if incomplete and is_triad:
            warnings.append(f"{names}: {incomplete} rows have some of them, not all")
        if not rows.any():
            continue
        warnings += _ended(names, rows)
        is_field, is_force = (is_triad and declared.unit == unit for unit in ("uT", "m/s^2"))
        zeros = rows & (values == 0.0).all(axis=1)
        if zeros.any() and (is_field or (is_force and (rows & ~zeros).any())):
            text = f"{names}: 0 in {zeros.sum()} samples: is the sensor dead?"
            warnings.append(text + " leave what is not new empty" * is_field)
            sensor = sensor._replace(new=rows & ~zeros)
            if not sensor.new.any():
                continue
        lengths = np.linalg.norm(values[sensor.new], axis=1)
        unlikely = _unlikely(names, len(columns), declared, float(np.median(lengths)))
        if declared.unit == "rad/s" and (units or {}).get(declared.name) not in (None, "rad/s"):
            unlikely = []  # converted from deg/s, however fast they are
        warnings += unlikely
        if declared.name != "dt":
            warnings += _held(sensor, timed=steps_s is not None)
        if is_triad:
            triads[declared.unit], implausible[declared.unit] = sensor, unlikely
            clamps = any(estimator.inputs[k].clamp for k in columns)
            ends = [] if clamps else [*_at_ends(sensor)]
            warnings += ends
            still[declared.unit] = [] if steps_s is None or ends else [*_still(sensor, steps_s)]
        if is_field and not (unlikely or still["uT"]):
            low, high = np.percentile(lengths, (5.0, 95.0))
            uneven = bool(high > _UNEVEN * low)
            text = f"{names}: {low:.3g} to {high:.3g} uT in 9 of 10 samples: is there a magnet or "
            warnings += [f"{text}iron near, or an offset?"] * uneven
    warnings += chain.from_iterable(still.values())
    rates = triads.get("rad/s")
    if steps_s is not None and rates is not None:
        force = None if implausible.get("m/s^2") else triads.get("m/s^2")
        field = None if uneven else triads.get("uT")  # which is not that of the Earth
        lines, agree = contradictions(rates, force, field, _attitude(truth or {}), steps_s)
        if agree:  # however fast they are
            warnings = [text for text in warnings if text not in implausible["rad/s"]]
        warnings += [] if any(still.values()) else lines
    usual = 0.0 if steps_s is None else float(np.median(steps_s))
    if usual < 0.0 or 2 * (clamped or {}).get("dt", 0) > len(inputs):
        warnings.append("dt: beyond its range in most rows; is t in seconds?")
    elif rates is not None and 0.0 < usual < _FASTEST_S:
        warnings.append(f"dt: typically {usual:.2g} s, less than of any gyro; is t in seconds?")
    return tuple(warnings)


def estimate_warnings(
    estimator: Estimator, inputs: FloatArray, new: BoolArray, outputs: Mapping[str, FloatArray]
) -> list[str]:
    """A line where an estimated attitude does not turn as its rates say, in rows that are new."""
    attitude, steps_s = _attitude(outputs), _steps_s(estimator, inputs)
    for columns in _sensors(estimator):
        is_rates = len(columns) == 3 and estimator.inputs[columns[0]].unit == "rad/s"
        if is_rates and attitude is not None and steps_s is not None:
            names, values, rows = _triad(estimator, columns, inputs, new)
            rows &= steps_s >= 0.0  # a step below 0 restarts the estimator
            values = np.where(rows[:, None], values, np.nan)
            return departures(Triad(names, values, rows), attitude, steps_s)
    return []


def _triad(estimator: Estimator, columns: list[int], inputs: FloatArray, new: BoolArray) -> Triad:
    names = " ".join(estimator.inputs[k].name for k in columns)
    return Triad(names, inputs[:, columns], np.asarray(new[:, columns].all(axis=1)))


def _steps_s(estimator: Estimator, inputs: FloatArray) -> FloatArray | None:
    """The input ``dt`` in seconds; None without one, or in a unit that is no time."""
    for k, declared in enumerate(estimator.inputs):
        if declared.name == "dt":
            with suppress(UnitError):
                return inputs[:, k] * linear(declared.unit or "s", "s")[0]
    return None


def _attitude(values: Mapping[str, FloatArray]) -> Triad | None:
    """The quaternions of a truth, or of outputs."""
    if not values.keys() >= {*QUATERNION}:
        return None
    q = np.stack([values[name] for name in QUATERNION], axis=1)
    length = np.linalg.norm(q, axis=1, keepdims=True)
    known = np.isfinite(length) & (length > 0.5)
    q = q / np.where(known, length, 1.0)
    return Triad(" ".join(QUATERNION), q, known[:, 0])


def _unlikely(names: str, axes: int, declared: Input, typical: float) -> list[str]:
    """A line about a typical length that is none of a sensor with the unit."""
    if declared.unit not in _RULES or (axes != 3 and declared.unit != "rad/s"):
        return []
    least, most, range_limit, others = _RULES[declared.unit]
    if least <= typical <= most or not least < declared.high <= range_limit:
        return []
    looks = f"where {least:g} to {most:g} would be plausible"
    if declared.unit == "m/s^2" and typical < least:
        looks = "too little for gravity: is the sensor dead, or has the device removed it?"
    for unit, (low, high) in others.items():
        if low <= typical < high:
            looks = f"which looks like {unit}"
    return [f"{names}: typically {typical:.3g} {declared.unit}, {looks}"]


def _sensors(estimator: Estimator) -> list[list[int]]:
    """Columns of inputs with one unit whose names differ in a last x, y, z; others alone."""
    groups = dict[tuple[str, str], list[int]]()
    for k, declared in enumerate(estimator.inputs):
        if not declared.flags:
            stem = re.sub("[xyz]$", "", declared.name)
            groups.setdefault((stem, declared.unit), []).append(k)
    return list(groups.values())


def _ended(names: str, rows: BoolArray) -> Iterator[str]:
    """A sensor whose samples end long before the log does."""
    at = np.flatnonzero(rows)
    behind = len(rows) - 1 - int(at[-1])
    longest = max(int(np.diff(at).max(initial=0)), int(at[0]))
    if len(at) > _SOME and behind > max(_ENDED * len(rows), 3 * longest):
        yield f"{names}: no sample in the last {behind} of {len(rows)} rows: did the sensor stop?"


def _held(sensor: Triad, *, timed: bool) -> Iterator[str]:
    """Samples that are held; a model is ``timed`` if it takes the time step of a thinner log."""
    values = sensor.values[sensor.new]
    if is_held(values):
        share = (np.diff(values, axis=0) == 0.0).all(axis=1).mean()
        text = f"{sensor.names}: {share:.0%} of the samples repeat the one before: is the sensor"
        yield f"{text} slower? leave what is not new empty" + ", or thin the log by --every" * timed


def _is_noisy(steps: FloatArray) -> bool:
    """Whether nearly all steps of a sensor are changes, often to and fro."""
    to_and_fro = (steps[1:] * steps[:-1] < 0.0).sum()
    return bool((steps != 0.0).sum() > _CHANGING * len(steps) and to_and_fro > 0.05 * len(steps))


def _still(sensor: Triad, dt: FloatArray) -> Iterator[str]:
    """An axis without noise, in all samples or for a while, or that is another one."""
    names, values = sensor.names.split(), sensor.values[sensor.new]
    steps = np.diff(values, axis=0)
    is_noisy = [_is_noisy(steps[:, k]) for k in range(3)]
    for j, k in combinations(range(3), 2):
        if (sensor.values[:, j] == sensor.values[:, k]).all() and is_noisy[j]:
            text = f"{names[k]} is {names[j]} in every sample"
            yield f"{sensor.names}: {text}: is a column there twice?"
            return
    step_s = float(np.median(dt)) / float(sensor.new.mean())
    # A turn about an axis, without noise, leaves the length as it is.
    lengths = np.linalg.norm(values, axis=1)
    is_turn = np.ptp(lengths) < 1e-9 * lengths.max()
    for k, name in enumerate(names):
        changes = np.flatnonzero(np.concatenate([[True], steps[:, k] != 0.0, [True]]))
        first = int(np.diff(changes).argmax())
        start, end = changes[first : first + 2].tolist()
        text, value = f"{sensor.names}: {name}", f"{values[start, k] + 0.0:.4g}"
        if end - start > len(steps):
            if len(steps) > _AT_END and sum(is_noisy) - is_noisy[k] == 2 and not is_turn:
                yield f"{text} is {value} in every sample: is the axis dead?"
                return
            continue
        seconds = (end - start) * step_s
        if seconds > _STILL_S and _is_noisy(np.delete(steps[:, k], slice(start, end))):
            lasts = f"stays at {value} for {seconds:.3g} s"
            yield f"{text} {lasts}: is the sensor held or dead there?"
            return


def _at_ends(sensor: Triad) -> Iterator[str]:
    """Axes whose samples pile up at their largest or least value, while others change."""
    values = sensor.values[sensor.new]
    changes = np.ones(values.shape, bool)
    changes[1:] = np.diff(values, axis=0) != 0.0
    found = dict[str, int]()
    for k, name in enumerate(sensor.names.split()):
        largest, steps = np.abs(values[:, k]).max(), np.abs(np.diff(values[:, k]))
        finest = min(steps[steps > 1e-6 * largest], default=math.inf)
        varied = np.delete(changes, k, axis=1).all(axis=1)
        for end in (values[:, k].min(), values[:, k].max()):
            off = np.abs(values[:, k] - end)
            count = int((varied & (off == 0.0)).sum())
            beside = int(((off > 0.0) & (off < 0.02 * off.max())).sum())
            is_fine = off.max() >= max(_STEPS * finest, 1e-9 * largest)
            is_outer = 2.0 * abs(end) >= largest
            least = max(_AT_END, _CROWD * beside)
            if is_fine and is_outer and least < count < len(values) // 2:
                found[f"{name} {end:.4g}"] = count
    if found:
        text = f"{sensor.names}: {sum(found.values())} samples are at an end ({', '.join(found)})"
        yield f"{text}: are they clipped? choose a larger range of the sensor"
