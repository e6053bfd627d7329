"""Integer model of a complete system's chain: from raw counts to words of estimators.

Computes the words of the update controller and the core (`gateware.attitude.system`) with the
integer interpreter.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from boresight.firmware.build import CModel
from boresight.gateware.attitude.system import programs as layout
from boresight.model.arrays import BoolArray, FloatArray
from boresight.model.attitude.front import STAMP_BITS
from boresight.model.words.fixed import IntArray, wrap
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Program
from boresight.sim.levels.registry import interpret

#: Kinds of lines of the compass.
NO_LINE, COUNTS, HEADING = 0, 1, 2


@dataclass(frozen=True)
class Samples:
    """Data of the sensor readers for n updates."""

    stamp: IntArray  #: (n,) clock cycle of each sample, modulo 2^32
    #: (n, 6) gyro x, y, z, in its range of +-300 deg/s, accelerometer x, y, z: multiples of 1/4.
    counts: FloatArray | IntArray
    #: (n,) `COUNTS` or `HEADING` where a line of the compass is fresh for the update.
    line: IntArray
    values: IntArray  #: (n, 3) numbers of that line: counts, or tenths of a degree
    #: (n,) updates that restart the filter, besides those after a gap; at least the first.
    restart: BoolArray
    filter: IntArray  #: (n,) number of the filter
    #: New words of input registers, which the first update has.
    feed: Mapping[str, int] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.stamp)


@dataclass(frozen=True)
class Chain:
    """Records and results of n updates."""

    records: IntArray  #: (n, most) words, padded with zeros to the longest record
    outputs: IntArray  #: (n, most) output words, padded likewise
    saturated: BoolArray  #: (n,) a value of the estimator was clamped
    beyond: BoolArray  #: (n,) an input word of it was beyond its declared range
    restart: BoolArray  #: (n,) the time step was negative
    saturations: dict[str, int]  #: updates by the name of the value that was clamped


def run_chain(programs: Sequence[Program], samples: Samples) -> Chain:
    """Run samples through the programs of a system's core, by number, with parameter values."""
    filters, n = len(programs) - len(layout.FRONT_NAMES), len(samples)
    feed = layout.feed_of(programs[:filters])
    sensed, field_words = calibrated(programs[filters:], samples)
    fresh = samples.line != NO_LINE
    # The words of the last line; zeros before the first one.
    last = np.maximum.accumulate(np.where(fresh, np.arange(n), -1))
    latest = np.where(last[:, None] >= 0, field_words[last], 0)
    names = programs[filters].output_names
    words = {layout.PLACES[name]: sensed[:, k] for k, name in enumerate(names)}
    words |= {address: latest[:, k] for k, address in enumerate(layout.FIELD)}
    words |= {layout.HELD + k: np.full(n, c) for k, c in enumerate(feed.constants)}
    words[layout.ZERO] = np.zeros(n, dtype=np.int64)
    for k, (name, value) in enumerate(feed.registers.items()):
        words[layout.REGISTERS + k] = np.full(n, samples.feed.get(name, layout.reset_word(value)))
    new_set = (np.arange(n) == 0) & bool(samples.feed)

    def column_of(fed: layout.Fed) -> IntArray:
        """The word of a record at each update."""
        if fed.absent is None:
            return words[fed.place]
        new = (fresh | (not fed.field)) & (new_set | (not fed.registers))
        return np.where(new, words[fed.place], words[fed.absent])

    clamped, beyond = np.zeros((2, n), dtype=np.bool_)
    saturations = dict[str, int]()
    records = np.zeros((n, max(len(p.inputs) for p in programs[:filters])), dtype=np.int64)
    outputs = np.zeros((n, max(len(p.outputs) for p in programs[:filters])), dtype=np.int64)
    for number, program in enumerate(programs[:filters]):
        rows = np.flatnonzero(samples.filter == number)
        if len(rows):
            inputs = np.column_stack([column_of(fed) for fed in feed.records[number]])[rows]
            out, saturated, _, _ = interpret(program, inputs)
            clamped[rows], beyond[rows] = saturated, program.beyond(inputs)
            if saturated.any():
                counts = CModel(program).observe(inputs).saturations
                saturations |= {program.values[k].name: int(n) for k, n in enumerate(counts) if n}
            outputs[rows, : out.shape[1]] = out
            records[rows, : inputs.shape[1]] = inputs
    restart = sensed[:, names.index("dt")] < 0
    return Chain(records, outputs, clamped, beyond, restart, saturations)


def calibrated(front: Sequence[Program], samples: Samples) -> tuple[IntArray, IntArray]:
    """Output words of `calibrate_inertial` (n, 7), and of the field (n, 3), 0 without a line.

    ``front`` are the programs before the estimators (`FRONT_NAMES`).
    """
    inertial, field_program, compass = front
    word, n = inertial.arithmetic.word, len(samples)
    stamps = wrap(samples.stamp, STAMP_BITS) >> (STAMP_BITS - word)
    changed = np.diff(samples.filter, prepend=samples.filter[:1]) != 0
    restart = np.where(samples.restart | changed, -(1 << (word - 1)), 0)
    counts = samples.counts * 2.0 ** inertial.format(inertial.inputs[0]).frac
    raw = np.column_stack([counts.astype(np.int64), stamps, restart])
    field_words = np.zeros((n, len(layout.FIELD)), dtype=np.int64)
    for kind, program in ((COUNTS, field_program), (HEADING, compass)):
        rows = np.flatnonzero(samples.line == kind)
        if len(rows):
            lines = samples.values[rows] << program.format(program.inputs[0]).frac
            field_words[rows] = Interpreter(program, len(rows)).update(lines.T)[0].T
    return interpret(inertial, raw)[0], field_words
