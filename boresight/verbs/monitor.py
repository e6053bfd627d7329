"""Read attitudes and registers of a board from its serial line.

boresight monitor /dev/ttyUSB0  # attitudes, until Ctrl-C
boresight monitor capture.bin -o out.csv -o out.png  # from a captured file
boresight monitor /dev/ttyUSB0 --map registers.json --write filter=1  # select another filter
boresight monitor /dev/ttyUSB0 --map registers.json --log run.csv  # record, for check and accuracy
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from boresight.model.errors import require
from boresight.options import Progress, PythonOnly, Repeated
from boresight.sim.boards import board_system


def monitor(
    source: Annotated[str, Parameter(metavar="PORT|CAPTURE")],
    /,
    *,
    baud: int = 921_600,
    steps: int | None = None,
    output: Annotated[
        Sequence[str | Path] | str | Path,
        Repeated,
        Parameter(name=["--output", "-o"], metavar="FILE"),
    ] = (),
    log: Annotated[str | Path | None, Parameter(metavar="FILE")] = None,
    reads: Annotated[Sequence[str], Repeated, Parameter(name="--read", metavar="NAME")] = (),
    writes: Annotated[
        Sequence[str], Repeated, Parameter(name="--write", metavar="NAME=VALUE|@FILE")
    ] = (),
    register_map: Annotated[
        str | Path | None, Parameter(name="--map", metavar="REGISTERS.json")
    ] = None,
    silence_s: Annotated[float, PythonOnly] = 5.0,
    each: Progress = None,
) -> Any:
    """Listen to a board; first write, then read registers.

    With ``reads`` or ``writes`` and without ``steps``, ``output`` and ``log`` it then ends.
    Otherwise it ends after ``steps`` attitudes, or at Ctrl-C. Returns attitudes, missing and
    damaged frames, registers by name. Raises InputError for a wrong argument, an unknown register,
    and a port that cannot be read.

    Parameters
    ----------
    source : str
        Serial port, or a file with bytes captured from one.
    baud : int
        Bits per second.
    steps : int, optional
        Stop after so many attitudes; by default at the end of the file, or at Ctrl-C.
    output : paths
        Table (FILE.csv), or plot of heading, pitch and roll (FILE.png, .svg, .pdf); repeatable.
    log : path, optional
        Record: a log of the filter's inputs, its outputs and the sensors' counts, for `check`,
        `run` and `accuracy`. Restarts the filter from its initial states.
    reads : sequence of str
        Read a register, by name or address; repeatable.
    writes : sequence of str
        Write a register, or those of a file of fit board, before registers are read; repeatable.
    register_map : path, optional
        Register map of the bitstream, registers.json: names, formats, clock (without it 100 MHz).
    silence_s : float
        Longest silence of a port, s.
    each : callable, optional
        Called with each attitude as a line of text.
    """
    output = [output] if isinstance(output, str | Path) else output
    kinds = {"csv" if str(path).endswith(".csv") else "plot": path for path in output}
    wanted, found = "at most one table, FILE.csv, and one picture", ", ".join(map(str, output))
    require(len(kinds) == len(output), "--output", wanted, found, "leave the others out")
    return board_system().monitor(
        source,
        baud=baud,
        count=steps,
        csv=kinds.get("csv"),
        log=log,
        plot=kinds.get("plot"),
        reads=reads,
        writes=writes,
        register_map=register_map,
        silence_s=silence_s,
        each=each,
    )


def typed(words: Sequence[Any], options: Mapping[str, Any], shown: Any) -> dict[str, Any]:
    """Print each attitude as it comes."""
    return {} if shown.json or shown.quiet else {"each": lambda line: print(line, flush=True)}
