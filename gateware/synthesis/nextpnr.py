"""Run nextpnr on a netlist of yosys: placed, routed, timed.

Either form will do: the program on the PATH, or its YoWASP package from PyPI, which an extra of
this package brings. Every run has a temporary folder of its own.
"""

from __future__ import annotations

import importlib.util
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, Final, NamedTuple

from boresight.gateware.synthesis.family import Router, Target
from boresight.gateware.synthesis.yosys import Tool, run_tool, yowasp
from boresight.model.errors import InputError, ToolMissing
from boresight.model.tools.external import yosys_environment
from boresight.model.tools.files import Cache

#: Part of the cache key; raise it when the stored form changes.
_CACHE_FORMAT: Final = 2


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
    words = (answer.stdout + answer.stderr).replace(")", " ").split()
    version = next((w for w in words if w.startswith("nextpnr-") and w[8:9].isdigit()), "")
    return Tool(name=program, argv=argv, version=f"{program} {version.removeprefix('nextpnr-')}")


def find_router(router: Router) -> Tool:
    """The program of a family."""
    return find_program(router.program, f"yowasp-{router.program}", router.extra)


def command(target: Target, *, seed: int, clock_mhz: float) -> tuple[str, ...]:
    """Options of the router for a target, without files."""
    router = target.family.router
    assert router is not None
    name, grade = target.device.name, router.grades.get(target.grade, target.grade)
    size = name.partition("-")[2]
    part = (o.format(name=name.upper(), size=size, grade=grade) for o in router.options)
    wanted = ("--seed", str(seed), "--freq", f"{clock_mhz:g}", "--timing-allow-fail")
    return (*part, *wanted)


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

    Parameters
    ----------
    netlist : mapping
        As yosys writes it, of the target's family.
    clock_mhz : float
        Clock that the tool works towards.
    constraints : mapping
        Option -> name and text of a file that it names: pins.
    writes : mapping
        Option -> name of a text file that the tool writes there.

    Raises
    ------
    ToolMissing
        The router is not installed.
    RouteError
        It failed.
    """
    assert target.family.router is not None
    tool = find_router(target.family.router)
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

    identity = json.dumps(
        [_CACHE_FORMAT, tool.version, options, sorted(files.items()), sorted(outputs.items())]
    ) + json.dumps(netlist, sort_keys=True)
    entry = Cache().get(f"route-{target.name}", identity, store)
    result = json.loads((entry / "run.json").read_text(encoding="utf-8"))
    return Run(seed=seed, clock_mhz=result["clock_mhz"], files=result["files"])


def pack(router: Router, name: str, text: str) -> bytes:
    """Bitstream of a placed and routed design: ``name`` and ``text`` of its `Router.placed`.

    Raises ToolMissing, or ToolFailed if the packer failed.
    """
    program, *options = router.packer
    tool = find_program(program, f"yowasp-{router.program}", router.extra)
    arguments, file = (*options, name, router.bitstream), {name: text.encode("latin-1")}
    message = f"{tool.name} makes no bitstream"
    return run_tool(tool, arguments, file, (router.bitstream,), message)[router.bitstream]
