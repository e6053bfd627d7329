"""Builds: estimators that share one core; levels: each of them in one form, by one protocol."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any, ClassVar, Self

import numpy as np

from boresight.firmware.emit import emit_c
from boresight.gateware.core import Core, build_shared_core
from boresight.gateware.schedule.slots import Schedule, ScheduleError
from boresight.model.arrays import BoolArray, FloatArray
from boresight.model.declarations import Output
from boresight.model.estimator import Estimator, with_params
from boresight.model.lowering.graph import Node
from boresight.model.words.fixed import Format, IntArray
from boresight.model.words.program import Port, Program

_VERILOG = ("core.v", "spartan6.v")  #: Files that hold the core and the primitives in it.


class Build:
    """Estimators and everything that affects their words; programs and core are made on first use.

    ``estimators`` are in the order of their numbers in the core; ``params`` has the parameter
    values of each, by default those declared; ``target`` is the part whose area is measured.
    ``files`` are the contents of a compiled folder by relative path: its Verilog and C run in place
    of newly generated ones. Raises InputError for an unknown parameter, or a value out of range.
    """

    def __init__(
        self,
        *estimators: Estimator,
        config: str = "small",
        word: int = 32,
        params: Sequence[Mapping[str, float] | None] | None = None,
        target: str = "xc6slx9",
        files: Mapping[str, str] | None = None,
    ) -> None:
        self.config, self.word = config, word
        self.target, self.files = target, files or {}
        self.estimators = estimators
        self.params = tuple(params or [None] * len(estimators))
        #: All parameters of each estimator, the given values on top of the defaults.
        self.values = [e.param_values(v) for e, v in zip(estimators, self.params, strict=True)]

    @cached_property
    def _traced(self) -> list[tuple[Program, dict[int, Node]]]:
        return [e.compile_traced(word=self.word) for e in self.estimators]

    @cached_property
    def programs(self) -> list[Program]:
        return [
            with_params(program, e, values)
            for (program, _), e, values in zip(
                self._traced, self.estimators, self.params, strict=True
            )
        ]

    @property
    def nodes(self) -> list[dict[int, Node]]:
        """The traced nodes of each program; see `Estimator.compile_traced`."""
        return [nodes for _, nodes in self._traced]

    @cached_property
    def core(self) -> Core:
        """The core with all programs, the first one selected; raises as `build_shared_core`."""
        try:
            core = build_shared_core(self.programs, self.config)
        except ScheduleError as error:
            raise ScheduleError(f"{error}{heaviest(self._traced)}") from None
        verilog = {name: text for name, text in self.files.items() if name in _VERILOG}
        return replace(core, files=verilog) if verilog else core

    def firmware(self, number: int) -> dict[str, str] | None:
        """C files of a program in `files`, by name, the header first; None: there are none."""
        names = emit_c(self.programs[number]) if self.files else {}
        return {name: self.files[f"firmware/{name}"] for name in names} or None

    @cached_property
    def shortage(self) -> str:
        """Why no core holds the programs, empty if one does."""
        try:
            self.core  # noqa: B018
        except ScheduleError as error:
            return str(error)
        return ""


_NAMED = 3  #: Lines that are named.


def heaviest(traced: Sequence[tuple[Program, Mapping[int, Node]]]) -> str:
    """The lines with most operations of all programs, as the end of an error's line.

    Parts of an operation count where they are used first.
    """
    total, counts = sum(len(program.ops) for program, _ in traced), Counter[str]()
    for program, nodes in traced:
        parts, prefix = 0, f"{program.name}, " if len(traced) > 1 else ""
        for op in program.ops:
            parts += 1
            if op.dest in nodes and (line := nodes[op.dest].line):
                counts[prefix + line] += parts
                parts = 0
    named = ", ".join(f"{line} ({count})" for line, count in counts.most_common(_NAMED))
    return f"; most of its {total} operations: {named}" if total else ""


@dataclass(frozen=True, eq=False)
class Run:
    """Result of a level's run.

    Of a level with several runs side by side every shape has the runs behind n: (n, runs), ...
    """

    outputs: dict[str, FloatArray]  #: by name, (n,) in their units.
    words: IntArray | None = None  #: (n, n_outputs); None for floating point.
    saturated: BoolArray | None = None  #: (n,): updates in which an operation was clamped.
    #: (n, n_states): words after each update, where the level shows them.
    states: IntArray | None = None
    beyond: BoolArray | None = None  #: (n,): updates with an input word beyond its declared range.
    #: (n, n_outputs) and (n,): see `sim.rtl.simulation.RtlRun`; None for levels without a clock.
    latency_cycles: IntArray | None = field(default=None, repr=False)
    interval_cycles: IntArray | None = field(default=None, repr=False)
    fault: str = ""  #: reason why the run is not valid evidence; normally empty.

    @property
    def n_saturated(self) -> int:
        """Updates in which an operation was clamped, of all runs; 0 in floating point."""
        return 0 if self.saturated is None else int(self.saturated.sum())

    @classmethod
    def joined(cls, runs: Sequence[Run]) -> Run:
        """Runs of one level of which each goes on where the last one ended, as one."""
        parts = {f.name: [getattr(run, f.name) for run in runs] for f in fields(cls)}
        outputs = {n: np.concatenate([x[n] for x in parts["outputs"]]) for n in runs[0].outputs}
        arrays = {
            name: None if values[0] is None else np.concatenate(values)
            for name, values in parts.items()
            if name not in ("outputs", "fault")
        }
        return cls(outputs, **arrays, fault=next(filter(None, parts["fault"]), ""))


class Level(ABC):
    """An estimator in one form, with its own states.

    ``run``, ``advance`` and ``step`` go on where the last one stopped; ``reset`` starts anew. A
    level holds resources until ``close``. A new form is one more class in `sim.levels.registry`.
    ``number`` is that of the estimator that runs, ``tool`` the simulator of the RTL.
    """

    name: str  #: name of the form.
    tool: str  #: the tool that runs it.
    #: Whether it computes words, which must equal those of the integer interpreter.
    exact: ClassVar[bool] = True
    #: Number of runs side by side, each with its own states (`Emitted`); None: without that axis.
    runs: int | None = None
    traced: bool = True  #: whether runs have the states, of a level that can show them.

    def __init__(self, build: Build, number: int = 0, tool: str | None = None) -> None:
        self.build, self.number, self.tool = build, number, tool or self.tool

    @property
    def program(self) -> Program:
        """Program of the estimator."""
        return self.build.programs[self.number]

    @property
    def schedule(self) -> Schedule | None:
        """Schedule for its cycles; None without a clock."""
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

    def advance(self, records: FloatArray) -> Run:
        """`run` from where the last update ended, on every level."""
        return self.run(records)

    def step(self, record: FloatArray) -> Run:
        """One update of inputs (n_inputs,) in their units: `advance` with n = 1."""
        return self.advance(record[None])

    @classmethod
    def run_together(
        cls,
        levels: Sequence[Level],
        records: Sequence[FloatArray],
        *,
        anew: bool = True,
        seed: int = 0,
    ) -> list[Run]:
        """Run every estimator of a build, a level of each, on its own records.

        ``anew``: they begin with a reset, else where the last ones ended. ``seed`` is of the order
        in which they take turns.
        """
        for level in levels if anew else ():
            level.reset()
        return [level.run(inputs) for level, inputs in zip(levels, records, strict=True)]

    def close(self) -> None:  # noqa: B027
        """Release resources."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


