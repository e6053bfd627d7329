"""Where a level first differs from the interpreter: named value, step, cycle."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from boresight.model.words.fixed import IntArray
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Program
from boresight.sim.levels.level import Level

__all__ = ["Divergence", "first_divergence", "program_at"]


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


def program_at(program: Program, states: IntArray, step: int) -> Program:
    """The program whose states begin with the words that they have before ``step``.

    ``states`` (n, n_states) are those after each update.
    """
    if not step:
        return program
    values = list(program.values)
    for (state, _), word in zip(program.states, states[step - 1], strict=True):
        values[state] = dataclasses.replace(values[state], initial=int(word))
    return dataclasses.replace(program, values=tuple(values))


def first_divergence(
    level: Level, records: npt.NDArray[np.float64], inputs: IntArray, states: IntArray, step: int
) -> Divergence | None:
    """Run a level up to ``step`` again, alone, and compare the values that it shows.

    Parameters
    ----------
    records, inputs : (n, n_inputs)
        In their units, and as words.
    states : int64 (n, n_states)
        The interpreter's state words after each update.
    """
    program = level.program if level.schedule is None else level.schedule.program
    machine = Interpreter(program_at(program, states, step))
    machine.update(inputs[step][:, None])
    wanted = [int(w[0]) for w in machine.values_before_commit()]
    for seen in level.words_of_update(records[: step + 1]):
        if seen.word != wanted[seen.value]:
            name = program.values[seen.value].name
            return Divergence(level.name, step, name, seen.cycle, wanted[seen.value], seen.word)
    return None
