"""Compiled simulation: SystemVerilog and Verilator alone, no Python in the loop.

For runs of many cycles: one simulated second, and fuzzing. The bench is a SystemVerilog module with
exactly the inputs ``clk`` and ``rst``; it reads ``$value$plusargs``, prints, and ends with
``$finish``. It has no delays; all times are counts of cycles.
"""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from boresight.model.tools.cache import Cache
from boresight.sim.rtl.simulators import BUILD_ARGS, SimulationFailed, require, version
from boresight.sim.rtl.verilator import build_program

#: Cycles for which ``rst`` is held.
RESET_CYCLES = 4

_ARGS = (*BUILD_ARGS, "-Wno-lint", "--no-timing", "--prefix", "Vbench")

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
    identity = repr((top, texts, overrides, main, _ARGS, version("verilator")))

    def make(folder: Path) -> None:
        build_program(folder / "bench", {**texts, "main.cpp": main}, [*_ARGS, *overrides], top=top)

    return Compiled(Cache(cache).get("compiled", identity, make))
