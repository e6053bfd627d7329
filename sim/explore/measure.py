"""The work of an exploration: errors, cycles and area of one combination, as plain data.

Errors are those of `sim.compare` and `sim.accuracy`, of the emitted C, whose words are those of the
core (`boresight check`); cycles are those of the schedule; area and clock those of
`gateware.synthesis`: an estimate for Spartan-6, routed where an open tool routes.
"""

from __future__ import annotations

import ast
import hashlib
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from boresight.gateware.core import Core
from boresight.gateware.schedule.slots import ScheduleError
from boresight.gateware.synthesis.device import Device
from boresight.gateware.synthesis.routed import implement, netlist_for
from boresight.gateware.synthesis.spartan6.family import SPARTAN6
from boresight.gateware.synthesis.targets import TARGETS
from boresight.gateware.synthesis.yosys import SynthesisError
from boresight.model.declarations import ATTITUDE
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.resolve import Named, estimator_of
from boresight.model.tools.cache import Cache
from boresight.model.tools.failure import ToolFailed
from boresight.sim.accuracy.figures import ANGLES, errors, units_of
from boresight.sim.compare.difference import Difference, differences
from boresight.sim.compare.soundness import check_sound
from boresight.sim.levels.build import Build
from boresight.sim.levels.floating import CompiledFloat
from boresight.sim.levels.integer import Emitted, words_of
from boresight.sim.levels.level import Run
from boresight.sim.records.feed import Feed, feed
from boresight.sim.records.files import record_of
from boresight.sim.records.record import Record
from boresight.sim.records.selection import Selection, selected, selection
from boresight.sim.rtl.netlist import NetlistSimulation
from boresight.sim.rtl.simulators import SimulationFailed

__all__ = ["ATTITUDES", "KINDS", "Case", "Exploration", "Task", "measured"]

Params = tuple[tuple[str, float], ...]

#: Names of the angles between attitudes, distinct from those of outputs.
ATTITUDES = {ANGLES[0]: ATTITUDE} | {name: f"{ATTITUDE}_{name}" for name in ANGLES[1:]}


@dataclass(frozen=True)
class Case:
    """A combination.

    Attributes
    ----------
    estimator : str, class or Estimator
    arguments : tuple of (name, value)
        Of its constructor; values as Python writes them.
    word : int
    config, target : str
    """

    estimator: Named
    arguments: tuple[tuple[str, str], ...]
    word: int
    config: str
    target: str

    @property
    def named(self) -> Named:
        """The estimator with the arguments of its constructor.

        Raises
        ------
        InputError
            The constructor does not take them, or is missing.
        """
        name, text = self.estimator, ", ".join(f"{key}={value}" for key, value in self.arguments)
        if not text:
            return name
        if isinstance(name, type):
            try:
                return name(**{key: ast.literal_eval(value) for key, value in self.arguments})
            except InputError:
                raise
            except Exception as error:
                found = f"{type(error).__name__}: {error}".splitlines()[0]
                where = f"{name.__name__}({text})"
                raise InputError.at(
                    where,
                    wanted="a constructor that returns",
                    found=found,
                    fix="correct the arguments",
                ) from error
        if not isinstance(name, str):
            raise InputError.at(
                "estimator",
                wanted="a name or a class with arguments of the constructor",
                found="an object",
                fix="give its class, or leave the arguments out",
            )
        if name.endswith(")"):
            return f"{name[:-1]}{'' if name.endswith('()') else ', '}{text})"
        if name.endswith(".py"):
            name = f"{name}:{type(estimator_of(name)).__name__}"
        return f"{name}({text})"

    def build(self, exploration: Exploration) -> Build:
        """The build to measure; raises `InputError` as `named` and `Build` do."""
        return Build(
            estimator_of(self.named),
            config=self.config,
            word=self.word,
            params=[dict(exploration.params)],
            urgent=exploration.urgent,
        )


