"""Co-simulation: run a core's Verilog on input words, return its output words and cycle counts."""

from __future__ import annotations

import contextlib
import importlib.metadata
import os
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from boresight.disk.cache import Cache
from boresight.gateware.core import Core
from boresight.gateware.registers.core import PROGRAM
from boresight.model.tools.failure import failure
from boresight.model.words.fixed import IntArray
from boresight.sim.rtl.memories import split_memories
from boresight.sim.rtl.replay import (
    BusWrite,
    RtlRun,
    bus_text,
    input_text,
    read_output,
    register_writes,
)
from boresight.sim.rtl.simulators import BUILD_ARGS, TIMESCALE, SimulationFailed, require, version
from boresight.sim.rtl.verilator import build_program, cocotb_environment

__all__ = ["RtlSimulation", "SimulationFailed", "quiet"]


class RtlSimulation:
    """A built simulation of one core, run as often as wanted.

    The build depends on the machine, not on the program (`sim.rtl.memories`), and is kept in a
    cache.

    Parameters
    ----------
    core : Core
        The program at hand runs, unless `run` is told otherwise.
    simulator : str
        "verilator" or "icarus".
    cache : Path, optional
        Folder for builds; the user's cache by default.

    Raises
    ------
    ToolMissing
        The simulator, or what it needs, is not installed.
    SimulationFailed
        The build failed.
    """

    def __init__(
        self, core: Core, *, simulator: str = "verilator", cache: Path | None = None
    ) -> None:
        self.core, self.simulator, self.word = core, simulator, core.machine.arithmetic.word
        text, self._memories = split_memories(core.verilog(instances=False))
        # Names inside the core exist for each lane only: the harness is cut to the lanes there are.
        harness = Path(__file__).with_name("replay.sv").read_text()
        harness = harness.replace("//SECOND", "" if core.machine.lanes == 2 else "//")
        require(simulator)
        tools = (version(simulator), importlib.metadata.version("cocotb"))
        identity = repr((text, harness, simulator, tools, BUILD_ARGS[simulator], self.word))
        self._entry = Cache(cache).get(
            f"rtl-{simulator}", identity, lambda folder: self._build(folder, text, harness)
        )

    def _runner(self) -> Any:
        from cocotb_tools.runner import get_runner

        return get_runner(self.simulator)

    def _build(self, folder: Path, text: str, harness: str) -> None:
        sources = {"core.sv": text, "replay.sv": harness}
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

    def run(
        self,
        inputs: IntArray,
        *,
        numbers: IntArray | None = None,
        bus_writes: Sequence[BusWrite] = (),
        stall: int = 0,
        trace: int | None = None,
        allow_unknown: bool = False,
    ) -> RtlRun:
        """Feed input words (steps, n_inputs).

        Parameters
        ----------
        numbers : int (steps,), optional
            The program of each record, when several take turns (`bus_writes` must select them);
            what a record does not need of its row is left out. By default that at hand.
        bus_writes : sequence of BusWrite
            What the host writes meanwhile, in the order of records.
        stall : int
            0: input always there, output always taken. Otherwise the seed of a pattern of pauses.
        trace : int, optional
            Update whose register writes are recorded.
        allow_unknown : bool
            Return the register writes even when the run fails (to find out why).

        Raises
        ------
        SimulationFailed
            Hung, an unknown value (X), or fewer words than expected.
        """
        from cocotb_tools.check_results import get_results

        if not len(inputs):
            raise SimulationFailed("nothing to compare: no input records")
        parts = self.core.parts
        if numbers is None:
            numbers = np.full(len(inputs), self.core.number)
            if len(parts) > 1:
                bus_writes = [BusWrite(0, PROGRAM, self.core.number), *bus_writes]
        n_in, n_out = (
            np.array([len(ports) for ports in counts])[numbers]
            for counts in zip(
                *((p.program.streamed, p.program.outputs) for p in parts), strict=True
            )
        )
        cycles = int(np.array([p.schedule.interval for p in parts])[numbers].max())
        limit = (len(inputs) + 4) * cycles * (16 if stall else 1) + 64 * len(bus_writes) + 1000
        with tempfile.TemporaryDirectory(prefix="boresight-rtl-") as name:
            folder = Path(name)
            (folder / "input.hex").write_text(input_text(inputs, n_in, self.word))
            (folder / "bus.txt").write_text(bus_text(bus_writes, self.word))
            for file, text in self._memories.items():
                (folder / file).write_text(text)
            self._simulate(folder, len(inputs), limit, stall, trace)
            out_file = folder / "output.txt"
            lines = out_file.read_text().splitlines() if out_file.exists() else []
            writes = register_writes(lines)
            try:
                tests, failed = get_results(folder / "results.xml")
                if tests != 1:
                    raise SimulationFailed(f"expected 1 bench to run, {tests} ran")
                run = read_output(lines, n_out, self.word)
                if failed:
                    raise SimulationFailed("the bench failed")
                return replace(run, writes=writes)
            except SimulationFailed as error:
                if allow_unknown:
                    none = np.zeros((0, 0), dtype=np.int64)
                    return RtlRun(none, np.zeros(0, dtype=np.bool_), none, none.ravel(), writes)
                raise SimulationFailed(f"{self.simulator}: {error}") from None

    def _simulate(
        self, folder: Path, steps: int, limit: int, stall: int, trace: int | None
    ) -> None:
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
                    f"+steps={steps}",
                    f"+stall={stall}",
                    f"+trace={-1 if trace is None else trace}",
                    *(
                        ["+verilator+rand+reset+2", "+verilator+seed+7"]
                        if self.simulator == "verilator"
                        else []
                    ),
                ],
                extra_env={
                    **cocotb_environment(),
                    "REPLAY_MAX_CYCLES": str(limit),
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
