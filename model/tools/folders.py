"""Cache folders: the user's, or a private one if that cannot be written."""

from __future__ import annotations

import contextlib
import functools
import os
import stat
import tempfile
from pathlib import Path


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
    """Environment for YoWASP with a cache folder that can be written."""
    return _unless_writable("YOWASP_CACHE_DIR", "YoWASP", [])


def matplotlib_environment() -> dict[str, str]:
    """Environment for matplotlib with a cache folder that can be written."""
    base = os.environ.get("XDG_CONFIG_HOME") or os.path.join(os.path.expanduser("~"), ".config")
    return _unless_writable("MPLCONFIGDIR", "matplotlib", [Path(base) / "matplotlib"])


def _unless_writable(variable: str, name: str, folders: list[Path]) -> dict[str, str]:
    """Set a variable, unless the user has set it or all folders of the tool can be written."""
    if variable in os.environ:
        return {}
    folder = cache_folder(name)
    unwritable = private_folder() in folder.parents or not all(map(_writable, folders))
    return {variable: str(folder)} if unwritable else {}


@functools.cache
def private_folder() -> Path:
    """``boresight-UID`` in the temporary folder, mode 700; one for all processes of a user."""
    folder = Path(tempfile.gettempdir()) / f"boresight-{os.getuid()}"
    with contextlib.suppress(FileExistsError):
        folder.mkdir(mode=0o700)
    status = folder.lstat()
    if stat.S_ISDIR(status.st_mode) and status.st_uid == os.getuid() and not status.st_mode & 0o077:
        return folder
    return Path(tempfile.mkdtemp(prefix="boresight-"))


def _writable(folder: Path) -> bool:
    """Make ``folder`` if it is missing; return whether files can be made in it."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK | os.X_OK)
