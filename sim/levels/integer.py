"""Integer levels: the interpreter, which is the reference, and the emitted C."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from boresight.firmware.build import CModel, WordRanges
from boresight.model.arrays import FloatArray
from boresight.model.estimator import param_words
from boresight.model.words.fixed import IntArray
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Program
from boresight.sim.levels.build import Build
from boresight.sim.levels.level import Level, Run, Seen, formats_of, run_of_words
from boresight.sim.levels.segments import interpret


def words_of(program: Program, records: FloatArray) -> IntArray:
    """Input words (..., n_inputs) of records in their units; clamped to the word."""
    return formats_of(program, program.inputs).quantise(records)


class Interpreted(Level):
    """The integer interpreter: from a reset on in segments, else one update after the other."""

    name, tools = "fixed", ("interpreter",)

    def __init__(self, build: Build, number: int = 0, tool: str | None = None) -> None:
        super().__init__(build, number, tool)
        self.reset()

    def reset(self) -> None:
        """Set the states to their start words."""
        self._machine: Interpreter | None = None
        self._ahead: CModel | None = None
        self._rows = 0

    def run(self, records: FloatArray) -> Run:
        """Updates, one after the other."""
        program, lent, self.shown = self.program, self.shown, None
        words = words_of(program, records)
        if lent is not None:
            self._ahead = None
        elif self._machine is None and len(words) >= 16:
            self._ahead = CModel(program)  # tells where the segments of every piece begin
        if self._ahead is not None:
            lent = self._ahead.trajectory(words)[2]
        out, saturated, states, broken = interpret(
            program, words, states=lent, machine=self._machine
        )
        machine = self._machine = self._machine or Interpreter(program)
        if len(words):
            machine.states = states[-1:].T
        fault = "" if broken is None else f"states differ from C after step {self._rows + broken}"
        self._rows += len(words)
        beyond = program.beyond(words)
        return run_of_words(program, out, saturated, states=states, beyond=beyond, fault=fault)


class Emitted(Level):
    """The emitted C, compiled for this computer."""

    name, tools = "c", ("gcc",)

    def __init__(self, build: Build, number: int = 0, tool: str | None = None) -> None:
        super().__init__(build, number, tool)
        self._model = CModel(self.program, files=build.firmware(number))

    def set_params(self, params: Mapping[str, float] | None) -> None:
        """Set these parameter values, and the others to their defaults; a reset preserves them."""
        values = self.build.estimators[self.number].param_values(params)
        for number, word in param_words(self.program, values).items():
            self._model.set_param(self.program.values[number].name, word)

    def reset(self) -> None:
        """Set the states to their start words."""
        self._model.reset()

    def run(self, records: FloatArray) -> Run:
        """Updates, one after the other."""
        inputs = words_of(self.program, records).astype(np.int32, order="C")
        model, states = self._model, None
        if self.traced:
            words, saturated, states = model.trajectory(inputs)
        else:
            words, saturated = model.update(inputs)
        return run_of_words(self.program, words, saturated, states=states, beyond=model.beyond)

    def observe(self, records: FloatArray) -> WordRanges:
        """Run updates, at least one: extremes and saturations of every value."""
        return self._model.observe(words_of(self.program, records))

    @classmethod
    def batch(cls, build: Build, runs: int) -> Level:
        """Several runs side by side, updated by one call; without states."""
        level = cls(build)
        level.runs, level.traced = runs, False
        level._model = CModel(level.program, runs, files=build.firmware(0))
        return level

    def words_of_update(
        self, records: FloatArray, before: Iterable[FloatArray] = ()
    ) -> Sequence[Seen]:
        """Every word of the last update."""
        self.reset()
        for piece in (*before, records[:-1]):
            self._model.update(words_of(self.program, piece))
        words = self._model.values_of_update(words_of(self.program, records[-1]))
        return [Seen(op.dest, words[op.dest]) for op in self.program.ops]
