"""The files of a compiled core: their names, known before it is compiled, and their contents."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from boresight.firmware.body import Body
from boresight.firmware.emit import emit_c
from boresight.firmware.names import stem
from boresight.firmware.validation import validate_c
from boresight.gateware.boards.bitstream import build_bitstream, write_open_project
from boresight.gateware.boards.board import BOARDS
from boresight.gateware.boards.ise import write_ise_project
from boresight.gateware.boards.project import Design, prepared
from boresight.gateware.core import Core
from boresight.gateware.description import describe
from boresight.gateware.microcode.image import rom_pieces
from boresight.gateware.synthesis.nextpnr import find_router
from boresight.gateware.synthesis.routed import Mapped, Routed
from boresight.gateware.synthesis.spartan6.family import SPARTAN6
from boresight.gateware.synthesis.targets import TARGETS
from boresight.gateware.texts.bench import Recorded
from boresight.gateware.texts.core import (
    REGISTER_FILES,
    integration_files,
    integration_names,
    register_files,
    verilog_head,
)
from boresight.gateware.texts.memories import check_memories
from boresight.model.errors import InputError
from boresight.sim.boards import board_system
from boresight.sim.levels.build import Build

#: Targets of ``core.v``; the first by default.
TARGET_NAMES = ("xc6slx9", "generic", *(name for name in TARGETS if name != "xc6slx9"))

#: Clocks of complete systems, Hz: one that is routed; that of the simulated board, which the
#: estimate for Spartan-6 with slow nets meets.
ROUTED_CLOCK_HZ, SYSTEM_CLOCK_HZ = 100_000_000, 70_000_000


def check_routable(targets: Sequence[str], alternative: str) -> None:
    """Raise InputError unless an open tool routes one of ``targets``, ToolMissing without it."""
    routers = [TARGETS[name].family.router for name in targets if name in TARGETS]
    if not any(routers):
        routed = {other.device.name: None for other in TARGETS.values() if other.family.router}
        raise InputError.at(
            "route",
            wanted="a target that an open tool routes",
            found=f"--target {','.join(targets)}",
            fix=f"choose {', '.join(routed)}, or {alternative} for area alone",
        )
    for router in routers:
        if router is not None:
            find_router(router)


def has_primitives(target: str) -> bool:
    """Whether ``core.v`` for a target has primitives of it: Spartan-6."""
    return target in TARGETS and TARGETS[target].family is SPARTAN6


_PROJECT = (
    *("README.txt", "build.bat", "build.sh", "build_top.bat", "build_top.sh"),
    *("top.prj", "top.ucf", "top.v", "top.xst"),
)


def core_files(
    names: Sequence[str], *, target: str = TARGET_NAMES[0], axi: bool = False
) -> list[str]:
    """Names of the texts of these estimators' core (`core_texts`), and of the report."""
    beside = integration_names(generic=not has_primitives(target), axi=axi)
    out = ["core.v", "report.json", *REGISTER_FILES, *beside]
    for name in names:
        out += [f"firmware/{stem(name)}{end}" for end in (".c", ".h")]
    return out


def is_open(board: str | None) -> bool:
    """Whether a board's part has an open router, which makes its bitstream."""
    return board in BOARDS and TARGETS[BOARDS[board].target].family.router is not None


def project_folder(board: str) -> str:
    """Folder of a board's project."""
    return f"{'board' if is_open(board) else 'ise'}-{board}"


def project_files(board: str, *, system: bool) -> list[str]:
    """Names of the files of a board's project; ``system``: complete system with register map."""
    names: Sequence[str] = _PROJECT
    if is_open(board):
        router = TARGETS[BOARDS[board].target].family.router
        assert router is not None
        names = ("README.txt", "top.v", router.pins[1], router.bitstream)
    names = (*names, *REGISTER_FILES) if system else names
    return [f"{project_folder(board)}/{name}" for name in names]


