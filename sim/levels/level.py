"""One protocol for every form of an estimator."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import numpy.typing as npt

from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Program

__all__ = ["Level", "Run", "outputs_of", "run_of_words"]

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Run:
    """What a level made of records.

    Attributes
    ----------
    outputs : dict of str to float64 (n,)
        In their units.
    words : int64 (n, n_outputs) or None
        Output words; None for floating point.
    saturated : bool (n,) or None
        Updates in which an operation was clamped.
    states : int64 (n, n_states) or None
        State words after each update, where the level shows them.
    latency_cycles, interval_cycles : int64 (n, n_outputs), (n,) or None
        Of levels with a clock: `sim.rtl.cosim.RtlRun`.
    """

    outputs: dict[str, FloatArray]
    words: IntArray | None = None
    saturated: BoolArray | None = None
    states: IntArray | None = None
    latency_cycles: IntArray | None = field(default=None, repr=False)
    interval_cycles: IntArray | None = field(default=None, repr=False)


class Level(Protocol):
    """An estimator in one form, with states of its own.

    ``step`` and ``run`` go on where the last one stopped, but for ``run`` of a level that replays
    records from a reset on (`sim.levels.rtl`); ``reset`` starts anew. A level holds resources until
    ``close``.
    """

    @property
    def name(self) -> str:
        """Name of the form."""
        ...

    def reset(self) -> None:
        """Set the states to their start values."""
        ...

    def step(self, record: FloatArray) -> dict[str, float]:
        """One update: inputs (n_inputs,) in their units to outputs by name in theirs."""
        ...

    def run(self, records: FloatArray) -> Run:
        """Updates, one after the other: inputs (n, n_inputs) in their units."""
        ...

    def close(self) -> None:
        """Give back what it holds."""
        ...


def run_of_words(
    program: Program,
    words: IntArray,
    saturated: BoolArray,
    *,
    states: IntArray | None = None,
    latency_cycles: IntArray | None = None,
    interval_cycles: IntArray | None = None,
) -> Run:
    """A run of a level that computes words."""
    outputs = outputs_of(program, words)
    return Run(outputs, words, saturated, states, latency_cycles, interval_cycles)


def outputs_of(program: Program, words: IntArray) -> dict[str, FloatArray]:
    """Output words (n, n_outputs) as real values (n,) by name."""
    return {
        name: program.format(value).real(words[:, k])
        for k, (name, value) in enumerate(zip(program.output_names, program.outputs, strict=True))
    }
