"""What an exception means for the person at the terminal: a line, and an exit code."""

from __future__ import annotations

import os
import signal
import sys
import threading
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from boresight.model.errors import InputError, ToolMissing
from boresight.terminal import ClosedPipe, abandon, tell

__all__ = ["DEBUG", "Terminated", "code_of", "interruptible"]

#: Set in the environment, this shows the traceback of a bug.
DEBUG = "BORESIGHT_DEBUG"
#: Longest message of a bug, in characters.
_LONGEST = 160


def code_of(error: BaseException) -> int:
    """Tell about an exception in one line, and give the exit code.

    2: bad input. 1: a tool is missing or failed, or memory ran out. 130: Ctrl-C. 141: standard
    output is a pipe that nobody reads any more. 143, 129: SIGTERM, SIGHUP. 3: a bug of Boresight.
    """
    if isinstance(error, ClosedPipe | BrokenPipeError):
        abandon(sys.stdout)
        return 128 + signal.SIGPIPE
    if isinstance(error, Terminated):
        tell("terminated")
        return 128 + int(error.args[0])
    if isinstance(error, KeyboardInterrupt):
        tell("interrupted")
        return 130
    if isinstance(error, MemoryError):
        tell("error: memory ran out; give less at a time, or use a computer with more")
        return 1
    if isinstance(error, InputError) or _is_schedule_error(error):
        tell(f"error: {error}")
        return 2
    if isinstance(error, ToolMissing) or _is_tool_failure(error):
        tell(f"error: {str(error).splitlines()[0]}")
        return 1
    if isinstance(error, OSError) and error.strerror:
        where = "a file" if error.filename is None else os.fsdecode(error.filename)
        return code_of(
            InputError.at(
                where or "''",
                wanted="something that can be used",
                found=error.strerror.lower(),
                fix="check the path",
            )
        )
    return _bug(error)


def _is_schedule_error(error: BaseException) -> bool:
    from boresight.gateware.schedule.slots import ScheduleError

    return isinstance(error, ScheduleError)


def _is_tool_failure(error: BaseException) -> bool:
    from boresight.firmware.soc.image import ImageError
    from boresight.gateware.synthesis.yosys import SynthesisError
    from boresight.model.tools.failure import ToolFailed
    from boresight.sim.rtl.simulators import SimulationFailed

    return isinstance(error, ImageError | SimulationFailed | SynthesisError | ToolFailed)


def _bug(error: BaseException) -> int:
    if os.environ.get(DEBUG):
        tell("".join(traceback.format_exception(error)).rstrip())
    last = traceback.extract_tb(error.__traceback__)[-1]
    what = " ".join(f"{type(error).__name__}: {error}".split())
    what = what if len(what) <= _LONGEST else f"{what[:_LONGEST]}..."
    tell(
        f"error: a bug of Boresight, {what} ({Path(last.filename).name}, line {last.lineno}); "
        f"please report it with the traceback, which {DEBUG}=1 shows"
    )
    return 3


def _descendants(process: int) -> list[int]:
    """Processes that this one began, and those that they began (Linux; elsewhere none)."""
    found: list[int] = []
    for file in Path(f"/proc/{process}/task").glob("*/children"):
        with suppress(OSError):
            for child in map(int, file.read_text().split()):
                found += [child, *_descendants(child)]
    return found


@contextmanager
def interruptible() -> Iterator[None]:
    """The first Ctrl-C, SIGTERM or SIGHUP ends all children and interrupts; a second ends at once.

    What was begun is cleaned up in between. Only a main thread that such a signal reaches is
    changed: a process told to ignore one still does.

    Raises
    ------
    KeyboardInterrupt
        Ctrl-C.
    Terminated
        The others: ended as by Ctrl-C.
    """
    usual: dict[signal.Signals, Any] = {}

    def stop(number: int, frame: object) -> None:
        signal.signal(number, signal.SIG_DFL)
        for child in _descendants(os.getpid()):
            with suppress(OSError):
                os.kill(child, signal.SIGTERM)
        raise KeyboardInterrupt if number == signal.SIGINT else Terminated(number)

    if threading.current_thread() is threading.main_thread():
        for each in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            if signal.getsignal(each) in (signal.default_int_handler, signal.SIG_DFL):
                usual[each] = signal.signal(each, stop)
    try:
        yield
    finally:
        for each, handler in usual.items():
            signal.signal(each, handler)


class Terminated(KeyboardInterrupt):
    """Asked to end by another process; the number of the signal is its argument."""
