"""The second bench: a core's Verilog under cocotb, in Icarus or Verilator.

Its harness `replay.sv` feeds the records and writes down what comes out, so that a long log runs at
the simulator's own speed and not at Python's. Icarus has four values: an unknown one (X) is an
error. Cycle by cycle it does what `sim.rtl.harness` does.
"""

from __future__ import annotations

import contextlib
import importlib.metadata
import os
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from boresight.disk.cache import Cache
from boresight.gateware.core import Core
from boresight.model.tools.failure import failure
from boresight.model.words.fixed import IntArray
from boresight.sim.rtl.replay import (
    Batch,
    BusWrite,
    RegisterWrite,
    ReplayFailed,
    RtlRun,
    RtlSimulation,
)
from boresight.sim.rtl.simulators import BUILD_ARGS, TIMESCALE, SimulationFailed, require, version
from boresight.sim.rtl.verilator import build_program, cocotb_environment

__all__ = ["CocotbSimulation", "bus_text", "input_text", "quiet", "read_output", "register_writes"]


class CocotbSimulation(RtlSimulation):
    """See `RtlSimulation`.

    Parameters
    ----------
    core : Core
        See `RtlSimulation`.
    simulator : str
        "icarus" or "verilator".
    cache : Path, optional
        Folder for builds; the user's cache by default.

    Raises
    ------
    ToolMissing
        The simulator, or what it needs, is not installed.
    SimulationFailed
        The build failed.
    """

    def __init__(self, core: Core, *, simulator: str = "icarus", cache: Path | None = None) -> None:
        require(simulator)
        require("cocotb")
        super().__init__(core)
        self.simulator = simulator
        harness = Path(__file__).with_name("replay.sv").read_text()
        tools = (version(simulator), importlib.metadata.version("cocotb"))
        identity = repr((self.text, harness, simulator, tools, BUILD_ARGS[simulator], self.word))
        self._entry = Cache(cache).get(
            f"rtl-{simulator}", identity, lambda folder: self._build(folder, harness)
        )

    def _runner(self) -> Any:
        from cocotb_tools.runner import get_runner

        return get_runner(self.simulator)

    def _build(self, folder: Path, harness: str) -> None:
        sources = {"core.sv": self.text, "replay.sv": harness}
        if self.simulator == "verilator":
            build_program(
                folder / "replay",
                sources,
                [*BUILD_ARGS["verilator"], *TIMESCALE, f"-GWORD={self.word}"],
                top="replay",
                cocotb=True,
            )
            return
        for name, source in sources.items():
            (folder / name).write_text(source)
        with quiet(folder / "build.log", f"{self.simulator} build"):
            self._runner().build(
                sources=[folder / name for name in sources],
                hdl_toplevel="replay",
                build_args=BUILD_ARGS[self.simulator],
                build_dir=folder,
                parameters={"WORD": self.word},
                always=True,
                timescale=("1ns", "1ps"),
            )

    def _replay(self, batch: Batch) -> RtlRun:
        from cocotb_tools.check_results import get_results

        with tempfile.TemporaryDirectory(prefix="boresight-rtl-") as name:
            folder = Path(name)
            (folder / "input.hex").write_text(input_text(batch.inputs, batch.n_in, self.word))
            (folder / "bus.txt").write_text(bus_text(batch.bus_writes, self.word))
            for file, text in self.memories.items():
                (folder / file).write_text(text)
            self._simulate(folder, batch)
            out_file = folder / "output.txt"
            lines = out_file.read_text().splitlines() if out_file.exists() else []
            writes = register_writes(lines)
            try:
                tests, failed = get_results(folder / "results.xml")
                if tests != 1:
                    raise SimulationFailed(f"expected 1 bench to run, {tests} ran")
                run = read_output(lines, batch.n_out, self.word)
                if failed:
                    raise SimulationFailed("the bench failed")
            except SimulationFailed as error:
                raise ReplayFailed(f"{self.simulator}: {error}", writes) from None
            return replace(run, writes=writes)

    def _simulate(self, folder: Path, batch: Batch) -> None:
        root = str(Path(__file__).parents[2])
        with quiet(folder / "run.log", f"{self.simulator} run"):
            self._runner().test(
                hdl_toplevel="replay",
                hdl_toplevel_lang="verilog",
                test_module="boresight.sim.rtl.replay_bench",
                build_dir=self._entry.path,
                results_xml=str(folder / "results.xml"),
                test_dir=str(folder),
                seed=1,
                plusargs=[
                    # By name, in the folder of the run: Icarus ends a path at its first blank.
                    "+input=input.hex",
                    "+bus=bus.txt",
                    "+output=output.txt",
                    f"+steps={len(batch.inputs)}",
                    f"+stall={batch.stall}",
                    f"+trace={batch.trace}",
                    *(
                        ["+verilator+rand+reset+2", "+verilator+seed+7"]
                        if self.simulator == "verilator"
                        else []
                    ),
                ],
                extra_env={
                    **cocotb_environment(),
                    "REPLAY_MAX_CYCLES": str(batch.limit),
                    "PYTHONPATH": os.pathsep.join([root, os.environ.get("PYTHONPATH", "")]),
                },
            )


