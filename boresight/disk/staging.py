"""New files beside their places, then moved there in a way that a killed process cannot spoil.

A staging folder ``.boresight-XXXXXXXX`` stands in the output folder, for both to be on one file
system. Its process holds a claim on it; one that nobody claims is of a dead process. What is in it:

``new/``
    the files, by relative path;
``journal.json``
    once they are complete: what moves where. From then on the moves will be finished, if not by
    this process then by the next that looks.
"""

from __future__ import annotations

import errno
import json
import os
import re
import shutil
import stat
import tempfile
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path

from boresight.disk.claims import claim
from boresight.disk.manifest import Entry, Manifest, State, digest, inside, path_in, state

__all__ = ["Journal", "Staging", "recover"]

_PREFIX = ".boresight-"
_STAGING = re.compile(r"\.boresight-[a-z0-9_]{8}")
_CONTENTS = {"new", "journal.json", "journal.part", "manifest.part"}


@dataclass(frozen=True)
class Journal:
    """What becomes of staged files.

    Attributes
    ----------
    by, of : str
        See `boresight.disk.manifest.Entry`.
    files : dict
        SHA-256 by relative path.
    clears : bool
        Files that the same verb wrote before and does not write now are removed.
    """

    by: str
    of: str
    files: dict[str, str]
    clears: bool


class Staging:
    """A staging folder, claimed.

    Raises
    ------
    OSError
        Nothing can be written there.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.path = Path(tempfile.mkdtemp(prefix=_PREFIX, dir=folder))
        self.new = self.path / "new"
        try:
            self._claim = claim(self.path)
            (self.path / "journal.part").write_bytes(bytes(4096))  # a full disk says so now
            (self.path / "journal.part").unlink()
            self.new.mkdir()
        except BaseException:
            self.remove()
            raise

    def remove(self) -> None:
        """Remove it, with all that is still in it."""
        shutil.rmtree(self.path, ignore_errors=True)

    def files(self) -> list[str]:
        """Relative paths of the staged files."""
        return sorted(
            path.relative_to(self.new).as_posix()
            for path in self.new.rglob("*")
            if not path.is_dir()
        )

    def commit(self, by: str, of: str, *, clears: bool) -> None:
        """Move all files into place; the folder is claimed by the caller."""
        journal = Journal(by, of, {name: digest(self.new / name) for name in self.files()}, clears)
        part = self.path / "journal.part"
        part.write_text(json.dumps(asdict(journal)), encoding="utf-8")
        part.replace(self.path / "journal.json")
        _apply(self.folder, self.path, journal)


def recover(folder: Path) -> None:
    """Finish or remove what killed processes left in a folder that the caller claims."""
    for path in sorted(folder.glob(f"{_PREFIX}*")):
        if _is_staging(path) and (held := claim(path)) is not None:
            with held:
                journal = _journal(path)
                if journal is not None:
                    _apply(folder, path, journal)
                shutil.rmtree(path, ignore_errors=True)


def _is_staging(path: Path) -> bool:
    """Whether a path is a staging folder by name, kind, owner and contents."""
    if not _STAGING.fullmatch(path.name):
        return False
    found = path.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.geteuid():
        return False
    return {entry.name for entry in os.scandir(path)} <= _CONTENTS


def _journal(path: Path) -> Journal | None:
    try:
        data = json.loads((path / "journal.json").read_text(encoding="utf-8"))
        files = {inside(name): str(found) for name, found in data["files"].items()}
        return Journal(str(data["by"]), str(data["of"]), files, bool(data["clears"]))
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None


def _apply(folder: Path, staging: Path, journal: Journal) -> None:
    """Do what a journal says, whatever of it has been done: each file is complete at any time.

    The manifest first takes the new contents beside the old, then, when all is done, alone.
    """
    manifest = Manifest.load(folder)
    gone = [n for n in manifest.by(journal.by) if n not in journal.files] if journal.clears else []
    for name, found in journal.files.items():
        before = manifest.files.get(name)
        known = () if before is None else before.sha256
        manifest.files[name] = Entry(journal.by, journal.of, tuple(dict.fromkeys((*known, found))))
    _save(manifest, folder, staging)
    for name in journal.files:
        _move(staging / "new" / name, folder, name, manifest)
    for name in gone:
        if state(folder / name) is State.OURS and not (folder / name).is_symlink():
            (folder / name).unlink()
        del manifest.files[name]
    for name in sorted(manifest.folders, key=len, reverse=True):
        with suppress(OSError):  # somebody's files are in it
            (folder / name).rmdir()
        if not (folder / name).is_dir():
            manifest.folders.discard(name)
    for name, found in journal.files.items():
        manifest.files[name] = Entry(journal.by, journal.of, (found,))
    _save(manifest, folder, staging)


def _save(manifest: Manifest, folder: Path, staging: Path) -> None:
    """Replace the manifest at once."""
    part = staging / "manifest.part"
    part.write_text(manifest.to_json(), encoding="utf-8")
    part.replace(path_in(folder))


def _move(source: Path, folder: Path, name: str, manifest: Manifest) -> None:
    """Move a staged file, if it has not been moved and its place is free or ours."""
    target = folder / name
    if not source.exists():
        return
    for parent in reversed(Path(name).parents[:-1]):
        if not (folder / parent).is_dir():
            (folder / parent).mkdir()
            manifest.folders.add(parent.as_posix())
    plain = not target.is_symlink() and (target.is_file() or not target.exists())
    if plain and state(target) not in (State.ABSENT, State.OURS):
        return
    if plain:
        if target.exists():
            source.chmod(stat.S_IMODE(target.stat().st_mode))
        try:
            source.replace(target)
            return
        except OSError as error:
            if error.errno != errno.EXDEV:
                raise
    with target.open("wb") as file:  # through a link, a device, a FIFO, or to another disk
        file.write(source.read_bytes())
