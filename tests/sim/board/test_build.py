"""What the bench and the system are built with for given speeds; conftest.py builds it for real."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from boresight.gateware.sensors.adis16385_setup import Timing
from boresight.sim.board import build
from boresight.sim.board.build import Board, board_parameters, board_sources, make_board
from boresight.sim.board.setup import REAL, SCALED


def test_parameters_of_the_real_speeds() -> None:
    assert board_parameters(REAL) == {
        "CLOCK_HZ": 100_000_000,
        "HOST_DIVISOR": 109,  # 921,600 baud
        "ADIS_RATE": 1024,
        "ADIS_PPM": 0,
        "ADIS_STARTUP_CYCLES": 119_999,  # of 200,000 that the reader waits
        "ADIS_READY_CYCLES": 5_000,
        "ADIS_STALL_MIN": 1_600,
        "ADIS_HALF_MIN": 50,
        "ADIS_DOUT_DELAY": 10,
        "HMR_DIVISOR": 5_208,  # 19,200 baud
        "HMR_LINE_CYCLES": 12_500_000,
        "HMR_STARTUP_CYCLES": 1_000_000,
        "HMR_ANSWER_CYCLES": 100_000,  # 1 ms
    }


def test_an_answer_takes_a_cycle_at_least() -> None:
    assert board_parameters(replace(SCALED, sclk_hz=25e6))["ADIS_DOUT_DELAY"] == 1
    assert board_parameters(SCALED)["ADIS_HALF_MIN"] == 5


def test_the_system_waits_as_long_as_the_devices_need(monkeypatch: pytest.MonkeyPatch) -> None:
    """The compass's waits go with its lines: half a second stands for 8 lines a second."""
    for part in ("AttitudeSystem", "Adis16385", "Hmr3300"):
        monkeypatch.setattr(build, part, lambda **given: SimpleNamespace(**given))
    core: Any = object()
    clock = SCALED.clock_hz
    for lines, slower in ((8, 1.0), (64, 0.125)):
        setup = replace(SCALED, lines_hz=lines)
        board = make_board(setup, core=core, wishbone=True)
        given: Any = board.system
        assert board.setup is setup and board.core is given.core is core and given.wishbone
        assert (given.clock_hz, given.host_baud) == (clock, SCALED.host_baud)
        assert vars(given.compass) == {
            "clock_hz": clock,
            "baud": SCALED.hmr_baud,
            "stale_s": 0.5 * slower,
            "quiet_s": pytest.approx(0.3 * slower),
            "timeout_s": pytest.approx(1.3 * slower),
        }
        assert given.inertial.clock_hz == clock
        assert given.inertial.timing == Timing(
            sclk_hz=SCALED.sclk_hz,
            stall_s=SCALED.stall_s,
            startup_s=SCALED.startup_s,
            reset_s=SCALED.reset_s,
            period_s=1.0 / SCALED.rate_hz,
        )


def test_sources_in_the_order_of_compilation(monkeypatch: pytest.MonkeyPatch) -> None:
    """The system as behaviour, for a simulator; the devices and the bench as they stand."""
    monkeypatch.setattr(
        build, "to_verilog", lambda part, name, instances: f"module {name} {part} {instances}"
    )
    system: Any = "of parts"
    sources = board_sources(Board(system, SCALED))
    assert sources.pop("system.sv") == "module system of parts False"
    assert list(sources) == ["adis16385.sv", "hmr3300.sv", "bench.sv"]
    for name, text in sources.items():
        assert f"module {name.removesuffix('.sv')}" in text
