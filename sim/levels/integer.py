"""Integer levels: the interpreter, which is the reference, and the emitted C.

numpy is fast over many runs, not over many steps. So the interpreter cuts a long log into segments
that run side by side; each starts from the state words that the C had there. That is no short cut:
every segment must end in exactly the state words the next one starts from, so by induction the
interpreter's own run from the first sample is the same.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from boresight.firmware.build import CModel, WordRanges
from boresight.model.arrays import BoolArray, FloatArray
from boresight.model.estimator import param_words
from boresight.model.words.fixed import IntArray
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Program
from boresight.sim.levels.build import Build
from boresight.sim.levels.level import Level, Run, Seen, formats_of, run_of_words

#: Segments that run side by side, each of at least eight steps.
SEGMENTS = 4096


def interpret(
    program: Program, inputs: IntArray, machine: Interpreter | None = None
) -> tuple[IntArray, BoolArray, IntArray, int | None]:
    """Run the interpreter over ``inputs`` (steps, n_inputs).

    ``machine``, of one run, goes on from where it stands; by default a new one does. Returns
    outputs (steps, n_outputs), saturated (steps,), states after each step (steps, n_states), and
    the first step whose states are not those that the next segment started from.
    """
    machine = machine or Interpreter(program)
    steps, count = len(inputs), max(1, min(SEGMENTS, len(inputs) // 8))
    bounds = np.linspace(0, steps, count + 1).astype(int)
    starts, lengths, ends = bounds[:-1], np.diff(bounds), bounds[1:-1] - 1
    segments, seeds = machine, np.zeros((steps, len(program.states)), dtype=np.int64)
    if count > 1:
        model, segments = CModel(program), Interpreter(program, count)
        model.states[:] = machine.states.T
        seeds = model.trajectory(inputs)[2]
        segments.states = np.concatenate([machine.states.T, seeds[ends]]).T
    outputs = np.zeros((steps, len(program.outputs)), dtype=np.int64)
    states, saturated = np.zeros_like(seeds), np.zeros(steps, dtype=np.bool_)
    for j in range(int(lengths.max())):
        live = j < lengths
        rows = np.where(live, starts + j, starts)  # a finished segment runs on, unread
        out, sat = segments.update(inputs[rows].T)
        outputs[rows[live]] = out[:, live].T
        saturated[rows[live]] = sat[live]
        states[rows[live]] = segments.states[:, live].T
    if steps:
        machine.states = states[-1:].T
    mismatches = ends[(states[ends] != seeds[ends]).any(axis=1)]
    return outputs, saturated, states, int(mismatches[0]) if len(mismatches) else None


def words_of(program: Program, records: FloatArray) -> IntArray:
    """Input words (..., n_inputs) of records in their units; clamped to the word."""
    return formats_of(program, program.inputs).quantise(records)


class Interpreted(Level):
    """The integer interpreter."""

    name, tools = "fixed", ("interpreter",)

    def __init__(self, build: Build, number: int = 0, tool: str | None = None) -> None:
        super().__init__(build, number, tool)
        self.reset()

    def reset(self) -> None:
        """Set the states to their start words."""
        self._machine: Interpreter | None = None
        self._rows = 0

    def run(self, records: FloatArray) -> Run:
        """Updates, one after the other."""
        program, words = self.program, words_of(self.program, records)
        self._machine = self._machine or Interpreter(program)
        out, saturated, states, broken = interpret(program, words, self._machine)
        fault = "" if broken is None else f"states differ from C after step {self._rows + broken}"
        self._rows += len(words)
        beyond = program.beyond(words)
        return run_of_words(program, out, saturated, states=states, beyond=beyond, fault=fault)


class Emitted(Level):
    """The emitted C, compiled for this computer.

    With ``runs`` it updates so many runs side by side, inputs (n, runs, n_inputs); without states.
    """

    name, tools = "c", ("gcc",)

    def __init__(
        self, build: Build, number: int = 0, tool: str | None = None, runs: int | None = None
    ) -> None:
        super().__init__(build, number, tool)
        self.runs, self.traced = runs, runs is None
        self._model = CModel(self.program, runs, files=build.firmware(number))

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

    def words_of_update(
        self, records: FloatArray, before: Iterable[FloatArray] = ()
    ) -> Sequence[Seen]:
        """Every word of the last update."""
        self.reset()
        for piece in (*before, records[:-1]):
            self._model.update(words_of(self.program, piece))
        words = self._model.values_of_update(words_of(self.program, records[-1]))
        return [Seen(op.dest, words[op.dest]) for op in self.program.ops]
