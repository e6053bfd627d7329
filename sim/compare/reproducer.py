"""Where a level first differs, and a file that shows it: a program, states, one record."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from boresight.gateware.machine import MACHINES
from boresight.model.arrays import FloatArray
from boresight.model.errors import InputError
from boresight.model.tools.files import OutputFile
from boresight.model.words.fixed import IntArray
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Program
from boresight.sim.levels.build import Build
from boresight.sim.levels.integer import words_of
from boresight.sim.levels.level import Level
from boresight.sim.levels.registry import LEVELS
from boresight.sim.records.reading import kind_of, read_json
from boresight.sim.rtl.simulators import SimulationFailed

_WANTED = "a reproducer of `boresight check`"


def write_reproducer(
    file: OutputFile, at_step: Program, record: IntArray, step: int, *, config: str, level: str
) -> None:
    """Write the program with the states before ``step``, the record (n_inputs,), the right words.

    See `program_at`.
    """
    outputs, saturated = Interpreter(at_step).update(record[:, None])
    file.write(
        json.dumps(
            {
                "boresight_reproducer": 1,
                "level": level,
                "config": config,
                "step": int(step),
                "inputs": [[int(w) for w in record]],
                "outputs": [[int(w) for w in outputs[:, 0]]],
                "saturated": [bool(saturated[0])],
                "program": json.loads(at_step.to_json()),
                "sha256": _digest(at_step),
            },
            indent=1,
        )
        + "\n"
    )


def _digest(program: Program) -> str:
    return hashlib.sha256(program.to_json().encode()).hexdigest()


def load_reproducer(path: Path) -> dict[str, Any]:
    """Read a reproducer file, with the program under ``program``.

    Raises
    ------
    InputError
        It cannot be read, is something else, or its program or record was changed.
    """
    data = read_json(path, _WANTED)
    if not isinstance(data, dict):
        kind = kind_of(data)
    elif data.get("boresight_reproducer") != 1:
        kind = "another kind of JSON"
    else:
        try:
            data["program"] = Program.from_json(json.dumps(data.get("program")))
            if data.get("sha256") != _digest(data["program"]):
                raise ValueError
        except (AttributeError, KeyError, TypeError, ValueError):
            kind = "a program that was changed"
        else:
            try:
                _check_record(data)
                return data
            except ValueError as error:
                kind = str(error)
    raise InputError.at(
        str(path), wanted=_WANTED, found=kind, fix="give the file that boresight check wrote"
    )


def _check_record(data: dict[str, Any]) -> None:
    """Raise ValueError unless there is one record of words in and out, for a known machine."""
    program: Program = data["program"]
    low, high = program.arithmetic.min_int, program.arithmetic.max_int
    for key, count in (("inputs", len(program.inputs)), ("outputs", len(program.outputs))):
        rows = data.get(key)
        if not (
            isinstance(rows, list)
            and len(rows) == 1
            and isinstance(rows[0], list)
            and len(rows[0]) == count
            and all(type(word) is int and low <= word <= high for word in rows[0])
        ):
            raise ValueError(f"no record of {count} words in {key}")
    if data.get("config") not in list(MACHINES):
        raise ValueError(f"the config {kind_of(data.get('config'))}")


class _Saved(Build):
    """The program of a reproducer: there is no estimator."""

    def __init__(self, program: Program, config: str, target: str) -> None:
        super().__init__(config=config, word=program.arithmetic.word, target=target)
        self.programs = [program]


def replay_reproducer(
    path: Path,
    *,
    levels: Sequence[str] | None = None,
    simulator: str = "verilator",
    target: str = "xc6slx9",
) -> list[str]:
    """Run a reproducer on these levels, by default on every exact one that is usual.

    ``target`` is the part of the level netlist.

    Returns
    -------
    list of str
        A line for each level that differs.
    """
    data = load_reproducer(path)
    program: Program = data["program"]
    build = _Saved(program, data["config"], target)
    inputs = np.array(data["inputs"], dtype=np.int64)
    wanted = np.array(data["outputs"], dtype=np.int64)
    record = np.stack([program.format(n).real(inputs[:, k]) for k, n in enumerate(program.inputs)])
    lines = []
    chosen = (
        [name for name, level in LEVELS.items() if level.exact and level.usual]
        if levels is None
        else levels
    )
    for kind in (LEVELS[name] for name in chosen):
        tool = simulator if simulator in kind.tools else None
        try:
            with kind(build, tool=tool) as level:
                words = level.run(record.T).words
                if words is None or not np.array_equal(words, wanted):
                    lines.append(f"{kind.name}: outputs differ")
        except SimulationFailed as error:
            lines.append(f"{kind.name}: {error}")
    return lines


@dataclass(frozen=True)
class Divergence:
    """The first difference.

    ``cycle`` counts from the update's first input word; None for levels without cycles.
    """

    level: str
    step: int
    value: str
    cycle: int | None
    wanted: int
    found: int | None

    def __str__(self) -> str:
        at = "" if self.cycle is None else f", cycle {self.cycle}"
        value = "X" if self.found is None else str(self.found)
        return (
            f"{self.level}: first difference in value {self.value}, step {self.step}{at}: "
            f"wanted {self.wanted}, found {value}"
        )


def program_at(program: Program, before: IntArray | None) -> Program:
    """The program whose states begin with these words, (n_states,); None: with its own."""
    if before is None:
        return program
    values = list(program.values)
    for (state, _), word in zip(program.states, before, strict=True):
        values[state] = dataclasses.replace(values[state], initial=int(word))
    return dataclasses.replace(program, values=tuple(values))


def first_divergence(
    level: Level,
    pieces: Iterable[FloatArray],
    before: IntArray | None,
    step: int,
    *,
    first: int = 0,
    states: IntArray | None = None,
) -> Divergence | None:
    """Run a level up to ``step`` again, alone, and compare the values that it shows.

    Parameters
    ----------
    pieces : iterable of float64 (n, n_inputs)
        Records in their units, from update ``first`` on.
    before : int64 (n_states,), optional
        The interpreter's state words before the step; None: the initial ones.
    states : int64 (n_states,), optional
        Those before update ``first``, which the level begins with.
    """
    program = level.program if level.schedule is None else level.schedule.program
    machine = Interpreter(program_at(program, before))
    *earlier, last = _until(pieces, step - first)
    machine.update(words_of(level.program, last[-1])[:, None])
    wanted = [int(w[0]) for w in machine.values_before_commit()]
    for seen in level.words_of_update(last, earlier, states):
        if seen.word != wanted[seen.value]:
            name = program.values[seen.value].name
            return Divergence(level.name, step, name, seen.cycle, wanted[seen.value], seen.word)
    return None


def _until(pieces: Iterable[FloatArray], step: int) -> Iterator[FloatArray]:
    """Pieces up to a step, and with it."""
    rows = step + 1
    for piece in pieces:
        yield piece[:rows]
        rows -= len(piece)
        if rows <= 0:
            return
