"""``python -m boresight.disk.clear FOLDER...``: remove results and nothing else.

Removes unchanged files that Boresight wrote below the folders, and folders that are then empty.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from boresight.disk.locks import lock_folder
from boresight.disk.manifest import Manifest, State, path_in, state
from boresight.disk.signals import deferred_signals
from boresight.disk.staging import recover
from boresight.model.errors import InputError

__all__ = ["clear", "main"]


def clear(folder: Path) -> list[Path]:
    """Remove the results below a folder, and folders that held nothing else.

    Returns
    -------
    list of Path
        Files and folders that stay: Boresight did not write them, or they were changed since.

    Raises
    ------
    InputError
        A file named ``.boresight.json`` is not a list of results.
    OSError
        Something cannot be removed.
    """
    if not folder.is_dir():
        return [folder] if folder.exists() else []
    inner = [p for p in folder.rglob("*") if p.is_dir() and not p.is_symlink()]
    for each in (*sorted(inner, reverse=True), folder):
        lock = lock_folder(each, wait=True)
        with deferred_signals():
            recover(each)
            results = path_in(each).exists()
            _clear(each)
        if lock is not None:
            lock.release()
        if results:
            with suppress(OSError):  # not empty
                each.rmdir()
    return sorted(folder.rglob("*"))


#: Files that the manifest lists and that stay.
_STAY = (State.CHANGED, State.UNREADABLE)


def _clear(folder: Path) -> None:
    """Remove what the manifest of one folder lists."""
    manifest = Manifest.load(folder)
    for name in list(manifest.files):
        path = folder / name
        if path.is_symlink() or (whose := state(path.absolute())) in _STAY:
            continue
        if whose is State.OURS:
            path.unlink()
        del manifest.files[name]
    for name in sorted(manifest.folders, key=len, reverse=True):
        with suppress(OSError):  # not empty
            (folder / name).rmdir()
    if not manifest.files:
        path_in(folder).unlink(missing_ok=True)


def main(arguments: Sequence[str]) -> int:
    """Clear each folder and print how much stays."""
    for name in arguments:
        try:
            left = clear(Path(name)) if name else []
        except (InputError, OSError) as error:
            print(f"error: {error}", file=sys.stderr)
            return 2
        if left:
            print(
                f"{name}: {len(left)} files and folders stay: changed, or not written by boresight"
            )
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
