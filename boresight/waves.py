"""Waveforms of a window of a log: files for viewers of a core's signals, with a program's names."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from boresight.model.errors import InputError
from boresight.model.tools.files import output_folder
from boresight.sim.compare.check import KEPT
from boresight.sim.levels.build import Build
from boresight.sim.levels.integer import words_of
from boresight.sim.records.feed import feed
from boresight.sim.records.files import Log
from boresight.sim.records.record import joined
from boresight.sim.rtl.wave import write_wave

#: Where waveforms are, unless said otherwise.
WAVE_FOLDER = "wave"


def _window(text: str, rows: int) -> range:
    """Rows "FIRST:STOP" of a log with so many; STOP is not one of them.

    Raises
    ------
    InputError
        Not two numbers, no row between them, or rows that the log does not have.
    """
    first, _, stop = text.partition(":")
    are_numbers = first.isdecimal() and stop.isdecimal()
    if not are_numbers or not 0 <= int(first) < int(stop) <= rows:
        raise InputError.at(
            "--wave",
            wanted=f"FIRST:STOP, rows of the log with 0 <= FIRST < STOP <= {rows}",
            found=repr(text),
            fix=f"write for example {max(rows - 10, 0)}:{rows}",
        )
    return range(int(first), int(stop))


def write_waves(
    build: Build, rounds: Sequence[Sequence[Log]], rows: str, folder: str | Path
) -> str:
    """Write ESTIMATOR.vcd, and .gtkw and .sucl for GTKWave and Surfer; return a line for people.

    Parameters
    ----------
    rounds : sequence of sequence of Log
        The only log of the only estimator of ``build``.
    rows : str
        As FIRST:STOP, without STOP.

    Raises
    ------
    InputError
        Several estimators or logs, rows that the log does not have, a folder that cannot be
        written, or a log that does not feed the estimator.
    ToolMissing, SimulationFailed
        As `write_wave`.
    """
    if len(build.estimators) > 1 or len(rounds) > 1:
        raise InputError.at(
            "--wave",
            wanted="one estimator and one log",
            found=f"{len(build.estimators)} and {len(rounds)}",
            fix="check them one by one",
        )
    record = joined([*rounds[0][0].blocks(KEPT)])
    window = _window(rows, len(record))
    (estimator,), (program,), (nodes,) = build.estimators, build.programs, build.nodes
    name, lines = estimator.name, {number: node.line for number, node in nodes.items()}
    files = [f"{name}.{suffix}" for suffix in ("vcd", "gtkw", "sucl")]
    vcd = files[0]
    inputs = feed(estimator, record).inputs[: window.stop]
    words = words_of(program, inputs)
    with output_folder(folder, "check", files=files) as out:
        with (out / vcd).open("w", encoding="ascii", errors="backslashreplace") as file:
            wave = write_wave(build.core, lines, words, window.start, window.stop, file)
        for suffix, write in (("gtkw", wave.gtkwave), ("sucl", wave.surfer)):
            with (out / f"{name}.{suffix}").open("w", encoding="utf-8") as file:
                write(file, vcd)
    return (
        f"rows {window.start} to {window.stop - 1}, {wave.cycles} cycles of {name}: "
        f"gtkwave {Path(folder, files[1])}, or surfer --command-file {Path(folder, files[2])}"
    )
