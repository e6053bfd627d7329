"""`boresight check`: every level on the same input, bit by bit and cycle by cycle."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.disk.output import OutputFile
from boresight.firmware.build import CModel
from boresight.gateware.core import Core, build_core
from boresight.model.errors import InputError, ToolMissing
from boresight.model.estimator import Estimator, with_params
from boresight.model.tools.failure import ToolFailed
from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Program
from boresight.sim.compare.divergence import Divergence, first_divergence_rtl, write_reproducer
from boresight.sim.compare.verdict import Accuracy, beyond_declared, judge_accuracy
from boresight.sim.levels.floating import CompiledFloat
from boresight.sim.levels.level import outputs_of
from boresight.sim.records.feed import feed
from boresight.sim.records.record import Record
from boresight.sim.records.segments import SegmentedRun, interpret
from boresight.sim.rtl.cosim import RtlRun, RtlSimulation, SimulationFailed
from boresight.sim.rtl.sharing import selection
from boresight.sim.rtl.simulators import SIMULATORS, available

__all__ = [
    "ICARUS_CYCLES",
    "LEVELS",
    "CheckResult",
    "LevelResult",
    "check",
    "compare_rtl",
    "default_simulators",
    "failed_rtl",
    "simulation_of",
    "with_params",
]

#: Levels in order; each is compared with the integer interpreter.
LEVELS = ("fixed", "c", "rtl")
#: Cycles that Icarus runs beside Verilator: enough to see it agree, few enough to wait for.
ICARUS_CYCLES = 10_000

Progress = Callable[[str], None]


@dataclass(frozen=True)
class LevelResult:
    """One level's verdict.

    ``n_mismatch`` counts updates whose outputs, states or saturation flag differ and
    ``first_wrong`` is the first of them; ``error`` says why a level could not run (that fails
    too). Cycles are None for levels without a clock.
    """

    level: str
    simulator: str
    n_total: int
    n_mismatch: int
    seconds: float
    cycles_predicted: int | None = None
    cycles_min: int | None = None
    cycles_max: int | None = None
    interval_predicted: int | None = None
    interval_max: int | None = None
    error: str = ""
    divergence: str = ""
    first_wrong: int | None = None

    @property
    def good(self) -> bool:
        """Ran, compared something, and found no difference in words or cycles."""
        return (
            not self.error
            and self.n_total > 0
            and self.n_mismatch == 0
            and self.cycles_min == self.cycles_predicted == self.cycles_max
            and self.interval_predicted == self.interval_max
        )

    def line(self) -> str:
        """One line for people."""
        name = f"{self.level:8s} {self.simulator:12s}"
        if self.error:
            return f"{name} FAILED    {self.error}"
        text = f"{name} [{self.n_mismatch}/{self.n_total}] mismatches"
        if self.cycles_predicted is not None:
            counted = (
                f"{self.cycles_min}"
                if self.cycles_min == self.cycles_max
                else f"{self.cycles_min}..{self.cycles_max}"
            )
            text += (
                f"   cycles predicted {self.cycles_predicted}, counted {counted}"
                f"; interval predicted {self.interval_predicted}, counted {self.interval_max}"
            )
        return f"{text}   {self.seconds:.1f} s" + (
            f"\n         {self.divergence}" if self.divergence else ""
        )


@dataclass(frozen=True)
class CheckResult:
    """All levels on one record, and the float comparison that goes with them.

    ``outputs`` (steps, n_outputs) and ``saturated`` (steps,) are the interpreter's, and
    ``float_outputs`` those of float64. ``warnings`` say what in the record cannot be what its unit
    says.
    """

    estimator: str
    log: str
    config: str
    word: int
    levels: tuple[LevelResult, ...]
    accuracy: Accuracy
    warnings: tuple[str, ...]
    outputs: IntArray = field(repr=False)
    saturated: npt.NDArray[np.bool_] = field(repr=False)
    float_outputs: Mapping[str, npt.NDArray[np.float64]] = field(repr=False)

    @property
    def exact(self) -> bool:
        """Every level ran and equals the integer model."""
        return bool(self.levels) and all(level.good for level in self.levels)

    @property
    def good(self) -> bool:
        """Every level is exact, and fixed point is as near to float64 as its author accepts."""
        return self.exact and self.accuracy.good

    def to_json(self) -> dict[str, Any]:
        """Plain data for --json."""
        return {
            "estimator": self.estimator,
            "log": self.log,
            "config": self.config,
            "word": self.word,
            "good": self.good,
            "exact": self.exact,
            "accuracy": self.accuracy.to_json(),
            "warnings": list(self.warnings),
            "verification": [{**dataclasses.asdict(x), "good": x.good} for x in self.levels],
        }


def check(
    estimator: Estimator,
    record: Record,
    *,
    config: str = "small",
    word: int = 32,
    steps: int | None = None,
    levels: Sequence[str] = ("fixed", "c", "rtl"),
    simulator: str | None = None,
    params: Mapping[str, float] | None = None,
    reproducer: OutputFile | None = None,
    verilog_hook: Callable[[str], str] | None = None,
    core: Core | None = None,
    progress: Progress | None = None,
) -> CheckResult:
    """Run every level on a record, and judge fixed point against float64.

    Parameters
    ----------
    steps : int, optional
        Leading samples to use; all by default.
    levels : sequence of str
        Which of `LEVELS`; the integer interpreter runs in any case, as the reference.
    simulator : str, optional
        "verilator" or "icarus"; by default Verilator, and Icarus too (about `ICARUS_CYCLES`,
        not all updates) where it is installed.
    reproducer : OutputFile, optional
        Where to write a reproducer on the first mismatch.
    verilog_hook : callable, optional
        Changes the core's Verilog before it is simulated: for tests that must see a failure.
    core : Core, optional
        The core, if it is there already.

    Raises
    ------
    InputError
        Unknown level or simulator, steps below 1, a record that does not feed the estimator.
    """
    _refuse_options(levels, simulator, steps)
    say = progress or (lambda text: None)
    given = feed(estimator, record.head(steps))
    for text in given.warnings:
        say(f"warning: {text}")
    program, nodes = estimator.compile_traced(word=word)
    program = with_params(program, estimator, params)
    words = given.words(program)
    say(f"float64 and integer interpreter, {len(words)} updates")
    reference = CompiledFloat(estimator, params).run(given.inputs).outputs
    start = time.perf_counter()
    run = interpret(program, words)
    results = []
    if "fixed" in levels:
        results.append(_fixed_level(run, len(words), time.perf_counter() - start))
    if "c" in levels:
        say("C")
        results.append(_check_c(program, words, run.outputs, run.states, run.saturated))
    if "rtl" in levels:
        if core is None or core.program != program:
            say("compiling the core")
            core = build_core(program, config, urgent=estimator.urgent)
        results += _rtl_levels(core, estimator, words, run, simulator, verilog_hook, say)
    bad = next((r for r in results if r.first_wrong is not None), None)
    if bad is not None and bad.first_wrong is not None and reproducer is not None:
        write_reproducer(
            reproducer, program, words, bad.first_wrong, config=config, level=bad.level
        )
    accuracy = judge_accuracy(
        estimator.outputs,
        outputs_of(program, run.outputs),
        reference,
        program=program,
        nodes=nodes,
        inputs=words,
        states=run.states,
        saturated=run.saturated,
        clamped=given.clamped,
    )
    return CheckResult(
        estimator.name,
        record.name,
        config,
        word,
        tuple(results),
        accuracy,
        given.warnings + beyond_declared(program, run.states),
        run.outputs,
        run.saturated,
        reference,
    )


def _refuse_options(levels: Sequence[str], simulator: str | None, steps: int | None) -> None:
    for level in levels:
        if level not in LEVELS:
            raise InputError.at(
                "levels",
                wanted=f"some of {', '.join(LEVELS)}",
                found=repr(level),
                fix="separate them with commas",
            )
    if simulator is not None and simulator not in SIMULATORS:
        raise InputError.at(
            "simulator",
            wanted=f"one of {', '.join(SIMULATORS)}",
            found=repr(simulator),
            fix="choose one of these",
        )
    if steps is not None and steps < 1:
        raise InputError.at("steps", wanted="1 or more", found=str(steps), fix="give more steps")


def _fixed_level(run: SegmentedRun, updates: int, seconds: float) -> LevelResult:
    broken = run.broken_at
    text = "" if broken is None else f"fixed: states differ from C after step {broken}"
    return LevelResult(
        "fixed",
        "interpreter",
        updates,
        int(broken is not None),
        seconds,
        divergence=text,
        first_wrong=broken,
    )


def _rtl_levels(
    core: Core,
    estimator: Estimator,
    words: IntArray,
    run: SegmentedRun,
    simulator: str | None,
    hook: Callable[[str], str] | None,
    say: Progress,
) -> list[LevelResult]:
    results = []
    for name in (simulator,) if simulator else default_simulators():
        few = max(1, ICARUS_CYCLES // core.schedule.interval)
        m = len(words) if name == "verilator" or simulator else min(len(words), few)
        say(f"RTL in {name}, {m} updates")
        results.append(
            _check_rtl(core, estimator, words[:m], run.outputs[:m], run.saturated[:m], name, hook)
        )
    return results


def default_simulators() -> list[str]:
    """Verilator always (its absence is a failure), Icarus where it is."""
    return ["verilator"] + (["icarus"] if available("icarus") else [])


def _check_c(
    program: Program,
    words: IntArray,
    outputs: IntArray,
    states: IntArray,
    saturated: npt.NDArray[np.bool_],
) -> LevelResult:
    from boresight.sim.records.segments import with_state_outputs

    start = time.perf_counter()
    try:
        plain, flags = CModel(program).update(words)
        full, _ = CModel(with_state_outputs(program)).update(words)
    except (ToolMissing, ToolFailed) as error:
        return LevelResult("c", "gcc", len(words), 0, 0.0, error=str(error))
    n_out = len(program.outputs)
    wrong = (
        (plain != outputs).any(axis=1)
        | (full[:, :n_out] != outputs).any(axis=1)
        | (full[:, n_out:] != states).any(axis=1)
        | (flags != saturated)
    )
    text, step = "", None
    if wrong.any():
        step = int(np.argmax(wrong))
        text = str(_divergence_c(program, words, step))
    return LevelResult(
        "c",
        "gcc",
        len(words),
        int(wrong.sum()),
        time.perf_counter() - start,
        divergence=text,
        first_wrong=step,
    )


def _divergence_c(program: Program, words: IntArray, step: int) -> Divergence:
    from boresight.sim.compare.divergence import words_of_step

    at_step, wanted = words_of_step(program, words, step)
    found = CModel(at_step).values_of_update(words[step])
    for op in program.ops:
        if found[op.dest] != wanted[op.dest]:
            return Divergence(
                "c", step, program.values[op.dest].name, None, wanted[op.dest], found[op.dest]
            )
    return Divergence("c", step, "outputs", None, 0, None)


def simulation_of(core: Core, simulator: str, verilog: str) -> RtlSimulation:
    """The simulation of a core's Verilog."""
    program = core.program
    return RtlSimulation(
        verilog,
        word=program.arithmetic.word,
        n_inputs=len(program.inputs),
        n_outputs=len(program.outputs),
        lanes=core.machine.lanes,
        simulator=simulator,
    )


