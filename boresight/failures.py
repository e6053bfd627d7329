"""Exceptions as one line on the terminal and an exit code; signals."""

from __future__ import annotations

import os
import signal
import sys
import threading
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from boresight.model.errors import InputError, ToolMissing
from boresight.terminal import ClosedPipe, abandon, tell

__all__ = ["DEBUG", "Terminated", "code_of", "interruptible"]

#: Environment variable that makes a bug show its traceback.
DEBUG = "BORESIGHT_DEBUG"
#: Maximum length of a bug's message, in characters.
_LONGEST = 160


def code_of(error: BaseException) -> int:
    """Print an exception as one line on standard error and return the exit code.

    2: bad input. 1: a tool is missing or failed, or memory ran out. 130: Ctrl-C. 141: standard
    output is a pipe whose reader has closed it. 143, 129: SIGTERM, SIGHUP. 3: a bug of Boresight.
    """
    # Amaranth's warning of gateware that was not elaborated because of the error.
    warnings.filterwarnings("ignore", ".* created but never used")
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
        tell("error: out of memory; use smaller inputs, or a computer with more memory")
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
    from boresight.gateware.synthesis.yosys import SynthesisError
    from boresight.model.tools.failure import ToolFailed
    from boresight.sim.rtl.simulators import SimulationFailed

    return isinstance(error, SimulationFailed | SynthesisError | ToolFailed)


def _bug(error: BaseException) -> int:
    if os.environ.get(DEBUG):
        tell("".join(traceback.format_exception(error)).rstrip())
    last = traceback.extract_tb(error.__traceback__)[-1]
    message = " ".join(f"{type(error).__name__}: {error}".split())
    message = message if len(message) <= _LONGEST else f"{message[:_LONGEST]}..."
    tell(
        f"error: a bug of Boresight, {message} ({Path(last.filename).name}, line {last.lineno}); "
        f"please report it with the traceback, which {DEBUG}=1 shows"
    )
    return 3


def _descendants(process: int) -> list[int]:
    """Child processes and their descendants (Linux; elsewhere none)."""
    processes: list[int] = []
    for file in Path(f"/proc/{process}/task").glob("*/children"):
        with suppress(OSError):
            for child in map(int, file.read_text().split()):
                processes += [child, *_descendants(child)]
    return processes


@contextmanager
def interruptible() -> Iterator[None]:
    """Make the first Ctrl-C, SIGTERM or SIGHUP end all children and interrupt the block.

    Clean-up code runs; a second signal ends the process at once. Ignored signals stay ignored, and
    threads other than the main one are not changed.

    Raises
    ------
    KeyboardInterrupt
        Ctrl-C.
    Terminated
        SIGTERM or SIGHUP.
    """
    previous_handlers: dict[signal.Signals, Any] = {}

    def stop(number: int, frame: object) -> None:
        signal.signal(number, signal.SIG_DFL)
        for child in _descendants(os.getpid()):
            with suppress(OSError):
                os.kill(child, signal.SIGTERM)
        raise KeyboardInterrupt if number == signal.SIGINT else Terminated(number)

    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            if signal.getsignal(number) in (signal.default_int_handler, signal.SIG_DFL):
                previous_handlers[number] = signal.signal(number, stop)
    try:
        yield
    finally:
        for number, handler in previous_handlers.items():
            signal.signal(number, handler)


class Terminated(KeyboardInterrupt):
    """SIGTERM or SIGHUP; the argument is the number of the signal."""
