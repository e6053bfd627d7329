"""Builds: estimators that share one core, and their programs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property

from boresight.firmware.emit import emit_c
from boresight.gateware.core import Core, build_shared_core
from boresight.gateware.schedule.slots import ScheduleError
from boresight.model.estimator import Estimator, with_params
from boresight.model.lowering.graph import Node
from boresight.model.words.program import Program

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
