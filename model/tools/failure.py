"""The failure of an external tool as one line, and a log file with its complete output."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

from boresight.model.tools.folders import cache_folder

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
    """Write a log; return None if it cannot be written."""
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
