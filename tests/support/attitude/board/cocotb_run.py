"""The board's bench under cocotb with Verilator: the same run, heard by Python."""

from __future__ import annotations

import contextlib
import ctypes
import json
import os
import sys
import sysconfig
import tempfile
from collections.abc import Iterator, Mapping
from functools import lru_cache
from importlib.metadata import version as version_of
from pathlib import Path

import numpy as np

from boresight.gateware.core import Core
from boresight.model.errors import ToolMissing
from boresight.model.tools.external import failure
from boresight.model.tools.files import Cache, package_digest
from boresight.model.words.fixed import IntArray
from boresight.sim.attitude.board.build import Board, board_parameters, board_sources
from boresight.sim.attitude.board.run import (
    BoardRun,
    Stimulus,
    cycles_limit,
    files_and_arguments,
    frames_of,
    read_trace,
)
from boresight.sim.rtl.simulators import SimulationFailed, build_program, version


def run_under_cocotb(
    board: Board,
    what: Stimulus,
    *,
    updates: int,
    settings: Mapping[str, int],
    faults: Mapping[str, str] | None = None,
) -> tuple[BoardRun, list[int]]:
    """Run the bench under cocotb until so many updates are done.

    The bytes of the host's line are heard by Python, as they come; they must be those that the
    bench wrote down. Python counts the cycles of each update, from the data-ready edge at the pin
    to the new results in the registers.

    Raises
    ------
    ToolMissing
        Verilator, or Python's library, is not installed.
    SimulationFailed
        The run did not end, or Python heard other bytes than the bench.
    """
    from cocotb_tools.check_results import get_results
    from cocotb_tools.config import libs_dir
    from cocotb_tools.runner import get_runner

    path = _path()
    files, arguments = files_and_arguments(board, what, updates, settings, faults or {})
    with tempfile.TemporaryDirectory(prefix="boresight-board-") as temporary:
        folder = Path(temporary)
        for name, text in files.items():
            (folder / name).write_text(text)
        with quiet(folder / "run.log", "verilator run"):
            get_runner("verilator").test(
                hdl_toplevel="bench",
                hdl_toplevel_lang="verilog",
                test_module="tests.support.attitude.board.cocotb_bench",
                build_dir=_built(board),
                results_xml=str(folder / "results.xml"),
                test_dir=str(folder),
                seed=1,
                plusargs=["+keep", *(f"+{k}={v}" for k, v in arguments.items())],
                extra_env={
                    "LD_LIBRARY_PATH": os.pathsep.join(
                        [str(libs_dir), os.environ.get("LD_LIBRARY_PATH", "")]
                    ),
                    "BOARD_MAX_CYCLES": str(cycles_limit(board, updates)),
                    "PYTHONPATH": path,
                },
            )
        tests, failed = get_results(folder / "results.xml")
        if tests != 1 or failed:
            raise SimulationFailed("verilator: the board's bench did not come to its end")
        trace = read_trace((folder / "trace.txt").read_text())
        if (folder / "heard.bin").read_bytes() != trace.data:
            raise SimulationFailed("verilator: Python heard other bytes than the bench")
        counted = [int(text) for text in (folder / "latencies.txt").read_text().split()]
    return BoardRun(trace, *frames_of(trace)), counted


def run_core(core: Core, records: IntArray) -> tuple[IntArray, IntArray]:
    """Run a core alone under cocotb in Icarus: output words, and the cycles to each of them.

    Raises
    ------
    ToolMissing
        Python's library is not installed.
    SimulationFailed
        The build failed, or a word was unknown or did not come.
    """
    from cocotb_tools.check_results import get_results
    from cocotb_tools.runner import get_runner

    path, word = _path(), core.machine.arithmetic.word
    with tempfile.TemporaryDirectory(prefix="boresight-core-") as temporary:
        folder, runner = Path(temporary), get_runner("icarus")
        sources = {**core.files, "core.v": core.verilog(instances=False)}
        for name, text in sources.items():
            (folder / name).write_text(text)
        words = (records & (1 << word) - 1).tolist()
        (folder / "records.txt").write_text(json.dumps(words))
        with quiet(folder / "run.log", "icarus run"):
            runner.build(
                sources=[folder / name for name in sources],
                hdl_toplevel="core",
                build_dir=folder,
                timescale=("1ns", "1ps"),
            )
            runner.test(
                hdl_toplevel="core",
                hdl_toplevel_lang="verilog",
                test_module="tests.support.attitude.board.cocotb_core",
                build_dir=folder,
                results_xml=str(folder / "results.xml"),
                test_dir=folder,
                extra_env={"PYTHONPATH": path},
            )
        if get_results(folder / "results.xml") != (1, 0):
            raise SimulationFailed("icarus: the core's bench did not come to its end")
        found = np.array(json.loads((folder / "found.txt").read_text()))
    outputs, cycles = found.transpose(2, 0, 1)
    return (outputs ^ 1 << word - 1) - (1 << word - 1), cycles


def _embeddable() -> bool:
    """Whether this Python can run inside another program, as cocotb needs."""
    library = sysconfig.get_config_var("INSTSONAME") or ""
    folders = (sysconfig.get_config_var("LIBDIR") or "", os.path.join(sys.base_prefix, "lib"))
    if ".so" not in library:  # Python is a static program; its library is a package of its own.
        library = f"libpython{sys.version_info.major}.{sys.version_info.minor}.so.1.0"
    try:
        found = any(Path(folder, library).exists() for folder in folders) or ctypes.CDLL(library)
    except OSError:
        found = sysconfig.get_config_var("PYTHONFRAMEWORK")
    return bool(found)


def _path() -> str:
    """Where the simulator's Python finds the tests; ToolMissing if it cannot run."""
    if not _embeddable():
        raise ToolMissing("cocotb needs libpython, which is not found: apt-get install python3-dev")
    return os.pathsep.join([str(Path(__file__).parents[4]), os.environ.get("PYTHONPATH", "")])


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
            for to, old in enumerate(saved, 1):
                os.dup2(old, to)
                os.close(old)
    if failed is not None:
        output = f"{log.read_text(errors='replace')}\n{failed}"
        raise SimulationFailed(failure(f"{subject} failed", output)) from failed


#: What Python sees besides the bench's ports.
_SEEN = """`verilator_config
public_flat_rd -module "bench" -var "adis_data_ready"
public_flat_rd -module "system" -var "probe_updated"
"""


@lru_cache
def _built(board: Board) -> Path:
    """Folder of the bench's program, in the build cache."""
    from cocotb_tools.config import libs_dir, share_dir

    arguments = ["--vpi", "--prefix", "Vtop", "--timescale", "1ns/1ps"]
    arguments += [f"-G{name}={value}" for name, value in board_parameters(board.setup).items()]
    main = (Path(share_dir) / "lib/verilator/verilator.cpp").read_text()
    sources = {"seen.vlt": _SEEN, **board_sources(board), "verilator.cpp": main}
    link = [f"-Wl,-rpath-link,{libs_dir}", f"-L{libs_dir}", "-lcocotbvpi_verilator"]

    def make(folder: Path) -> None:
        build_program(folder / "bench", sources, arguments, top="bench", link=link)

    versions = package_digest(), version("verilator"), version_of("cocotb")
    return Cache().get("cocotb", repr((sources, arguments, link, versions)), make)
