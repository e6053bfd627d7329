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
from boresight.model.estimator import Estimator, input_words, with_params
from boresight.model.fixed import IntArray
from boresight.model.program import Program
from boresight.model.tool_failure import ToolFailed
from boresight.sim.accuracy import largest_turn_deg
from boresight.sim.cosim import RtlRun, RtlSimulation, SimulationFailed
from boresight.sim.divergence import Divergence, first_divergence_rtl, write_reproducer
from boresight.sim.feed import attitude_of, inputs_of, named_outputs, status_of
from boresight.sim.log import Log
from boresight.sim.segments import interpret
from boresight.sim.sharing import selection
from boresight.sim.simulators import SIMULATORS, available

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
    """All levels on one log, and the float comparison that goes with them.

    ``vs_float_max_deg``: largest difference of each Euler angle and sample between fixed and
    float64. ``vs_float_attitude_deg``: largest angle between the attitudes, None for an estimator
    without a quaternion. ``status_changed``: updates whose status word, and so some decision,
    differs. ``outputs`` (steps, n_outputs) and ``saturated`` (steps,) are the interpreter's.
    """

    estimator: str
    log: str
    config: str
    word: int
    levels: tuple[LevelResult, ...]
    vs_float_max_deg: float
    vs_float_until_80_deg: float
    vs_float_attitude_deg: float | None
    status_changed: int
    saturated_updates: int
    outputs: IntArray = field(repr=False)
    saturated: npt.NDArray[np.bool_] = field(repr=False)
    float_outputs: Mapping[str, npt.NDArray[np.float64]] = field(repr=False)

    @property
    def good(self) -> bool:
        """Every level is good."""
        return bool(self.levels) and all(level.good for level in self.levels)

    def to_json(self) -> dict[str, Any]:
        """Plain data for --json."""
        return {
            "estimator": self.estimator,
            "log": self.log,
            "config": self.config,
            "word": self.word,
            "good": self.good,
            "accuracy": {
                "vs_float_max_deg": self.vs_float_max_deg,
                "vs_float_until_80_deg": self.vs_float_until_80_deg,
                "vs_float_attitude_deg": self.vs_float_attitude_deg,
                "status_changed": self.status_changed,
                "source": "fixed against float64, every sample: Euler angles, angle "
                "between the attitudes, status words",
            },
            "saturated_updates": self.saturated_updates,
            "verification": [{**dataclasses.asdict(x), "good": x.good} for x in self.levels],
        }


def euler_difference_deg(
    program: Program, outputs: IntArray, reference: Mapping[str, npt.NDArray[np.float64]]
) -> npt.NDArray[np.float64]:
    """Largest wrapped difference of pitch, roll and heading [deg], (steps,)."""
    worst = np.zeros(len(outputs))
    for name in ("pitch", "roll", "heading"):
        k = program.output_names.index(name)
        fixed = program.format(program.outputs[k]).real(outputs[:, k])
        d = np.abs((fixed - reference[name] + 1.0) % 2.0 - 1.0) * 180.0
        worst = np.maximum(worst, d)
    return worst


def check(
    estimator: Estimator,
    log: Log,
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
    """Run every level on a log.

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

    Raises
    ------
    InputError
        Unknown level or simulator, steps below 1, or an estimator without attitude.
    """
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
    if not {"pitch", "roll", "heading"} <= {o.name for o in estimator.outputs}:
        raise InputError.at(
            estimator.name,
            wanted="outputs pitch, roll, heading",
            found="others",
            fix="this estimator cannot be checked against float in degrees",
        )
    say = progress or (lambda text: None)
    program = with_params(estimator.compile(word=word), estimator, params)
    real = inputs_of(estimator, log)[:steps]
    words = input_words(program, real[:, :, None])[:, :, 0]
    n = len(words)

    say(f"float reference, {n} updates")
    reference = {
        k: v[:, 0] for k, v in estimator.run_float(real[:, :, None], params=params).outputs.items()
    }
    say("integer interpreter")
    start = time.perf_counter()
    run = interpret(program, words)
    results = []
    if "fixed" in levels:
        divergence = ""
        if run.broken_at is not None:
            divergence = f"fixed: states differ from C after step {run.broken_at}"
        results.append(
            LevelResult(
                "fixed",
                "interpreter",
                n,
                int(run.broken_at is not None),
                time.perf_counter() - start,
                divergence=divergence,
                first_wrong=run.broken_at,
            )
        )
    if "c" in levels:
        say("C")
        results.append(_check_c(program, words, run.outputs, run.states, run.saturated))
    if "rtl" in levels:
        if core is None or core.program != program:
            say("compiling the core")
            core = build_core(program, config, urgent=estimator.urgent)
        for name in (simulator,) if simulator else default_simulators():
            few = max(1, ICARUS_CYCLES // core.schedule.interval)
            m = n if name == "verilator" or simulator else min(n, few)
            say(f"RTL in {name}, {m} updates")
            results.append(
                _check_rtl(
                    core,
                    estimator,
                    words[:m],
                    run.outputs[:m],
                    run.saturated[:m],
                    name,
                    verilog_hook,
                )
            )
    bad = next((r for r in results if r.first_wrong is not None), None)
    if bad is not None and bad.first_wrong is not None and reproducer is not None:
        write_reproducer(
            reproducer, program, words, bad.first_wrong, config=config, level=bad.level
        )
    difference = euler_difference_deg(program, run.outputs, reference)
    steep = np.abs(reference["pitch"]) * 180.0 > 80.0
    until = int(np.argmax(steep)) if steep.any() else n
    fixed = named_outputs(program, run.outputs)
    turn = largest_turn_deg(attitude_of(fixed), attitude_of(reference)) if "qw" in fixed else None
    changed = (
        int(np.count_nonzero(status_of(fixed) != status_of(reference))) if "status" in fixed else 0
    )
    return CheckResult(
        estimator.name,
        log.name,
        config,
        word,
        tuple(results),
        float(difference.max()),
        float(difference[:until].max()) if until else 0.0,
        turn,
        changed,
        int(run.saturated.sum()),
        run.outputs,
        run.saturated,
        reference,
    )


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
    from boresight.sim.segments import with_state_outputs

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
    from boresight.sim.divergence import words_of_step

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
