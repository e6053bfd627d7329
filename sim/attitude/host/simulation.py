"""Simulation of the complete board with every filter, written as page and JSON."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from boresight.gateware.core import Core
from boresight.model.errors import InputError
from boresight.model.words.fixed import Format
from boresight.model.words.program import Value
from boresight.sim.attitude.board.build import REAL, Board, make_board
from boresight.sim.attitude.board.run import BoardRun, Judgement, judge, run_board, stimulus
from boresight.sim.attitude.ma2014.paper import TIME_US
from boresight.sim.attitude.worlds.synthetic import synthetic_log
from boresight.sim.compare.verdict import saturated_text
from boresight.sim.pages import page_of, section_of
from boresight.sim.records.record import Record
from boresight.sim.result import Result

#: Files written.
BOARD_FILES = ("board.html", "board.json")
#: Sources of the field: number of the source and mode of the compass.
SOURCES = {"counts": (1, 2), "heading": (2, 1)}
#: Samples of the short runs, which only measure durations.
SHORT = 24
#: Columns of the table, and their figures.
_SHOWN = {
    "filter": "filter",
    "updates": "updates",
    "lost": "lost_samples",
    "differ": "mismatches",
    "fields": "fields",
    "in registers, us": "in_registers_us",
    "beside program, us": "beside_program_us",
    "last bit, us": "frame_end_us",
    "cycles/s": "cycles_per_s",
}


def default_log(updates: int) -> Record:
    """Synthetic motion with this number of samples."""
    return synthetic_log(
        seconds=max(updates + 64, 128) / REAL.rate_hz,
        rate_hz=REAL.rate_hz,
        seed=1,
        acceleration=0.3,
    )


def write_board(
    folder: Path,
    name: str,
    core: Core,
    log: Record,
    *,
    updates: int,
    source: str = "heading",
    feed: Mapping[str, float] | None = None,
    say: Callable[[str], None],
) -> Result:
    """Run the board with every filter, ``name`` for long; write `BOARD_FILES` into a folder.

    Returns
    -------
    Result
        ``runs`` has a row for each filter. ``in_registers_us``: most time from data-ready to the
        registers, ``predicted_us`` by the schedule. ``beside_program_us``: time of the core beside
        its programs. ``frame_end_us``: from data-ready to the last bit of the frame.
        ``mismatches``: words of frames that differ from the integer models. ``good``: nothing was
        lost, differs or is damaged.
    """
    board = make_board(REAL, core=core)
    words = feed_words(board.system.plan.feed.registers, feed or {})
    filters = board.system.plan.names[: board.system.plan.filters]
    what = stimulus(log, board)
    number, mode = SOURCES[source]
    runs, notes = [], []
    for filter, filter_name in enumerate(filters):
        length = updates if filter_name == name else SHORT
        cycles = length * board.setup.period_cycles
        say(f"{filter_name}: {length} samples, {cycles / 1e6:.1f} million cycles")
        run = run_board(
            board,
            what,
            updates=length,
            settings={
                "filter": filter,
                "magnetic_source": number,
                "compass_mode": mode,
                "output_divider": 1,
                **{f"feed_{k}": word & 0xFFFF_FFFF for k, word in words.items()},
            },
        )
        verdict = judge(board, what, run, filter=filter, source=number, feed=words)
        runs.append(_row(board, filter_name, filter, run, verdict))
        if count := int(verdict.chain.saturated.sum()):
            notes.append(f"{filter_name}: {saturated_text(count, verdict.chain.saturations)}")
    result = Result(
        {
            "config": core.machine.name,
            "source": source,
            "log": log.name,
            "clock_mhz": board.setup.clock_hz / 1e6,
            "setup": board.setup,
            "build": f"{board.system.build:016x}",
            "runs": runs,
        },
        {"filters": [{head: row[key] for head, key in _SHOWN.items()} for row in runs]},
        notes=notes,
        failures=[
            f"{r['filter']}: {r['first_mismatch'] or 'samples lost'}" for r in runs if not r["good"]
        ],
    )
    data = result.to_json()
    (folder / "board.json").write_text(json.dumps(data, allow_nan=False) + "\n")
    intro = (
        f"The complete board in simulation at {result['clock_mhz']:g} MHz, core "
        f"{result['config']}: sensors at the pins, {result['log']}, frames to the host. Times are "
        "from the sample's data-ready edge; the paper's software takes "
        f"{TIME_US['complementary']:,.0f} us (complementary filter) and "
        f"{TIME_US['kalman']:,.0f} us (Kalman filter) at 100 MHz."
    )
    page = page_of("Board", [intro], [section_of("Filters", result.tables["filters"])])
    (folder / "board.html").write_text(page, encoding="utf-8")
    return result


def feed_words(registers: Mapping[str, Value], values: Mapping[str, float]) -> dict[str, int]:
    """Words of the input registers for these values.

    Raises
    ------
    InputError
        Unknown register, or a value outside its range.
    """
    words = {}
    for name, number in values.items():
        value = registers.get(name)
        if value is None:
            raise InputError.at(
                f"feed {name}",
                wanted=f"an input without a sensor: {', '.join(registers) or 'none declared'}",
                found=repr(name),
                fix="leave it out, or correct the name",
            )
        if not value.low <= number <= value.high:
            raise InputError.at(
                f"feed {name}",
                wanted=f"{value.low:g} to {value.high:g} {value.unit}".rstrip(),
                found=f"{number:g}",
                fix="choose a value inside the range",
            )
        words[name] = int(Format(32, value.frac).quantise(number))
    return words


def _row(board: Board, name: str, filter: int, run: BoardRun, verdict: Judgement) -> dict[str, Any]:
    """Metrics of a run."""
    us = 1e6 / board.setup.clock_hz
    trace = run.trace
    good = (
        verdict.mismatches == verdict.lost == run.dropped == trace.violations == 0
        and len(trace.framing_errors) == 0
        and len(run.frames) == verdict.updates > 0
    )
    length = board.system.plan.lengths[filter]
    return {
        "filter": name,
        "updates": verdict.updates,
        "frames": len(run.frames),
        "mismatches": verdict.mismatches,
        "first_mismatch": verdict.first,
        "lost_samples": verdict.lost,
        "fields": verdict.fields,
        "compass_lines": verdict.lines,
        "transfer_cycles": verdict.transfer_cycles,
        "core_cycles": verdict.core_cycles,
        "program_cycles": length,
        "beside_program_us": round((verdict.core_cycles[1] - length) * us, 3),
        "in_registers_us": round((verdict.transfer_cycles[1] + verdict.core_cycles[1]) * us, 2),
        "predicted_us": round(board.system.latency_cycles(filter) * us, 2),
        "frame_end_us": round(verdict.frame_end_cycles[1] * us, 2),
        "timing_violations": trace.violations,
        "damaged_frames": run.dropped,
        "cycles": run.cycles,
        "cycles_per_s": round(run.cycles / run.seconds),
        "good": good,
    }