def write_project(
    make: Callable[[int], Design],
    board: str,
    folder: Path,
    *,
    clock_hz: int | None = None,
    seeds: int = 1,
    progress: Callable[[str], None] = lambda text: None,
) -> Routed | None:
    """Write a design for a board: an ISE project, or with an open flow the bitstream.

    Returns
    -------
    Routed or None
        The placed and routed design.

    Raises
    ------
    InputError, ToolMissing, ClockMissed
        See `gateware.boards.bitstream.build_bitstream`.
    """
    if not is_open(board):
        write_ise_project(make, board, folder, clock_hz=clock_hz)
        return None
    project = prepared(make, board, clock_hz=clock_hz)
    bitstream = build_bitstream(project, seeds=seeds, progress=progress)
    write_open_project(folder, project, bitstream)
    return bitstream.routed


def write_system(
    folder: Path,
    board: str,
    core: Core,
    *,
    clock_hz: int,
    seeds: int = 1,
    progress: Callable[[str], None] = lambda text: None,
) -> tuple[Any, Routed | None]:
    """Write the project of a complete system, with its register map beside it."""
    system, description = board_system().design(core, clock_hz)
    routed = write_project(
        lambda _: system, board, folder, clock_hz=clock_hz, seeds=seeds, progress=progress
    )
    for file, text in register_files(description).items():
        write_text(folder / file, text)
    return system, routed


def core_texts(
    build: Build,
    records: Sequence[Recorded],
    *,
    area: Mapped | Routed | None = None,
    target: str = TARGET_NAMES[0],
    axi: bool = False,
) -> dict[str, str]:
    """Verilog, C, register map, texts and bench of a core, by file.

    Parameters
    ----------
    build : Build
        The core and its estimators.
    records : sequence of Recorded
        Records of every program for the bench (`sim.levels.vectors.recorded`).
    area : Mapped or Routed, optional
        Area and clock, for the README.
    target : str
        One of `TARGET_NAMES`.
    axi : bool
        With the core that has an AXI interface, too.
    """
    core = build.core
    description = describe(core, {e.name: e.summary for e in build.estimators})
    primitives = has_primitives(target)
    head = verilog_head(description, instances=primitives)
    texts = {
        "core.v": head + core.verilog(instances=primitives, identified=True),
        **register_files(description),
    }
    texts |= integration_files(description, records, generic=not primitives, axi=axi, area=area)
    for part in core.parts:
        texts |= {f"firmware/{file}": text for file, text in emit_c(part.program).items()}
    return texts


def write_core(folder: Path, core: Core, texts: Mapping[str, str]) -> str:
    """Prove that texts of a core (`core_texts`) compute its programs for all inputs; write them.

    The microcode was proven when the core was built (`gateware.core`). Checked here are the
    memories in the Verilog, which hold it, and the C.

    Returns
    -------
    str
        What was proven.

    Raises
    ------
    Refuted
        The texts do not compute the programs, and nothing is written: a bug of the compiler.
    """
    start = time.perf_counter()
    check_memories(core.machine, core.image, texts["core.v"])
    firmware = {k.removeprefix("firmware/"): v for k, v in texts.items()}
    for part in core.parts:
        validate_c(part.program, Body(part.program).name, firmware)
    seconds = time.perf_counter() - start
    for file, text in texts.items():
        (folder / file).parent.mkdir(exist_ok=True)
        write_text(folder / file, text)
    operations = sum(len(part.program.ops) for part in core.parts)
    plural = "s" * (operations != 1)
    return f"{operations} operation{plural}, microcode and C, all inputs  {seconds:.1f} s"


def write_text(file: Path, text: str) -> None:
    """Write UTF-8 with line feeds on every operating system."""
    file.write_text(text, encoding="utf-8", newline="\n")


def together(core: Core, reports: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """The report of a core from those of its programs; of a single one, its own."""
    if len(reports) == 1:
        return reports[0]
    depth = sum(rom_pieces(len(core.image.rom)))
    return {
        "core": core.name,
        "config": core.machine.name,
        "word": core.machine.arithmetic.word,
        "digest": core.digest,
        "identity": core.identity,
        "resources": reports[0]["resources"],
        "fmax_mhz": reports[0]["timing"]["fmax_mhz"],
        "microcode": {
            "words": len(core.image.rom),
            "depth": depth,
            "bits": core.machine.word_bits,
            "first_word": dict(zip(core.names, core.image.bases[: len(core.names)], strict=True)),
        },
        "states": {
            "used": sum(len(p.program.states) for p in core.parts),
            "available": core.machine.lanes * core.machine.state_slots,
        },
        "programs": dict(zip(core.names, reports, strict=True)),
    }
