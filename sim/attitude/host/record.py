"""A board's record as a log: the inputs of its filter, its outputs, and the raw counts.

`log_of` makes from frames of kind SENSED the words that the filter had, by the integer models
of the programs before it. A level that computes bit by bit then has the board's outputs, which are
the columns ``NAME_true``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from boresight.gateware.attitude.system.attitude_frame import FIELDS, Update
from boresight.gateware.attitude.system.plan import FRONT_NAMES
from boresight.gateware.description import Description
from boresight.model.arrays import BoolArray, FloatArray, IntArray
from boresight.model.attitude.front import FRONT
from boresight.model.errors import InputError
from boresight.model.estimator import with_params
from boresight.model.words.program import Program
from boresight.sim.attitude.board.chain import COUNTS, HEADING, NO_LINE, Samples, calibrated
from boresight.sim.records.record import TRUTH, Column, Record

_RAW = tuple(f"{s}{a}_counts" for s in "ga" for a in "xyz")
_FIELD = tuple(f"m{a}_counts" for a in "xyz")
_ANGLES = ("compass_heading_deg", "compass_pitch_deg", "compass_roll_deg")


def _flag(updates: Sequence[Update], name: str) -> BoolArray:
    return np.array([FIELDS[name].of(u.flags << 16) for u in updates], dtype=np.bool_)


def log_of(
    source: str,
    updates: Sequence[Update],
    numbers: Sequence[int],
    described: Description | None,
    written: Mapping[str, int],
) -> tuple[Record, list[str]]:
    """Return the log of one filter's updates from its initial states on, and notes.

    ``t`` [s] from the first row on; the inputs of the filter; its outputs as ``NAME_true``;
    ``number``, ``stamp`` [cycles] and ``flags`` of the frame; the counts of the ADIS16385 (of
    +-300 deg/s), and of the compass's line its counts or its angles, empty without a new one.
    Numbers are exact. ``restart`` is 1 where the filter began anew from its initial states.

    Parameters
    ----------
    source : str
        Port or file, for messages.
    updates : sequence of Update
        What came, with the ``numbers`` of `track_of`.
    written : mapping of str to int
        Words of parameters that the host has written, by register.

    Raises
    ------
    InputError
        No frame of kind SENSED, none that begins from initial states, no register map, or a filter
        with inputs from registers.
    """
    if described is None or not described.parameters_of(FRONT_NAMES[0]):
        raise InputError.at(
            "--log",
            wanted="the register map of the complete system",
            found="none" if described is None else f"that of a {described.title}",
            fix="add --map registers.json",
        )
    has_counts = np.array([u.sensed is not None for u in updates], dtype=np.bool_)
    begins = _flag(updates, "initial_states") & has_counts
    if not begins.any():
        count, raw_count = len(updates), int(has_counts.sum())
        raise InputError.at(
            source,
            wanted="updates with counts, from the filter's initial states on",
            found=f"{raw_count} of {count} updates with counts, none of them from initial states",
            fix="record from the port, or write output_mode=record, then order=8",
        )
    first = int(np.argmax(begins))
    filter = np.array([u.filter for u in updates])
    ends = np.flatnonzero((~has_counts | (filter != filter[first]))[first:])
    last = first + int(ends[0]) if len(ends) else len(updates)
    rows, number = updates[first:last], np.asarray(numbers[first:last])
    notes = []
    if last < len(updates):
        what = "the filter changes" if has_counts[last] else "the counts end"
        notes.append(f"the record ends after {last - first} rows, where {what}")
    gaps = np.flatnonzero(np.diff(number) != 1)
    if len(gaps):
        notes.append(f"an update is missing after row {gaps[0] + 1}: replay is exact up to there")
    program, names = described.programs[filter[first]], {r.name for r in described.registers}
    if registers := [w.name for w in program.inputs if f"feed_{w.name}" in names]:
        raise InputError.at(
            f"--log, {program.program}",
            wanted="a filter whose inputs all come from the sensors",
            found=f"input registers {', '.join(registers)}",
            fix="record another filter",
        )
    sensed = [u.sensed for u in rows if u.sensed is not None]
    stamp, flags = np.array([(u.stamp, u.flags) for u in rows], dtype=np.int64).T
    counts, line, words = (
        np.array([getattr(s, name) for s in sensed]) for name in ("counts", "line", "outputs")
    )
    used, is_counts = _flag(rows, "field_used"), _flag(rows, "field_counts")
    kind = np.where(used, np.where(is_counts, COUNTS, HEADING), NO_LINE)
    asked, number_of = _flag(rows, "restart_asked"), np.full(len(rows), filter[first])
    front = []
    for name in FRONT_NAMES:
        estimator = FRONT[name]()
        values = described.parameters_of(name, written)
        front.append(with_params(estimator.compile(word=32), estimator, values))
    inputs, field = calibrated(front, Samples(stamp, counts, kind, line, asked, number_of))
    tick_s = described.parameters_of(FRONT_NAMES[0], written)["tick_s"]
    ticks = np.cumsum(np.diff(stamp, prepend=stamp[0]) % 2**32)
    columns = {"t": Column(ticks * tick_s, "s"), **_columns(front[0], inputs)}
    for name, column in _columns(front[1], field).items():
        columns[name] = Column(np.where(used, column.values, np.nan), column.unit)
    for k, out in enumerate(program.outputs):
        columns[f"{out.name}{TRUTH}"] = Column(words[:, k] * 2.0**-out.frac, out.unit)
    raw = {"number": number, "stamp": stamp, "flags": flags}
    raw |= dict(zip(_RAW, counts.T, strict=True))
    for names_of, of, unit in ((_FIELD, COUNTS, 1.0), (_ANGLES, HEADING, 0.1)):
        raw |= dict(zip(names_of, np.where(kind == of, line.T * unit, np.nan), strict=True))
    restart = _flag(rows, "initial_states")
    if restart[1:].any():
        raw["restart"] = restart & (np.arange(len(rows)) > 0)
    columns |= {name: Column(values.astype(float)) for name, values in raw.items()}
    return Record(source, columns), notes


def _columns(program: Program, words: IntArray) -> dict[str, Column]:
    """Outputs of a program, by name."""
    outputs = zip(FRONT[program.name].outputs, program.outputs, words.T, strict=True)
    return {o.name: Column(program.format(k).real(w), o.unit) for o, k, w in outputs}


def static_noise(record: Record) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Mean and variance of the sensors at rest, as in Table 2 of Ma Long et al. (2014).

    Parameters
    ----------
    record : Record
        Of a board that stands still: rates ``g`` [rad/s], specific forces ``a`` [m/s^2] and fields
        ``m`` [uT], in body axes. A straight line over time is taken off before the variance, so
        that warming does not count.

    Returns
    -------
    dict
        For "gyro", "accelerometer" and "magnetometer": mean (3,), and variance (3,) in the square
        of that unit; the mean of the gyro is its bias, as long as the turn of the Earth is small
        beside it. NaN with fewer than 3 samples.
    """
    out = {}
    for letter, name in (("g", "gyro"), ("a", "accelerometer"), ("m", "magnetometer")):
        values = np.column_stack([record.numbers(f"{letter}{a}") for a in "xyz"])
        new = np.isfinite(values).all(axis=1)
        at, x = record.numbers("t")[new], values[new]
        if len(x) < 3:
            out[name] = (np.full(3, np.nan), np.full(3, np.nan))
            continue
        line = np.column_stack([np.ones(len(x)), at - at.mean()])
        fit, *_ = np.linalg.lstsq(line, x, rcond=None)
        out[name] = (fit[0], np.square(x - line @ fit).sum(axis=0) / (len(x) - 2))
    return out
