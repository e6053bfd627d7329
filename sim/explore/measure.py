"""The combinations of an exploration, and the work of each: errors, cycles, area, as plain data.

Errors and the verdict are those of `sim.compare.check` with the emitted C, whose words are those of
the core; cycles are those of the schedule; area, and on Spartan-6 an estimate of the clock, are
those of `gateware.synthesis`.

The key of a piece of work is a digest of everything that determines its result: program, machine,
target, tool, logs. Combinations share results that are the same for them: errors do not depend on
the machine.
"""

from __future__ import annotations

import ast
import hashlib
import itertools
import math
import re
import shlex
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

from boresight.gateware.core import Core, machine_for
from boresight.gateware.schedule.slots import ScheduleError
from boresight.gateware.synthesis.family import Target
from boresight.gateware.synthesis.routed import Mapped, Routed, implement, netlist_for
from boresight.gateware.synthesis.targets import SPARTAN6, TARGETS
from boresight.gateware.synthesis.tools import SynthesisError, find_tool
from boresight.model.declarations import ATTITUDE
from boresight.model.errors import InputError, require
from boresight.model.resolve import Named, estimator_of, split_names
from boresight.model.settings import CURRENT, using
from boresight.model.tools.external import ToolFailed
from boresight.model.words.program import Program
from boresight.sim.accuracy.figures import ANGLES, Errors, means
from boresight.sim.campaign import digest, sources
from boresight.sim.compare.check import Check
from boresight.sim.compare.verdict import saturated_text
from boresight.sim.levels.build import Build
from boresight.sim.records.files import record_of
from boresight.sim.records.record import Record
from boresight.sim.records.selection import Selection, selection
from boresight.sim.worlds.loop import recorded
from boresight.sim.worlds.world import NamedWorld, world_of

_ARGUMENT = re.compile(r"[A-Za-z_]\w*=")


@dataclass(frozen=True)
class Case:
    """A combination of word, machine and target.

    ``arguments`` are names and values of the estimator's constructor, as Python writes them.
    """

    estimator: Named
    arguments: tuple[tuple[str, str], ...]
    word: int
    config: str
    target: str

    @property
    def name(self) -> str:
        """Name that distinguishes it from other combinations."""
        arguments = [f"{key}={value}" for key, value in self.arguments]
        return ", ".join([*arguments, f"{self.word} bits", self.config, self.target])

    @property
    def named(self) -> Named:
        """The estimator with the arguments of its constructor; InputError if it has no name."""
        name, text = self.estimator, ", ".join(f"{key}={value}" for key, value in self.arguments)
        if not text:
            return name
        if not isinstance(name, str):
            wanted = "a name such as FILE.py:CLASS, with arguments of the constructor"
            found, fix = "an object of Python", "give its name, or leave the arguments out"
            raise InputError.at("estimator", wanted=wanted, found=found, fix=fix)
        if name.endswith(")"):
            return f"{name[:-1]}{'' if name.endswith('()') else ', '}{text})"
        if name.endswith(".py"):
            name = f"{name}:{type(estimator_of(name)).__name__}"
        return f"{name}({text})"

    def build(self, exploration: Exploration) -> Build:
        """The build to measure; raises `InputError` as `named` and `Build` do."""
        params = [dict(exploration.params)]
        return Build(estimator_of(self.named), config=self.config, word=self.word, params=params)

    def commands(self, exploration: Exploration) -> tuple[str, ...]:
        """Command lines that make and check it; none for an object."""
        if not isinstance(self.named, str):
            return ()
        name = shlex.quote(self.named)
        options = f"--word {self.word} --config {self.config}"
        options += "".join(f" --param {n}={value!r}" for n, value in exploration.params)
        options += CURRENT.get().options
        texts = [x for x in (*exploration.logs, *exploration.worlds) if isinstance(x, str)]
        rows = selection().options + (f" --steps {exploration.steps}" if exploration.steps else "")
        check = f"boresight check {name} {shlex.join(texts)} {options}{rows}"
        compile_ = f"boresight compile {name} {options} --target {self.target} -o build"
        return (compile_, check) if texts else (compile_,)


