"""The second bench: a core's Verilog under cocotb, in Icarus or Verilator.

Cycle by cycle it does what `sim.rtl.harness` does, hundreds of times slower: the clock is driven by
Python (`sim.rtl.replay_bench`). Icarus has four values: an unknown one (X) is an error.
"""

from __future__ import annotations

import contextlib
import importlib.metadata
import io
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from boresight.gateware.core import Core
from boresight.model.tools.cache import Cache
from boresight.model.tools.failure import failure
from boresight.sim.rtl.replay import Batch, RtlRun, RtlSimulation
from boresight.sim.rtl.simulators import BUILD_ARGS, TIMESCALE, SimulationFailed, require, version
from boresight.sim.rtl.verilator import build_program, cocotb_environment

__all__ = ["CocotbSimulation", "quiet"]

#: By default, Verilator shows cocotb only the ports of the top module.
_PUBLIC = '`verilator_config\npublic_flat_rw -module "harness" -var "*"\n'


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
        The simulator, or a tool that it needs, is not installed.
    SimulationFailed
        The build failed.
    """

    def __init__(self, core: Core, *, simulator: str = "icarus", cache: Path | None = None) -> None:
        require(simulator)
        require("cocotb")
        super().__init__(core)
        self.simulator = simulator
        tools = (version(simulator), importlib.metadata.version("cocotb"))
        identity = repr((self.sources, self.parameters, simulator, tools, BUILD_ARGS[simulator]))
        self._entry = Cache(cache).get(f"rtl-{simulator}", identity, self._build)

    def _runner(self) -> Any:
        from cocotb_tools.runner import get_runner

        return get_runner(self.simulator)

    def _build(self, folder: Path) -> None:
        if self.simulator == "verilator":
            parameters = [f"-G{name}={value}" for name, value in self.parameters.items()]
            build_program(
                folder / "harness",
                {"public.vlt": _PUBLIC, **self.sources},
                [*BUILD_ARGS["verilator"], *TIMESCALE, *parameters],
                top="harness",
                cocotb=True,
            )
            return
        for name, source in self.sources.items():
            (folder / name).write_text(source)
        with quiet(folder / "build.log", f"{self.simulator} build"):
            self._runner().build(
                sources=[folder / name for name in self.sources],
                hdl_toplevel="harness",
                build_args=BUILD_ARGS[self.simulator],
                build_dir=folder,
                parameters=self.parameters,
                always=True,
                timescale=("1ns", "1ps"),
            )

    def _replay(self, batch: Batch) -> RtlRun:
        from cocotb_tools.check_results import get_results

        with tempfile.TemporaryDirectory(prefix="boresight-rtl-") as name:
            folder = Path(name)
            (folder / "batch").write_bytes(batch.packed())
            for file, text in self.memories.items():
                (folder / file).write_text(text)
            self._simulate(folder)
            if get_results(folder / "results.xml") != (1, 0):
                raise SimulationFailed(f"{self.simulator}: the bench failed")
            unknown = folder / "unknown"
            fault = f"unknown value (X): {unknown.read_text()}" if unknown.exists() else ""
            results = io.BytesIO((folder / "results").read_bytes())
            return batch.result(results.read, word=self.word, tool=self.simulator, fault=fault)

    def _simulate(self, folder: Path) -> None:
        root = str(Path(__file__).parents[2])
        with quiet(folder / "run.log", f"{self.simulator} run"):
            self._runner().test(
                hdl_toplevel="harness",
                hdl_toplevel_lang="verilog",
                test_module="boresight.sim.rtl.replay_bench",
                build_dir=self._entry,
                results_xml=str(folder / "results.xml"),
                test_dir=str(folder),
                seed=1,
                plusargs=["+verilator+rand+reset+2", "+verilator+seed+7"],
                extra_env={
                    **cocotb_environment(),
                    "PYTHONPATH": os.pathsep.join([root, os.environ.get("PYTHONPATH", "")]),
                },
            )


@contextlib.contextmanager
def quiet(log: Path, subject: str) -> Iterator[None]:
    """Redirect the output of tools to a file; a failure raises with its cause and keeps the log."""
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
        output = f"{log.read_text(errors='replace')}\n{failed}"
        raise SimulationFailed(failure(f"{subject} failed", output)) from failed
