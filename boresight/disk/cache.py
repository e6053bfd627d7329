"""The build cache: what compilers, simulators and yosys made, by the hash of what it was made from.

An entry is a folder that is complete or absent: it is made under another name and renamed. Its
``entry.json`` lists its files with their hashes; an entry that does not agree with it is made anew.
Beyond a limit the least recently used entries go, but never one that a living process uses: who
uses an entry holds a shared claim on its folder (`boresight.disk.claims`).
"""

from __future__ import annotations

import hashlib
import json
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

from boresight.disk.claims import Claim, claim
from boresight.disk.manifest import digest
from boresight.model.errors import InputError
from boresight.model.tools.folders import cache_folder

__all__ = ["LIMIT_MB", "LIMIT_VARIABLE", "Cache", "Cleared", "Entry", "Usage"]

#: Environment variable with another limit, in megabytes.
LIMIT_VARIABLE = "BORESIGHT_CACHE_MB"
#: Size above which entries go, in megabytes of 1,000,000 bytes.
LIMIT_MB = 1000

_LIST = "entry.json"
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

    def __init__(self, path: Path, held: Claim) -> None:
        self.path = path
        self._held = held


@dataclass(frozen=True)
class Usage:
    """How full the cache is; sizes in bytes."""

    path: Path
    entries: int
    size: int
    limit: int


@dataclass(frozen=True)
class Cleared:
    """What went: entries and bytes; and how many are in use and stayed."""

    entries: int
    size: int
    in_use: int


@dataclass(frozen=True)
class _Kept:
    folder: Path
    size: int
    used_ns: int


