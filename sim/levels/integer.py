"""Integers: the interpreter, which says what is right, and the emitted C."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from boresight.firmware.build import CModel
from boresight.model.estimator import input_words, param_words
from boresight.model.words.fixed import IntArray
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Program
from boresight.sim.levels.level import Run, run_of_words

__all__ = ["Emitted", "Interpreted", "words_of"]

FloatArray = npt.NDArray[np.float64]


def words_of(program: Program, records: FloatArray) -> IntArray:
    """Input words (n, n_inputs) of records in their units; beyond the word they clamp."""
    return input_words(program, records[:, :, None])[:, :, 0]


class Interpreted:
    """The integer interpreter, one update after the other."""

    name = "fixed"

    def __init__(self, program: Program) -> None:
        self.program = program
        self.reset()

    def reset(self) -> None:
        """Set the states to their start words."""
        self._machine = Interpreter(self.program)

    def step(self, record: FloatArray) -> dict[str, float]:
        """One update."""
        return {name: float(v[0]) for name, v in self.run(record[None, :]).outputs.items()}

    def run(self, records: FloatArray) -> Run:
        """Updates, one after the other."""
        found = [self._machine.update(w[:, None]) for w in words_of(self.program, records)]
        words = np.stack([out[:, 0] for out, _ in found])
        return run_of_words(self.program, words, np.array([bool(sat[0]) for _, sat in found]))

    def close(self) -> None:
        """Nothing is held."""


class Emitted:
    """The emitted C, compiled for this computer."""

    name = "c"

    def __init__(self, program: Program) -> None:
        self.program = program
        self._model = CModel(program)

    def set_params(self, values: Mapping[str, float]) -> None:
        """Write every parameter register; it stays so over a reset."""
        for number, word in param_words(self.program, values).items():
            self._model.set_param(self.program.values[number].name, word)

    def reset(self) -> None:
        """Set the states to their start words."""
        self._model.reset()

    def step(self, record: FloatArray) -> dict[str, float]:
        """One update."""
        return {name: float(v[0]) for name, v in self.run(record[None, :]).outputs.items()}

    def run(self, records: FloatArray) -> Run:
        """Updates, one after the other."""
        words, saturated = self._model.update(words_of(self.program, records))
        return run_of_words(self.program, words, saturated)

    def close(self) -> None:
        """Nothing is held."""
