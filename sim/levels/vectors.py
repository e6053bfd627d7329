"""Records for a plain bench, and what the integer model answers to them."""

from __future__ import annotations

import random
from collections.abc import Iterator
from functools import cache

import numpy as np
import numpy.typing as npt

from boresight.gateware.texts.bench import Recorded
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

__all__ = ["recorded"]

FloatArray = npt.NDArray[np.float64]

#: Bundled log and its first sample here, in the midst of a motion.
_LOG, _FROM = "synthetic_60s", 4000
#: Cycles of all records of a program together, and how many records that may be.
_CYCLES, _RECORDS = 10_000, (6, 60)
#: Part of its range by which a made-up input moves from record to record; how often it is missing.
_MOVES, _MISSING = 8, 8


def recorded(build: Build) -> list[Recorded]:
    """Records of every program from power-up on, programs that others read before those.

    From the bundled log where an estimator reads its columns, else words that wander within the
    declared ranges, the same on every machine. All records of one program come before those of the
    next.
    """
    found: dict[int, Recorded] = {}
    kept: dict[int, IntArray] = {}
    for number in build.order:
        program = build.programs[number]
        interval = build.core.parts[number].schedule.interval
        count = min(max(_CYCLES // interval, _RECORDS[0]), _RECORDS[1])
        words, source = _inputs(build, number, count)
        for column, (other, name) in build.links[number].items():
            place = build.programs[other].output_names.index(name)
            words[:, column] = kept[other][place]
        machine = Interpreter(program)
        answers = [machine.update(row[:, None]) for row in words]
        outputs = np.stack([out[:, 0] for out, _ in answers])
        saturated = np.array([bool(flag[0]) for _, flag in answers])
        kept[number] = outputs[-1]
        streamed = words[:, build.streamed(number)]
        found[number] = Recorded(number, streamed, outputs, saturated, source)
    return list(found.values())


def _inputs(build: Build, number: int, count: int) -> tuple[IntArray, str]:
    """Words (count, n_inputs), and where they are from; linked columns hold anything."""
    estimator, program = build.estimators[number], build.programs[number]
    try:
        given = feed(estimator, _log(), linked=build.links[number])
    except InputError:  # another estimator than the log is for
        return _wandering(program, count), "words that wander within the declared ranges"
    rows = given.inputs[_FROM : _FROM + count]
    return words_of(program, rows), f"{_LOG}, samples {_FROM} to {_FROM + count - 1}"


@cache
def _log() -> Record:
    return read_record(bundled(_LOG))


def _wandering(program: Program, count: int) -> IntArray:
    """Words of made-up inputs."""
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
    """One input: steps within its range, now and then the word that says "no sample"."""
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
