"""An estimator over fixed logs, run and judged, again and again with other parameters.

What does not depend on the parameters is done once: the program is compiled, its C built, every
log read. Threads share the logs; each log has levels of its own, whose calls release Python's lock.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from dataclasses import dataclass, field

from boresight.model.estimator import Estimator
from boresight.sim.accuracy.figures import Alignment, Errors
from boresight.sim.campaign import processes
from boresight.sim.compare.difference import Difference, Differences
from boresight.sim.compare.verdict import saturations
from boresight.sim.levels.build import Build
from boresight.sim.levels.floating import CompiledFloat
from boresight.sim.levels.integer import Emitted
from boresight.sim.records.feed import Feed, LongFeed
from boresight.sim.worlds.loop import drive


@dataclass(frozen=True)
class Scores:
    """A run of a log on one level.

    The level is fixed, float, or package (of a published filter). ``errors`` are root mean squares
    against truth (`sim.accuracy.figures`), ``saturations`` the ``saturated`` updates by value
    (None: nothing can), ``near`` fixed point beside float64, ``offset_deg`` a constant turn that
    was taken out of attitudes.
    """

    level: str
    errors: Mapping[str, float]
    units: Mapping[str, str]
    seconds: float = 0.0
    saturated: int | None = None
    saturations: Mapping[str, int] = field(default_factory=dict)
    near: tuple[Difference, ...] = ()
    offset_deg: tuple[float, ...] = ()


class LogRuns:
    """The emitted C of an estimator over logs, with ``floating`` compiled float64 beside it.

    ``jobs`` are threads, by default one for each processor; ``align`` is one of `ALIGNMENTS`.
    """

    def __init__(
        self,
        estimator: Estimator,
        feeds: Sequence[Feed | LongFeed],
        *,
        floating: bool = False,
        word: int = 32,
        jobs: int | None = None,
        align: str = "none",
    ) -> None:
        self.estimator, self.feeds, self.align = estimator, tuple(feeds), align
        self.jobs = max(1, min(processes(jobs), len(self.feeds)))
        build = Build(estimator, word=word)
        kinds = (Emitted, CompiledFloat)[: 1 + floating]
        self._levels = [[kind(build) for kind in kinds] for _ in self.feeds]

    def run(
        self, params: Mapping[str, float] | None = None, indices: Sequence[int] | None = None
    ) -> list[list[Scores]]:
        """Run some logs (all by default); the scores of each, fixed point first.

        Raises
        ------
        InputError
            Unknown or illegal parameter.
        """
        self.estimator.param_values(params)
        indices = range(len(self.feeds)) if indices is None else indices
        if self.jobs == 1:
            return [self._scores(index, params) for index in indices]
        with ThreadPoolExecutor(self.jobs) as pool:
            contexts = [copy_context() for _ in indices]  # the selection of rows
            futures = [
                pool.submit(context.run, self._scores, index, params)
                for context, index in zip(contexts, indices, strict=True)
            ]
            return [future.result() for future in futures]

    def _scores(self, index: int, params: Mapping[str, float] | None) -> list[Scores]:
        """One log on all levels; twice if an offset is taken out, first to measure it."""
        columns, levels = self.feeds[index], self._levels[index]
        for level in levels:
            level.set_params(params)
        offsets = [Alignment(self.align) for _ in levels]
        for k, part in enumerate(columns.parts() if self.align != "none" else ()):
            for offset, level in zip(offsets, levels, strict=True):
                (loop,) = drive(part, level, anew=not k)
                offset.add_outputs(part, loop.outputs)
        outputs = self.estimator.outputs
        comparison = Differences(outputs, [o.name for o in outputs])
        errors = [Errors(self.estimator) for _ in levels]
        seconds, saturated = [0.0] * len(levels), 0
        for k, part in enumerate(columns.parts()):
            loops = [loop for level in levels for loop in drive(part, level, anew=not k)]
            for n, loop in enumerate(loops):
                errors[n].add(part, offsets[n].turned_outputs(loop.outputs))
                seconds[n] += loop.seconds
            saturated += loops[0].run.n_saturated
            if len(loops) > 1:
                comparison.add(loops[0].outputs, loops[1].outputs)
        near = tuple(comparison.result()) if len(levels) > 1 else ()
        inputs = (s for k, part in enumerate(columns.parts()) for s in part.spans(not k))
        values = saturations(levels[0], inputs, params) if saturated else {}
        return [
            Scores(
                "float" if n else "fixed",
                e.result(),
                e.units,
                seconds[n],
                None if n else saturated,
                {} if n else values,
                () if n else near,
                offsets[n].offset_deg,
            )
            for n, e in enumerate(errors)
        ]
