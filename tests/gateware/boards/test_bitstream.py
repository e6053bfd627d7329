"""Boards of open flows: the design and its pins without a router, bitstreams by a stand-in."""

import re
import time
from functools import partial
from types import SimpleNamespace

import pytest
from amaranth.hdl import ClockDomain, ClockSignal, Const, Module, Signal
from amaranth.lib import io
from amaranth.sim import Simulator

from boresight.gateware.attitude.system.attitude_system import system_design
from boresight.gateware.attitude.system.programs import system_core
from boresight.gateware.boards import clock
from boresight.gateware.boards.board import ClockMissed, prepared, write_project
from boresight.gateware.boards.clock import Ecp5Clock, Ice40Clock, Pll
from boresight.gateware.boards.top import records_design
from boresight.gateware.core import Core
from boresight.gateware.synthesis.tools import find_program
from boresight.model.errors import InputError
from boresight.verbs.compile import project_files
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
    core = system_core(("complementary",))
    made = prepared(partial(system_design, core), "ulx3s", clock_hz=100_000_000)
    pins = made.texts["top.lpf"]
    assert dict(re.findall(r'LOCATE COMP "(\w+?)(?:_0)?__io" SITE "(\w+)"', pins)) | {
        f"{name}_{k}": site
        for name, k, site in re.findall(r'COMP "(led|held)_(\d)__io" SITE "(\w+)"', pins)
    } == SITES | {"led": "B2", "held": "L2"}
    pulled = re.findall(r'IOBUF PORT "(\w+)_0__io" IO_TYPE=LVCMOS33 PULLMODE=UP;', pins)
    assert pulled == ["host_rx", "adis_miso", "hmr_rx"]
    assert pins.count("SLEWRATE=SLOW DRIVE=8;") == 6
    assert 'FREQUENCY PORT "clk25_0__io" 25000000.0 HZ;' in pins
    verilog = made.texts["top.v"]
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
    assert all(len(line) <= 100 for line in readme.splitlines()) and "[[" not in readme


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
    pll = Ecp5Clock.of(25_000_000, int(1e6 * mhz)).pll
    hz = pll.oscillator_hz * pll.feedback / pll.reference
    assert hz == 1e6 * mhz and 400e6 <= hz * pll.output <= 800e6
    assert pll.oscillator_hz / pll.reference >= 10e6


@pytest.mark.parametrize("mhz", [127.5, 130, 128.125, 60.0])
def test_factors_of_a_second_output(mhz: float) -> None:
    """Where the first output cannot be the clock; else it is."""
    pll = Ecp5Clock.of(25_000_000, int(1e6 * mhz)).pll
    first = pll.oscillator_hz * pll.feedback / pll.reference
    assert pll.second is not None and first * pll.output / pll.second == 1e6 * mhz
    assert 400e6 <= first * pll.output <= 800e6 and first <= 400e6
    assert pll.oscillator_hz / pll.reference >= 10e6 and pll.feedback <= 80


def test_factors_are_those_of_ecppll() -> None:
    assert Ecp5Clock.of(25_000_000, 112_500_000).pll == Pll(25_000_000, 2, 9, 5)
    assert Ecp5Clock.of(25_000_000, 25_000_000) is None


def test_the_second_output_of_an_ecp5s_pll_behind_its_gate(monkeypatch) -> None:
    """Its parameters; the gate opens two periods of the oscillator after the lock."""
    lock, m, parts, pin = Signal(), Module(), {}, io.SimulationPort("i", 1)

    def model(kind: str, **ports) -> Module:
        parts[kind] = ports
        made = Module()
        if kind == "EHXPLLL":
            made.d.comb += [ports["o_CLKOS"].eq(ports["i_CLKI"]), ports["o_LOCK"].eq(lock)]
        return made

    monkeypatch.setattr(clock, "Instance", model)
    m.domains += [ClockDomain("board"), ClockDomain("sync", reset_less=True)]
    m.d.comb += pin.i.eq(ClockSignal("board"))
    platform = SimpleNamespace(default_clk="", request=lambda *_, **options: pin)
    m.submodules.clock = Ecp5Clock(Pll(25_000_000, 1, 5, 5, 4)).elaborate(platform)
    pll, gate = parts["EHXPLLL"], parts["DCCA"]
    clocks = {k[-5:].strip("_"): v for k, v in pll.items() if k.startswith("a_FREQUENCY_PIN")}
    assert clocks == {"CLKI": "25", "CLKOP": "125", "CLKOS": "156.25"}
    assert {name[2:]: v for name, v in pll.items() if name[0] == "p" and isinstance(v, int)} == {
        **{"CLKI_DIV": 1, "CLKFB_DIV": 5},
        **{"CLKOP_DIV": 5, "CLKOP_CPHASE": 2, "CLKOP_FPHASE": 0},
        **{"CLKOS_DIV": 4, "CLKOS_CPHASE": 2, "CLKOS_FPHASE": 0},
    }
    inputs = {name[2:]: v.value for name, v in pll.items() if isinstance(v, Const)}
    high = {"PHASEDIR", "PHASESTEP", "PHASELOADREG"}
    assert {name for name in inputs if inputs[name]} == high and {*inputs.values()} == {0, 1}
    assert gate["i_CLKI"] is pll["o_CLKOS"] and pll["i_CLKFB"] is pll["o_CLKOP"]

    async def bench(ctx):
        for locked in (1, 0, 1):
            ctx.set(lock, locked)
            await ctx.tick("board")
            assert ctx.get(gate["i_CE"]) != locked
            await ctx.tick("board")
            assert ctx.get(gate["i_CE"]) == locked

    simulator = Simulator(m)
    simulator.add_clock(4e-8, domain="board")
    simulator.add_testbench(bench)
    simulator.run()


