"""ISE projects of the boards."""

import os
import re
import shutil
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from boresight.firmware.build import CModel
from boresight.gateware.attitude.system.programs import system_core
from boresight.gateware.boards.board import write_project
from boresight.gateware.boards.clock import Spartan6Clock
from boresight.gateware.boards.frames import Decoder, encode
from boresight.gateware.boards.top import records_design
from boresight.gateware.core import Core
from boresight.gateware.description import describe
from boresight.gateware.synthesis.tools import find_tool
from boresight.model.errors import InputError
from boresight.model.tools.external import yosys_environment
from boresight.verbs.compile import SYSTEM_CLOCK_HZ, write_system

# --------------------------------------------------------------------------------------------------
# ISE projects: complete, the same every time, with the boards' pins; the Verilog elaborates

FILES = [
    "README.txt",
    "build.bat",
    "build.sh",
    "build_top.bat",
    "build_top.sh",
    "top.prj",
    "top.ucf",
    "top.v",
    "top.xst",
]
TOOLS = ["xst", "ngdbuild", "map", "par", "bitgen", "trce"]
#: Pins of the nets, from the boards' schematics as amaranth-boards has them.
PINS = {
    "mimas": {
        "clk100_0__io": "P126",
        "rx_0__io": "P35",
        "tx_0__io": "P34",
        "led_0__io": "P119",
        "led_1__io": "P118",
    },
    "sk-xc6slx9": {
        "clk50_0__io": "P134",
        "rx_0__io": "P34",
        "tx_0__io": "P33",
        "led_0__io": "P32",
        "led_1__io": "P30",
    },
}


@pytest.fixture(scope="module")
def project(leaky: Core, tmp_path_factory) -> dict[str, Path]:
    """A project for each board, one of them with a PLL."""
    out = {}
    for board, clock in (("mimas", None), ("sk-xc6slx9", 100_000_000)):
        folder = out[board] = tmp_path_factory.mktemp(board) / "made" / "here"
        assert write_project(records_design(leaky), board, folder, clock_hz=clock) is None
        assert sorted(os.listdir(folder)) == FILES
    return out


BOARD = pytest.mark.parametrize("board", sorted(PINS))