@dataclass(frozen=True)
class Exploration:
    """Settings of all combinations.

    Logs, parameter values, most samples of each log, router seeds, urgent outputs, and the digest
    of the logs.
    """

    logs: tuple[str | Record, ...]
    params: Params = ()
    steps: int | None = None
    seeds: int = 1
    urgent: int | None = None
    digest: str = ""


@dataclass(frozen=True)
class Task:
    """One piece of work: its key, one of `KINDS`, a combination that needs it."""

    key: str
    kind: str
    case: Case


def measured(exploration: Exploration, tasks: Sequence[Task]) -> list[dict[str, Any]]:
    """Rows of some tasks: figures, or under ``refused`` why there are none.

    A row with ``again`` failed in a tool, and may be tried once more.
    """
    return [_row(exploration, task) for task in tasks]


def _row(exploration: Exploration, task: Task) -> dict[str, Any]:
    try:
        return KINDS[task.kind](exploration, task.case)
    except (InputError, ScheduleError) as error:
        return {"refused": str(error).splitlines()[0]}
    except (SynthesisError, SimulationFailed, ToolFailed) as error:
        return {"refused": str(error).splitlines()[0], "again": True}


def digest_of(records: Sequence[Record]) -> str:
    """Digest of names, units and values."""
    digest = hashlib.sha256()
    for record in records:
        for name, column in record.columns.items():
            digest.update(repr((name, column.unit, len(column.values))).encode())
            digest.update(column.values.tobytes())
    return digest.hexdigest()


def _records(exploration: Exploration) -> list[Record]:
    """The logs, read once in each process.

    Raises
    ------
    InputError
        A file has changed since the exploration began.
    """
    records = _read(exploration.logs, selection(), exploration.digest)
    if exploration.digest and digest_of(records) != exploration.digest:
        raise InputError.at(
            "logs",
            wanted="the logs as they were when the exploration began",
            found="other values",
            fix="explore again",
        )
    return records


@lru_cache(maxsize=2)
def _read(logs: tuple[str | Record, ...], rows: Selection, _: str) -> list[Record]:
    with selected(rows):
        return [record_of(log) for log in logs]


def _errors(exploration: Exploration, case: Case) -> dict[str, Any]:
    """Largest and root mean square errors from float64 and from truth, saturated updates."""
    build = case.build(exploration)
    estimator, records = build.estimators[0], _records(exploration)
    feeds = [feed(estimator, r.head(exploration.steps)) for r in records]
    for rows in feeds:
        check_sound(build, [rows.inputs])
    fixed, floating = Emitted(build), CompiledFloat(build)
    runs = [fixed.run_anew(rows.inputs) for rows in feeds]
    near = [
        differences(estimator.outputs, run.outputs, floating.run_anew(rows.inputs).outputs)
        for run, rows in zip(runs, feeds, strict=True)
    ]
    lengths = [len(rows) for rows in feeds]
    return {
        "updates": sum(lengths),
        "saturated": sum(run.n_saturated for run in runs),
        "clamped": sum(sum(rows.clamped.values()) for rows in feeds),
        "errors": {
            parts[0].output: _error(parts, lengths) for parts in map(list, zip(*near, strict=True))
        },
        "truth": _truth(estimator, feeds, runs),
    }


def _error(parts: Sequence[Difference], lengths: Sequence[int]) -> dict[str, Any]:
    """An output's error over all logs."""
    d = Difference.joined(parts, lengths)
    return {
        "unit": d.unit,
        "largest": _number(d.largest),
        "rms": _number(d.rms),
        "tolerance": d.tolerance,
        "good": all(part.good for part in parts),
    }


