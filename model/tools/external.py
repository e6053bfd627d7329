"""Programs and libraries of others: their absence, their failures, and folders for their caches."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import os
import re
import stat
import tempfile
from importlib import import_module
from pathlib import Path
from types import ModuleType

from boresight.model.errors import ToolMissing

#: Extra of `pyproject.toml` by library.
_EXTRAS = {
    "amaranth_boards": "board",
    "distributed": "cluster",
    "matplotlib": "plots",
    "pyarrow": "logs",
    "pymap3d": "systems",
    "pyulog": "ulog",
    "rosbags": "ros",
    "scipy": "logs",
    "serial": "board",
    "vqf": "published",
}
#: Lines that report an error without its cause.
_ECHO = re.compile(
    r"make(\[\d+\])?:|%Error: (Exiting due|Command Failed)|collect2: |\s*\.\.\. (See|Use) "
    r"|compilation terminated|Traceback \(most recent"
)
_COMPLAINT = re.compile(
    r"error|fatal|cannot|not found|no such|denied|no space|killed|undefined|unrecogni[sz]ed",
    re.IGNORECASE,
)
#: Number of logs kept, the newest ones.
_LOGS_MAX = 20


class ToolFailed(RuntimeError):
    """An external program failed; the message is the line of `failure`."""


def last_words(output: str) -> str:
    """The line of a tool's output with the cause of its failure: the first error, or the last."""
    lines = [" ".join(line.split()) for line in output.splitlines() if line.strip()]
    messages = [line for line in lines if not _ECHO.match(line)]
    complaints = [line for line in messages if _COMPLAINT.search(line)]
    return (complaints[:1] or messages[-1:] or lines[-1:] or ["no message"])[-1]


def failure(subject: str, output: str) -> str:
    """Return ``<subject>: <why> (log: <file>)`` and store the complete output in that file."""
    log = _keep(subject, output) if output.strip() else None
    where = f" (log: {log})" if log else ""
    return f"{subject}: {last_words(output)}{where}"


def _keep(subject: str, output: str) -> Path | None:
    digest = hashlib.sha256(output.encode(errors="replace")).hexdigest()[:8]
    name = re.sub(r"[^A-Za-z0-9]+", "-", subject).strip("-")[:60]
    try:
        folder = cache_folder("boresight") / "logs"
        folder.mkdir(parents=True, exist_ok=True)
        log = folder / f"{name}-{digest}.log"
        log.write_text(output, encoding="utf-8", errors="replace")
        for old in sorted(folder.glob("*.log"), key=lambda p: p.stat().st_mtime)[:-_LOGS_MAX]:
            old.unlink(missing_ok=True)
    except OSError:
        return None
    return log


def optional(name: str) -> ModuleType:
    """Import a module of an optional library; ToolMissing if that is not installed."""
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        library = name.partition(".")[0]
        if error.name is None or error.name.partition(".")[0] != library:
            raise
        extra = _EXTRAS[library]
        raise ToolMissing(f"{library} was not found: pip install 'boresight[{extra}]'") from None


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
    """Environment for YoWASP with a cache folder that can be written, where its own cannot."""
    folder = cache_folder("YoWASP")
    if "YOWASP_CACHE_DIR" in os.environ or private_folder() not in folder.parents:
        return {}
    return {"YOWASP_CACHE_DIR": str(folder)}


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
