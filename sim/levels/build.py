"""What levels are made from: estimators that share one core, and how they become one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property

from boresight.gateware.core import Core, build_shared_core
from boresight.model.estimator import Estimator, with_params
from boresight.model.lowering.graph import Node
from boresight.model.words.program import Program

__all__ = ["Build"]


class Build:
    """Estimators and everything that decides their words; made of it once, when first asked for.

    Parameters
    ----------
    estimators : Estimator
        In the order of their numbers in the core; one is the common case.
    config : str
        Configuration of the core.
    word : int
        Width, bits.
    params : sequence of mapping or None, optional
        Parameter values of each; by default as declared.
    urgent : int, optional
        Leading outputs whose latency counts first, of all; by default each one's own.
    restarts : int, optional
        Effort of the scheduler.

    Raises
    ------
    InputError
        A parameter that there is not, or out of range.
    """

    def __init__(
        self,
        *estimators: Estimator,
        config: str = "small",
        word: int = 32,
        params: Sequence[Mapping[str, float] | None] | None = None,
        urgent: int | None = None,
        restarts: int | None = None,
    ) -> None:
        self.estimators, self.config, self.word = estimators, config, word
        self.urgent, self.restarts = urgent, restarts
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

    @cached_property
    def core(self) -> Core:
        """The core that holds them all, the first at hand.

        Raises
        ------
        InputError
            Unknown configuration.
        ScheduleError
            The programs do not fit into one core.
        """
        own = [p.urgent if self.urgent is None else self.urgent for p in self.programs]
        return build_shared_core(self.programs, self.config, urgents=own, restarts=self.restarts)
