"""`boresight check` of several estimators that share one core."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Mapping, Sequence

from boresight.gateware.core import Core, build_shared_core
from boresight.model.errors import ToolMissing
from boresight.model.estimator import Estimator
from boresight.model.words.fixed import IntArray
from boresight.sim.compare.check import (
    ICARUS_CYCLES,
    CheckResult,
    LevelResult,
    Progress,
    check,
    compare_rtl,
    default_simulators,
    failed_rtl,
    simulation_of,
    with_params,
)
from boresight.sim.records.feed import feed
from boresight.sim.records.record import Record
from boresight.sim.rtl.cosim import SimulationFailed
from boresight.sim.rtl.sharing import run_in_turns

__all__ = ["check_shared", "shared_core"]


def shared_core(
    estimators: Sequence[Estimator],
    *,
    config: str = "small",
    word: int = 32,
    params: Sequence[Mapping[str, float] | None] | None = None,
    urgent: int | None = None,
    restarts: int | None = None,
) -> Core:
    """One core that holds all of the estimators.

    Parameters
    ----------
    params : sequence of mapping or None, optional
        Parameter values of each.
    urgent : int, optional
        Leading outputs whose latency counts first, of all; by default each one's own.
    restarts : int, optional
        Effort of the scheduler.
    """
    programs = [
        with_params(e.compile(word=word), e, p)
        for e, p in zip(estimators, params or [None] * len(estimators), strict=True)
    ]
    return build_shared_core(
        programs,
        config,
        urgents=[e.urgent if urgent is None else urgent for e in estimators],
        restarts=restarts,
    )


def check_shared(
    estimators: Sequence[Estimator],
    record: Record,
    *,
    config: str = "small",
    word: int = 32,
    steps: int | None = None,
    levels: Sequence[str] = ("fixed", "c", "rtl"),
    simulator: str | None = None,
    params: Sequence[Mapping[str, float] | None] | None = None,
    core: Core | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> list[CheckResult]:
    """Check estimators on a log, each as `sim.compare.check`, but for the RTL all on one core.

    Every estimator sees the whole log; they take turns in random pieces of it
    (`sim.rtl.sharing.run_in_turns`).

    Parameters
    ----------
    params : sequence of mapping or None, optional
        Parameter values of each estimator.
    core : Core, optional
        The core, if it is there already.
    seed : int
        Of the turns.

    Raises
    ------
    InputError
        See `sim.compare.check.check`.
    """
    say = progress or (lambda text: None)
    chosen = list(params or [None] * len(estimators))
    plain = tuple(x for x in levels if x != "rtl")
    results = []
    for estimator, values in zip(estimators, chosen, strict=True):
        say(estimator.name)
        results.append(
            check(
                estimator,
                record,
                config=config,
                word=word,
                steps=steps,
                levels=plain,
                simulator=simulator,
                params=values,
                progress=say,
            )
        )
    if "rtl" not in levels:
        return results
    if core is None:
        say("compiling the core")
        core = shared_core(estimators, config=config, word=word, params=chosen)
    streams = [
        feed(e, record.head(steps)).words(part.program)
        for e, part in zip(estimators, core.parts, strict=True)
    ]
    for name in (simulator,) if simulator else default_simulators():
        few = name != "verilator" and not simulator
        most = max(1, ICARUS_CYCLES // sum(part.schedule.interval for part in core.parts))
        cut = [s[:most] for s in streams] if few else streams
        say(f"RTL in {name}, {sum(map(len, cut))} updates of {len(cut)} programs in turns")
        found = _check_rtl(core, estimators, cut, results, name, seed)
        results = [
            dataclasses.replace(r, levels=(*r.levels, level))
            for r, level in zip(results, found, strict=True)
        ]
    return results


def _check_rtl(
    core: Core,
    estimators: Sequence[Estimator],
    streams: Sequence[IntArray],
    wanted: Sequence[CheckResult],
    simulator: str,
    seed: int,
) -> list[LevelResult]:
    """One level for each estimator."""
    start = time.perf_counter()
    try:
        runs = run_in_turns(
            core, simulation_of(core, simulator, core.verilog(instances=False)), streams, seed=seed
        )
    except (ToolMissing, SimulationFailed) as error:
        seconds = time.perf_counter() - start
        return [failed_rtl(simulator, len(s), seconds, error) for s in streams]
    seconds = time.perf_counter() - start
    out = []
    for k, (estimator, run, result) in enumerate(zip(estimators, runs, wanted, strict=True)):
        n = len(run.outputs)
        level = compare_rtl(
            core.select(k), estimator, run, result.outputs[:n], result.saturated[:n], simulator
        )
        text = (
            ""
            if level.first_wrong is None
            else f"rtl: outputs differ, step {level.first_wrong}, "
            f"with {len(streams)} programs in turns"
        )
        out.append(dataclasses.replace(level, seconds=seconds, divergence=text))
    return out
