"""ISE project of the complete system with a soft core, its firmware in block RAM."""

from __future__ import annotations

from pathlib import Path

from boresight.firmware.attitude.image import build_image, project_files
from boresight.gateware.attitude.soc.attitude_soc import RAM_WORDS, AttitudeSoc
from boresight.gateware.attitude.soc.cpu import cpu_verilog
from boresight.gateware.attitude.soc.memory import ram_verilog
from boresight.gateware.attitude.system.attitude_system import AttitudeSystem
from boresight.gateware.boards.ise import write_ise_project
from boresight.gateware.core import Core
from boresight.gateware.texts.core import register_files
from boresight.gateware.verilog import to_verilog
from boresight.sim.attitude.soc.board import attitude_files

__all__ = ["SOC_CLOCK_HZ", "soc_verilog", "write_soc"]

#: Clock of a system with a soft core, Hz; the estimate for the soft core is 65 MHz
#: (`docs/decisions/0010-soft-core.md`).
SOC_CLOCK_HZ = 50_000_000


def soc_verilog(soc: AttitudeSoc) -> str:
    """Complete Verilog for synthesis, top module ``system``; without contents of the memory."""
    memory = ram_verilog().replace("    initial $readmemh(IMAGE, words);\n", "")
    return "\n".join((to_verilog(soc, "system", instances=True), memory, cpu_verilog()))


def write_soc(folder: Path, board: str, core: Core) -> AttitudeSoc:
    """Write the ISE project, the register map, and the firmware's sources ready to build.

    Raises
    ------
    ToolMissing
        The compiler for the soft core is missing.
    ImageError
        The firmware could not be built.
    """
    system = AttitudeSystem(core=core, clock_hz=SOC_CLOCK_HZ, wishbone=True)
    soc = AttitudeSoc(system=system, words=RAM_WORDS)
    files, sources = attitude_files(system)
    image = build_image(files, sources=sources, ram=4 * RAM_WORDS)
    write_ise_project(
        lambda _: soc,
        board,
        folder,
        clock_hz=SOC_CLOCK_HZ,
        files={"VexRiscv.v": cpu_verilog(), "ram.v": ram_verilog(), "firmware.hex": image.hex},
    )
    for name, text in register_files(system.map()).items():
        (folder / name).write_text(text, encoding="utf-8")
    software = folder / "firmware"
    software.mkdir()
    for name, text in project_files(files, sources=sources, ram=4 * RAM_WORDS).items():
        (software / name).write_text(text, encoding="utf-8")
    (software / "build.sh").chmod(0o755)
    return soc