@dataclass(frozen=True)
class Exploration:
    """Settings of all combinations.

    Each world with the combination's estimator in float64 gives one more log. Of each log the first
    ``steps`` samples count. ``digest`` is that of the logs when the exploration began.
    """

    logs: tuple[str | Record, ...]
    worlds: tuple[NamedWorld, ...] = ()
    params: tuple[tuple[str, float], ...] = ()
    steps: int | None = None
    digest: str = ""


def arguments_of(texts: Sequence[Any]) -> tuple[list[Any], dict[str, list[Any]]]:
    """Logs, and values of the constructor's arguments by name, written ``NAME=VALUE,VALUE``.

    Raises InputError for a name twice, or a value that is no literal of Python.
    """
    logs: list[Any] = []
    arguments: dict[str, list[Any]] = {}
    for text in texts:
        if not isinstance(text, str) or not _ARGUMENT.match(text):
            logs.append(text)
            continue
        name, _, values = text.partition("=")
        require(name not in arguments, text, "each argument once", f"{name} twice", "join both")
        arguments[name] = [_literal(text, value.strip()) for value in split_names(values)]
    return logs, arguments


def _literal(text: str, value: str) -> Any:
    try:
        return ast.literal_eval(value)
    except (SyntaxError, ValueError, TypeError, MemoryError, RecursionError):
        fix = "write for example taps=4,8,16"
        require(value.isidentifier(), text, "values of an argument, with commas", value, fix)
        return value


def cases_of(
    name: Named,
    arguments: Mapping[str, Sequence[Any]],
    *,
    words: Sequence[int],
    configs: Sequence[str],
    targets: Sequence[str],
) -> list[Case]:
    """Every combination, once."""
    values = itertools.product(*arguments.values())
    argument_sets = [tuple(zip(arguments, map(repr, v), strict=True)) for v in values]
    product = dict.fromkeys(itertools.product(argument_sets, targets, configs, words))
    return [Case(name, a, word, config, target) for a, target, config, word in product]


#: Names of the angles between attitudes, distinct from the names of outputs.
ANGLE_NAMES = {ANGLES[0]: ATTITUDE} | {name: f"{ATTITUDE}_{name}" for name in ANGLES[1:]}


class Task(NamedTuple):
    """One piece of work: its kind, one of `KINDS`, and a combination that needs it."""

    kind: str
    case: Case


class Plan(NamedTuple):
    """A combination, the keys of its work, or the reason why it has no program."""

    case: Case
    keys: tuple[str, ...] = ()
    refused: str = ""


def digest_of(records: Sequence[Record]) -> str:
    """Digest of names, units and values."""
    columns = [(name, c) for record in records for name, c in record.columns.items()]
    return digest([(n, c.unit, hashlib.sha256(c.values.tobytes()).hexdigest()) for n, c in columns])


def planned(
    exploration: Exploration, cases: Sequence[Case], *, area: bool
) -> tuple[list[Plan], dict[str, Task]]:
    """The work of every combination, and all of it by key, the quick kinds first.

    Raises ToolMissing without yosys, if areas are wanted.
    """
    tool = find_tool().version if area else ""
    own = sources(*map(world_of, exploration.worlds))
    plans, programs = list[Plan](), dict[tuple[Any, int], Program]()
    tasks: dict[str, dict[str, Task]] = {kind: {} for kind in KINDS}
    for case in cases:
        try:
            variant = case.arguments, case.word
            if variant not in programs:
                programs[variant] = case.build(exploration).programs[0]
            machine = repr(machine_for(case.config, programs[variant]))
        except InputError as error:
            plans.append(Plan(case, refused=_line(error)))
            continue
        program = [own, programs[variant].digest]
        run = [*exploration.worlds, exploration.params, exploration.steps, exploration.digest]
        inputs: dict[str, list[Any]] = {
            "errors": [*program, case.arguments, *run, CURRENT.get().tolerances],
            "cycles": [*program, machine],
        }
        if area:
            inputs["area"] = [*program, machine, case.target, tool]
        keys = {kind: digest(kind, parts) for kind, parts in inputs.items()}
        plans.append(Plan(case, tuple(keys.values())))
        for kind, key in keys.items():
            tasks[kind].setdefault(key, Task(kind, case))
    return plans, {key: task for of_kind in tasks.values() for key, task in of_kind.items()}


