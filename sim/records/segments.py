"""The integer interpreter over one long log: many segments at once.

numpy is fast over many runs, not over many steps. So the log is cut into segments that run side by
side; each starts from the state words that another level, as a rule the C, had there. That is no
short cut: every segment must end in exactly the state words the next one starts from, so by
induction the interpreter's own run from the first sample is the same.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from boresight.firmware.build import CModel
from boresight.model.words.fixed import IntArray
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Program

__all__ = ["SegmentedRun", "interpret"]


@dataclasses.dataclass(frozen=True)
class SegmentedRun:
    """What the interpreter computed.

    Attributes
    ----------
    outputs : int64 (steps, n_outputs)
    states : int64 (steps, n_states)
        State words after each step.
    saturated : bool (steps,)
    broken_at : int or None
        First step whose state words are not those the next segment started from.
    """

    outputs: IntArray
    states: IntArray
    saturated: npt.NDArray[np.bool_]
    broken_at: int | None


def interpret(
    program: Program,
    inputs: IntArray,
    *,
    states: IntArray | None = None,
    segments: int = 256,
    progress: Callable[[int, int], None] | None = None,
) -> SegmentedRun:
    """Run the interpreter over ``inputs`` (steps, n_inputs).

    Parameters
    ----------
    states : int64 (steps, n_states), optional
        State words after each step, of another level; by default the C is run for them.
    segments : int
        Segments that run side by side.
    progress : callable, optional
        Called with (steps done, steps in all) of the longest segment.
    """
    steps, n_out, n_states = len(inputs), len(program.outputs), len(program.states)
    seeds = CModel(program).trajectory(inputs)[2] if states is None else states
    count = max(1, min(segments, steps // 8))
    bounds = np.linspace(0, steps, count + 1).astype(int)
    starts, lengths = bounds[:-1], np.diff(bounds)
    machine = Interpreter(program, count)
    for k, (state, _) in enumerate(program.states):
        words = np.where(
            starts == 0, program.values[state].initial, seeds[np.maximum(starts - 1, 0), k]
        )
        machine.values[state] = words.astype(np.int64)
    outputs = np.zeros((steps, n_out), dtype=np.int64)
    after = np.zeros((steps, n_states), dtype=np.int64)
    saturated = np.zeros(steps, dtype=np.bool_)
    for j in range(int(lengths.max())):
        live = j < lengths
        rows = np.where(live, starts + j, starts)  # a finished segment runs on, unread
        out, sat = machine.update(inputs[rows].T)
        outputs[rows[live]] = out[:, live].T
        saturated[rows[live]] = sat[live]
        for k, (state, _) in enumerate(program.states):
            after[rows[live], k] = machine.values[state][live]
        if progress is not None:
            progress(j + 1, int(lengths.max()))
    ends = bounds[1:-1] - 1
    wrong = ends[(after[ends] != seeds[ends]).any(axis=1)] if len(ends) else ends
    return SegmentedRun(outputs, after, saturated, int(wrong[0]) if len(wrong) else None)
