"""Builds: estimators that share one core, and their programs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from graphlib import TopologicalSorter
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.gateware.core import Core, build_shared_core
from boresight.gateware.schedule.slots import ScheduleError
from boresight.model.arrays import FloatArray
from boresight.model.estimator import Estimator, with_params
from boresight.model.linking import families, first_word, linked_estimators, linked_words
from boresight.model.lowering.graph import Node
from boresight.model.lowering.heaviest import heaviest
from boresight.model.words.program import Program
from boresight.sim.rtl.sharing import Rounds, Turn, completed

__all__ = ["Build", "Exchange"]


class Build:
    """Estimators and everything that affects their words; programs and core are made on first use.

    Parameters
    ----------
    estimators : Estimator
        In the order of their numbers in the core; one is the common case.
    config : str
        Configuration of the core.
    word : int
        Width, bits.
    params : sequence of mapping or None, optional
        Parameter values of each estimator; by default those declared.
    urgent : int, optional
        Leading outputs whose latency counts first; by default as each estimator declares.
    target : str
        Part of the level netlist (`sim.levels.synthesised`).

    Raises
    ------
    InputError
        Unknown parameter, or value out of range; a link that does not fit its source.
    """

    def __init__(
        self,
        *estimators: Estimator,
        config: str = "small",
        word: int = 32,
        params: Sequence[Mapping[str, float] | None] | None = None,
        urgent: int | None = None,
        target: str = "xc6slx9",
    ) -> None:
        self.config, self.word, self.urgent = config, word, urgent
        self.target = target
        #: The estimators, with linked inputs in the format of their source.
        self.estimators = tuple(linked_estimators(estimators, word=word))
        self.params = tuple(params or [None] * len(estimators))
        for estimator, values in zip(estimators, self.params, strict=True):
            estimator.param_values(values)

    @cached_property
    def _traced(self) -> list[tuple[Program, dict[int, Node]]]:
        return [e.compile_traced(word=self.word) for e in self.estimators]

    @cached_property
    def programs(self) -> list[Program]:
        """The program of each estimator."""
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

    @property
    def urgents(self) -> list[int | None]:
        """For each program, the leading outputs whose latency counts first."""
        return [p.urgent if self.urgent is None else self.urgent for p in self.programs]

    @cached_property
    def core(self) -> Core:
        """The core with all programs, the first one selected.

        Raises
        ------
        InputError
            Unknown configuration.
        ScheduleError
            The programs do not fit into one core.
        """
        try:
            return build_shared_core(self.programs, self.config, urgents=self.urgents)
        except ScheduleError as error:
            raise ScheduleError(f"{error}{heaviest(self._traced)}") from None

    @property
    def shortage(self) -> str:
        """Why no core holds the programs, empty if one does."""
        try:
            self.core  # noqa: B018
        except ScheduleError as error:
            return str(error)
        return ""

    @cached_property
    def links(self) -> list[dict[int, tuple[int, str]]]:
        """For each estimator its linked inputs: by column, number and output of the source."""
        numbers = {e.name: k for k, e in enumerate(self.estimators)}
        sources = [[i.source.partition(".") for i in e.inputs] for e in self.estimators]
        return [
            {
                column: (numbers[of], output)
                for column, (of, _, output) in enumerate(sources_of)
                if of in numbers
            }
            for sources_of in sources
        ]

    @property
    def order(self) -> list[int]:
        """Numbers of the estimators, each after those that it reads."""
        before = {k: {other for other, _ in links.values()} for k, links in enumerate(self.links)}
        return list(TopologicalSorter(before).static_order())

    @cached_property
    def sharing(self) -> dict[int, int]:
        """Estimators that share states, by number, with the number of the one that has them."""
        owners = families(self.estimators)
        shared = {owner for k, owner in enumerate(owners) if k != owner}
        return {k: owner for k, owner in enumerate(owners) if owner in shared}

    def streamed(self, number: int) -> list[int]:
        """Columns of an estimator's inputs in its record."""
        columns = range(len(self.estimators[number].inputs))
        return [k for k in columns if k not in self.links[number]]


class Exchange:
    """What the estimators of a build have of each other, piece by piece: words, states.

    They take turns as in `sim.rtl.sharing.Rounds`.

    Parameters
    ----------
    build : Build
    clamp : bool
        Whether to clamp to the declared range, as the program does.
    """

    def __init__(self, build: Build, *, clamp: bool = False) -> None:
        self.build, self.clamp = build, clamp
        self._rounds, self._coupled = Rounds(), any(build.links) or bool(build.sharing)
        #: Turns of the piece at hand, where estimators are linked or share states, and pieces
        #: before it.
        self.turns: list[Turn] = []
        self.pieces = -1
        #: Records of each estimator in the piece, filled.
        self.records: dict[int, FloatArray] = {}
        #: Of shared states, by the number of their owner, which level has the last ones.
        self.holders: dict[int, int] = {}
        #: Of each estimator that shares states, those before each record of the piece.
        self.before: dict[int, npt.NDArray[Any]] = {}
        self._outputs: dict[int, Mapping[str, FloatArray]] = {}
        self._last: dict[tuple[int, str], float] = {}

    def begin(self, counts: Sequence[int]) -> None:
        """Begin a piece of so many records of each estimator."""
        self.pieces += 1
        if self._coupled:
            self.turns = self._rounds.piece(counts)
            for number, outputs in self._outputs.items():
                self._last |= {(number, n): float(v[-1]) for n, v in outputs.items() if len(v)}

    def filled(self, number: int, records: FloatArray) -> FloatArray:
        """Fill the columns of linked inputs, (n, n_inputs), which may hold any values."""
        if self.build.links[number]:
            records, streams = records.copy(), len(self.build.estimators)
            done = completed(self.turns, streams, number)
            for column, (other, name) in self.build.links[number].items():
                program = self.build.programs[other]
                form = program.format(program.outputs[program.output_names.index(name)])
                first = self._last.get((other, name))
                first = float(form.real(first_word(program, name))) if first is None else first
                seen = linked_words(self._outputs[other][name], done[other], first)
                declared = self.build.estimators[number].inputs[column]
                clipped = np.clip(seen, declared.low, declared.high) if self.clamp else seen
                records[:, column] = clipped
        self.records[number] = records
        return records

    def give(self, number: int, outputs: Mapping[str, FloatArray]) -> None:
        """Outputs of an estimator in the piece, before an estimator is filled that reads them."""
        self._outputs[number] = outputs