@pytest.mark.parametrize("hz", [1, 101_500_001, 412_500_000])
def test_impossible_clocks(hz: int) -> None:
    with pytest.raises(InputError, match=r"^clock: wanted a clock that the PLL makes of 25 MHz, f"):
        Ecp5Clock.of(25_000_000, hz)


@pytest.mark.parametrize(
    ("mhz", "pll"),
    [
        # As icepll of Project IceStorm gives them for 12 MHz.
        (24, Pll(12_000_000, 1, 64, 5)),
        (30, Pll(12_000_000, 1, 80, 5)),
        (33, Pll(12_000_000, 1, 88, 5)),
        (48, Pll(12_000_000, 1, 64, 4)),
    ],
)
def test_factors_are_those_of_icepll(mhz: int, pll: Pll) -> None:
    assert Ice40Clock.of(12_000_000, 1_000_000 * mhz).pll == pll
    assert Ice40Clock(pll).filter == 1


@pytest.mark.parametrize(
    ("pll", "waits"), [(Pll(12_000_000, 1, 80, 5), 450), (Pll(34_133_333, 1, 16, 4), 512)]
)
def test_the_design_runs_15_us_after_the_lock(monkeypatch, pll: Pll, waits: int) -> None:
    """And begins anew when the lock is lost."""
    lock, runs, domain, m = Signal(), Signal(8), ClockDomain("sync"), Module()

    def pll_model(_: str, **ports: object) -> Module:
        model = Module()
        model.d.comb += [
            ports["o_PLLOUTGLOBAL"].eq(ClockSignal("oscillator")),
            ports["o_LOCK"].eq(lock),
        ]
        return model

    monkeypatch.setattr(clock, "Instance", pll_model)
    pin = SimpleNamespace(io=Signal())
    platform = SimpleNamespace(default_clk="", request=lambda *_, **options: pin)
    m.domains += [domain, ClockDomain("oscillator")]
    m.submodules.clock = Ice40Clock(pll).elaborate(platform)
    m.d.sync += runs.eq(runs + 1)

    async def bench(ctx):
        for _ in range(2):
            ctx.set(lock, 0)
            await ctx.tick("oscillator").repeat(20)
            ctx.set(lock, 1)
            cycles = 0
            while ctx.get(domain.rst):
                await ctx.tick("oscillator")
                cycles += 1
                assert cycles < 1000
            assert cycles == waits + 3  # a synchroniser of two, and a register behind the timer
            await ctx.tick("oscillator").repeat(9)
            assert ctx.get(runs) == 9

    simulator = Simulator(m)
    simulator.add_clock(1e-8, domain="oscillator")
    simulator.add_testbench(bench)
    simulator.run()


def test_a_core_on_an_icebreaker(leaky: Core) -> None:
    made = prepared(records_design(leaky), "icebreaker", clock_hz=30_000_000)
    verilog = made.texts["top.v"]
    # Schematic of the iCEBreaker, version 1.0: its oscillator, the FT2232H's TX and RX, two LEDs.
    wanted = {"clk12_0": "35", "rx_0": "6", "tx_0": "9", "led_0": "11", "led_1": "37"}
    assert dict(re.findall(r"set_io (\w+)__io (\d+)", made.texts["top.pcf"])) == wanted
    # 12 MHz * 80 / 2^5; a pull-up at the input alone; a domain with a reset.
    for parameter in ("DIVF(7'h4f)", "DIVQ(3'h5)", "DIVR(4'h0)", "FILTER_RANGE(3'h1)"):
        assert f".{parameter}" in verilog
    # The PLL is neither held in reset nor bypassed.
    assert ".RESETB(1'h1)" in verilog and ".BYPASS(1'h0)" in verilog
    (_, receiver) = verilog.split(r"module \top.pin_rx_0.buf")
    assert verilog.count("PULLUP") == receiver.split("endmodule")[0].count("PULLUP") == 1
    # The design's reset lasts 15 us, 450 cycles, from the lock on.
    (source,) = re.findall(r"(?s)module \\top\.clock \(.*?endmodule", verilog)
    assert "9'h1c2" in source and re.search(r"assign rst = ~ ?ready;", source)
    assert re.search(r"module \\top\.design \([^)]*\brst\b", verilog)
    assert "iCE40UP5K-SG48" in made.readme()  # a part without grades
