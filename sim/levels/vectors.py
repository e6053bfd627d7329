"""Records for a plain bench, with results of the integer model."""

from __future__ import annotations

import random
from collections.abc import Iterator
from functools import cache

import numpy as np

from boresight.gateware.texts.core import Recorded
from boresight.model.errors import InputError
from boresight.model.words.fixed import IntArray
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import InPort, Program
from boresight.sim.levels.build import Build
from boresight.sim.levels.integer import words_of
from boresight.sim.records.bundled import bundled
from boresight.sim.records.feed import feed
from boresight.sim.records.files import read_record
from boresight.sim.records.record import Record

#: Bundled log, and its first sample for the bench, during a motion.
_LOG, _FROM = "synthetic_60s", 4000
#: Cycles of all records of a program together; minimum and maximum number of records.
_CYCLES, _RECORDS = 10_000, (6, 60)
#: A generated input moves by 1/8 of its range per record at most, and is missing in 1 of 8 records.
_MOVES, _MISSING = 8, 8


def recorded(build: Build) -> list[Recorded]:
    """Return records of every program from power-up on.

    Inputs come from the bundled log if it has the estimator's columns, else from random walks
    within the declared ranges, the same on every machine; in the last record but one each input
    word is the largest one. All records of one program come before those of the next.
    """
    records = []
    for number, program in enumerate(build.programs):
        interval = build.core.parts[number].schedule.interval
        count = min(max(_CYCLES // interval, _RECORDS[0]), _RECORDS[1])
        words, source = _inputs(build, number, count)
        words[-2] = program.arithmetic.max_int
        machine = Interpreter(program)
        answers = [machine.update(row[:, None]) for row in words]
        outputs = np.stack([out[:, 0] for out, _ in answers])
        saturated = np.array([bool(flag[0]) for _, flag in answers])
        records.append(Recorded(number, words, outputs, saturated, program.beyond(words), source))
    return records


def _inputs(build: Build, number: int, count: int) -> tuple[IntArray, str]:
    """Words (count, n_inputs), and their source."""
    estimator, program = build.estimators[number], build.programs[number]
    try:
        inputs = feed(estimator, _log())
    except InputError:  # the log does not fit the estimator
        return _wandering(program, count), "random walks within the declared ranges"
    rows = inputs.inputs[_FROM : _FROM + count]
    return words_of(program, rows), f"{_LOG}, samples {_FROM} to {_FROM + count - 1}"


@cache
def _log() -> Record:
    return read_record(bundled(_LOG))


def _wandering(program: Program, count: int) -> IntArray:
    """Words of generated inputs."""
    rng = random.Random(program.name)
    ports = dict(zip(program.inputs, program.in_ports, strict=False))
    columns = [
        list(_walk(program, number, ports.get(number, InPort()), count, rng))
        for number in program.inputs
    ]
    return np.array(columns, dtype=np.int64).T


def _walk(
    program: Program, number: int, port: InPort, count: int, rng: random.Random
) -> Iterator[int]:
    """One input: steps within its range, at times the word for a missing sample."""
    value, form = program.values[number], program.format(number)
    low, high = int(form.quantise(value.low)), int(form.quantise(value.high))
    at = rng.randint(low, high)
    for _ in range(count):
        step = (high - low) // _MOVES
        at = min(max(at + rng.randint(-step, step), low), high)
        if port.flags:
            yield rng.choice((low, high))
        elif isinstance(port.missing, float) and not rng.randrange(_MISSING):
            yield int(form.quantise(port.missing))
        else:
            yield at