def elaborate(folder: Path) -> None:
    """Yosys finds every module of the project, and its `check` no fault."""
    done = subprocess.run(
        [
            *find_tool().argv,
            "-q",
            "-p",
            "read_verilog -lib +/xilinx/cells_sim.v +/xilinx/cells_xtra.v; read_verilog top.v; "
            "hierarchy -check -top top; proc; check -assert",
        ],
        cwd=folder,
        env={**os.environ, **yosys_environment()},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr


@BOARD
def test_verilog_elaborates(board: str, project) -> None:
    elaborate(project[board])
    text = (project[board] / "top.v").read_text()
    for primitive, wanted in (
        ("DSP48A1", True),
        ("STARTUP_SPARTAN6", True),
        ("BUFGCE", True),
        ("PLL_BASE", board == "sk-xc6slx9"),
    ):
        assert bool(re.search(rf"(?m)^  {primitive} ", text)) == wanted, primitive
    if board == "sk-xc6slx9":  # the clock runs from when it is stable and the device configured
        (enable,) = re.findall(r"BUFGCE [^;]*\.CE\(([^)]*)\)", text)
        assert re.search(rf"assign {re.escape(enable)} = locked & started;", text)


def pins(ucf: str) -> dict[str, str]:
    """Pin of every net of a constraints file."""
    return dict(re.findall(r'(?m)^NET "(\w+)" LOC=(P\d+);$', ucf))


@BOARD
def test_pins_are_those_of_the_schematic(board: str, project) -> None:
    result = pins((project[board] / "top.ucf").read_text())
    assert result == PINS[board]
    # Every port of the top module has a pin, and every pin a port.
    verilog = (project[board] / "top.v").read_text()
    ports = re.search(r"(?m)^module top\((.*)\);$", verilog)
    assert ports and set(ports[1].split(", ")) == set(result)


@BOARD
def test_constraints(board: str, project) -> None:
    ucf = (project[board] / "top.ucf").read_text()
    period = {"mimas": 10.0, "sk-xc6slx9": 20.0}[board]
    clock = next(net for net in PINS[board] if net.startswith("clk"))
    assert f'TIMESPEC "TS{clock}"=PERIOD "PRD{clock}" {period} ns HIGH 50%;' in ucf
    assert 'NET "rx_0__io" PULLUP=TRUE;' in ucf
    assert 'NET "rx_0__io" TIG;' in ucf and ucf.count(" TIG;") == 1
    assert ucf.count("IOSTANDARD=LVCMOS33;") == len(PINS[board])
    assert "LOC=65" not in ucf
    xst = (project[board] / "top.xst").read_text()
    assert "-p xc6slx9tqg144-2\n" in xst and "-ifn top.prj\n" in xst and "-top top\n" in xst
    assert "verilog work top.v\n" in (project[board] / "top.prj").read_text()


def test_same_files_elsewhere(leaky: Core, project, tmp_path, monkeypatch) -> None:
    """No path, no date, no version, and no variable of Amaranth's gets into the files."""
    variables = [f"AMARANTH_{name}" for name in ("add_constraints", "map_opts", "debug_verilog")]
    for variable in variables:
        monkeypatch.setenv(variable, "1")
    write_project(records_design(leaky), "sk-xc6slx9", tmp_path, clock_hz=100_000_000)
    assert [os.environ[variable] for variable in variables] == ["1"] * 3
    for name in FILES:
        text = (tmp_path / name).read_bytes()
        assert text == (project["sk-xc6slx9"] / name).read_bytes(), name
        assert not re.search(rb"Yosys|Amaranth \d|\.py:|src =|/home|/tmp|/work|20\d\d-", text), name
        assert b"\t" not in text and text.endswith(b"\n")
    assert b"\r\n" in (tmp_path / "build.bat").read_bytes()


def test_the_program_in_the_readme(leaky: Core, project, monkeypatch, capsys) -> None:
    """It sends a record, u = 0.5, to a port and prints what the core answers."""
    folder, model = project["mimas"], CModel(leaky.program)
    (folder.parent / "registers.json").write_text(describe(leaky).to_json())
    monkeypatch.chdir(folder)
    _, _, program = (folder / "README.txt").read_text().partition("\n\nimport json\n")
    master, slave = os.openpty()
    program = "import json\n" + program.replace("/dev/ttyUSB0", os.ttyname(slave))
    for wrong, error in (("'z': 1", "^'z'$"), ("'u': 2", "word 0 of .* found 2147483648; keep")):
        with pytest.raises((KeyError, InputError), match=error):
            exec(program.replace('"u": 0.5', wrong), {})

    def answer() -> None:
        decoder, frames = Decoder(word=32), []
        while not frames:
            frames = [*decoder.feed(os.read(master, 100))]
        ((kind, words),) = frames
        outputs = model.update(np.array([words]))[0][0]
        os.write(master, encode(kind, outputs, word=32))

    with ThreadPoolExecutor() as threads:
        done = threads.submit(answer)
        exec(program, {})
        done.result()
    os.close(master)
    os.close(slave)
    assert capsys.readouterr().out.split() == ["y", "0.25", "step", "0.25", "sum", "0.5"]


def run_build(folder: Path, path: str) -> subprocess.CompletedProcess:
    return subprocess.run(
        [folder / "build.sh"], env={"PATH": path}, capture_output=True, text=True, cwd="/"
    )


@pytest.fixture
def shell(tmp_path) -> Path:
    """A folder for the PATH with what a shell script needs."""
    folder = tmp_path / "bin"
    folder.mkdir()
    for tool in ("bash", "dirname", "grep", "env", "cat"):
        found = shutil.which(tool)
        assert found
        (folder / tool).symlink_to(found)
    return folder


def test_build_without_tools_says_what_is_missing(project, shell) -> None:
    done = run_build(project["mimas"], str(shell))
    assert done.returncode == 2
    assert done.stderr.startswith("error: xst is not on the PATH: install ISE 14.7")
    assert "settings64.sh" in done.stderr and not done.stdout


def fake(shell: Path, tool: str, script: str = "") -> None:
    (shell / tool).write_text(f'#!/usr/bin/env bash\necho {tool} "$@"\n{script}\n')
    (shell / tool).chmod(0o755)


def test_build_runs_every_tool(project, shell, tmp_path) -> None:
    folder = tmp_path / "project"
    shutil.copytree(project["mimas"], folder)
    for tool in TOOLS:
        fake(shell, tool)
    fake(shell, "trce", "echo 'Minimum period:   9.5ns' > top.twr")
    done = run_build(folder, str(shell))
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines() == [
        "xst -ifn top.xst",
        "ngdbuild -quiet -uc top.ucf top.ngc",
        "map -ol high -w -o top_map.ncd top.ngd top.pcf",
        "par -ol high -w top_map.ncd top_par.ncd top.pcf",
        "bitgen -g Compress -w -g Binary:Yes top_par.ncd top.bit",
        "trce -v 3 -s 2 -n 3 top_par.ncd top.pcf -o top.twr",
        "",
        "top.bit is the bitstream, top.twr the timing report:",
        "Minimum period:   9.5ns",
    ]


#: Nets of the complete system, but for the clock; Mimas, SK-XC6SLX9.
SYSTEM_PINS = {
    "host_rx_0__io": ("P35", "P34"),
    "host_tx_0__io": ("P34", "P33"),
    "adis_cs_n_0__io": ("P33", "P29"),
    "adis_sclk_0__io": ("P32", "P27"),
    "adis_mosi_0__io": ("P30", "P26"),
    "adis_miso_0__io": ("P29", "P24"),
    "adis_data_ready_0__io": ("P27", "P23"),
    "adis_reset_n_0__io": ("P26", "P22"),
    "hmr_rx_0__io": ("P24", "P21"),
    "hmr_tx_0__io": ("P23", "P17"),
    "led_0__io": ("P119", "P32"),
    "led_1__io": ("P118", "P30"),
}


@BOARD
def test_complete_system(board: str, tmp_path) -> None:
    core = system_core(("complementary",), clock_hz=SYSTEM_CLOCK_HZ)
    write_system(tmp_path, board, core, clock_hz=SYSTEM_CLOCK_HZ)
    assert sorted(os.listdir(tmp_path)) == sorted([*FILES, "registers.h", "registers.json"])
    ucf = (tmp_path / "top.ucf").read_text()
    result = pins(ucf)
    clock = next(net for net in result if net.startswith("clk"))
    column = ("mimas", "sk-xc6slx9").index(board)
    assert result == {
        clock: PINS[board][clock],
        **{net: both[column] for net, both in SYSTEM_PINS.items()},
    }
    # Every constraint: the period, and no path from a pad of an asynchronous input.
    assert f'TIMESPEC "TS{clock}"=PERIOD' in ucf
    assert {line.split('"')[1] for line in ucf.splitlines() if line.endswith(" TIG;")} == {
        f"{name}_0__io" for name in ("host_rx", "adis_miso", "adis_data_ready", "hmr_rx")
    }
    assert ucf.count("PULLUP=TRUE;") == 3 and ucf.count("SLEW=SLOW;") == 6
    assert "PLL_BASE" in (tmp_path / "top.v").read_text()
    if board == "mimas":  # the other board differs by its pins and the factors of its PLL
        elaborate(tmp_path)
    text = (tmp_path / "README.txt").read_text()
    assert all(len(line) <= 100 for line in text.splitlines()) and "{" not in text
    assert "complementary" in text and "boresight monitor" in text
    assert "The ADIS16385 gives 1024 samples a second" in text


# -- factors of the PLL ---------------------------------------------------------------------------


@pytest.mark.parametrize("oscillator", [50_000_000, 100_000_000])
@pytest.mark.parametrize("clock", [25_000_000, 75_000_000, 120_000_000, 150_000_000])
def test_factors(oscillator: int, clock: int) -> None:
    pll = Spartan6Clock.of(oscillator, clock).pll
    assert oscillator * pll.feedback == clock * pll.output
    assert 400e6 <= oscillator * pll.feedback <= 900e6
    assert 1 <= pll.feedback <= 64 and 1 <= pll.output <= 128


@pytest.mark.parametrize(
    "clock, choice",
    [(0, 4), (-1, 4), (123_456_789, 125), (123_600_000, 125), (400_000_000, 375), (2_000_000, 4)],
)
def test_impossible_clocks(clock: int, choice: int) -> None:
    with pytest.raises(
        InputError,
        match=rf"^clock: wanted a clock that the PLL makes of 50 MHz, found .*; choose {choice}, ",
    ):
        Spartan6Clock.of(50_000_000, clock)
