"""What a tool said when it failed, in one line, and the file that keeps all of it."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

from boresight.model.tools.folders import cache_folder

__all__ = ["ToolFailed", "failure", "last_words"]

#: Lines that say that there was an error, not which.
_ECHO = re.compile(
    r"make(\[\d+\])?:|%Error: (Exiting due|Command Failed)|collect2: |\s*\.\.\. (See|Use) "
    r"|compilation terminated|Traceback \(most recent"
)
_COMPLAINT = re.compile(
    r"error|fatal|cannot|not found|no such|denied|no space|killed|undefined|unrecogni[sz]ed",
    re.IGNORECASE,
)
#: Logs that are kept, the newest ones.
_KEPT = 20


class ToolFailed(RuntimeError):
    """A compiler refused what it was given; the message is `failure`'s line."""


def last_words(output: str) -> str:
    """The line of a tool's output that says why it failed: the first complaint, else the last line.

    Parameters
    ----------
    output : str
        Standard output and error.
    """
    lines = [" ".join(line.split()) for line in output.splitlines() if line.strip()]
    own = [line for line in lines if not _ECHO.match(line)]
    complaints = [line for line in own if _COMPLAINT.search(line)]
    return (complaints[:1] or own[-1:] or lines[-1:] or ["no message"])[-1]


def failure(what: str, output: str) -> str:
    """``<what>: <why> (log: <file>)``; the file stays, as one of the newest.

    Parameters
    ----------
    what : str
        What went wrong, e.g. "verilator build of core failed".
    output : str
        All that the tool said.
    """
    log = _keep(what, output) if output.strip() else None
    where = f" (log: {log})" if log else ""
    return f"{what}: {last_words(output)}{where}"


def _keep(what: str, output: str) -> Path | None:
    """Write a log; None if there is no room for it."""
    digest = hashlib.sha256(output.encode(errors="replace")).hexdigest()[:8]
    name = re.sub(r"[^A-Za-z0-9]+", "-", what).strip("-")[:60]
    try:
        folder = cache_folder("boresight") / "logs"
        folder.mkdir(parents=True, exist_ok=True)
        log = folder / f"{name}-{digest}.log"
        log.write_text(output, encoding="utf-8", errors="replace")
        for old in sorted(folder.glob("*.log"), key=lambda p: p.stat().st_mtime)[:-_KEPT]:
            old.unlink(missing_ok=True)
    except OSError:
        return None
    return log
