"""The chain of a complete system in integers: raw counts in, attitude words out.

What the conductor and the core do with samples (`gateware.system`), word for word, by the integer
interpreter; and how a log becomes the raw counts that the sensors would have sent.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from boresight.gateware.system.plan import FRONT_NAMES, RECORD
from boresight.model.front.compass_field import TENTH_HT
from boresight.model.front.field import FIELD_SCALE
from boresight.model.front.inertial import ACC_SCALE, GYRO_SCALE, STAMP_BITS
from boresight.model.words.fixed import IntArray, wrap
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Program
from boresight.sim.attitude.rotation import quaternion_to_euler
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Column, Record
from boresight.sim.records.segments import interpret

__all__ = [
    "COUNTS",
    "HEADING",
    "NO_LINE",
    "Chain",
    "Samples",
    "field_words",
    "heading_words",
    "inertial_words",
    "quantise",
    "run_chain",
    "words_as_record",
]

#: Kinds of lines of the compass.
NO_LINE, COUNTS, HEADING = 0, 1, 2
#: Full scale of the sensor in counts, at any range: 300 deg/s and 5 g (the maker's figures).
GYRO_COUNTS, ACC_COUNTS = 24000, 20000

FloatArray = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Samples:
    """What the readers give for n updates.

    Attributes
    ----------
    stamp : int (n,)
        Clock cycle of each sample, modulo 2^32.
    counts : int (n, 6)
        Gyro x, y, z, accelerometer x, y, z.
    line : int (n,)
        `COUNTS` or `HEADING` where a line of the compass is fresh for the update, else `NO_LINE`.
    values : int (n, 3)
        The numbers of that line: counts, or tenths of a degree of heading, pitch, roll.
    restart : bool (n,)
        Updates that restart the filter besides those after a gap: at least the first.
    filter : int (n,)
        Number of the filter for each update.
    """

    stamp: IntArray
    counts: IntArray
    line: IntArray
    values: IntArray
    restart: Flags
    filter: IntArray

    def __len__(self) -> int:
        """Count the updates."""
        return len(self.stamp)


@dataclass(frozen=True)
class Chain:
    """What comes of them.

    Attributes
    ----------
    records : int (n, 10)
        The filter's input words (`gateware.system.plan.RECORD`).
    outputs : int (n, n_outputs)
        The filter's output words.
    saturated : bool (n,)
        A value of the filter was clamped.
    restart : bool (n,)
        The time step was negative.
    """

    records: IntArray
    outputs: IntArray
    saturated: Flags
    restart: Flags


def run_chain(programs: Sequence[Program], samples: Samples) -> Chain:
    """Run samples through calibration and filters.

    Parameters
    ----------
    programs : sequence of Program
        Those of the system's core, by number, with the parameters' values in them.
    samples : Samples
        What comes in.
    """
    filters = len(programs) - len(FRONT_NAMES)
    inertial, field, compass = programs[filters:]
    word, n = inertial.arithmetic.word, len(samples)
    stamps = wrap(samples.stamp, STAMP_BITS) >> (STAMP_BITS - word)
    changed = np.diff(samples.filter, prepend=samples.filter[:1]) != 0
    restart = np.where(samples.restart | changed, -(1 << (word - 1)), 0)
    frac = inertial.format(inertial.inputs[0]).frac
    raw = np.column_stack([samples.counts << frac, stamps, restart])
    calibrated = interpret(inertial, raw).outputs
    records = np.zeros((n, len(RECORD)), dtype=np.int64)
    for k, name in enumerate(inertial.output_names):
        records[:, RECORD.index(name)] = calibrated[:, k]
    place = [RECORD.index(name) for name in field.output_names]
    for kind, program in ((COUNTS, field), (HEADING, compass)):
        rows = np.flatnonzero(samples.line == kind)
        if len(rows):
            lines = samples.values[rows] << program.format(program.inputs[0]).frac
            machine = Interpreter(program, len(rows))
            records[rows[:, None], place] = machine.update(lines.T)[0].T
    outputs = np.zeros((n, len(programs[0].outputs)), dtype=np.int64)
    saturated = np.zeros(n, dtype=np.bool_)
    for number in range(filters):
        rows = np.flatnonzero(samples.filter == number)
        if len(rows):
            run = interpret(programs[number], records[rows])
            outputs[rows], saturated[rows] = run.outputs, run.saturated
    return Chain(records, outputs, saturated, records[:, RECORD.index("dt")] < 0)


def quantise(
    record: Record,
    *,
    clock_hz: float = 100e6,
    kind: int = COUNTS,
    line_hz: float = 8.0,
    number: int = 0,
) -> Samples:
    """A nine-axis record as what an ADIS16385 and an HMR3300 would have sent.

    Sensor axes are body axes. Rates and forces beyond the sensors' full scale are clamped there.

    Parameters
    ----------
    clock_hz : float
        Clock that the stamps count.
    kind : int
        Lines of the compass: `NO_LINE`, `COUNTS` (of the record's field) or `HEADING` (of its
        reference attitude).
    line_hz : float
        Most lines in a second.
    number : int
        Filter.

    Raises
    ------
    InputError
        Headings are wanted of a record without reference attitude.
    """
    log = NineAxis.of(record)
    n = len(log)
    stamp = np.rint((log.t - log.t[0]) * clock_hz).astype(np.int64)
    q = None if kind != HEADING else log.attitude
    here = log.mag_new if q is None else np.isfinite(q).all(axis=1)
    line = np.full(n, NO_LINE)
    due = log.t[0]
    for k in np.flatnonzero(here) if kind != NO_LINE else ():
        if log.t[k] >= due:
            line[k] = kind
            due = max(due + 1.0 / line_hz, log.t[k])
    values = np.zeros((n, 3), dtype=np.int64)
    rows = line != NO_LINE
    if q is not None:
        values[rows] = heading_words(q[rows])
    elif kind == COUNTS:
        values[rows] = field_words(log.mag[rows])
    restart = np.zeros(n, dtype=np.bool_)
    restart[0] = True
    return Samples(
        stamp % (1 << STAMP_BITS), inertial_words(log), line, values, restart, np.full(n, number)
    )


def inertial_words(log: NineAxis) -> IntArray:
    """Counts (n, 6) of the gyro and the accelerometer."""
    return np.column_stack(
        [_counts(log.gyr, GYRO_SCALE, GYRO_COUNTS), _counts(log.acc, ACC_SCALE, ACC_COUNTS)]
    )


def field_words(mag: FloatArray) -> IntArray:
    """Counts (n, 3) of the compass for fields [uT]."""
    return _counts(mag, FIELD_SCALE, 32767)


def heading_words(q: FloatArray) -> IntArray:
    """Tenths of a degree (n, 3) of the compass for attitudes (n, 4): heading, pitch, roll."""
    pitch, roll, heading = quaternion_to_euler(q).T / np.pi
    angles = np.rint(np.stack([-heading, pitch, roll], axis=1) / TENTH_HT).astype(np.int64)
    angles[:, 0] %= 3600
    return angles


def _counts(value: FloatArray, scale: float, limit: int) -> IntArray:
    return np.clip(np.rint(value / scale), -limit, limit).astype(np.int64)


def words_as_record(program: Program, chain: Chain, name: str = "words") -> Record:
    """The records of a chain in SI units, exactly: `sim.records.feed` gives the words back.

    Parameters
    ----------
    program : Program
        A filter, for the formats of its inputs.
    """
    real = {
        name: program.format(n).real(chain.records[:, k])
        for k, (name, n) in enumerate(zip(RECORD, program.inputs, strict=True))
    }
    return Record(name, {n: Column(v) for n, v in real.items()})
