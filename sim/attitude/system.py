"""The attitude system behind the command line: its core, its design, its simulation, its host."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from boresight.gateware.attitude.system.attitude_system import AttitudeSystem, system_design
from boresight.gateware.attitude.system.programs import system_core, system_estimators
from boresight.gateware.core import Core
from boresight.gateware.description import Description
from boresight.gateware.machine import machine_named
from boresight.model.attitude import FILTERS
from boresight.model.attitude.front import FRONT
from boresight.model.errors import require, require_choice
from boresight.model.resolve import Named, estimator_of
from boresight.model.words.fixed import Format
from boresight.model.words.program import Value
from boresight.sim.attitude.board.build import REAL, Board, make_board
from boresight.sim.attitude.board.faults import FAULTS, fault_board, fault_trial, trial_log
from boresight.sim.attitude.board.run import BoardRun, Judgement, judge, run_board, stimulus
from boresight.sim.attitude.calibration.files import calibrate
from boresight.sim.attitude.host.monitor import monitor
from boresight.sim.attitude.ma2014.world import TIME_US
from boresight.sim.attitude.worlds import synthetic_log
from boresight.sim.boards import BoardSystem
from boresight.sim.campaign import processes
from boresight.sim.compare.twin import Traced
from boresight.sim.compare.verdict import saturated_text
from boresight.sim.plotting import page_of, section_of
from boresight.sim.records.files import record_of
from boresight.sim.records.record import Record
from boresight.sim.result import Result

#: Longest simulated time, s: cycles are counted in 32 bits.
_LONGEST_S = 20.0
#: Sources of the field: number of the source and mode of the compass.
_SOURCES = {"counts": (1, 2), "heading": (2, 1)}
#: Samples of the short runs, which only measure durations.
_SHORT = 24
#: Columns of the table, and their figures.
_SHOWN = {
    "filter": "filter",
    "updates": "updates",
    "lost samples": "lost_samples",
    "wrong words": "mismatches",
    "new fields": "fields",
    "in registers, us": "in_registers_us",
    "calibration, us": "beside_program_us",
    "frame end, us": "frame_end_us",
}
_INTRO = (
    "The complete board in simulation at {clock_mhz:g} MHz, core {config}: sensors at the pins, "
    "{log}, frames to the host. Times are from the sample's data-ready edge; the paper's software "
    "takes {complementary:,.0f} us (complementary filter) and {kalman:,.0f} us (Kalman filter) at "
    "100 MHz. Wrong words: in frames, against the integer models; new fields: updates with a new "
    "sample of the compass; calibration: time of the core less that "
    "of the filter's program."
)


class AttitudeBoard(BoardSystem):
    """Inertial sensor and compass, calibration, attitude filters, frames."""

    files = ("board.html", "board.json")
    programs = tuple(FRONT.values())
    rate_hz = REAL.rate_hz

    def core(
        self,
        estimators: Sequence[Named],
        *,
        config: str,
        word: int,
        clock_hz: int,
        params: Mapping[str, Mapping[str, float]],
    ) -> Core:
        return system_core(estimators, config=config, word=word, clock_hz=clock_hz, params=params)

    def design(self, core: Core, clock_hz: int) -> tuple[AttitudeSystem, Description]:
        system = system_design(core, clock_hz)
        return system, system.map()

    def simulate(
        self,
        folder: Path,
        name: Named | None,
        log: Any,
        *,
        config: str,
        params: Mapping[str, Mapping[str, float]],
        seconds: float,
        source: str,
        feed: Mapping[str, float] | None,
        say: Callable[[str], None],
    ) -> Result:
        chosen = estimator_of("mekf" if name is None else name)
        filters: Sequence[Named] = FILTERS if chosen.name in FILTERS else [chosen]
        machine_named(config)
        require_choice("source", source, _SOURCES)
        good = isinstance(seconds, int | float) and 0.05 <= seconds <= _LONGEST_S
        require(good, "seconds", f"0.05 to {_LONGEST_S:g}", seconds)
        good = feed is None or isinstance(feed, Mapping)
        require(good, "feed", "values by input, for example {'allowed': 50}", feed)
        updates = round(seconds * REAL.rate_hz)
        if log is None:
            length_s = max(updates + 64, 128) / REAL.rate_hz
            log = synthetic_log(seconds=length_s, rate_hz=REAL.rate_hz, seed=1, acceleration=0.3)
        record = record_of(log)
        rows, fix = max(updates, _SHORT), "give a longer log, or fewer seconds"
        where = f"log {record.name!r}"
        require(len(record) >= rows, where, f"{rows} rows or more", len(record), fix)
        names = ", ".join(estimator_of(f).name for f in filters)
        say(f"core with {names} and the calibration, {config}")
        core = system_core(filters, config=config, clock_hz=REAL.clock_hz, params=params)
        return write_board(
            folder,
            chosen.name,
            core,
            record,
            filters=filters,
            updates=updates,
            source=source,
            feed=feed,
            say=say,
            notes=self.rate_notes([chosen]),
        )

    def simulate_faults(
        self, name: str | None, *, progress: Callable[[str], None] | None
    ) -> Result:
        name = name or "mekf"
        require_choice("filter", name, FILTERS)
        board, log = fault_board(name), trial_log()
        assert board.verilog  # made once, before the threads that wait for the simulators

        def trial(fault: str) -> dict[str, Any]:
            row = fault_trial(board, fault, log)
            if progress:
                progress(f"{fault}: {'good' if row['good'] else 'FAILED'}")
            return row

        with ThreadPoolExecutor(processes(None)) as threads:
            rows = list(threads.map(trial, FAULTS))
        failures = [row["fault"] for row in rows if not row["good"]]
        return Result({"filter": name, "trials": rows}, {"faults": rows}, failures=failures)

    calibrate = staticmethod(calibrate)
    monitor = staticmethod(monitor)


def write_board(
    folder: Path,
    name: str,
    core: Core,
    log: Record,
    *,
    filters: Sequence[Named],
    updates: int,
    source: str,
    feed: Mapping[str, float] | None,
    say: Callable[[str], None],
    notes: Sequence[str] = (),
) -> Result:
    """Run the board with every filter, ``name`` for long; write the files into a folder.

    ``runs`` has a row for each filter. ``in_registers_us``: most time from data-ready to the
    registers, ``predicted_us`` by the schedule. ``beside_program_us``: time of the core beside its
    programs. ``frame_end_us``: from data-ready to the last bit of the frame. ``mismatches``: words
    of frames that differ from the integer models. ``good``: nothing was lost, differs or is
    damaged. ``notes`` come first in the result's.
    """
    board = make_board(REAL, core=core)
    words = feed_words(board.system.plan.feed.registers, feed or {})
    what, runs, notes = stimulus(log, board), [], [*notes]
    number, mode = _SOURCES[source]
    settings = {"magnetic_source": number, "compass_mode": mode, "output_divider": 1}
    settings |= {f"feed_{k}": word & 0xFFFF_FFFF for k, word in words.items()}
    for filter, filter_name in enumerate(board.system.plan.names[: board.system.plan.filters]):
        length = updates if filter_name == name else _SHORT
        cycles = length * board.setup.period_cycles
        say(f"{filter_name}: {length} samples, {cycles / 1e6:.1f} million cycles")
        run = run_board(board, what, updates=length, settings={"filter": filter, **settings})
        verdict = judge(board, what, run, filter=filter, source=number, feed=words)
        runs.append({"filter": filter_name, **_figures(board, filter, run, verdict)})
        if count := int(verdict.chain.saturated.sum()):
            fed = system_estimators(filters)[filter]  # the board narrows its inputs
            of = Traced(fed, *fed.compile_traced())
            values = verdict.chain.saturations.items()
            places = {of.place(of.program.find(value)): n for value, n in values}
            notes.append(f"{filter_name}: {saturated_text(count, places)}")
    table = [{head: row[key] for head, key in _SHOWN.items()} for row in runs]
    wrong = [row for row in runs if not row["good"]]
    data = {
        "config": core.machine.name,
        "source": source,
        "log": log.name,
        "clock_mhz": board.setup.clock_hz / 1e6,
        "setup": board.setup,
        "build": f"{board.system.build:016x}",
        "runs": runs,
    }
    failures = [f"{row['filter']}: {row['first_mismatch'] or 'samples lost'}" for row in wrong]
    result = Result(data, {"filters": table}, notes=notes, failures=failures)
    (folder / "board.json").write_text(json.dumps(result.to_json(), allow_nan=False) + "\n")
    page = page_of("Board", [_INTRO.format(**data, **TIME_US)], [section_of("Filters", table)])
    (folder / "board.html").write_text(page, encoding="utf-8")
    return result


def feed_words(registers: Mapping[str, Value], values: Mapping[str, float]) -> dict[str, int]:
    words = {}
    for name, number in values.items():
        wanted = f"an input without a sensor: {', '.join(registers) or 'none declared'}"
        fix = "leave it out, or correct the name"
        require(name in registers, f"feed {name}", wanted, name, fix)
        value = registers[name]
        good = isinstance(number, int | float) and value.low <= number <= value.high
        wanted = f"{value.low:g} to {value.high:g} {value.unit}".rstrip()
        require(good, f"feed {name}", wanted, number, "choose a value inside the range")
        words[name] = int(Format(32, value.frac).quantise(number))
    return words


def _figures(board: Board, filter: int, run: BoardRun, verdict: Judgement) -> dict[str, Any]:
    us, trace = 1e6 / board.setup.clock_hz, run.trace
    transfer, core = verdict.transfer_cycles[1], verdict.core_cycles[1]
    clean = not (verdict.mismatches or verdict.lost or run.dropped or trace.violations)
    return {
        "updates": verdict.updates,
        "frames": len(run.frames),
        "mismatches": verdict.mismatches,
        "first_mismatch": verdict.first,
        "lost_samples": verdict.lost,
        "fields": verdict.fields,
        "beside_program_us": round((core - board.system.plan.lengths[filter]) * us, 3),
        "in_registers_us": round((transfer + core) * us, 2),
        "predicted_us": round(board.system.latency_cycles(filter) * us, 2),
        "frame_end_us": round(verdict.frame_end_cycles[1] * us, 2),
        "timing_violations": trace.violations,
        "damaged_frames": run.dropped,
        "good": clean and not len(trace.framing_errors) and len(run.frames) == verdict.updates > 0,
    }
