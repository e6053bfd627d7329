"""Records for a plain bench, with results of the integer model."""

from __future__ import annotations

import random
from collections.abc import Iterator

import numpy as np

from boresight.gateware.texts.core import Recorded
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import InPort, Program
from boresight.sim.levels.build import Build

#: Cycles of all records of a program together; minimum and maximum number of records.
_CYCLES, _RECORDS = 10_000, (6, 60)
#: A generated input moves by 1/8 of its range per record at most, and is missing in 1 of 8 records.
_MOVES, _MISSING = 8, 8


def recorded(build: Build) -> list[Recorded]:
    """Return records of every program from power-up on.

    Inputs are random walks within the declared ranges, the same on every machine; in the last
    record but one each input word is the largest one. All records of one program come before those
    of the next.
    """
    records = []
    for number, program in enumerate(build.programs):
        interval = build.core.parts[number].schedule.interval
        count = min(max(_CYCLES // interval, _RECORDS[0]), _RECORDS[1])
        rng = random.Random(program.name)
        ports = dict(zip(program.inputs, program.in_ports, strict=False))
        walks = [
            list(_walk(program, n, ports.get(n, InPort()), count, rng)) for n in program.inputs
        ]
        words = np.array(walks, dtype=np.int64).T
        words[-2] = program.arithmetic.max_int
        machine = Interpreter(program)
        answers = [machine.update(row[:, None]) for row in words]
        outputs = np.stack([out[:, 0] for out, _ in answers])
        saturated = np.array([bool(flag[0]) for _, flag in answers])
        records.append(Recorded(number, words, outputs, saturated, program.beyond(words)))
    return records


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
