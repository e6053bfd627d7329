"""Where a level first differs from the interpreter: named value, step, cycle."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from boresight.model.arrays import FloatArray
from boresight.model.words.fixed import IntArray
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Program
from boresight.sim.levels.integer import words_of
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
