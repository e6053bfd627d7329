"""The work of an exploration: errors, cycles and area of one combination, as plain data.

Errors and the verdict are those of `sim.compare.check` with the emitted C, whose words are those of
the core; cycles are those of the schedule; area and clock those of `gateware.synthesis`: an
estimate for Spartan-6, routed where an open tool routes.

The key of a piece of work is a digest of everything that determines its result: program, machine,
target, tool, logs. Combinations share results that are the same for them: errors do not depend on
the machine.
"""

from __future__ import annotations

import hashlib
import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from boresight.gateware.core import Core, machine_for
from boresight.gateware.schedule.slots import ScheduleError
from boresight.gateware.synthesis.family import Target
from boresight.gateware.synthesis.nextpnr import find_router
from boresight.gateware.synthesis.routed import Mapped, Routed, implement, netlist_for
from boresight.gateware.synthesis.spartan6.family import SPARTAN6
from boresight.gateware.synthesis.targets import TARGETS
from boresight.gateware.synthesis.yosys import SynthesisError, find_tool
from boresight.model.declarations import ATTITUDE
from boresight.model.errors import InputError
from boresight.model.tolerances import tolerances_now
from boresight.model.tools.failure import ToolFailed
from boresight.sim.accuracy.figures import ANGLES, errors
from boresight.sim.campaign import digest, sources
from boresight.sim.compare.check import Check
from boresight.sim.compare.results import CheckResult
from boresight.sim.compare.verdict import saturated_text
from boresight.sim.explore.cases import Case, Exploration
from boresight.sim.records.files import record_of
from boresight.sim.records.record import Record
from boresight.sim.records.selection import Selection, selected, selection

#: Names of the angles between attitudes, distinct from the names of outputs.
ANGLE_NAMES = {ANGLES[0]: ATTITUDE} | {name: f"{ATTITUDE}_{name}" for name in ANGLES[1:]}


@dataclass(frozen=True)
class Task:
    """One piece of work: its kind, one of `KINDS`, and a combination that needs it."""

    kind: str
    case: Case


@dataclass(frozen=True)
class Plan:
    """A combination, the keys of its work, or the reason why it has no program."""

    case: Case
    keys: tuple[str, ...] = ()
    refused: str = ""


def digest_of(records: Sequence[Record]) -> str:
    """Digest of names, units and values."""
    total = hashlib.sha256()
    for record in records:
        for name, column in record.columns.items():
            total.update(repr((name, column.unit, len(column.values))).encode())
            total.update(column.values.tobytes())
    return total.hexdigest()


def planned(
    exploration: Exploration, cases: Sequence[Case], *, area: bool, route: bool = False
) -> tuple[list[Plan], dict[str, Task]]:
    """The work of every combination, and all of it by key, the quick kinds first.

    Raises
    ------
    ToolMissing
        There is no yosys or no router, and areas or routed clocks are wanted.
    """
    tool = find_tool().version if area or route else ""
    families = {case.target: TARGETS[case.target].family for case in cases} if route else {}
    routers = {
        name: find_router(family.router).version
        for name, family in families.items()
        if family.router is not None
    }
    plans: list[Plan] = []
    tasks: dict[str, dict[str, Task]] = {kind: {} for kind in KINDS}
    programs: dict[tuple[Any, int], Any] = {}
    for case in cases:
        try:
            variant = case.arguments, case.word
            if variant not in programs:
                programs[variant] = case.build(exploration).programs[0]
            machine = repr(machine_for(case.config, programs[variant]))
        except InputError as error:
            plans.append(Plan(case, refused=_line(error)))
            continue
        program = [sources(), programs[variant].digest]
        run = [case.arguments, exploration.params, exploration.steps, exploration.digest]
        inputs: dict[str, list[Any]] = {
            "errors": [*program, *run, tolerances_now()],
            "cycles": [*program, machine],
        }
        if area:
            inputs["area"] = [*program, machine, case.target, tool]
        if case.target in routers:
            router = routers[case.target], exploration.seeds
            inputs["routed"] = [*program, machine, case.target, tool, router]
        keys = {kind: digest(kind, parts) for kind, parts in inputs.items()}
        plans.append(Plan(case, tuple(keys.values())))
        for kind, key in keys.items():
            tasks[kind].setdefault(key, Task(kind, case))
    return plans, {key: task for of_kind in tasks.values() for key, task in of_kind.items()}


def measured(exploration: Exploration, tasks: Sequence[Task]) -> list[dict[str, Any]]:
    """Rows of some tasks: figures, or under ``refused`` why there are none.

    A row with ``again`` failed in a tool, and may be tried once more.
    """
    return [_row(exploration, task) for task in tasks]


def _row(exploration: Exploration, task: Task) -> dict[str, Any]:
    try:
        return KINDS[task.kind](exploration, task.case)
    except (InputError, ScheduleError) as error:
        return {"refused": _line(error)}
    except (SynthesisError, ToolFailed) as error:
        return {"refused": _line(error), "again": True}


