"""The integer interpreter over one long log: many segments at once.

numpy is fast over many runs, not over many steps. So the log is cut into segments that run side by
side; each starts from the state words that another level, as a rule the C, had there. That is no
short cut: every segment must end in exactly the state words the next one starts from, so by
induction the interpreter's own run from the first sample is the same.
"""

from __future__ import annotations

import numpy as np

from boresight.firmware.build import CModel
from boresight.model.arrays import BoolArray
from boresight.model.words.fixed import IntArray
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Program

#: Segments that run side by side, each of at least eight steps.
SEGMENTS = 4096


def interpret(
    program: Program,
    inputs: IntArray,
    *,
    states: IntArray | None = None,
    machine: Interpreter | None = None,
) -> tuple[IntArray, BoolArray, IntArray, int | None]:
    """Run the interpreter over ``inputs`` (steps, n_inputs).

    ``states`` (steps, n_states) are the words after each step of another level; by default the C is
    run for them. ``machine``, of one run, goes on from where it stands, without ``states`` in one
    segment. Returns outputs (steps, n_outputs), saturated (steps,), states after each step, and the
    first step whose states are not those that the next segment started from.
    """
    steps, numbers = len(inputs), [state for state, _ in program.states]
    is_single = machine is not None and states is None
    count = 1 if is_single else max(1, min(SEGMENTS, steps // 8))
    bounds = np.linspace(0, steps, count + 1).astype(int)
    starts, lengths, ends = bounds[:-1], np.diff(bounds), bounds[1:-1] - 1
    if machine is None:
        machine = Interpreter(program, count)
    elif count > 1:
        initial, machine = machine, Interpreter(program, count)
        for state in numbers:
            machine.values[state][0] = initial.values[state][0]
    if count > 1:
        seeds = CModel(program).trajectory(inputs)[2] if states is None else states
        for k, state in enumerate(numbers):
            machine.values[state][1:] = seeds[ends, k]
    outputs = np.zeros((steps, len(program.outputs)), dtype=np.int64)
    end_states = np.zeros((steps, len(numbers)), dtype=np.int64)
    saturated = np.zeros(steps, dtype=np.bool_)
    for j in range(int(lengths.max())):
        live = j < lengths
        rows = np.where(live, starts + j, starts)  # a finished segment runs on, unread
        out, sat = machine.update(inputs[rows].T)
        outputs[rows[live]] = out[:, live].T
        saturated[rows[live]] = sat[live]
        for k, state in enumerate(numbers):
            end_states[rows[live], k] = machine.values[state][live]
    mismatches = ends[(end_states[ends] != seeds[ends]).any(axis=1)] if count > 1 else ends
    return outputs, saturated, end_states, int(mismatches[0]) if len(mismatches) else None
