"""Folders for what can be made again: the user's cache, or a private one where that is closed."""

from __future__ import annotations

import contextlib
import functools
import os
import stat
import tempfile
from pathlib import Path

__all__ = ["cache_folder", "private_folder", "tool_environment"]


def cache_folder(name: str) -> Path:
    """Folder ``name`` in the user's cache; in `private_folder` if that cannot be written."""
    base = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    folder = Path(base) / name
    if folder.is_absolute() and _writable(folder):
        return folder
    folder = private_folder() / name
    folder.mkdir(exist_ok=True)
    return folder


def tool_environment() -> dict[str, str]:
    """Variables that tools with a cache of their own need where the home is closed.

    Yosys keeps its machine code and matplotlib its list of fonts below the home. Nothing is said
    where they can do so, or where the user has said where.
    """
    wanted = {}
    if "YOWASP_CACHE_DIR" not in os.environ:
        folder = cache_folder("YoWASP")
        if private_folder() in folder.parents:
            wanted["YOWASP_CACHE_DIR"] = str(folder)
    if "MPLCONFIGDIR" not in os.environ:
        base = os.environ.get("XDG_CONFIG_HOME") or os.path.join(os.path.expanduser("~"), ".config")
        folder = cache_folder("matplotlib")
        if private_folder() in folder.parents or not _writable(Path(base) / "matplotlib"):
            wanted["MPLCONFIGDIR"] = str(folder)
    return wanted


@functools.cache
def private_folder() -> Path:
    """``boresight-UID`` in the temporary folder, the same in every process; nobody else's."""
    folder = Path(tempfile.gettempdir()) / f"boresight-{os.getuid()}"
    with contextlib.suppress(FileExistsError):
        folder.mkdir(mode=0o700)
    found = folder.lstat()
    if stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & 0o077:
        return folder
    return Path(tempfile.mkdtemp(prefix="boresight-"))


def _writable(folder: Path) -> bool:
    """Whether files can be made in ``folder``, which is made if need be."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK | os.X_OK)
