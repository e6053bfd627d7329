"""Build of the board's bench with Verilator, alone or for cocotb."""

from __future__ import annotations

import importlib.resources
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from boresight.gateware.attitude.sensors.adis16385 import Adis16385
from boresight.gateware.attitude.sensors.adis16385_device import Timing
from boresight.gateware.attitude.sensors.hmr3300 import Hmr3300
from boresight.gateware.attitude.system.attitude_system import AttitudeSystem
from boresight.gateware.attitude.system.programs import system_core
from boresight.gateware.boards.uart import divisor_for
from boresight.gateware.core import Core
from boresight.gateware.verilog import to_verilog
from boresight.model.attitude import FILTERS
from boresight.model.resolve import Named
from boresight.sim.attitude.board.setup import Setup
from boresight.sim.attitude.devices import device_text


@dataclass(frozen=True)
class Board:
    """A system, and the speeds for which it is built."""

    system: AttitudeSystem
    setup: Setup

    @property
    def core(self) -> Core:
        """Core of the system."""
        return self.system.core

    @cached_property
    def verilog(self) -> str:
        """The system as Verilog, for simulation."""
        return to_verilog(self.system, "system", instances=False)


def make_board(
    setup: Setup,
    *,
    filters: Sequence[Named] = FILTERS,
    config: str = "small",
    core: Core | None = None,
    wishbone: bool = False,
    params: Mapping[str, Mapping[str, float]] | None = None,
) -> Board:
    """Return a complete system for these speeds.

    Parameters
    ----------
    setup : Setup
        Speeds.
    filters, config, params
        See `gateware.attitude.system.programs.system_core`; unused with a ``core``.
    wishbone : bool
        Whether to add a Wishbone slave, for a processor.
    """
    clock_hz = setup.clock_hz
    core = core or system_core(filters, config=config, clock_hz=clock_hz, params=params)
    timing = Timing(
        sclk_hz=setup.sclk_hz,
        stall_s=setup.stall_s,
        startup_s=setup.startup_s,
        reset_s=setup.reset_s,
        self_test_s=setup.self_test_s,
        period_s=1.0 / setup.rate_hz,
    )
    # The compass's waits scale with its lines.
    slower = 8.0 / setup.lines_hz
    compass = Hmr3300(
        clock_hz=setup.clock_hz,
        baud=setup.hmr_baud,
        stale_s=0.5 * slower,
        quiet_s=0.3 * slower,
        timeout_s=1.3 * slower,
    )
    return Board(
        AttitudeSystem(
            core=core,
            clock_hz=setup.clock_hz,
            host_baud=setup.host_baud,
            inertial=Adis16385(clock_hz=setup.clock_hz, timing=timing),
            compass=compass,
            wishbone=wishbone,
        ),
        setup,
    )


def board_sources(board: Board) -> dict[str, str]:
    """Texts of the bench by file name, in the order of compilation."""
    return {"system.sv": board.verilog, **bench_sources("boresight.sim.attitude.board", "bench.sv")}


def bench_sources(package: str, name: str) -> dict[str, str]:
    """The devices, and a bench that has them, from a file of a package."""
    return {
        **{f"{device}.sv": device_text(device) for device in ("adis16385", "hmr3300")},
        "bench.sv": (importlib.resources.files(package) / name).read_text(),
    }


def board_parameters(setup: Setup) -> dict[str, int]:
    """Parameters of the bench."""
    clock = setup.clock_hz
    half = clock / setup.sclk_hz / 2
    return {
        "CLOCK_HZ": clock,
        "HOST_DIVISOR": divisor_for(clock_hz=clock, baud=setup.host_baud),
        "ADIS_RATE": setup.rate_hz,
        "ADIS_PPM": setup.ppm,
        "ADIS_STARTUP_CYCLES": int(0.6 * setup.startup_s * clock),
        "ADIS_READY_CYCLES": setup.ready_cycles,
        "ADIS_STALL_MIN": int(setup.stall_s * clock),
        "ADIS_HALF_MIN": int(half),
        "ADIS_DOUT_DELAY": max(int(0.2 * half), 1),
        "HMR_DIVISOR": divisor_for(clock_hz=clock, baud=setup.hmr_baud),
        "HMR_LINE_CYCLES": round(clock / setup.lines_hz),
        "HMR_STARTUP_CYCLES": setup.compass_start_cycles,
        "HMR_ANSWER_CYCLES": round(clock / setup.lines_hz / 125),
    }