def run_of_words(program: Program, words: IntArray, saturated: BoolArray, **more: object) -> Run:
    """A run of a level that computes words; ``more`` of `Run`'s attributes."""
    return Run(outputs_of(program, words), words, saturated, **more)  # type: ignore[arg-type]


def formats_of(program: Program, values: Sequence[int]) -> Format:
    """The formats of several values as one, for arrays with these values along the last axis."""
    return Format(program.arithmetic.word, program.fracs[list(values)])  # type: ignore[arg-type]


def words_of(program: Program, records: FloatArray) -> IntArray:
    """Input words (..., n_inputs) of records in their units; clamped to the word."""
    return formats_of(program, program.inputs).quantise(records)


def outputs_of(program: Program, words: IntArray) -> dict[str, FloatArray]:
    """Output words (..., n_outputs) as real values (...) by name."""
    real = formats_of(program, program.outputs).real(words)
    named = {name: real[..., k] for k, name in enumerate(program.output_names)}
    return wrapped(named, program.ports)


def states_of(program: Program, words: IntArray) -> dict[str, FloatArray]:
    """State words (..., n_states) as real values (...) by name."""
    numbers = enumerate(state for state, _ in program.states)
    return {program.values[n].name: program.format(n).real(words[..., k]) for k, n in numbers}


def wrapped(outputs: dict[str, Any], declared: Iterable[Port | Output]) -> dict[str, Any]:
    """Outputs by name, with those in turns wrapped to [0, 1)."""
    return outputs | {o.name: outputs[o.name] % 1.0 for o in declared if o.unit == "turn"}
