"""Boards of open flows: the design and its pins without a router, bitstreams by a stand-in."""

import re
import time

import pytest

from boresight.core_files import project_files, write_project
from boresight.gateware.boards.bitstream import ClockMissed, open_project
from boresight.gateware.boards.board import BOARDS
from boresight.gateware.boards.ecp5_clock import VCO_HZ, Ecp5Pll, ecp5_clock, ecp5_pll
from boresight.gateware.boards.top import records_design
from boresight.gateware.core import Core
from boresight.gateware.synthesis.nextpnr import find_program
from boresight.gateware.system.attitude_system import system_design
from boresight.gateware.system.programs import system_core
from boresight.model.errors import InputError
from tests.support.router import stand_in

#: Sites of the complete system on the ULX3S: its schematic, version 3.0.8.
SITES = {
    "clk25": "G2",
    "host_rx": "M1",  # ftdi_txd
    "host_tx": "L4",  # ftdi_rxd
    "adis_cs_n": "B11",  # gp0, gn0 and so on
    "adis_sclk": "C11",
    "adis_mosi": "A10",
    "adis_miso": "A11",
    "adis_data_ready": "A9",
    "adis_reset_n": "B10",
    "hmr_rx": "B9",
    "hmr_tx": "C10",
    "led_0": "B2",
    "led_1": "C2",
    "held_0": "L2",  # wifi_gpio0
}


@pytest.fixture
def tools(tmp_path, monkeypatch):
    """Router and packer that do what a test says, and record their arguments.

    Their version is new each time: no build cache has their results.
    """
    version = f"9.{time.time_ns()}"
    router, packer = (
        stand_in(tmp_path, monkeypatch, program, version) for program in ("nextpnr-ecp5", "ecppack")
    )

    def make(*mhz: float):
        """Clocks of the seeds 1, 2, ..."""
        act = (
            f"n = int(sys.argv[sys.argv.index('--seed') + 1]); mhz = {mhz!r}[n - 1]\n"
            "pathlib.Path('report.json').write_text(json.dumps({'fmax': {'c': {'achieved': mhz}},"
            " 'critical_paths': []}))\n"
            "pathlib.Path('top.config').write_text(f'placed {n}')"
        )
        packed = "pathlib.Path('top.bit').write_text('bits of ' + pathlib.Path('top.config')"
        return router(act), packer(f"{packed}.read_text())")

    yield make
    find_program.cache_clear()


def test_the_complete_system_on_its_pins() -> None:
    core = system_core(("complementary",), restarts=0)
    made = open_project(system_design(core), "ulx3s", clock_hz=100_000_000)
    pins = made.pins
    assert dict(re.findall(r'LOCATE COMP "(\w+?)(?:_0)?__io" SITE "(\w+)"', pins)) | {
        f"{name}_{k}": site
        for name, k, site in re.findall(r'COMP "(led|held)_(\d)__io" SITE "(\w+)"', pins)
    } == SITES | {"led": "B2", "held": "L2"}
    pulled = re.findall(r'IOBUF PORT "(\w+)_0__io" IO_TYPE=LVCMOS33 PULLMODE=UP;', pins)
    assert pulled == ["host_rx", "adis_miso", "hmr_rx"]
    assert pins.count("SLEWRATE=SLOW DRIVE=8;") == 6
    assert 'FREQUENCY PORT "clk25_0__io" 25000000.0 HZ;' in pins
    verilog = made.verilog
    # 25 MHz * 4, the inner oscillator at 600 MHz, as ecppll has it; the gate opens with the lock.
    for parameter in ("CLKI_DIV(32'd1)", "CLKFB_DIV(32'd4)", "CLKOP_DIV(32'd6)"):
        assert f".{parameter}" in verilog
    assert ".CLKOP_CPHASE(32'd2)" in verilog and '.FEEDBK_PATH("CLKOP")' in verilog
    assert re.search(r"(?m)^  DCCA gate ", verilog) and "DSP48A1" not in verilog


def test_the_bitstream_is_that_of_the_fastest_seed(tools, leaky: Core, tmp_path) -> None:
    router, packer = tools(101.0, 120.0, 110.0)
    routed = write_project(
        records_design(leaky), "ulx3s", tmp_path / "out", clock_hz=100_000_000, seeds=3
    )
    assert routed is not None and routed.clock_mhz == 101.0
    written = {f"board-ulx3s/{p.name}" for p in (tmp_path / "out").iterdir()}
    assert written == set(project_files("ulx3s", system=False))
    assert (tmp_path / "out" / "top.bit").read_text() == "bits of placed 2"
    assert packer() == ["--compress", "top.config", "top.bit"]
    text = " ".join(router())
    for option in ("--85k", "--package CABGA381", "--speed 6", "--freq 100", "--lpf top.lpf"):
        assert option in text
    readme = (tmp_path / "out" / "README.txt").read_text()
    assert "120.0 MHz with seed 2" in readme and "101.0 MHz at worst of seeds 1 to 3" in readme
    assert re.search(r"host_?rx|rx\s+M1\s+on the board", readme) and "adapter\n" not in readme
    assert all(len(line) <= 100 for line in readme.splitlines()) and "{" not in readme


def test_a_clock_that_is_missed_writes_nothing(tools, leaky: Core, tmp_path) -> None:
    tools(99.9, 98.0)
    missed = r"^clock: wanted 100 MHz, found 99\.9 MHz at best, seeds 1 to 2 "
    with pytest.raises(ClockMissed, match=missed):
        write_project(
            records_design(leaky), "ulx3s", tmp_path / "out", clock_hz=100_000_000, seeds=2
        )
    assert not (tmp_path / "out").exists()


# -- factors of the PLL ---------------------------------------------------------------------------


@pytest.mark.parametrize("mhz", [12.5, 75, 100, 112.5, 125, 150, 400])
def test_factors(mhz: float) -> None:
    pll = ecp5_pll(oscillator_hz=25_000_000, clock_hz=int(1e6 * mhz))
    clock = pll.oscillator_hz * pll.feedback / pll.reference
    assert clock == 1e6 * mhz and VCO_HZ[0] <= clock * pll.output <= VCO_HZ[1]
    assert pll.oscillator_hz / pll.reference >= 10e6


def test_factors_are_those_of_ecppll() -> None:
    assert ecp5_pll(oscillator_hz=25_000_000, clock_hz=112_500_000) == Ecp5Pll(25_000_000, 2, 9, 5)
    assert ecp5_clock(25_000_000, 25_000_000) is None


@pytest.mark.parametrize("hz", [1, 101_000_000, 412_500_000])
def test_impossible_clocks(hz: int) -> None:
    with pytest.raises(InputError, match=r"^clock: wanted a multiple of 12\.5 MHz up to 400 MHz, "):
        ecp5_pll(oscillator_hz=25_000_000, clock_hz=hz)


def test_parts_of_boards_are_targets() -> None:
    assert {name: board.target for name, board in BOARDS.items()} == {
        "mimas": "xc6slx9",
        "sk-xc6slx9": "xc6slx9",
        "ulx3s": "ecp5-85k",
    }
