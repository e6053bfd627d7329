"""A core's Verilog in a simulator: Verilator, or Icarus, hundreds of times slower.

The bench (`bench.sv`) and the formats are the same in both. The simulated core has its own process
and stands still between batches of records: a log is one batch, a closed loop one batch for each
update. Verilator is two-valued, and unknown start values are random; in Icarus an unknown one (X)
that counts is an error.
"""

from __future__ import annotations

import contextlib
import shutil
import subprocess
import tempfile
import weakref
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Self

import numpy as np

from boresight.gateware.core import Core
from boresight.gateware.registers import PROGRAM
from boresight.model.tools.external import failure
from boresight.model.tools.files import Cache
from boresight.model.words.fixed import IntArray
from boresight.sim.rtl.replay import Batch, BusWrite, Reset, RtlRun, split_memories
from boresight.sim.rtl.simulators import SimulationFailed, require, version
from boresight.sim.rtl.verilator import build


class RtlSimulation:
    """A built simulation of one core, for any number of runs.

    The build depends on the machine, not on the program (`split_memories`), and is kept in a
    cache.

    Parameters
    ----------
    core : Core
        Core, whose selected program runs unless ``numbers`` of `run` says otherwise.
    simulator : str
        One of `sim.rtl.simulators.SIMULATORS`.

    Raises ToolMissing, or SimulationFailed if the build failed.
    """

    def __init__(
        self, core: Core, simulator: str = "verilator", *, cache: Path | None = None
    ) -> None:
        require(simulator)
        self.core, self.simulator, self.word = core, simulator, core.machine.arithmetic.word
        text, self.memories = split_memories(core.verilog(instances=False))
        lanes = core.machine.lanes
        # Signals of the second lane exist only if the core has one.
        bench = "`define TWO_LANES\n" * (lanes == 2)
        bench += Path(__file__).with_name("bench.sv").read_text()
        sources = {**core.files, "core.v": text, "bench.sv": bench}
        parameters = {"WORD": self.word, "LANES": lanes}
        self.command: tuple[str, ...]
        if simulator == "icarus":
            identity = repr((sources, parameters, version("icarus")))
            entry = Cache(cache).get(
                "rtl-icarus", identity, lambda f: _build(f, sources, parameters)
            )
            self.command = ("vvp", "-n", str(entry / "bench"))
        else:
            program = build("bench", sources, parameters=parameters, cache=cache).program
            self.command = (str(program), f"+max_cycles={1 << 63}")

    def power_on(self) -> CoreProcess:
        """Start a process with the core after its reset; the caller closes it."""
        return CoreProcess(self, self.memories)

    def run(
        self,
        inputs: IntArray,
        *,
        numbers: IntArray | None = None,
        bus_writes: Sequence[BusWrite | Reset] = (),
        stall: int = 0,
        trace: int = -1,
    ) -> RtlRun:
        """Run input words (steps, n_inputs) from the core's reset on; see `batch` and `replay`."""
        with self.power_on() as process:
            return process.replay(self.batch(inputs, numbers, bus_writes, stall=stall, trace=trace))

    def batch(
        self,
        inputs: IntArray,
        numbers: IntArray | None = None,
        bus_writes: Sequence[BusWrite | Reset] = (),
        *,
        stall: int = 0,
        trace: int = -1,
    ) -> Batch:
        """Return the batch for these records.

        Parameters
        ----------
        numbers : int (steps,), optional
            The program of each record, when several take turns (`bus_writes` must select them);
            what a record does not need of its row is left out. By default the selected one.
        bus_writes, stall, trace
            See `Batch`.
        """
        if not len(inputs):
            raise SimulationFailed("nothing to compare: no input records")
        parts = self.core.parts
        if numbers is None:
            numbers = np.full(len(inputs), self.core.number)
            if len(parts) > 1:
                bus_writes = [BusWrite(0, PROGRAM, self.core.number), *bus_writes]
        counts = [
            (len(p.program.inputs), len(p.program.outputs), p.schedule.interval) for p in parts
        ]
        n_in, n_out, intervals = np.array(counts)[numbers].T
        cycles = (len(inputs) + 4) * int(intervals.max()) * (16 if stall else 1)
        limit = cycles + 64 * len(bus_writes) + 1000
        return Batch(inputs, n_in, n_out, bus_writes, stall, trace, limit)


def _build(folder: Path, sources: Mapping[str, str], parameters: Mapping[str, int]) -> None:
    """Compile a bench with Icarus."""
    for name, text in sources.items():
        (folder / name).write_text(text)
    values = [f"-Pbench.{name}={value}" for name, value in parameters.items()]
    command = ["iverilog", "-g2012", "-s", "bench", *values, "-o", "bench", *sources]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SimulationFailed(failure("icarus build failed", done.stdout + done.stderr))


class CoreProcess:
    """A simulated core in its own process."""

    def __init__(self, simulation: RtlSimulation, memories: Mapping[str, str]) -> None:
        self._word, self._tool = simulation.word, simulation.simulator
        self.folder = Path(tempfile.mkdtemp(prefix="boresight-rtl-"))
        for file, contents in memories.items():
            (self.folder / file).write_text(contents)
        self._log = self.folder / "run.log"
        with self._log.open("wb") as log:
            self.process = subprocess.Popen(
                simulation.command,
                cwd=self.folder,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
            )
        #: End the process; it ends, too, when nothing refers to this any more.
        self.close = weakref.finalize(self, _end, self.process, self.folder)

    def replay(self, batch: Batch) -> RtlRun:
        """Run records, continuing after the last batch.

        Raises ReplayFailed if the core hung, gave an unknown value (X) or too few words, and
        SimulationFailed if the process has ended.
        """
        assert self.process.stdin is not None and self.process.stdout is not None
        with contextlib.suppress(OSError):  # the exit code tells the cause
            self.process.stdin.write(batch.text().encode())
            self.process.stdin.flush()
        lines = list[bytes]()
        for line in self.process.stdout:
            if line.startswith(b"end"):
                return batch.result(lines, line[4:].decode().strip(), self._word, self._tool)
            lines += [line] if line[:1].isdigit() else []  # else of the simulator
        code, output = self.process.wait(), self._log.read_text(errors="replace")
        text = f"{output}\nthe process ended with exit code {code}"
        raise SimulationFailed(failure(f"{self._tool} run failed", text))

    def __enter__(self) -> Self:
        """Itself."""
        return self

    def __exit__(self, *error: object) -> None:
        """Close."""
        self.close()


def _end(process: subprocess.Popen[bytes], folder: Path) -> None:
    assert process.stdin is not None and process.stdout is not None
    process.kill()
    process.wait()
    with contextlib.suppress(OSError):  # input that it has not read
        process.stdin.close()
    process.stdout.close()
    shutil.rmtree(folder, ignore_errors=True)
