"""``.boresight.json``: the files that Boresight wrote into a folder, and what it wrote."""

from __future__ import annotations

import hashlib
import json
import os
import stat
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path, PurePosixPath
from typing import Any

from boresight.model.errors import InputError

__all__ = ["NAME", "Entry", "Manifest", "State", "digest", "inside", "path_in", "state"]

NAME = ".boresight.json"
_FORMAT = 1
_ABOUT = "Files that boresight wrote here. It overwrites and removes these alone, while unchanged."


class State(Enum):
    """Relation of a file to the manifests of its folders."""

    ABSENT = "absent"
    OURS = "as boresight wrote it"
    CHANGED = "changed since boresight wrote it"
    UNREADABLE = "that cannot be read"
    FOREIGN = "not written by boresight"


@dataclass(frozen=True)
class Entry:
    """A file that a verb wrote.

    Attributes
    ----------
    by, of : str
        The verb that wrote it, and its subject (estimators, an experiment).
    sha256 : tuple of str
        Of its contents; two hashes while the file is being replaced.
    """

    by: str
    of: str
    sha256: tuple[str, ...]


@dataclass
class Manifest:
    """Files by relative path, and the folders made for them."""

    files: dict[str, Entry] = field(default_factory=dict)
    folders: set[str] = field(default_factory=set)

    @classmethod
    def load(cls, folder: Path) -> Manifest:
        """Read the manifest of a folder; an empty one if the file is missing.

        Raises
        ------
        InputError
            The file with the manifest's name is not one.
        OSError
            It cannot be read.
        """
        path = path_in(folder)
        try:
            if path.is_symlink():
                raise ValueError("a symbolic link")
            data = json.loads(path.read_text(encoding="utf-8"))
            return cls._parse(data)
        except FileNotFoundError:
            return cls()
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError, IsADirectoryError):
            raise InputError.at(
                str(path),
                wanted="the list of files that boresight keeps under this name",
                found="something else",
                fix="move it away, or choose another folder",
            ) from None

    @classmethod
    def _parse(cls, data: Any) -> Manifest:
        if data["boresight_manifest"] != _FORMAT:
            raise ValueError("another format")
        files = {
            inside(name): Entry(str(e["by"]), str(e["of"]), tuple(map(str, e["sha256"])))
            for name, e in data["files"].items()
        }
        return cls(files, {inside(name) for name in data["folders"]})

    def to_json(self) -> str:
        """Contents of the file; equal manifests give equal texts."""
        data = {
            "boresight_manifest": _FORMAT,
            "about": _ABOUT,
            "folders": sorted(self.folders),
            "files": {
                name: {"by": e.by, "of": e.of, "sha256": list(e.sha256)}
                for name, e in sorted(self.files.items())
            },
        }
        return json.dumps(data, indent=1) + "\n"

    def by(self, verb: str) -> Mapping[str, Entry]:
        """Return the files of one verb."""
        return {name: e for name, e in self.files.items() if e.by == verb}


def path_in(folder: Path) -> Path:
    """Path of a folder's manifest; one for each user in a folder with the sticky bit."""
    if folder.stat().st_mode & stat.S_ISVTX:
        return folder / f"{Path(NAME).stem}-{os.geteuid()}.json"
    return folder / NAME


def inside(name: str) -> str:
    """Return a relative path that does not leave its folder; raise ValueError for any other."""
    path = PurePosixPath(name)
    if not path.parts or path.is_absolute() or ".." in path.parts:
        raise ValueError(f"not inside: {name!r}")
    return path.as_posix()


def digest(path: Path) -> str:
    """SHA-256 of a file's contents, in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def state(path: Path) -> State:
    """State of a plain file, or a link to one, by the manifests of its folder and those above."""
    if not path.exists():
        return State.ABSENT
    if not path.is_file():
        return State.FOREIGN
    listed = False
    contents = ""
    for folder in path.parents:
        entry = _entry(folder, path)
        if entry is None:
            continue
        listed = True
        try:
            contents = contents or digest(path)
        except OSError:
            return State.UNREADABLE
        if contents in entry.sha256:
            return State.OURS
    return State.CHANGED if listed else State.FOREIGN


def _entry(folder: Path, path: Path) -> Entry | None:
    try:
        return Manifest.load(folder).files.get(path.relative_to(folder).as_posix())
    except (InputError, OSError):
        return None
