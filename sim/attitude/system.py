"""The attitude system behind the command line: its core, its design, its simulation, its host."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from boresight.gateware.attitude.system.attitude_system import AttitudeSystem, system_design
from boresight.gateware.attitude.system.programs import system_core
from boresight.gateware.core import Core
from boresight.gateware.description import Description
from boresight.gateware.machine import machine_named
from boresight.model.attitude import FILTERS
from boresight.model.attitude.front import FRONT
from boresight.model.errors import InputError, require, require_choice
from boresight.model.estimator import Estimator
from boresight.model.resolve import Named, estimator_of
from boresight.sim.attitude.board.build import REAL
from boresight.sim.attitude.board.faults import (
    FAULTS,
    fault_board,
    fault_trial,
    faults_result,
    trial_log,
)
from boresight.sim.attitude.calibration.files import calibrate
from boresight.sim.attitude.host.monitor import monitor
from boresight.sim.attitude.host.simulation import (
    BOARD_FILES,
    SHORT,
    SOURCES,
    default_log,
    write_board,
)
from boresight.sim.boards import BoardSystem
from boresight.sim.campaign import processes
from boresight.sim.records.files import record_of
from boresight.sim.result import Result

#: Longest simulated time, s: cycles are counted in 32 bits.
_LONGEST_S = 20.0


class AttitudeBoard(BoardSystem):
    """Inertial sensor and compass, calibration, attitude filters, frames."""

    files = BOARD_FILES
    programs = tuple(FRONT.values())

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
        filters = _beside(chosen)
        machine_named(config)
        require_choice("source", source, SOURCES)
        require(0.05 <= seconds <= _LONGEST_S, "seconds", f"0.05 to {_LONGEST_S:g}", seconds)
        updates = round(seconds * REAL.rate_hz)
        record = default_log(updates) if log is None else record_of(log)
        if len(record) < max(updates, SHORT):
            raise InputError.at(
                f"log {record.name!r}",
                wanted=f"{max(updates, SHORT)} rows or more",
                found=str(len(record)),
                fix="give a longer log, or fewer --seconds",
            )
        names = ", ".join(estimator_of(f).name for f in filters)
        say(f"core with {names} and the calibration, {config}")
        core = system_core(filters, config=config, clock_hz=REAL.clock_hz, params=params)
        return write_board(
            folder, chosen.name, core, record, updates=updates, source=source, feed=feed, say=say
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
            return faults_result(name, list(threads.map(trial, FAULTS)))

    def calibrate(
        self, sources: Sequence[Any], settings: Mapping[str, Any], output: str | Path
    ) -> Result:
        return calibrate(sources, settings, output)

    def monitor(self, source: str, **options: Any) -> Result:
        return monitor(source, **options)


def _beside(chosen: Estimator) -> Sequence[Named]:
    """The estimators of the board: all filters, or ``chosen`` alone."""
    return FILTERS if chosen.name in FILTERS else [chosen]
