"""The combinations of an exploration, and the work that each needs, by key.

A key is a digest of all that decides a result: program, machine, target, tool, records, sources. So
combinations share results that are the same for them: errors do not depend on the machine.
"""

from __future__ import annotations

import ast
import itertools
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from boresight.gateware.core import machine_for
from boresight.gateware.synthesis.nextpnr import find_router
from boresight.gateware.synthesis.spartan6.family import SPARTAN6
from boresight.gateware.synthesis.targets import TARGETS
from boresight.gateware.synthesis.yosys import find_tool
from boresight.model.errors import InputError
from boresight.model.resolve import Named, split_names
from boresight.model.tolerances import tolerances_now
from boresight.sim.campaign import digest, sources
from boresight.sim.explore import measure
from boresight.sim.explore.measure import Case, Exploration, Task, digest_of
from boresight.sim.records.record import Record
from boresight.sim.rtl.simulators import require, version

__all__ = ["Planned", "arguments_of", "cases_of", "planned"]

#: Raised when rows of the journal change.
_FORMAT = 2

_ARGUMENT = re.compile(r"[A-Za-z_]\w*=")


@dataclass(frozen=True)
class Planned:
    """A combination and its work.

    Attributes
    ----------
    case : Case
    keys : mapping of str to str
        Of the work, by kind; empty where there is no program.
    refused : str
        Why there is no program.
    """

    case: Case
    keys: Mapping[str, str]
    refused: str = ""


def arguments_of(texts: Sequence[Any]) -> tuple[list[Any], dict[str, list[Any]]]:
    """Divide logs and texts ``NAME=VALUE,VALUE`` with arguments of the constructor.

    Returns
    -------
    logs : list
    arguments : dict of str to list
        Values by name.

    Raises
    ------
    InputError
        A name twice, or a value that is no literal of Python.
    """
    logs: list[Any] = []
    arguments: dict[str, list[Any]] = {}
    for text in texts:
        if not isinstance(text, str) or not _ARGUMENT.match(text):
            logs.append(text)
            continue
        name, _, values = text.partition("=")
        if name in arguments:
            raise InputError.at(
                text, wanted="each argument once", found=f"{name} twice", fix="join them"
            )
        arguments[name] = [_literal(text, value) for value in split_names(values)]
    return logs, arguments


def _literal(text: str, value: str) -> Any:
    try:
        return ast.literal_eval(value.strip())
    except (SyntaxError, ValueError, TypeError, MemoryError, RecursionError):
        if value.strip().isidentifier():
            return value.strip()
        raise InputError.at(
            text,
            wanted="values of the constructor's argument, with commas",
            found=repr(value),
            fix="write for example taps=4,8,16",
        ) from None


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
    product = itertools.product(argument_sets, targets, configs, words)
    return [
        *dict.fromkeys(Case(name, a, word, config, target) for a, target, config, word in product)
    ]


def planned(
    exploration: Exploration,
    cases: Sequence[Case],
    records: Sequence[Record],
    *,
    area: bool,
    route: bool = False,
    toggles: bool = False,
) -> tuple[list[Planned], dict[str, Task]]:
    """The work of every combination.

    Returns
    -------
    planned : list of Planned
    tasks : dict of str to Task
        By key, the quick ones first.

    Raises
    ------
    ToolMissing
        There is no yosys, no router or no Verilator, and areas, routed clocks or toggles are
        wanted.
    """
    tool = find_tool().version if area or route or toggles else ""
    if toggles:
        require("verilator")
    families = {case.target: TARGETS[case.target].family for case in cases} if route else {}
    routers = {
        name: find_router(family.router).version
        for name, family in families.items()
        if family.router is not None
    }
    logs = digest_of(records)
    out: list[Planned] = []
    tasks: dict[str, dict[str, Task]] = {kind: {} for kind in measure.KINDS}
    programs: dict[tuple[Any, int], tuple[Any, str]] = {}
    for case in cases:
        try:
            variant = case.arguments, case.word
            if variant not in programs:
                build = case.build(exploration)
                program = build.programs[0]
                programs[variant] = program, digest(_FORMAT, sources(), program.digest)
            program, program_key = programs[variant]
            machine = repr((machine_for(case.config, program), exploration.urgent))
        except InputError as error:
            out.append(Planned(case, {}, str(error).splitlines()[0]))
            continue
        run = [case.arguments, exploration.params, exploration.steps, logs]
        inputs: dict[str, list[Any]] = {
            "errors": [program_key, run, tolerances_now()],
            "cycles": [program_key, machine],
            "area": [program_key, machine, case.target, tool],
        }
        if case.target in routers:
            inputs["routed"] = [*inputs["area"], routers[case.target], exploration.seeds]
        if toggles and TARGETS[case.target].family is SPARTAN6:
            inputs["toggles"] = [program_key, machine, run, tool, version("verilator")]
        if not area:
            del inputs["area"]
        keys = {kind: digest(kind, parts) for kind, parts in inputs.items()}
        out.append(Planned(case, keys))
        for kind, key in keys.items():
            tasks[kind].setdefault(key, Task(key, kind, case))
    return out, {key: task for kind_tasks in tasks.values() for key, task in kind_tasks.items()}
