"""A register map as files: JSON, C header, CMSIS-SVD, Markdown; one declaration."""

from __future__ import annotations

from boresight.gateware.registers.header import to_header
from boresight.gateware.registers.model import RegisterMap
from boresight.gateware.registers.page import to_markdown
from boresight.gateware.registers.svd import to_svd

__all__ = ["files_of"]


def files_of(registers: RegisterMap) -> dict[str, str]:
    """Texts by file name: ``registers`` with .h, .json, .md and .svd."""
    return {
        "registers.h": to_header(registers),
        "registers.json": registers.to_json(),
        "registers.md": to_markdown(registers),
        "registers.svd": to_svd(registers),
    }
