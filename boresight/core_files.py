"""The files of a compiled core: their names, known before it is compiled, and their contents."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from boresight.firmware.emit import emit_c
from boresight.firmware.names import stem
from boresight.gateware.boards.board import BOARDS
from boresight.gateware.boards.project import write_project
from boresight.gateware.core import Core
from boresight.gateware.description import describe
from boresight.gateware.microcode.image import rom_pieces
from boresight.gateware.synthesis.family import Router
from boresight.gateware.synthesis.nextpnr import find_router
from boresight.gateware.synthesis.routed import Mapped, Routed
from boresight.gateware.synthesis.targets import SPARTAN6, TARGETS
from boresight.gateware.texts.core import (
    REGISTER_FILES,
    Recorded,
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


def check_routable(target: str) -> None:
    """Raise InputError unless an open tool routes ``target``, ToolMissing without it."""
    router = TARGETS[target].family.router if target in TARGETS else None
    if router is None:
        routed = dict.fromkeys(t.device.name for t in TARGETS.values() if t.family.router)
        raise InputError.at(
            "route",
            wanted="a target that an open tool routes",
            found=f"--target {target}",
            fix=f"choose {', '.join(routed)}, or --synth for area alone",
        )
    find_router(router)


def has_primitives(target: str) -> bool:
    """Whether ``core.v`` for a target has primitives of it: Spartan-6."""
    return target in TARGETS and TARGETS[target].family is SPARTAN6


def core_files(names: Sequence[str], target: str) -> list[str]:
    """Names of the texts of these estimators' core (`core_texts`), and of the report."""
    beside = integration_names(generic=not has_primitives(target), axi=True)
    firmware = [f"firmware/{stem(name)}{end}" for name in names for end in (".c", ".h")]
    return ["core.v", "report.json", *REGISTER_FILES, *beside, *firmware]


def open_router(board: str | None) -> Router | None:
    """The open router of a board's part, which makes its bitstream; None: ISE makes it."""
    return TARGETS[BOARDS[board].target].family.router if board in BOARDS else None


def project_folder(board: str) -> str:
    """Folder of a board's project."""
    return f"{'board' if open_router(board) else 'ise'}-{board}"


def project_files(board: str, *, system: bool) -> list[str]:
    """Names of the files of a board's project; ``system``: complete system with register map."""
    if router := open_router(board):
        names = ["README.txt", "top.v", router.pins[1], router.bitstream]
    else:
        names = ["README.txt", "build.bat", "build.sh", "build_top.bat", "build_top.sh"]
        names += ["top.prj", "top.ucf", "top.v", "top.xst"]
    names += REGISTER_FILES if system else []
    return [f"{project_folder(board)}/{name}" for name in names]


def write_system(
    folder: Path, board: str, core: Core, *, clock_hz: int, **settings: Any
) -> tuple[Any, Routed | None]:
    """Write the project of a complete system, with its register map beside it."""
    system, description = board_system().design(core, clock_hz)
    routed = write_project(lambda _: system, board, folder, clock_hz=clock_hz, **settings)
    for file, text in register_files(description).items():
        write_text(folder / file, text)
    return system, routed


def core_texts(
    build: Build, records: Sequence[Recorded], target: str, area: Mapped | Routed | None = None
) -> dict[str, str]:
    """Verilog, C, register map, texts and bench of a core for one of `TARGET_NAMES`, by file.

    ``records`` of every program are the bench's (`sim.levels.vectors.recorded`); area and clock are
    for the README.
    """
    core = build.core
    description = describe(core, {e.name: e.summary for e in build.estimators})
    primitives = has_primitives(target)
    verilog = core.verilog(instances=primitives, identified=True)
    texts = {
        "core.v": verilog_head(description, instances=primitives) + verilog,
        **register_files(description),
        **integration_files(description, records, generic=not primitives, axi=True, area=area),
    }
    for part in core.parts:
        texts |= {f"firmware/{file}": text for file, text in emit_c(part.program).items()}
    return texts


def write_core(folder: Path, core: Core, texts: Mapping[str, str]) -> str:
    """Write texts of a core (`core_texts`); return what was proven of them.

    The microcode was proven when the core was built (`gateware.core`); the memories in the Verilog
    must hold it. Raises Refuted, and writes nothing, if they do not: a bug of the compiler.
    """
    check_memories(core.machine, core.image, texts["core.v"])
    for file, text in texts.items():
        (folder / file).parent.mkdir(exist_ok=True)
        write_text(folder / file, text)
    n = sum(len(part.program.ops) for part in core.parts)
    return f"{n} operation{'s' * (n != 1)}, microcode, all inputs"


def write_text(file: Path, text: str) -> None:
    """Write UTF-8 with line feeds on every operating system."""
    file.write_text(text, encoding="utf-8", newline="\n")


def together(core: Core, reports: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """The report of a core from those of its programs; of a single one, its own."""
    if len(reports) == 1:
        return reports[0]
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
            "depth": sum(rom_pieces(len(core.image.rom))),
            "bits": core.machine.word_bits,
            "first_word": dict(zip(core.names, core.image.bases[: len(core.names)], strict=True)),
        },
        "states": {
            "used": sum(len(p.program.states) for p in core.parts),
            "available": core.machine.lanes * core.machine.state_slots,
        },
        "programs": dict(zip(core.names, reports, strict=True)),
    }
