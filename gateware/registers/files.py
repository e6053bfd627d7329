"""The register map of a core as files: JSON, C header, CMSIS-SVD, Markdown; one declaration."""

from __future__ import annotations

from boresight.gateware.core import Core
from boresight.gateware.registers.header import to_header
from boresight.gateware.registers.model import RegisterMap, register_map
from boresight.gateware.registers.page import to_markdown
from boresight.gateware.registers.svd import to_svd

__all__ = ["RegisterMap", "files_of", "register_map", "register_map_files"]


def register_map_files(core: Core) -> dict[str, str]:
    """The register map of a core as files; see `files_of`."""
    return files_of(register_map(core))


def files_of(registers: RegisterMap) -> dict[str, str]:
    """Texts by file name: ``registers`` with .h, .json, .md and .svd."""
    return {
        "registers.h": to_header(registers),
        "registers.json": registers.to_json(),
        "registers.md": to_markdown(registers),
        "registers.svd": to_svd(registers),
    }