class Cache:
    """The build cache, or one at another place.

    Parameters
    ----------
    root : Path, optional
        Its folder; ``boresight`` in the user's cache folder by default, or a private one in the
        temporary folder where that cannot be written.
    limit_mb : float, optional
        Another limit than `LIMIT_MB` or what `LIMIT_VARIABLE` says.

    Raises
    ------
    InputError
        That variable holds no number.
    """

    def __init__(self, root: Path | None = None, *, limit_mb: float | None = None) -> None:
        self.root = cache_folder("boresight") if root is None else Path(root)
        self.limit = int(1e6 * (_limit_mb() if limit_mb is None else limit_mb))

    def get(self, name: str, identity: str, make: Callable[[Path], None]) -> Entry:
        """The entry of what ``identity`` describes, made if it is not here.

        Of several processes or threads that want the same, one makes it and the others wait.

        Parameters
        ----------
        name : str
            For people: the entry's folder begins with it.
        identity : str
            All that the result depends on.
        make : callable
            Makes the entry's files in the empty folder that it is given. The folder's name
            changes afterwards.
        """
        key = hashlib.sha256(identity.encode()).hexdigest()[:32]
        plain = re.sub(r"[^A-Za-z0-9_.-]", "_", name)[:40] or "entry"
        folder = self.root / f"{plain}-{key}"
        found = self._use(folder)
        if found is not None:
            return found
        (self.root / "locks").mkdir(parents=True, exist_ok=True)
        with FileLock(self.root / "locks" / f"{key[:2]}.lock"):
            found = self._use(folder)
            if found is None:
                found = self._make(folder, make)
        self.trim()
        return found

    def usage(self) -> Usage:
        """How full it is."""
        kept = self._kept()
        return Usage(self.root, len(kept), sum(k.size for k in kept), self.limit)

    def trim(self) -> Cleared:
        """Remove what dead processes left, and the least recently used entries beyond the limit."""
        return self._remove(self.limit)

    def clear(self) -> Cleared:
        """Remove everything that was put here, but for entries in use, and nothing else."""
        cleared = self._remove(-1)
        for path in sorted((self.root / "locks").glob("*")):
            lock = FileLock(path)
            if _LOCK.fullmatch(path.name) and not cleared.in_use:
                with suppress(OSError), lock.acquire(timeout=0):
                    path.unlink()
        for log in (self.root / "logs").glob("*.log"):
            log.unlink(missing_ok=True)
        for folder in (self.root / "locks", self.root / "logs", self.root):
            with suppress(OSError):  # not there, or something is left in it
                folder.rmdir()
        return cleared

    def _use(self, folder: Path) -> Entry | None:
        """The entry, if it is here and sound."""
        try:
            held = claim(folder, shared=True, wait=True)
            if held is None or not _same(held, folder) or not _sound(folder):
                return None
            os.utime(folder / _LIST)
        except OSError:
            return None
        return Entry(folder, held)

    def _make(self, folder: Path, make: Callable[[Path], None]) -> Entry:
        with self._claimed():
            work = Path(tempfile.mkdtemp(prefix="work-", dir=self.root))
            held = claim(work, shared=True)
        assert held is not None
        try:
            make(work)
            _list(work)
            with self._claimed():
                if folder.exists():  # not sound, else it would be in use
                    self._rename_away(folder)
                work.rename(folder)
        except BaseException:
            shutil.rmtree(work, ignore_errors=True)
            raise
        return Entry(folder, held)

    def _kept(self) -> list[_Kept]:
        """Entries, the least recently used first."""
        out = []
        for path in self.root.glob("*-*"):
            with suppress(OSError, ValueError, KeyError, TypeError):
                if _ENTRY.fullmatch(path.name) and not path.is_symlink():
                    size = sum(f["size"] for f in _listed(path).values())
                    out.append(_Kept(path, size, (path / _LIST).stat().st_mtime_ns))
        return sorted(out, key=lambda kept: kept.used_ns)

    def _remove(self, limit: int) -> Cleared:
        """Remove entries until those left are within a limit; below 0: all."""
        if not self.root.is_dir():
            return Cleared(0, 0, 0)
        gone: list[Path] = []
        entries = size = in_use = 0
        with self._claimed():
            for path in self.root.glob("work-*"):
                if _WORK.fullmatch(path.name):
                    with _unused(path) as unused:
                        gone += [path] if unused else []
            kept = self._kept()
            left = sum(k.size for k in kept)
            for each in kept:
                if left <= limit:
                    break
                with _unused(each.folder) as unused:
                    if not unused:
                        in_use += 1
                        continue
                    gone.append(self._rename_away(each.folder))
                left -= each.size
                entries, size = entries + 1, size + each.size
        for path in gone:
            shutil.rmtree(path, ignore_errors=True)
        return Cleared(entries, size, in_use)

    def _rename_away(self, folder: Path) -> Path:
        """Make an entry absent, at once."""
        away = Path(tempfile.mkdtemp(prefix="work-", dir=self.root))
        return folder.rename(away)

    @contextmanager
    def _claimed(self) -> Iterator[None]:
        held = claim(self.root, wait=True)
        assert held is not None
        with held:
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


def _same(held: Claim, folder: Path) -> bool:
    """Whether the claimed folder still has its name."""
    return os.path.samestat(os.fstat(held.descriptor), folder.stat())


@contextmanager
def _unused(folder: Path) -> Iterator[bool]:
    """Whether nobody uses a folder; nobody will in the block."""
    held = None
    with suppress(OSError):
        held = claim(folder)
    yield held is not None
    if held is not None:
        held.release()


def _list(folder: Path) -> None:
    files = {
        path.relative_to(folder).as_posix(): {"size": path.stat().st_size, "sha256": digest(path)}
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }
    (folder / _LIST).write_text(json.dumps({"format": _FORMAT, "files": files}), encoding="utf-8")


def _listed(folder: Path) -> dict[str, dict[str, Any]]:
    """Files of an entry; an exception of some kind if there is no good list."""
    data = json.loads((folder / _LIST).read_text(encoding="utf-8"))
    if data["format"] != _FORMAT:
        raise ValueError("another format")
    return dict(data["files"])


#: Entries whose contents this process has looked at: folder and its inode.
_known_sound: set[tuple[str, int]] = set()


def _sound(folder: Path) -> bool:
    """Whether all files of an entry are as they were; their contents once in a process."""
    known = (str(folder), folder.stat().st_ino)
    try:
        for name, wanted in _listed(folder).items():
            if (folder / name).stat().st_size != wanted["size"]:
                return False
            if known not in _known_sound and digest(folder / name) != wanted["sha256"]:
                return False
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return False
    _known_sound.add(known)
    return True