def measured(exploration: Exploration, tasks: Sequence[Task]) -> list[dict[str, Any]]:
    """Rows of some tasks: figures, or why there are none (``refused``; ``again``: by a tool)."""
    rows = list[dict[str, Any]]()
    for kind, case in tasks:
        try:
            rows.append(KINDS[kind](exploration, case))
        except (InputError, ScheduleError) as error:
            rows.append({"refused": _line(error)})
        except (SynthesisError, ToolFailed) as error:
            rows.append({"refused": _line(error), "again": True})
    return rows


def _line(error: Exception) -> str:
    return str(error).strip().splitlines()[0]


@lru_cache(maxsize=1)
def _records(logs: tuple[str | Record, ...], rows: Selection, expected: str) -> list[Record]:
    """The logs, read once in each process; InputError if a file has changed since the beginning."""
    with using(rows=rows):
        records = [record_of(log) for log in logs]
    same, wanted = digest_of(records) == expected, "the logs as they were at the start"
    require(same, "logs", wanted, "other values", "explore again")
    return records


def _errors(exploration: Exploration, case: Case) -> dict[str, Any]:
    """Errors from float64 and from truth, saturated updates, and the verdict of `check`."""
    build = case.build(exploration)
    check = Check(build, levels=("c",), search=False)
    read = _records(exploration.logs, selection(), exploration.digest)
    logs = [record.head(exploration.steps) for record in read]
    logs += [recorded(world, build, exploration.steps) for world in exploration.worlds]
    results = [check.run(log)[0] for log in logs]
    figures: dict[str, float | None] = {}
    shares = []
    for parts in zip(*(result.accuracy.differences for result in results), strict=True):
        squares = math.fsum(part.samples * part.rms**2 for part in parts)
        largest = max(part.largest if math.isfinite(part.largest) else math.inf for part in parts)
        rms = math.sqrt(squares / max(sum(part.samples for part in parts), 1))
        figures |= {parts[0].output: _number(largest), f"{parts[0].output}.rms": _number(rms)}
        shares += [largest / part.tolerance for part in parts if part.tolerance]
    if shares:
        figures["tolerance"] = _number(max(shares))
    failures = [failure for result in results for failure in result.failures]
    saturated = sum(result.accuracy.saturated_updates for result in results)
    values = sum((Counter(result.accuracy.saturated) for result in results), Counter[str]())
    reasons = failures[:1]
    reasons += [r.accuracy.culprit for r in results if r.failures and r.accuracy.culprit][:1]
    reasons += [saturated_text(saturated, values)] if saturated else []
    # Of an attitude the angles of `boresight accuracy`, named as in `ANGLE_NAMES`.
    found = []
    for result in results:
        accumulator = Errors(build.estimators[0])
        for part in result.parts():
            accumulator.add(part.given, part.fixed.outputs)
        found.append(accumulator.result())
    angles = ANGLE_NAMES if any(ANGLES[0] in of for of in found) else {}
    truth = {f"{angles.get(n, n)}.truth": _number(value) for n, value in means(found).items()}
    return {
        **figures,
        **truth,
        "saturated": saturated,
        "saturations": dict(values),
        "good": not failures,
        "reason": " ".join("; ".join(dict.fromkeys(reasons)).split()),
    }


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


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
    clock = {} if mapped.clock is None else {"clock": mapped.clock.median_mhz}
    return {**used, "ram": mapped.used[target.device.memory], **clock}


#: Functions that measure, by kind, the quick ones first.
KINDS: Mapping[str, Callable[[Exploration, Case], dict[str, Any]]] = {
    "errors": _errors,
    "cycles": _cycles,
    "area": _area,
}
