"""Which files a compiled core becomes: known before it is compiled."""

from __future__ import annotations

from collections.abc import Sequence

from boresight.firmware.names import identifier

__all__ = ["core_files", "project_files"]

_CORE = ("core.v", "core_sim.v", "report.json")
_REGISTERS = ("registers.h", "registers.json", "registers.md", "registers.svd")
_PROJECT = (
    *("README.txt", "build.bat", "build.sh", "build_top.bat", "build_top.sh"),
    *("top.prj", "top.ucf", "top.v", "top.xst"),
)


def core_files(names: Sequence[str]) -> list[str]:
    """Of a core with these estimators, by `boresight.verbs.compile.write_core`, and its report."""
    out = [*_CORE, *_REGISTERS]
    for name in names:
        of = f"-{name}" if len(names) > 1 else ""
        out += [f"microcode{of}.lst", f"program{of}.json", f"schedule{of}.json"]
        out += [f"firmware/{identifier(name)}{end}" for end in (".c", ".h", "_host.c")]
    return out


def project_files(board: str, *, system: bool) -> list[str]:
    """Of the ISE project for a board; ``system``: of the complete system, with a register map."""
    names = (*_PROJECT, *_REGISTERS) if system else _PROJECT
    return [f"ise-{board}/{name}" for name in names]
