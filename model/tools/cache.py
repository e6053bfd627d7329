"""The build cache: outputs of compilers, simulators and yosys, by the hash of their inputs.

An entry is a folder, complete or absent: it is filled under another name and renamed. Its
``entry.json`` lists the hashes of its files; a damaged entry is made again. Beyond a limit, the
least recently used entries are removed, but none that was used within the last hour.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from filelock import FileLock

from boresight.model.tools.external import cache_folder
from boresight.model.tools.files import digest

#: Size above which entries are removed, in bytes.
_LIMIT = 1_000_000_000
_LIST = "entry.json"
#: Entries used within this time, in seconds, are never removed: a process may be using them.
_RECENT_S = 3600
_trimmed: set[Path] = set()


class Cache:
    """The build cache in a folder, by default ``boresight/builds`` in the user's cache folder."""

    def __init__(self, root: Path | None = None) -> None:
        self.root = cache_folder("boresight") / "builds" if root is None else Path(root)

    def get(self, name: str, identity: str, make: Callable[[Path], None]) -> Path:
        """Return the folder of the entry with this identity; make the entry if it is absent.

        ``identity`` is everything that the result depends on, ``name`` that with which the entry's
        folder begins; ``make`` writes files into an empty folder, which is renamed afterwards. If
        several processes or threads need the same entry, one makes it and the others wait. Raises
        OSError if the cache cannot be written.
        """
        key = hashlib.sha256(identity.encode()).hexdigest()[:32]
        plain = re.sub(r"[^A-Za-z0-9_.-]", "_", name)[:40] or "entry"
        folder = self.root / f"{plain}-{key}"
        if _sound(folder):
            return folder
        (self.root / "locks").mkdir(parents=True, exist_ok=True)
        with FileLock(self.root / "locks" / f"{plain}-{key[:2]}.lock"):
            if _sound(folder):
                return folder
            shutil.rmtree(folder, ignore_errors=True)
            with tempfile.TemporaryDirectory(
                prefix="work-", dir=self.root, ignore_cleanup_errors=True
            ) as work:
                made = Path(work) / "entry"
                made.mkdir()
                make(made)
                files = [p for p in made.rglob("*") if p.is_file()]
                hashes = {p.relative_to(made).as_posix(): digest(p) for p in files}
                (made / _LIST).write_text(json.dumps(hashes), encoding="utf-8")
                made.rename(folder)
        if self.root not in _trimmed:  # Once in a process: it looks at every file.
            _trimmed.add(self.root)
            self.trim()
        return folder

    def usage(self) -> int:
        """Return the bytes of all entries."""
        return sum(size for _, size, _ in self._entries())

    def trim(self) -> None:
        """Remove what killed processes left, and least recently used entries beyond the limit."""
        entries = self._entries()
        left = sum(size for _, size, _ in entries)
        for used, size, folder in sorted(entries):
            if left <= _LIMIT or used > time.time() - _RECENT_S:
                break
            shutil.rmtree(folder, ignore_errors=True)
            left -= size
        for folder in self.root.glob("work-*"):
            if folder.stat().st_mtime < time.time() - 24 * _RECENT_S:
                shutil.rmtree(folder, ignore_errors=True)

    def _entries(self) -> list[tuple[float, int, Path]]:
        """Time of the last use, bytes and folder of each entry."""
        entries = []
        for path in self.root.glob(f"*/{_LIST}"):
            size = sum(p.stat().st_size for p in path.parent.rglob("*") if p.is_file())
            entries.append((path.stat().st_mtime, size, path.parent))
        return entries


def _sound(folder: Path) -> bool:
    """Whether an entry exists and its files have their hashes; note that it was used."""
    try:
        hashes = json.loads((folder / _LIST).read_text(encoding="utf-8"))
        if any(digest(folder / name) != value for name, value in hashes.items()):
            return False
        os.utime(folder / _LIST)
    except (OSError, ValueError, AttributeError):
        return False
    return True
