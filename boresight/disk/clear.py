"""``python -m boresight.disk.clear FOLDER...``: remove results, and nothing else.

Files that Boresight wrote below the folders and nobody changed, and folders that are empty then.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from boresight.disk.claims import claim
from boresight.disk.deferred import deferred
from boresight.disk.manifest import Manifest, State, path_in, state
from boresight.disk.staging import recover
from boresight.model.errors import InputError

__all__ = ["clear", "main"]


def clear(folder: Path) -> list[Path]:
    """Remove the results below a folder, and folders that held nothing else.

    Returns
    -------
    list of Path
        Files and folders that stay: they are somebody's.

    Raises
    ------
    InputError
        A file named ``.boresight.json`` is no list of results.
    OSError
        Something cannot be removed.
    """
    if not folder.is_dir():
        return [folder] if folder.exists() else []
    inner = [p for p in folder.rglob("*") if p.is_dir() and not p.is_symlink()]
    for each in (*sorted(inner, reverse=True), folder):
        held = claim(each, wait=True)
        with deferred():
            recover(each)
            results = path_in(each).exists()
            _clear(each)
        if held is not None:
            held.release()
        if results:
            with suppress(OSError):  # something is left in it
                each.rmdir()
    return sorted(folder.rglob("*"))


#: Files that the manifest lists and that stay.
_STAY = (State.CHANGED, State.UNREADABLE)


def _clear(folder: Path) -> None:
    """What the manifest of one folder lists."""
    manifest = Manifest.load(folder)
    for name in list(manifest.files):
        path = folder / name
        if path.is_symlink() or (whose := state(path.absolute())) in _STAY:
            continue
        if whose is State.OURS:
            path.unlink()
        del manifest.files[name]
    for name in sorted(manifest.folders, key=len, reverse=True):
        with suppress(OSError):  # somebody's files are in it
            (folder / name).rmdir()
    if not manifest.files:
        path_in(folder).unlink(missing_ok=True)


def main(arguments: Sequence[str]) -> int:
    """Clear each folder; say what stays."""
    for name in arguments:
        try:
            left = clear(Path(name)) if name else []
        except (InputError, OSError) as error:
            print(f"error: {error}", file=sys.stderr)
            return 2
        if left:
            print(f"{name}: {len(left)} files and folders stay, boresight did not write them so")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
