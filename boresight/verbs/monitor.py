"""Attitudes and registers of a board, from its serial port or a capture.

boresight monitor /dev/ttyUSB0  # attitudes, until Ctrl-C
boresight monitor capture.bin --csv out.csv --plot out.png  # of a capture
boresight monitor /dev/ttyUSB0 --map registers.json --write filter=1  # another filter
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any

from boresight.options import Arguments, Option, Outcome, PythonOnly, Verb, outcome
from boresight.sim.boards import board_system
from boresight.terminal import say

__all__ = ["monitor"]


def monitor(
    source: Annotated[str, Option(metavar="PORT|CAPTURE")],
    *,
    baud: int = 921_600,
    count: int | None = None,
    csv: Annotated[str | Path | None, Option(metavar="OUT.csv")] = None,
    plot: Annotated[str | Path | None, Option(metavar="OUT.png")] = None,
    reads: Annotated[Sequence[str], Option(("--read",), "NAME", repeated=True)] = (),
    writes: Annotated[Sequence[str], Option(("--write",), "NAME=VALUE", repeated=True)] = (),
    register_map: Annotated[str | Path | None, Option(("--map",), "REGISTERS.json")] = None,
    silence_s: Annotated[float, PythonOnly] = 5.0,
    each: Callable[[str], None] | None = None,
) -> Any:
    """Listen to a board; first write, then read registers.

    With ``reads`` or ``writes`` and without ``count``, ``csv`` and ``plot`` that is all. A port is
    listened to until ``count`` attitudes have come, or for ever; Ctrl-C ends it in good order.

    Parameters
    ----------
    source : str
        Serial port, or a file of what came from one.
    baud : int
        Bits per second.
    count : int, optional
        Attitudes to take; by default all, or for ever.
    csv : path, optional
        Write a table.
    plot : path, optional
        Write a picture of heading, pitch and roll: .png, .svg or .pdf.
    reads : sequence of str
        Read a register, by name or address; repeatable.
    writes : sequence of str
        Write a register, before any is read; repeatable.
    register_map : path, optional
        Register map of the bitstream: names, formats, clock.
    silence_s : float
        Longest silence of a port.
    each : callable, optional
        Called with each attitude as a line of text.

    Returns
    -------
    MonitorResult
        Attitudes, missing and damaged frames, registers by name.

    Raises
    ------
    InputError
        Wrong argument, no such register, or a line that cannot be read.
    """
    return board_system().monitor(
        source,
        baud=baud,
        count=count,
        csv=csv,
        plot=plot,
        reads=reads,
        writes=writes,
        register_map=register_map,
        silence_s=silence_s,
        each=each,
    )


def call(arguments: Arguments) -> Outcome:
    """Listen, each attitude a line."""
    quiet = arguments.json or arguments.quiet
    each = None if quiet else say
    return outcome(arguments.call(monitor, each=each))


VERB = Verb(monitor, call=call)
