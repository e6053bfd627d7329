"""The simulated board: its speeds, real or all scaled, and the sources of its bench."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from boresight.gateware.attitude.sensors.adis16385 import Adis16385, Timing
from boresight.gateware.attitude.sensors.hmr3300 import Hmr3300
from boresight.gateware.attitude.system.attitude_system import AttitudeSystem
from boresight.gateware.attitude.system.programs import system_core
from boresight.gateware.boards.uart import divisor_for
from boresight.gateware.core import Core
from boresight.gateware.synthesis.tools import to_verilog
from boresight.model.attitude import FILTERS
from boresight.model.resolve import Named
from boresight.sim.attitude.devices import device_text

#: Factor by which `SCALED` and `FAULTY` are faster than the real board.
FASTER = 16


@dataclass(frozen=True)
class Setup:
    """Parameters of the system, and speeds of the devices at its pins."""

    clock_hz: int = 70_000_000
    host_baud: int = 921_600
    hmr_baud: int = 19_200
    timing: Timing = Timing()
    #: Samples and compass lines a second; cycles of the data-ready pulse, and to the first line.
    rate_hz: int = 1024
    lines_hz: int = 8
    ready_cycles: int = 5_000
    compass_start_cycles: int = 80_000_000

    @property
    def period_cycles(self) -> float:
        """Cycles from sample to sample."""
        return self.clock_hz / self.rate_hz


#: As on the bench, but with short waits after power-up.
REAL = Setup(timing=Timing(startup_s=2e-3, self_test_s=1e-3), compass_start_cycles=1_000_000)

_FAST = Timing(sclk_hz=10e6, stall_s=1e-6, startup_s=0.3e-3, reset_s=50e-6, self_test_s=0.1e-3)
#: Sixteen times as fast, at 100 MHz, so that 500 samples take 3 million cycles.
SCALED = Setup(
    clock_hz=100_000_000,
    host_baud=12_500_000,
    hmr_baud=307_200,
    timing=_FAST,
    rate_hz=16_384,
    lines_hz=128,
    ready_cycles=200,
    compass_start_cycles=60_000,
)

#: The same with all waits of the bench, sixteen times as fast.
FAULTY = replace(SCALED, timing=replace(_FAST, startup_s=0.3 / FASTER, reset_s=1e-3 / FASTER))


@dataclass(frozen=True)
class Board:
    """A system, and the speeds for which it is built."""

    system: AttitudeSystem
    setup: Setup

    @property
    def core(self) -> Core:
        return self.system.core

    @cached_property
    def verilog(self) -> str:
        return to_verilog(self.system, "system", instances=False)


def make_board(
    setup: Setup,
    *,
    filters: Sequence[Named] = FILTERS,
    core: Core | None = None,
    params: Mapping[str, Mapping[str, float]] | None = None,
) -> Board:
    """Return a complete system for these speeds.

    ``filters`` and ``params`` are those of `gateware.attitude.system.programs`, unused with a
    ``core``.
    """
    core = core or system_core(filters, clock_hz=setup.clock_hz, params=params)
    timing = replace(setup.timing, period_s=1.0 / setup.rate_hz)
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
        ),
        setup,
    )


def board_sources(board: Board) -> dict[str, str]:
    """Texts of the bench by file name, in the order of compilation."""
    bench = Path(__file__).with_name("bench.sv").read_text()
    devices = {f"{device}.sv": device_text(device) for device in ("adis16385", "hmr3300")}
    return {"system.sv": board.verilog, **devices, "bench.sv": bench}


def board_parameters(setup: Setup) -> dict[str, int]:
    clock = setup.clock_hz
    half = clock / setup.timing.sclk_hz / 2
    return {
        "CLOCK_HZ": clock,
        "HOST_DIVISOR": divisor_for(clock_hz=clock, baud=setup.host_baud),
        "ADIS_RATE": setup.rate_hz,
        "ADIS_STARTUP_CYCLES": int(0.6 * setup.timing.startup_s * clock),
        "ADIS_READY_CYCLES": setup.ready_cycles,
        "ADIS_STALL_MIN": int(setup.timing.stall_s * clock),
        "ADIS_HALF_MIN": int(half),
        "ADIS_DOUT_DELAY": max(int(0.2 * half), 1),
        "HMR_DIVISOR": divisor_for(clock_hz=clock, baud=setup.hmr_baud),
        "HMR_LINE_CYCLES": round(clock / setup.lines_hz),
        "HMR_STARTUP_CYCLES": setup.compass_start_cycles,
        "HMR_ANSWER_CYCLES": round(clock / setup.lines_hz / 125),
    }
