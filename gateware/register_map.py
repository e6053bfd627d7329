"""The register map of a core as files: JSON, C header, CMSIS-SVD, Markdown; one declaration."""

from __future__ import annotations

from collections.abc import Mapping

from firmware.names import identifier
from gateware.core import Core
from gateware.register_header import to_header
from gateware.register_model import RegisterMap, register_map
from gateware.register_page import to_markdown
from gateware.register_svd import to_svd

__all__ = ["RegisterMap", "register_map", "register_map_files"]


def register_map_files(core: Core, *, meanings: Mapping[str, str] | None = None) -> dict[str, str]:
    """Texts by file name: ``<name>_registers`` with .h, .json, .md and .svd.

    Parameters
    ----------
    core : Core
        The compiled core.
    meanings : mapping, optional
        What each parameter does, by name: ``{p.name: p.meaning for p in Estimator.params}``.
    """
    registers = register_map(core, meanings=meanings)
    stem = f"{identifier(registers.name)}_registers"
    return {
        f"{stem}.h": to_header(registers),
        f"{stem}.json": registers.to_json(),
        f"{stem}.md": to_markdown(registers),
        f"{stem}.svd": to_svd(registers),
    }
