"""Folders for what can be made again: the user's cache, or a private one where that is closed."""

from __future__ import annotations

import contextlib
import functools
import os
import stat
import tempfile
from pathlib import Path

__all__ = ["cache_folder", "matplotlib_environment", "private_folder", "yosys_environment"]


def cache_folder(name: str) -> Path:
    """Folder ``name`` in the user's cache; in `private_folder` if that cannot be written."""
    base = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    folder = Path(base) / name
    if folder.is_absolute() and _writable(folder):
        return folder
    folder = private_folder() / name
    folder.mkdir(exist_ok=True)
    return folder


def yosys_environment() -> dict[str, str]:
    """What YoWASP needs to be told where the home is closed: where to keep its machine code."""
    return _told("YOWASP_CACHE_DIR", "YoWASP", [])


def matplotlib_environment() -> dict[str, str]:
    """What matplotlib needs to be told where the home is closed: where to keep its fonts' list."""
    base = os.environ.get("XDG_CONFIG_HOME") or os.path.join(os.path.expanduser("~"), ".config")
    return _told("MPLCONFIGDIR", "matplotlib", [Path(base) / "matplotlib"])


def _told(variable: str, name: str, also: list[Path]) -> dict[str, str]:
    """Nothing if the user has said it, or if all folders that the tool uses can be written."""
    if variable in os.environ:
        return {}
    folder = cache_folder(name)
    closed = private_folder() in folder.parents or not all(map(_writable, also))
    return {variable: str(folder)} if closed else {}


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
