"""Error of an estimator's emitted C over many records, again and again with other parameters.

What does not depend on the parameters is done once: the program is compiled, its C built, every
record fed. Threads share the records; each has a level of its own, whose calls leave Python's lock,
so that they run side by side.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from queue import SimpleQueue
from typing import TypeVar

from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.sim.accuracy.figures import Errors
from boresight.sim.campaign import processes
from boresight.sim.levels.build import Build
from boresight.sim.levels.integer import Emitted
from boresight.sim.records.feed import Feed, LongFeed
from boresight.sim.worlds.loop import drive

__all__ = ["Scorer"]

_T = TypeVar("_T")


class Scorer:
    """The emitted C of one estimator over fixed records.

    Parameters
    ----------
    estimator : Estimator
    feeds : sequence of Feed or LongFeed
    word : int
        Word width, 18 to 32.
    jobs : int, optional
        Threads; by default one for each processor.
    scored : sequence of (name, figure), optional
        Of each record the one figure that counts, and its name in the report; all by default.
    """

    def __init__(
        self,
        estimator: Estimator,
        feeds: Sequence[Feed | LongFeed],
        *,
        word: int = 32,
        jobs: int | None = None,
        scored: Sequence[tuple[str, str]] | None = None,
    ) -> None:
        self.estimator, self.feeds, self.scored = estimator, tuple(feeds), scored
        build = Build(estimator, word=word)
        self.jobs = max(1, min(processes(jobs), len(self.feeds)))
        self._levels: SimpleQueue[Emitted] = SimpleQueue()
        for _ in range(self.jobs):
            self._levels.put(Emitted(build))

    def _each(
        self,
        indices: Sequence[int],
        params: Mapping[str, float] | None,
        work: Callable[[int, Emitted], _T],
    ) -> list[_T]:
        """``work`` on every record in ``indices``, with a level for it, in that order."""
        self.estimator.param_values(params)

        def item(index: int) -> _T:
            level = self._levels.get()
            try:
                level.set_params(params)
                return work(index, level)
            finally:
                self._levels.put(level)

        if self.jobs == 1:
            return [item(index) for index in indices]
        with ThreadPoolExecutor(self.jobs) as pool:
            contexts = [copy_context() for _ in indices]  # with the selection of rows
            return list(pool.map(lambda context, k: context.run(item, k), contexts, indices))

    def each(
        self, work: Callable[[int, Emitted], _T], params: Mapping[str, float] | None = None
    ) -> list[_T]:
        """``work`` on every record, with a level that has these parameters, others by default."""
        return self._each(range(len(self.feeds)), params, work)

    def scores(
        self, params: Mapping[str, float] | None = None, indices: Sequence[int] | None = None
    ) -> list[dict[str, float]]:
        """Figures of some records (all by default), in the order of ``indices``.

        Raises
        ------
        InputError
            Unknown or illegal parameter; a record without truth.
        """

        def score(index: int, level: Emitted) -> dict[str, float]:
            errors, where = Errors(self.estimator), ""
            for k, part in enumerate(self.feeds[index].parts()):
                (loop,) = drive(part, level, anew=not k)
                errors.add(part, loop.outputs)
                where = part.record.where
            if not (metrics := errors.result()):
                raise InputError.at(
                    where,
                    wanted=f"a truth of {self.estimator.name}'s outputs",
                    found="none",
                    fix="leave this log out",
                )
            if self.scored is None:
                return metrics
            name, figure = self.scored[index]
            return {name: metrics[figure]}

        return self._each(range(len(self.feeds)) if indices is None else indices, params, score)
