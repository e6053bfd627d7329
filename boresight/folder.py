"""The folder that compile wrote: what its core was made of, and the files of the core."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeGuard

from boresight.model.errors import InputError
from boresight.model.resolve import (
    ESTIMATOR_GROUP,
    Named,
    estimator_of,
    names_of_entry_points,
    profiles,
    profiles_now,
)
from boresight.model.tools.files import MANIFEST, changed_files
from boresight.sim.levels.build import Build
from boresight.sim.records.reading import read_json

_REPORT = "report.json"


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
    files = profiles_now()
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
    return [
        f"{folder / name}: missing, or not as compile wrote it; compile again"
        for name in changed_files(folder)
    ]


def build_in(folder: Path) -> Build:
    """The build whose Verilog and C are a folder's, and whose estimators are those of today.

    Raises InputError if the report does not say what the core was made of.
    """
    report = read_json(folder / _REPORT, "a report of compile")
    made = report.get("made")
    if made is None:
        raise InputError.at(
            str(folder / _REPORT),
            wanted="what the core was compiled from",
            found="none: objects of Python, or the report of another verb",
            fix="compile it again, from a file",
        )
    files = made["profiles"]
    with profiles(files and [_moved(file, folder, Path()) for file in files]):
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
    if (today := build.core.identity) != report["identity"]:
        raise InputError.at(
            str(folder),
            wanted=f"the core {today} of its estimators",
            found=report["identity"],
            fix="an estimator or Boresight has changed: compile again",
        )
    return build


def _named(text: str, start: Path, to: Path) -> str:
    """A text of an estimator, whose file is seen from one folder, as seen from another."""
    stem, dot, rest = text.partition(".py")
    return _moved(f"{stem}{dot}", start, to) + rest if dot else text


def _moved(path: str, start: Path, to: Path) -> str:
    return Path(os.path.relpath(start / path, to)).as_posix()