@contextlib.contextmanager
def quiet(log: Path, what: str) -> Iterator[None]:
    """Keep the tools' chatter in a file; when something fails, say why, and keep it for good."""
    failed: BaseException | None = None
    with log.open("w") as file:
        saved = os.dup(1), os.dup(2)
        os.dup2(file.fileno(), 1)
        os.dup2(file.fileno(), 2)
        try:
            yield
        except (Exception, SystemExit) as error:
            failed = error
        finally:
            os.dup2(saved[0], 1)
            os.dup2(saved[1], 2)
            os.close(saved[0])
            os.close(saved[1])
    if failed is not None:
        said = f"{log.read_text(errors='replace')}\n{failed}"
        raise SimulationFailed(failure(f"{what} failed", said)) from failed


def input_text(inputs: IntArray, n_in: IntArray, word: int) -> str:
    """Words of records (steps, widest), of which the first ``n_in`` count; their last is marked."""
    last = np.arange(inputs.shape[1]) == n_in[:, None] - 1
    marked = (inputs & ((1 << word) - 1)) | np.where(last, 1 << word, 0)
    there = np.arange(inputs.shape[1]) < n_in[:, None]
    return "\n".join(f"{w:x}" for w in marked[there].tolist()) + "\n"


def bus_text(writes: Iterable[BusWrite], word: int) -> str:
    """What the host writes meanwhile, in the order of records."""
    mask = (1 << word) - 1
    return "".join(f"{w.record} {w.address:x} {w.word & mask:x}\n" for w in writes)


def read_output(lines: Sequence[str], n_out: IntArray, word: int) -> RtlRun:
    """What happened, from the lines of the output file.

    Parameters
    ----------
    n_out : int (steps,)
        Words that each record gives.

    Raises
    ------
    SimulationFailed
        An unknown value (X), a word too many, or an update that did not complete.
    """
    steps, widest = len(n_out), int(n_out.max())
    outputs, latency = np.zeros((2, steps, widest), dtype=np.int64)
    seen = np.arange(widest) >= n_out[:, None]
    saturated = np.zeros(steps, dtype=np.bool_)
    interval = np.full(steps, -1, dtype=np.int64)
    sign = 1 << (word - 1)
    for line in lines:
        kind, *rest = line.split()
        if (
            kind == "X"
            or (kind == "O" and set("xz") & set(rest[2].lower()))
            or (kind == "U" and set("xz") & set(rest[1].lower()))
        ):
            raise SimulationFailed(f"unknown value (X): {line}")
        if kind == "O":
            k, j = int(rest[0]), int(rest[1])
            if k >= steps or j >= n_out[k]:
                raise SimulationFailed(f"unexpected output word: {line}")
            outputs[k, j] = (int(rest[2], 16) ^ sign) - sign
            latency[k, j] = int(rest[3]) + 1
            seen[k, j] = True
        elif kind == "U":
            saturated[int(rest[0])] = rest[1] == "1"
            interval[int(rest[0])] = int(rest[2])
    complete = seen.all(axis=1) & (interval >= 0)
    if not complete.all():
        raise SimulationFailed(f"update {int(np.argmin(complete))} of {steps} did not complete")
    return RtlRun(outputs, saturated, latency, interval)


def register_writes(lines: Sequence[str]) -> tuple[RegisterWrite, ...]:
    """Register writes of the traced update."""
    writes = []
    for line in lines:
        kind, *rest = line.split()
        if kind == "R":
            known = not set("xz") & set((rest[2] + rest[3]).lower())
            writes.append(
                RegisterWrite(
                    int(rest[1]),
                    int(rest[2], 16) if known else -1,
                    int(rest[3], 16) if known else None,
                    int(rest[4]),
                )
            )
    return tuple(writes)
