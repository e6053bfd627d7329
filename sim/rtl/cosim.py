"""Co-simulation: run a core's Verilog on input words, return its output words and cycle counts."""

from __future__ import annotations

import contextlib
import importlib.metadata
import os
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.disk.cache import Cache
from boresight.model.tools.failure import failure
from boresight.model.words.fixed import IntArray
from boresight.sim.rtl.memories import split_memories
from boresight.sim.rtl.simulators import BUILD_ARGS, TIMESCALE, SimulationFailed, require, version
from boresight.sim.rtl.verilator import build_program, cocotb_environment

__all__ = ["BusWrite", "RegisterWrite", "RtlRun", "RtlSimulation", "SimulationFailed", "quiet"]


@dataclass(frozen=True)
class BusWrite:
    """A word for the bus, written before the first word of ``record`` is offered."""

    record: int
    address: int
    word: int


@dataclass(frozen=True)
class RegisterWrite:
    """A lane's write of a register: ``word`` None if it had unknown bits."""

    lane: int
    address: int
    word: int | None
    cycle: int


@dataclass(frozen=True)
class RtlRun:
    """What the core did.

    Attributes
    ----------
    outputs : int64 (steps, n_outputs)
        Output words in stream order.
    saturated : bool (steps,)
        The update's saturation flag.
    latency_cycles : int64 (steps, n_outputs)
        Cycles from the first input word taken to each output word taken, both inclusive.
    interval_cycles : int64 (steps,)
        Cycles from the first input word taken until the next record could begin.
    writes : tuple of RegisterWrite
        Register writes of the traced update.
    """

    outputs: IntArray
    saturated: npt.NDArray[np.bool_]
    latency_cycles: IntArray
    interval_cycles: IntArray
    writes: tuple[RegisterWrite, ...] = ()


class RtlSimulation:
    """A built simulation of one core, run as often as wanted.

    The build depends on the machine, not on the program (`sim.rtl.memories`), and is kept in a
    cache.

    Parameters
    ----------
    verilog : str
        The core, module ``core``, for simulation.
    word, n_inputs, n_outputs, lanes : int
        Word width, words per record, lanes of the machine.
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
        self,
        verilog: str,
        *,
        word: int,
        n_inputs: int,
        n_outputs: int,
        lanes: int,
        simulator: str = "verilator",
        cache: Path | None = None,
    ) -> None:
        self.simulator = simulator
        self.word, self.n_inputs, self.n_outputs = word, n_inputs, n_outputs
        text, self._memories = split_memories(verilog)
        # Names inside the core exist for each lane only: the harness is cut to the lanes there are.
        harness = Path(__file__).with_name("replay.sv").read_text()
        harness = harness.replace("//SECOND", "" if lanes == 2 else "//")
        require(simulator)
        tools = (version(simulator), importlib.metadata.version("cocotb"))
        identity = repr((text, harness, simulator, tools, BUILD_ARGS[simulator], word))
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
        max_interval: int,
        stall: int = 0,
        trace: int | None = None,
        allow_unknown: bool = False,
        bus_writes: Sequence[BusWrite] = (),
    ) -> RtlRun:
        """Feed input words (steps, n_inputs).

        Parameters
        ----------
        max_interval : int
            Cycles after which an update counts as hung (times 16 with stalls).
        stall : int
            0: input always there, output always taken. Otherwise the seed of a pattern of pauses.
        trace : int, optional
            Update whose register writes are recorded.
        allow_unknown : bool
            Return the register writes even when the run fails (to find out why).
        bus_writes : sequence of BusWrite
            What the host writes meanwhile, in the order of records.

        Raises
        ------
        SimulationFailed
            Hung, an unknown value (X), or fewer words than expected.
        """
        steps = len(inputs)
        if steps == 0:
            raise SimulationFailed("nothing to compare: no input records")
        with tempfile.TemporaryDirectory(prefix="boresight-rtl-") as name:
            folder = Path(name)
            mask = (1 << self.word) - 1
            (folder / "input.hex").write_text(
                "\n".join(f"{int(w) & mask:x}" for w in inputs.ravel()) + "\n"
            )
            (folder / "bus.txt").write_text(
                "".join(f"{w.record} {w.address:x} {w.word & mask:x}\n" for w in bus_writes)
            )
            for file, text in self._memories.items():
                (folder / file).write_text(text)
            self._simulate(folder, steps, max_interval, stall, trace, len(bus_writes))
            out_file = folder / "output.txt"
            lines = out_file.read_text().splitlines() if out_file.exists() else []
            writes = _register_writes(lines)
            try:
                return self._read(lines, folder / "results.xml", steps, writes)
            except SimulationFailed:
                if not allow_unknown:
                    raise
                none = np.zeros((0, self.n_outputs), dtype=np.int64)
                return RtlRun(none, np.zeros(0, dtype=np.bool_), none, none[:, 0], writes)

    def _simulate(
        self,
        folder: Path,
        steps: int,
        max_interval: int,
        stall: int,
        trace: int | None,
        writes: int,
    ) -> None:
        limit = (steps + 4) * max_interval * (16 if stall else 1) + 64 * writes + 1000
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
                    f"+n_in={self.n_inputs}",
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

    def _read(
        self, lines: list[str], results: Path, steps: int, writes: tuple[RegisterWrite, ...]
    ) -> RtlRun:
        from cocotb_tools.check_results import get_results

        tests, failed = get_results(results)
        if tests != 1:
            raise SimulationFailed(f"{self.simulator}: expected 1 bench to run, {tests} ran")
        outputs = np.zeros((steps, self.n_outputs), dtype=np.int64)
        latency = np.zeros((steps, self.n_outputs), dtype=np.int64)
        seen = np.zeros((steps, self.n_outputs), dtype=np.bool_)
        saturated = np.zeros(steps, dtype=np.bool_)
        interval = np.full(steps, -1, dtype=np.int64)
        sign = 1 << (self.word - 1)
        for line in lines:
            kind, *rest = line.split()
            if (
                kind == "X"
                or (kind == "O" and set("xz") & set(rest[2].lower()))
                or (kind == "U" and set("xz") & set(rest[1].lower()))
            ):
                raise SimulationFailed(f"{self.simulator}: unknown value (X): {line}")
            if kind == "O":
                k, j = int(rest[0]), int(rest[1])
                if k >= steps or j >= self.n_outputs:
                    raise SimulationFailed(f"{self.simulator}: unexpected output word: {line}")
                outputs[k, j] = (int(rest[2], 16) ^ sign) - sign
                latency[k, j] = int(rest[3]) + 1
                seen[k, j] = True
            elif kind == "U":
                saturated[int(rest[0])] = rest[1] == "1"
                interval[int(rest[0])] = int(rest[2])
        if failed or not seen.all() or (interval < 0).any():
            k = int(np.argmin(seen.all(axis=1) & (interval >= 0)))
            raise SimulationFailed(f"{self.simulator}: update {k} of {steps} did not complete")
        return RtlRun(outputs, saturated, latency, interval, writes)


def _register_writes(lines: list[str]) -> tuple[RegisterWrite, ...]:
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