def _line(error: Exception) -> str:
    return str(error).strip().splitlines()[0]


def _records(exploration: Exploration) -> list[Record]:
    """The logs, read once in each process.

    Raises
    ------
    InputError
        A file has changed since the exploration began.
    """
    records = _read(exploration.logs, selection(), exploration.digest)
    if digest_of(records) != exploration.digest:
        raise InputError.at(
            "logs",
            wanted="the logs as they were when the exploration began",
            found="other values",
            fix="explore again",
        )
    return records


@lru_cache(maxsize=1)
def _read(logs: tuple[str | Record, ...], rows: Selection, _: str) -> list[Record]:
    with selected(rows):
        return [record_of(log) for log in logs]


def _errors(exploration: Exploration, case: Case) -> dict[str, Any]:
    """Errors from float64 and from truth, saturated updates, and the verdict of `check`."""
    check = Check(case.build(exploration), levels=("c",), search=False)
    logs = [record.head(exploration.steps) for record in _records(exploration)]
    results = [check.run(log)[0] for log in logs]
    figures: dict[str, float | None] = {}
    shares = []
    for parts in zip(*(result.accuracy.differences for result in results), strict=True):
        count = sum(part.samples for part in parts)
        mean_square = math.fsum(part.samples * part.rms**2 for part in parts) / max(count, 1)
        largest = max((part.largest for part in parts), key=_size)
        figures[parts[0].output] = _number(largest)
        figures[f"{parts[0].output}.rms"] = _number(math.sqrt(mean_square))
        shares += [_size(largest) / part.tolerance for part in parts if part.tolerance]
    if shares:
        figures["tolerance"] = _number(max(shares))
    failures = [failure for result in results for failure in result.failures]
    saturated = sum(result.accuracy.saturated_updates for result in results)
    values = sum((Counter(result.accuracy.saturated) for result in results), Counter[str]())
    causes = [r.accuracy.culprit for r in results if r.failures and r.accuracy.culprit]
    reasons = [
        *failures[:1],
        *causes[:1],
        *([saturated_text(saturated, values)] if saturated else []),
    ]
    return {
        **figures,
        **_truth(results),
        "saturated": saturated,
        "saturations": dict(values),
        "good": not failures,
        "reason": " ".join("; ".join(dict.fromkeys(reasons)).split()),
    }


def _size(value: float) -> float:
    """The value; infinity if it is NaN."""
    return value if math.isfinite(value) else math.inf


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _truth(results: Sequence[CheckResult]) -> dict[str, float | None]:
    """Root mean square error from truth by output: the mean over the logs that have a truth.

    Of an attitude these are the angles of `boresight accuracy`, named as in `ANGLE_NAMES`.
    """
    rms: dict[str, list[float]] = {}
    for result in results:
        estimator = result.build.estimators[0]
        found = errors(estimator, result.given, result.fixed.outputs)
        angles = ANGLE_NAMES if ANGLES[0] in found else {}
        for name, value in found.items():
            rms.setdefault(f"{angles.get(name, name)}.truth", []).append(value)
    return {name: _number(math.fsum(values) / len(values)) for name, values in rms.items()}


def _cycles(exploration: Exploration, case: Case) -> dict[str, Any]:
    """Cycles to the last urgent output and to the next sample."""
    schedule = case.build(exploration).core.schedule
    return {"cycles": schedule.latency, "interval": schedule.interval}


def map_core(core: Core, target: Target) -> Mapped:
    """Resources of a core on a target; on Spartan-6 also an estimate of its clock."""
    primitives = target.family is SPARTAN6
    text = core.verilog(instances=primitives, identified=not primitives)
    return netlist_for(text, "core", target)


def route_core(core: Core, target: Target, **settings: Any) -> Routed:
    """A core placed and routed on a target; ``settings`` of `implement`."""
    text = core.verilog(instances=False, identified=True)
    return implement(text, "core", target, **settings)


def _area(exploration: Exploration, case: Case) -> dict[str, Any]:
    """Area of the core; of a Spartan-6 also its clock, estimated for grade -2 and median nets."""
    target = TARGETS[case.target]
    mapped = map_core(case.build(exploration).core, target)
    used = {name: mapped.used[name] for name in ("lut", "ff", "dsp")}
    clock: dict[str, Any] = {}
    if mapped.clock is not None:
        clock = {"clock": mapped.clock.median_mhz, "clock_is": "estimate"}
    return {**used, "ram": mapped.used[target.device.memory], **clock}


def _routed(exploration: Exploration, case: Case) -> dict[str, Any]:
    """Clock of the placed and routed core at its slowest seed, MHz."""
    core, target = case.build(exploration).core, TARGETS[case.target]
    design = route_core(core, target, seeds=exploration.seeds)
    return {"clock": design.clock_mhz, "clock_is": "routed"}


#: Functions that measure, by kind, the quick ones first.
KINDS: Mapping[str, Callable[[Exploration, Case], dict[str, Any]]] = {
    "errors": _errors,
    "cycles": _cycles,
    "area": _area,
    "routed": _routed,
}
