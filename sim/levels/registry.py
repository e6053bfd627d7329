"""The forms of an estimator by name: float64 with numpy and in C, integer interpreter, C, Verilog.

numpy is fast over many runs, not over many steps. So the interpreter cuts a long log into segments
that run side by side; each starts from the state words that the C had there. That is no short cut:
every segment must end in exactly the state words the next one starts from, so by induction the
interpreter's own run from the first sample is the same.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from boresight.firmware.build import CModel, WordRanges
from boresight.firmware.floating import FloatCModel
from boresight.model.arrays import BoolArray, FloatArray
from boresight.model.errors import require, require_choice
from boresight.model.estimator import param_words
from boresight.model.step import Values
from boresight.model.words.fixed import IntArray
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Program
from boresight.sim.levels.build import Build, Level, Run, run_of_words, words_of, wrapped
from boresight.sim.levels.rtl import Simulated


class NumpyFloat(Level):
    """The float reference: `Estimator.step` on numpy's float64."""

    name, tool, exact = "numpy", "numpy", False

    def __init__(self, build: Build, number: int = 0, tool: str | None = None) -> None:
        super().__init__(build, number, tool)
        self.estimator = build.estimators[number]
        self.estimator.record()  # Refuse a step that other levels cannot run.
        self._params = Values("parameter", build.values[number])
        self.reset()

    def reset(self) -> None:
        self._state = {s.name: np.float64(s.initial) for s in self.estimator.states}

    def run(self, records: FloatArray) -> Run:
        names, outputs = [i.name for i in self.estimator.inputs], self.estimator.outputs
        table = np.zeros((len(records), len(outputs)))
        for row, record in zip(table, records, strict=True):
            u = Values("input", {n: np.float64(v) for n, v in zip(names, record, strict=True)})
            x = Values("state", self._state)
            with np.errstate(all="ignore"):
                state, out = self.estimator.checked_step(x, u, self._params)
            self._state = {name: np.float64(value) for name, value in state.items()}
            row[:] = [float(out[o.name]) for o in outputs]
        return Run(wrapped({o.name: table[:, k] for k, o in enumerate(outputs)}, outputs))


class CompiledFloat(Level):
    """Float64 compiled from C: the reference within rounding, thousands of times as fast."""

    name, tool, exact = "float", "gcc", False

    def __init__(self, build: Build, number: int = 0, tool: str | None = None) -> None:
        super().__init__(build, number, tool)
        self._model = FloatCModel(build.estimators[number], params=build.params[number])

    def set_params(self, params: Mapping[str, float] | None) -> None:
        """Set these parameter values, and the others to their defaults."""
        self._model.set_params(params)

    def reset(self) -> None:
        self._model.reset()

    def run(self, records: FloatArray) -> Run:
        table = self._model.update(records).astype(np.float64)
        outputs = self.build.estimators[self.number].outputs
        return Run(wrapped({o.name: table[:, k].copy() for k, o in enumerate(outputs)}, outputs))


SEGMENTS = 4096  #: Segments that run side by side, each of at least eight steps.


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


class Interpreted(Level):
    """The integer interpreter: the reference of all words."""

    name, tool = "fixed", "interpreter"

    def __init__(self, build: Build, number: int = 0, tool: str | None = None) -> None:
        super().__init__(build, number, tool)
        self.reset()

    def reset(self) -> None:
        self._machine: Interpreter | None = None
        self._rows = 0

    def run(self, records: FloatArray) -> Run:
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

    name, tool = "c", "gcc"

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
        self._model.reset()

    def run(self, records: FloatArray) -> Run:
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


#: Float64 with numpy and compiled, integer interpreter, C, Verilog.
LEVELS: dict[str, type[Level]] = {
    kind.name: kind for kind in (NumpyFloat, CompiledFloat, Interpreted, Emitted, Simulated)
}


def make_level(name: str, build: Build, runs: int | None = None) -> Level:
    """Make a level; with ``runs``, which "c" alone takes, that many runs side by side."""
    require_choice("level", name, LEVELS)
    if runs is None:
        return LEVELS[name](build)
    require(name == "c", "level", "c, which has runs side by side", name, "choose it")
    return Emitted(build, runs=runs)
