"""One protocol for every form of an estimator."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Self

import numpy as np
import numpy.typing as npt

from boresight.gateware.schedule.slots import Schedule
from boresight.model.declarations import Output
from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Port, Program
from boresight.sim.levels.build import Build

__all__ = ["Level", "Run", "Seen", "outputs_of", "run_of_words", "told"]

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
        Of levels with a clock: `sim.rtl.replay.RtlRun`.
    fault : str
        Why it proves nothing, whatever its words are; empty as a rule.
    """

    outputs: dict[str, FloatArray]
    words: IntArray | None = None
    saturated: BoolArray | None = None
    states: IntArray | None = None
    latency_cycles: IntArray | None = field(default=None, repr=False)
    interval_cycles: IntArray | None = field(default=None, repr=False)
    fault: str = ""

    @property
    def n_saturated(self) -> int:
        """Updates in which an operation was clamped; 0 of a level that does not say."""
        return 0 if self.saturated is None else int(self.saturated.sum())


@dataclass(frozen=True)
class Seen:
    """A value's word in one update: None if it is unknown (X) or never came; with its cycle."""

    value: int
    word: int | None
    cycle: int | None = None


class Level(ABC):
    """An estimator in one form, with states of its own.

    ``step`` and ``run`` go on where the last one stopped, but for ``run`` of a level that replays
    records from a reset on (`sim.levels.rtl`); ``reset`` starts anew. A level holds resources until
    ``close``. A new form is one more module of this package: `sim.levels.registry`.

    Parameters
    ----------
    build : Build
        What it is made from.
    number : int
        Which of its estimators runs.
    tool : str, optional
        One of ``tools``; the first by default.
    """

    #: Name of the form.
    name: ClassVar[str]
    #: What may run it.
    tools: ClassVar[tuple[str, ...]]
    #: Whether it computes words, which must be those of the integer interpreter.
    exact: ClassVar[bool] = True

    def __init__(self, build: Build, number: int = 0, tool: str | None = None) -> None:
        self.build, self.number, self.tool = build, number, tool or self.tools[0]

    @classmethod
    def tools_of_check(cls, simulator: str | None) -> tuple[str, ...]:
        """The tools that a check runs, one after the other; ``simulator`` is the user's choice."""
        return cls.tools

    @property
    def program(self) -> Program:
        """What it runs, in words."""
        return self.build.programs[self.number]

    @property
    def schedule(self) -> Schedule | None:
        """What its cycles must be; None without a clock."""
        return None

    @property
    def most(self) -> int | None:
        """Records that a check waits for; None: all."""
        return None

    @abstractmethod
    def reset(self) -> None:
        """Set the states to their start values."""

    @abstractmethod
    def run(self, records: FloatArray) -> Run:
        """Updates, one after the other: inputs (n, n_inputs) in their units."""

    def run_anew(self, records: FloatArray) -> Run:
        """`run` from a reset on."""
        self.reset()
        return self.run(records)

    def step(self, record: FloatArray) -> dict[str, float]:
        """One update: inputs (n_inputs,) in their units to outputs by name in theirs."""
        return {name: float(v[0]) for name, v in self.run(record[None, :]).outputs.items()}

    def words_of_update(self, records: FloatArray) -> Sequence[Seen]:
        """Words of the last of these updates from a reset on, in the order in which they came.

        States count with the words before it. Empty where the level shows none.
        """
        return ()

    @classmethod
    def run_together(cls, levels: Sequence[Level], records: Sequence[FloatArray]) -> list[Run]:
        """Every estimator of a build on records of its own, each from a reset on.

        Those that read what others keep run behind them (`Build.filled`).
        """
        build, counts = levels[0].build, [len(own) for own in records]
        runs: dict[int, Run] = {}
        for k in build.order:
            outputs = {n: run.outputs for n, run in runs.items()}
            own = build.filled(k, records[k], outputs, counts, clamp=not cls.exact)
            runs[k] = levels[k].run_anew(own)
        return [runs[k] for k in range(len(levels))]

    def close(self) -> None:  # noqa: B027
        """Give back what it holds."""

    def __enter__(self) -> Self:
        """Itself."""
        return self

    def __exit__(self, *error: object) -> None:
        """Close."""
        self.close()


def run_of_words(program: Program, words: IntArray, saturated: BoolArray, **more: object) -> Run:
    """A run of a level that computes words; ``more`` of `Run`'s attributes."""
    return Run(outputs_of(program, words), words, saturated, **more)  # type: ignore[arg-type]


def outputs_of(program: Program, words: IntArray) -> dict[str, FloatArray]:
    """Output words (n, n_outputs) as real values (n,) by name."""
    found = {
        name: program.format(value).real(words[:, k])
        for k, (name, value) in enumerate(zip(program.output_names, program.outputs, strict=True))
    }
    return told(found, program.ports)


def told(outputs: dict[str, Any], declared: Iterable[Port | Output]) -> dict[str, Any]:
    """Outputs as they are told: turns from 0 to 1."""
    return outputs | {o.name: outputs[o.name] % 1.0 for o in declared if o.unit == "turn"}
