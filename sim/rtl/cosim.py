"""The second bench: a core's Verilog under cocotb, in Icarus.

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
from boresight.sim.rtl.simulators import BUILD_ARGS, SimulationFailed, require, version


class CocotbSimulation(RtlSimulation):
    """See `RtlSimulation`.

    Parameters
    ----------
    core : Core
        See `RtlSimulation`.
    cache : Path, optional
        Folder for builds; the user's cache by default.

    Raises
    ------
    ToolMissing
        Icarus, or a tool that it needs, is not installed.
    SimulationFailed
        The build failed.
    """

    def __init__(self, core: Core, *, cache: Path | None = None) -> None:
        require("icarus")
        super().__init__(core)
        tools = (version("icarus"), importlib.metadata.version("cocotb"))
        identity = repr((self.sources, self.parameters, tools, BUILD_ARGS["icarus"]))
        self._entry = Cache(cache).get("rtl-icarus", identity, self._build)

    def _build(self, folder: Path) -> None:
        for name, source in self.sources.items():
            (folder / name).write_text(source)
        with quiet(folder / "build.log", "icarus build"):
            _runner().build(
                sources=[folder / name for name in self.sources],
                hdl_toplevel="harness",
                build_args=BUILD_ARGS["icarus"],
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
                raise SimulationFailed("icarus: the bench failed")
            unknown = folder / "unknown"
            fault = f"unknown value (X): {unknown.read_text()}" if unknown.exists() else ""
            results = io.BytesIO((folder / "results").read_bytes())
            return batch.result(results.read, word=self.word, tool="icarus", fault=fault)

    def _simulate(self, folder: Path) -> None:
        root = str(Path(__file__).parents[2])
        with quiet(folder / "run.log", "icarus run"):
            _runner().test(
                hdl_toplevel="harness",
                hdl_toplevel_lang="verilog",
                test_module="boresight.sim.rtl.replay_bench",
                build_dir=self._entry,
                results_xml=str(folder / "results.xml"),
                test_dir=str(folder),
                seed=1,
                extra_env={"PYTHONPATH": os.pathsep.join([root, os.environ.get("PYTHONPATH", "")])},
            )


def _runner() -> Any:
    from cocotb_tools.runner import get_runner

    return get_runner("icarus")


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