def _truth(estimator: Estimator, feeds: Sequence[Feed], runs: Sequence[Run]) -> dict[str, Any]:
    """Errors from truth: mean of the root mean squares over the logs with truth, and the largest.

    For an attitude, the angles of `boresight accuracy`, under the names of `ATTITUDES`.
    """
    rms: dict[str, list[float]] = {}
    largest: dict[str, list[float]] = {}
    units: dict[str, str] = {}
    for rows, run in zip(feeds, runs, strict=True):
        error_units = units_of(estimator, rows)
        angles = ATTITUDES if ANGLES[0] in error_units else {}
        for name, value in errors(estimator, rows, run.outputs).items():
            rms.setdefault(angles.get(name, name), []).append(value)
            units[angles.get(name, name)] = error_units[name]
        truth = {name: values[rows.counts] for name, values in rows.truth.items()}
        outputs = {name: run.outputs[name][rows.counts] for name in truth}
        for d in differences(estimator.outputs, outputs, truth, judged=False):
            if d.output in rms:
                largest.setdefault(d.output, []).append(d.largest)
    return {
        name: {
            "unit": units[name],
            "rms": _number(math.fsum(values) / len(values)),
            "largest": _number(float(np.max(largest[name]))) if name in largest else None,
        }
        for name, values in rms.items()
    }


def _cycles(exploration: Exploration, case: Case) -> dict[str, Any]:
    """Cycles to each output and of an update, and its numbers of operations."""
    core = case.build(exploration).core
    plan = core.schedule
    terms = [slot for slot in plan.slots if slot.term is not None]
    return {
        "cycles": plan.latency,
        "interval": plan.interval,
        "latencies": dict(zip(core.program.output_names, plan.latencies, strict=True)),
        "microwords": len(core.image.rom),
        "multiplications": len(terms),
        "accesses": sum(1 + (slot.b is not None) for slot in plan.slots)
        + len(plan.ends)
        + len(plan.gets),
    }


def _area(exploration: Exploration, case: Case) -> dict[str, Any]:
    """Area of the core; of a Spartan-6 also its clock, estimated for grade -2 and median nets."""
    core, target = case.build(exploration).core, TARGETS[case.target]
    device = target.device
    primitives = target.family is SPARTAN6
    text = core.verilog(instances=primitives, identified=not primitives)
    mapped = netlist_for(text, "core", target, cache_dir=Cache().root)
    clock = {}
    if mapped.clock is not None:
        clock = {"clock": mapped.clock.median_mhz, "clock_is": "estimate"}
    return {**_used(mapped.used, device), **clock, "fits": True}


def _generic(core: Core) -> str:
    """Its Verilog for families without primitives of their own."""
    return core.verilog(instances=False, identified=True)


def _used(used: Mapping[str, float], device: Device) -> dict[str, Any]:
    return {"lut": used["lut"], "ff": used["ff"], "dsp": used["dsp"], "ram": used[device.memory]}


def _routed(exploration: Exploration, case: Case) -> dict[str, Any]:
    """Clock of the placed and routed core at its slowest seed, MHz."""
    core, target = case.build(exploration).core, TARGETS[case.target]
    design = implement(
        _generic(core), "core", target, seeds=exploration.seeds, cache_dir=Cache().root
    )
    return {"clock": design.clock_mhz, "clock_is": "routed"}


def _toggles(exploration: Exploration, case: Case) -> dict[str, Any]:
    """Nets that change in an update of the netlist, on the first log."""
    build = case.build(exploration)
    record = _records(exploration)[0]
    rows = feed(build.estimators[0], record.head(_TOGGLED.stop)).inputs
    words = words_of(build.programs[0], rows)
    stop = len(words)
    first = min(_TOGGLED.start, stop - 1)
    return {"toggles": NetlistSimulation(build.core, trace=True).toggles(words, first, stop)}


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


#: Updates of the first log in which toggles are counted, fewer if it is shorter.
_TOGGLED = range(28, 32)
#: Functions that measure, by kind, the quick ones first.
KINDS: Mapping[str, Callable[[Exploration, Case], dict[str, Any]]] = {
    "errors": _errors,
    "cycles": _cycles,
    "area": _area,
    "toggles": _toggles,
    "routed": _routed,
}
