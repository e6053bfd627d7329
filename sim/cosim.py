"""Co-simulation: run a core's Verilog on input words, return its output words and cycle counts."""

from __future__ import annotations

import contextlib
import io
import os
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from model.fixed import IntArray
from sim.simulators import BUILD_ARGS, simulator_environment

__all__ = ["RegisterWrite", "RtlRun", "RtlSimulation", "SimulationFailed"]


class SimulationFailed(RuntimeError):
    """The simulation did not end, or showed an unknown value: never a pass."""


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

    Parameters
    ----------
    verilog : str
        The core, module ``core``, for simulation.
    word, n_inputs, n_outputs, lanes : int
        Word width, words per record, lanes of the machine.
    simulator : str
        "verilator" or "icarus".
    folder : Path, optional
        Where to build; a temporary folder by default.
    """

    def __init__(self, verilog: str, *, word: int, n_inputs: int, n_outputs: int, lanes: int,
                 simulator: str = "verilator", folder: Path | None = None) -> None:
        from cocotb_tools.runner import get_runner

        self.simulator = simulator
        self.word, self.n_inputs, self.n_outputs = word, n_inputs, n_outputs
        self._temporary = tempfile.TemporaryDirectory(prefix="boresight-") if folder is None \
            else None
        self.folder = Path(self._temporary.name) if self._temporary else Path(folder or ".")
        self.folder.mkdir(parents=True, exist_ok=True)
        source = self.folder / "core.sv"
        # Simulators wait for a change before they first run `always @*`, and with initialised
        # variables none may come: `always_comb` runs at time 0, as the logic does.
        source.write_text(verilog.replace("always @*", "always_comb"))
        # Names inside the core exist for each lane only: the harness is cut to the lanes there are.
        harness = self.folder / "replay.sv"
        text = Path(__file__).with_name("replay.sv").read_text()
        harness.write_text(text.replace("//SECOND", "" if lanes == 2 else "//"))
        with self._quiet("build"), simulator_environment(simulator):
            self._runner: Any = get_runner(simulator)
            self._runner.build(
                sources=[source, harness], hdl_toplevel="replay",
                build_args=BUILD_ARGS[simulator], build_dir=self.folder / "build",
                parameters={"WORD": word, "N_IN": n_inputs, "N_OUT": n_outputs}, always=True,
                timescale=("1ns", "1ps"))

    @contextlib.contextmanager
    def _quiet(self, what: str) -> Any:
        """Keep the tools' chatter in a file; show its end when something fails."""
        log = self.folder / f"{what}.log"
        with log.open("w") as file:
            saved = os.dup(1), os.dup(2)
            os.dup2(file.fileno(), 1)
            os.dup2(file.fileno(), 2)
            try:
                with contextlib.redirect_stdout(io.StringIO()), \
                        contextlib.redirect_stderr(io.StringIO()):
                    yield
                failed: BaseException | None = None
            except (Exception, SystemExit) as error:
                failed = error
            finally:
                os.dup2(saved[0], 1)
                os.dup2(saved[1], 2)
                os.close(saved[0])
                os.close(saved[1])
        if failed is not None:
            tail = "\n".join(log.read_text(errors="replace").splitlines()[-30:])
            raise SimulationFailed(f"{self.simulator} {what} failed: {failed}\n{tail}") from failed

    def run(self, inputs: IntArray, *, max_interval: int, stall: int = 0,
            trace: int | None = None, allow_unknown: bool = False) -> RtlRun:
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

        Raises
        ------
        SimulationFailed
            Hung, an unknown value (X), or fewer words than expected.
        """
        steps = len(inputs)
        if steps == 0:
            raise SimulationFailed("nothing to compare: no input records")
        words_file, out_file = self.folder / "input.hex", self.folder / "output.txt"
        mask = (1 << self.word) - 1
        words_file.write_text("\n".join(f"{int(w) & mask:x}" for w in inputs.ravel()) + "\n")
        out_file.unlink(missing_ok=True)
        results = self.folder / "results.xml"
        limit = (steps + 4) * max_interval * (16 if stall else 1) + 1000
        with self._quiet("run"), simulator_environment(self.simulator):
            self._runner.test(
                hdl_toplevel="replay", test_module="sim.replay_bench", build_dir=self.folder / "build",
                results_xml=str(results), test_dir=str(self.folder), seed=1,
                plusargs=[f"+input={words_file}", f"+output={out_file}", f"+steps={steps}",
                          f"+stall={stall}", f"+trace={-1 if trace is None else trace}",
                          *(["+verilator+rand+reset+2", "+verilator+seed+7"]
                            if self.simulator == "verilator" else [])],
                extra_env={"REPLAY_MAX_CYCLES": str(limit),
                           "PYTHONPATH": os.pathsep.join(
                               [str(Path(__file__).parent.parent), os.environ.get("PYTHONPATH", "")])})
        try:
            return self._read(out_file, results, steps)
        except SimulationFailed:
            if not allow_unknown:
                raise
            none = np.zeros((0, self.n_outputs), dtype=np.int64)
            return RtlRun(none, np.zeros(0, dtype=np.bool_), none, none[:, 0],
                          self._writes(out_file))

    @staticmethod
    def _writes(out_file: Path) -> tuple[RegisterWrite, ...]:
        writes = []
        for line in out_file.read_text().splitlines():
            kind, *rest = line.split()
            if kind == "R":
                known = not set("xz") & set((rest[2] + rest[3]).lower())
                writes.append(RegisterWrite(int(rest[1]), int(rest[2], 16) if known else -1,
                                            int(rest[3], 16) if known else None, int(rest[4])))
        return tuple(writes)

    def _read(self, out_file: Path, results: Path, steps: int) -> RtlRun:
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
        for line in out_file.read_text().splitlines():
            kind, *rest = line.split()
            if kind == "R":
                continue
            if kind == "X" or "x" in rest[2].lower() or "z" in rest[2].lower():
                raise SimulationFailed(f"{self.simulator}: unknown value (X): {line}")
            if kind == "O":
                k, j = int(rest[0]), int(rest[1])
                if k >= steps or j >= self.n_outputs:
                    raise SimulationFailed(f"{self.simulator}: unexpected output word: {line}")
                outputs[k, j] = (int(rest[2], 16) ^ sign) - sign
                latency[k, j] = int(rest[3]) + 1
                seen[k, j] = True
            elif kind == "U":
                if "x" in rest[1]:
                    raise SimulationFailed(f"{self.simulator}: unknown value (X): {line}")
                saturated[int(rest[0])] = rest[1] == "1"
                interval[int(rest[0])] = int(rest[2])
        if failed or not seen.all() or (interval < 0).any():
            k = int(np.argmin(seen.all(axis=1) & (interval >= 0)))
            raise SimulationFailed(f"{self.simulator}: update {k} of {steps} did not complete")
        return RtlRun(outputs, saturated, latency, interval, self._writes(out_file))
