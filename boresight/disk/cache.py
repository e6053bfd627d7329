"""The build cache: outputs of compilers, simulators and yosys, by the hash of their inputs.

An entry is a folder that is complete or absent: it is filled under another name and renamed. Its
``entry.json`` lists its files with their hashes; an entry that differs from its list is made anew.
Beyond a limit the least recently used entries are removed, but never one that a running process
uses: it holds a shared lock on the entry's folder (`boresight.disk.locks`).
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import re
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from filelock import FileLock

from boresight.disk.locks import FolderLock, lock_folder
from boresight.disk.manifest import digest
from boresight.model.errors import InputError
from boresight.model.tools.folders import cache_folder

__all__ = ["LIMIT_MB", "LIMIT_VARIABLE", "Cache", "Cleared", "Entry", "Usage"]

#: Environment variable with another limit, in megabytes.
LIMIT_VARIABLE = "BORESIGHT_CACHE_MB"
#: Size above which entries are removed, in megabytes of 1,000,000 bytes.
LIMIT_MB = 1000

_LIST = "entry.json"
#: File of the cache with the bytes of all entries, or more: what stands there is never too small.
_SIZE = "size"
_FORMAT = 1
_ENTRY = re.compile(r"[A-Za-z0-9_.-]+-[0-9a-f]{32}")
_WORK = re.compile(r"work-[a-z0-9_]{8}")
_LOCK = re.compile(r"[0-9a-f]{2}\.lock")


class Entry:
    """An entry in use: it stays in the cache as long as this object lives.

    Attributes
    ----------
    path : Path
        Its folder.
    """

    def __init__(self, path: Path, lock: FolderLock) -> None:
        self.path = path
        self._lock = lock


@dataclass(frozen=True)
class Usage:
    """Size of the cache and its limit, in bytes."""

    path: Path
    entries: int
    size: int
    limit: int


@dataclass(frozen=True)
class Cleared:
    """Number and bytes of the entries removed; number of those kept because they are in use."""

    entries: int
    size: int
    in_use: int


@dataclass(frozen=True)
class _Stored:
    folder: Path
    size: int
    used_ns: int


class Cache:
    """The build cache, or one in another folder.

    Parameters
    ----------
    root : Path, optional
        Its folder; ``boresight`` in the user's cache folder by default, or a private one in the
        temporary folder where that cannot be written.
    limit_mb : float, optional
        Limit instead of that in `LIMIT_VARIABLE`, or else `LIMIT_MB`.

    Raises
    ------
    InputError
        `LIMIT_VARIABLE` is not a number.
    """

    def __init__(self, root: Path | None = None, *, limit_mb: float | None = None) -> None:
        self.root = cache_folder("boresight") if root is None else Path(root)
        self.limit = int(1e6 * (_limit_mb() if limit_mb is None else limit_mb))

    def get(self, name: str, identity: str, make: Callable[[Path], None]) -> Entry:
        """Return the entry with this identity; make it if it is absent.

        If several processes or threads need the same entry, one makes it and the others wait.

        Parameters
        ----------
        name : str
            Readable name with which the entry's folder begins.
        identity : str
            Everything that the result depends on.
        make : callable
            Writes the entry's files into the empty folder that is its argument. The folder is
            renamed afterwards.
        """
        key = hashlib.sha256(identity.encode()).hexdigest()[:32]
        plain = re.sub(r"[^A-Za-z0-9_.-]", "_", name)[:40] or "entry"
        folder = self.root / f"{plain}-{key}"
        entry = self._use(folder)
        if entry is not None:
            return entry
        (self.root / "locks").mkdir(parents=True, exist_ok=True)
        with FileLock(self.root / "locks" / f"{key[:2]}.lock"):
            entry = self._use(folder)
            if entry is None:
                entry = self._make(folder, make)
        self.trim()
        return entry

    def usage(self) -> Usage:
        """Return the size of the cache."""
        entries = self._stored()
        return Usage(self.root, len(entries), sum(k.size for k in entries), self.limit)

    def trim(self) -> Cleared:
        """Remove leftovers of ended processes, and beyond the limit least recently used entries.

        A tenth of the limit is then free, so that not every new entry needs a count of all.
        """
        return self._remove(self.limit, 9 * self.limit // 10)

    def clear(self) -> Cleared:
        """Remove all entries, locks and logs of the cache, except entries in use."""
        cleared = self._remove(-1, -1)
        (self.root / _SIZE).unlink(missing_ok=True)
        for path in sorted((self.root / "locks").glob("*")):
            lock = FileLock(path)
            if _LOCK.fullmatch(path.name) and not cleared.in_use:
                with suppress(OSError), lock.acquire(timeout=0):
                    path.unlink()
        for log in (self.root / "logs").glob("*.log"):
            log.unlink(missing_ok=True)
        for folder in (self.root / "locks", self.root / "logs", self.root):
            with suppress(OSError):  # missing, or not empty
                folder.rmdir()
        return cleared

    def _use(self, folder: Path) -> Entry | None:
        """Return the entry, or None if it is absent or damaged."""
        try:
            lock = lock_folder(folder, shared=True, wait=True)
            if lock is None or not _same(lock, folder) or not _sound(folder):
                return None
            os.utime(folder / _LIST)
        except OSError:
            return None
        return Entry(folder, lock)

    def _make(self, folder: Path, make: Callable[[Path], None]) -> Entry:
        with self._locked():
            work = Path(tempfile.mkdtemp(prefix="work-", dir=self.root))
            lock = lock_folder(work, shared=True)
        assert lock is not None
        try:
            make(work)
            size = _list(work)
            with self._locked():
                self._note(self._noted() + size)
                if folder.exists():  # damaged, or `_use` would have returned it
                    self._rename_away(folder)
                work.rename(folder)
        except BaseException:
            shutil.rmtree(work, ignore_errors=True)
            raise
        return Entry(folder, lock)

    def _stored(self) -> list[_Stored]:
        """Return the entries, least recently used first."""
        entries = []
        for path in self.root.glob("*-*"):
            with suppress(OSError, ValueError, KeyError, TypeError):
                if _ENTRY.fullmatch(path.name) and not path.is_symlink():
                    size = sum(f["size"] for f in _listed(path).values())
                    entries.append(_Stored(path, size, (path / _LIST).stat().st_mtime_ns))
        return sorted(entries, key=lambda entry: entry.used_ns)

    def _noted(self) -> float:
        """Return the bytes of all entries, or more; infinity if they were never counted."""
        try:
            return int((self.root / _SIZE).read_text(encoding="ascii"))
        except (OSError, ValueError):
            return math.inf

    def _note(self, size: float) -> None:
        if math.isfinite(size):
            (self.root / _SIZE).write_text(str(size), encoding="ascii")

    def _remove(self, limit: int, left: int) -> Cleared:
        """Remove entries until ``left`` bytes are left, if there are more than ``limit``."""
        if not self.root.is_dir():
            return Cleared(0, 0, 0)
        gone: list[Path] = []
        entries = size = in_use = 0
        with self._locked():
            for path in self.root.glob("work-*"):
                if _WORK.fullmatch(path.name):
                    with _unused(path) as unused:
                        gone += [path] if unused else []
            stored = self._stored() if self._noted() > limit else []
            size_left = sum(k.size for k in stored)
            least = left if size_left > limit else limit
            for entry in stored:
                if size_left <= least:
                    break
                with _unused(entry.folder) as unused:
                    if not unused:
                        in_use += 1
                        continue
                    gone.append(self._rename_away(entry.folder))
                size_left -= entry.size
                entries, size = entries + 1, size + entry.size
            if stored:
                self._note(size_left)
        for path in gone:
            shutil.rmtree(path, ignore_errors=True)
        return Cleared(entries, size, in_use)

    def _rename_away(self, folder: Path) -> Path:
        """Rename an entry's folder, so that the entry is absent at once."""
        away = Path(tempfile.mkdtemp(prefix="work-", dir=self.root))
        return folder.rename(away)

    @contextmanager
    def _locked(self) -> Iterator[None]:
        lock = lock_folder(self.root, wait=True)
        assert lock is not None
        with lock:
            yield


