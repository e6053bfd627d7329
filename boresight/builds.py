"""Builds as verbs make them: for a part, or of the folder that compile wrote."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeGuard

from boresight.gateware.core import build_shared_core
from boresight.gateware.machine import ALL_CONFIGS, machine_named
from boresight.gateware.schedule.slots import ScheduleError
from boresight.gateware.synthesis.targets import TARGETS
from boresight.model.errors import require
from boresight.model.resolve import ESTIMATOR_GROUP, Named, estimator_of, names_of_entry_points
from boresight.model.settings import CURRENT, using
from boresight.model.tools.files import MANIFEST, changed_files
from boresight.model.tools.reading import read_json
from boresight.sim.levels.build import Build

_REPORT = "report.json"


def build_for(make: Callable[..., Build], config: str, target: str) -> tuple[Build, str]:
    """The build for a target, and a line about its depth: the machine that every verb takes.

    ``make`` returns the build of a ``config``, which is taken as it is if its name has a depth. The
    depth is that with the least time from the last input word to the last urgent output. Of several
    programs the longest time counts; of one without urgent outputs, its interval. One pass of the
    scheduler gives the cycles, the table of the family (`Family.clocks`) the clock; without clocks,
    and for a ``target`` that is no part, no depth is chosen, and the line is empty.
    """
    build = make(config=config.removesuffix("-d7"))
    if config not in ALL_CONFIGS or target not in TARGETS:
        return build, ""
    family, lanes = TARGETS[target].family, machine_named(build.config).lanes
    depths = (depth for of_lanes, depth in family.clocks if of_lanes == lanes)
    configs = {depth: config if depth == 7 else f"{config}-d{depth}" for depth in depths}
    us = {}
    for depth, name in configs.items():
        try:
            core = build_shared_core(build.programs, name)
        except ScheduleError:  # no room
            continue
        plans = [part.schedule for part in core.parts]
        cycles = max(plan.latency if plan.urgent else plan.interval for plan in plans)
        us[depth] = cycles / family.clocks[lanes, depth]
    if not us:
        return build, ""
    best = min(us, key=lambda depth: us[depth])
    others = ", ".join(f"{depth} {t:.3g}" for depth, t in us.items() if depth != best)
    return make(config=configs[best]), (
        f"depth {best} for {target} ({configs[best]}): {us[best]:.3g} us to the last urgent output"
        f"{f' ({others})' if others else ''} by one pass of the scheduler and "
        f"{family.clocks_source}"
    )


def is_folder(name: Any) -> TypeGuard[str | Path]:
    """Whether an argument is a compiled folder; the name of an estimator comes first."""
    installed = names_of_entry_points(ESTIMATOR_GROUP)
    if not isinstance(name, str | Path) or name in installed:
        return False
    return any(os.path.isfile(os.path.join(name, file)) for file in (MANIFEST, _REPORT))


def made_of(names: Sequence[Named], build: Build, target: str, folder: Path) -> Any:
    """What a core is made of, for the report in its folder; None for objects.

    Paths are relative to the folder: it and the estimators may be moved together.
    """
    if not all(isinstance(name, str) for name in names):
        return None
    files = CURRENT.get().profiles
    return {
        "estimators": [_named(str(name), Path(), folder) for name in names],
        "config": build.config,
        "word": build.word,
        "target": target,
        "params": build.params,
        "profiles": None if files is None else [_moved(file, Path(), folder) for file in files],
    }


def changes_in(folder: Path) -> list[str]:
    """One line for each file of a compiled folder that has changed."""
    what = "missing, or not as compile wrote it; compile again"
    return [f"{folder / name}: {what}" for name in changed_files(folder)]


def build_in(folder: Path) -> Build:
    """The build whose Verilog and C are a folder's, and whose estimators are those of today.

    Raises InputError if the report does not say what the core was made of.
    """
    report = read_json(folder / _REPORT, "a report of compile")
    made = report.get("made")
    wanted, found = "what the core was compiled from", "objects of Python, or another verb's report"
    fix = "compile it again, from a file"
    require(made is not None, str(folder / _REPORT), wanted, found, fix)
    files = made["profiles"]
    with using(profiles=files and tuple(_moved(file, folder, Path()) for file in files)):
        estimators = [estimator_of(_named(n, folder, Path())) for n in made["estimators"]]
    build = Build(
        *estimators,
        **{key: made[key] for key in ("config", "word", "target", "params")},
        files={
            path.relative_to(folder).as_posix(): path.read_text(encoding="utf-8")
            for path in folder.rglob("*")
            if path.suffix in (".v", ".c", ".h")
        },
    )
    today, found = build.core.identity, f"the core {report['identity']}"
    wanted = f"the core {today} of its estimators"
    fix = "an estimator or Boresight has changed: compile again"
    require(today == report["identity"], str(folder), wanted, found, fix)
    return build


def _named(text: str, start: Path, to: Path) -> str:
    """A text of an estimator, whose file is seen from one folder, as seen from another."""
    stem, dot, rest = text.partition(".py")
    return _moved(f"{stem}{dot}", start, to) + rest if dot else text


def _moved(path: str, start: Path, to: Path) -> str:
    return Path(os.path.relpath(start / path, to)).as_posix()