def _check_rtl(
    core: Core,
    estimator: Estimator,
    words: IntArray,
    outputs: IntArray,
    saturated: npt.NDArray[np.bool_],
    simulator: str,
    hook: Callable[[str], str] | None,
) -> LevelResult:
    start = time.perf_counter()
    verilog = core.verilog(instances=False)
    if hook is not None:
        verilog = hook(verilog)
    try:
        run = simulation_of(core, simulator, verilog).run(
            words, max_interval=core.schedule.interval, bus_writes=selection(core)
        )
    except (ToolMissing, SimulationFailed) as error:
        return failed_rtl(simulator, len(words), time.perf_counter() - start, error)
    result = compare_rtl(core, estimator, run, outputs, saturated, simulator)
    text, step = "", result.first_wrong
    if step is not None:
        found = first_divergence_rtl(core, verilog, words, step, simulator=simulator)
        text = str(found) if found else f"rtl: outputs differ, step {step}, all values equal"
    return dataclasses.replace(result, seconds=time.perf_counter() - start, divergence=text)


def failed_rtl(simulator: str, updates: int, seconds: float, error: Exception) -> LevelResult:
    """The level when nothing came out of the simulation."""
    return LevelResult(
        "rtl", simulator, updates, 0, seconds, error=str(error).strip().splitlines()[0]
    )


def compare_rtl(
    core: Core,
    estimator: Estimator,
    run: RtlRun,
    outputs: IntArray,
    saturated: npt.NDArray[np.bool_],
    simulator: str,
) -> LevelResult:
    """The level by its words, flags and cycles, against the interpreter and the schedule."""
    wrong = (run.outputs != outputs).any(axis=1) | (run.saturated != saturated)
    latencies = core.schedule.latencies
    counted = run.latency_cycles[:, : estimator.urgent].max(axis=1)
    timing_ok = np.array_equal(run.latency_cycles.min(axis=0), latencies) and np.array_equal(
        run.latency_cycles.max(axis=0), latencies
    )
    return LevelResult(
        "rtl",
        simulator,
        len(outputs),
        int(wrong.sum()),
        0.0,
        max(latencies[: estimator.urgent]),
        int(counted.min()),
        int(counted.max()),
        core.schedule.interval,
        int(run.interval_cycles.max()),
        error="" if timing_ok else "output cycles differ from the schedule",
        first_wrong=int(np.argmax(wrong)) if wrong.any() else None,
    )
