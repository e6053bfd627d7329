"""Staging of new files, moved to their paths in a way that a killed process cannot spoil.

The staging folder ``.boresight-XXXXXXXX`` is in the output folder, so that both are on one file
system. Its process locks it; an unlocked one is left from a process that ended. It contains:

``new/``
    the files, by relative path;
``journal.json``
    written when the files are complete: which file moves where. From then on the moves will be
    finished, by this process or by the next that opens the output folder.
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

from boresight.disk.locks import lock_folder
from boresight.disk.manifest import Entry, Manifest, State, digest, inside, path_in, state

__all__ = ["Journal", "Staging", "recover"]

_PREFIX = ".boresight-"
_STAGING = re.compile(r"\.boresight-[a-z0-9_]{8}")
_CONTENTS = {"new", "journal.json", "journal.part", "manifest.part"}


@dataclass(frozen=True)
class Journal:
    """The moves of staged files.

    Attributes
    ----------
    by, of : str
        See `boresight.disk.manifest.Entry`.
    files : dict
        SHA-256 by relative path.
    clears : bool
        Whether files that the same verb wrote before and does not write now are removed.
    """

    by: str
    of: str
    files: dict[str, str]
    clears: bool


class Staging:
    """A locked staging folder.

    Raises
    ------
    OSError
        The folder cannot be written.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.path = Path(tempfile.mkdtemp(prefix=_PREFIX, dir=folder))
        self.new = self.path / "new"
        try:
            self._lock = lock_folder(self.path)
            (self.path / "journal.part").write_bytes(bytes(4096))  # fails now on a full disk
            (self.path / "journal.part").unlink()
            self.new.mkdir()
        except BaseException:
            self.remove()
            raise

    def remove(self) -> None:
        """Remove the folder and its contents."""
        shutil.rmtree(self.path, ignore_errors=True)

    def files(self) -> list[str]:
        """Return the relative paths of the staged files."""
        return sorted(
            path.relative_to(self.new).as_posix()
            for path in self.new.rglob("*")
            if not path.is_dir()
        )

    def commit(self, by: str, of: str, *, clears: bool) -> None:
        """Move all files to their paths; the caller has locked the output folder."""
        journal = Journal(by, of, {name: digest(self.new / name) for name in self.files()}, clears)
        part = self.path / "journal.part"
        part.write_text(json.dumps(asdict(journal)), encoding="utf-8")
        part.replace(self.path / "journal.json")
        _apply(self.folder, self.path, journal)


def recover(folder: Path) -> None:
    """Finish or remove what killed processes left in a folder that the caller has locked."""
    for path in sorted(folder.glob(f"{_PREFIX}*")):
        if _is_staging(path) and (lock := lock_folder(path)) is not None:
            with lock:
                journal = _journal(path)
                if journal is not None:
                    _apply(folder, path, journal)
                shutil.rmtree(path, ignore_errors=True)


def _is_staging(path: Path) -> bool:
    """Whether a path is a staging folder by name, kind, owner and contents."""
    if not _STAGING.fullmatch(path.name):
        return False
    status = path.lstat()
    if not stat.S_ISDIR(status.st_mode) or status.st_uid != os.geteuid():
        return False
    return {entry.name for entry in os.scandir(path)} <= _CONTENTS


def _journal(path: Path) -> Journal | None:
    try:
        data = json.loads((path / "journal.json").read_text(encoding="utf-8"))
        files = {inside(name): str(sha256) for name, sha256 in data["files"].items()}
        return Journal(str(data["by"]), str(data["of"]), files, bool(data["clears"]))
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return None


def _apply(folder: Path, staging: Path, journal: Journal) -> None:
    """Carry out a journal, also one partly carried out; each file is complete at any time.

    The manifest first lists the new hashes beside the old, and only the new when all is done.
    """
    manifest = Manifest.load(folder)
    gone = [n for n in manifest.by(journal.by) if n not in journal.files] if journal.clears else []
    for name, sha256 in journal.files.items():
        before = manifest.files.get(name)
        earlier = () if before is None else before.sha256
        manifest.files[name] = Entry(
            journal.by, journal.of, tuple(dict.fromkeys((*earlier, sha256)))
        )
    _save(manifest, folder, staging)
    for name in journal.files:
        _move(staging / "new" / name, folder, name, manifest)
    for name in gone:
        if state(folder / name) is State.OURS and not (folder / name).is_symlink():
            (folder / name).unlink()
        del manifest.files[name]
    for name in sorted(manifest.folders, key=len, reverse=True):
        with suppress(OSError):  # not empty
            (folder / name).rmdir()
        if not (folder / name).is_dir():
            manifest.folders.discard(name)
    for name, sha256 in journal.files.items():
        manifest.files[name] = Entry(journal.by, journal.of, (sha256,))
    _save(manifest, folder, staging)


def _save(manifest: Manifest, folder: Path, staging: Path) -> None:
    """Replace the manifest atomically."""
    part = staging / "manifest.part"
    part.write_text(manifest.to_json(), encoding="utf-8")
    part.replace(path_in(folder))


def _move(source: Path, folder: Path, name: str, manifest: Manifest) -> None:
    """Move a staged file unless that is done, or a file of other origin has its path."""
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