def _limit_mb() -> float:
    text = os.environ.get(LIMIT_VARIABLE, "")
    if not text:
        return LIMIT_MB
    try:
        limit = float(text)
        if not 0 <= limit < 1e9:
            raise ValueError
    except ValueError:
        raise InputError.at(
            LIMIT_VARIABLE,
            wanted="megabytes, 0 or more",
            found=repr(text),
            fix="correct or unset this environment variable",
        ) from None
    return limit


def _same(lock: FolderLock, folder: Path) -> bool:
    """Whether the locked folder still has this name."""
    return os.path.samestat(os.fstat(lock.descriptor), folder.stat())


@contextmanager
def _unused(folder: Path) -> Iterator[bool]:
    """Lock a folder for the block; False if another process uses it."""
    lock = None
    with suppress(OSError):
        lock = lock_folder(folder)
    yield lock is not None
    if lock is not None:
        lock.release()


def _list(folder: Path) -> int:
    """List the files of an entry in it; return their bytes."""
    files: dict[str, dict[str, Any]] = {
        path.relative_to(folder).as_posix(): {"size": path.stat().st_size, "sha256": digest(path)}
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }
    (folder / _LIST).write_text(json.dumps({"format": _FORMAT, "files": files}), encoding="utf-8")
    return sum(file["size"] for file in files.values())


def _listed(folder: Path) -> dict[str, dict[str, Any]]:
    """Files of an entry; a missing or malformed list raises."""
    data = json.loads((folder / _LIST).read_text(encoding="utf-8"))
    if data["format"] != _FORMAT:
        raise ValueError("another format")
    return dict(data["files"])


#: Entries whose contents this process has checked: folder and its inode.
_known_sound: set[tuple[str, int]] = set()


def _sound(folder: Path) -> bool:
    """Whether an entry's files have their sizes and, checked once in a process, their hashes."""
    entry = (str(folder), folder.stat().st_ino)
    try:
        for name, wanted in _listed(folder).items():
            if (folder / name).stat().st_size != wanted["size"]:
                return False
            if entry not in _known_sound and digest(folder / name) != wanted["sha256"]:
                return False
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return False
    _known_sound.add(entry)
    return True
