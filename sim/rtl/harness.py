"""The bench of a core: C++ around its Verilog, compiled by Verilator, no Python in the simulator.

Records go in and results come out as binary, through pipes (`harness.cpp`). The simulated core
lives in a process of its own and stands still between batches of records: a log is one batch, a
closed loop one batch for each update. Verilator is two-valued; unknown start values are random.
"""

from __future__ import annotations

import contextlib
import subprocess
import tempfile
from pathlib import Path
from typing import Self

import numpy as np
import numpy.typing as npt

from boresight.gateware.core import Core
from boresight.model.tools.failure import failure
from boresight.sim.rtl.compiled import RESET_CYCLES, build
from boresight.sim.rtl.replay import Batch, RegisterWrite, ReplayFailed, RtlRun, RtlSimulation
from boresight.sim.rtl.simulators import SimulationFailed

__all__ = ["CompiledSimulation", "CoreProcess"]


class CompiledSimulation(RtlSimulation):
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
        Verilator, or what it needs, is not installed.
    SimulationFailed
        The build failed.
    """

    def __init__(self, core: Core, *, cache: Path | None = None) -> None:
        super().__init__(core)
        top, main = (
            Path(__file__).with_name(f"harness.{end}").read_text() for end in ("sv", "cpp")
        )
        self._program = build(
            "harness",
            {"core.sv": self.text, "harness.sv": top},
            parameters={"WORD": self.word, "LANES": core.machine.lanes},
            main=main.replace("RESET_CYCLES", str(RESET_CYCLES)),
            cache=cache,
        ).program

    def power_on(self) -> CoreProcess:
        """The core behind its reset, in a process of its own; to be closed."""
        return CoreProcess(self)

    def _replay(self, batch: Batch) -> RtlRun:
        with self.power_on() as process:
            return process.replay(batch)


class CoreProcess:
    """A simulated core in a process of its own."""

    def __init__(self, simulation: CompiledSimulation) -> None:
        self._word = simulation.word
        self.folder = tempfile.TemporaryDirectory(prefix="boresight-rtl-")
        for file, contents in simulation.memories.items():
            (Path(self.folder.name) / file).write_text(contents)
        self._log = Path(self.folder.name) / "run.log"
        with self._log.open("wb") as log:
            self.process = subprocess.Popen(
                [simulation._program, str(self._word), str(simulation.core.machine.lanes)],
                cwd=self.folder.name,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
            )

    def replay(self, batch: Batch) -> RtlRun:
        """Run records from where the last batch ended.

        Raises
        ------
        ReplayFailed
            Hung, or other words than expected.
        SimulationFailed
            The process has ended.
        """
        assert self.process.stdin is not None and self.process.stdout is not None
        with contextlib.suppress(OSError):  # its exit code says more
            self.process.stdin.write(_packed(batch))
            self.process.stdin.flush()
        results, traced = (self._read(4 * int(n)) for n in self._read(16).view(np.int64))
        return _unpacked(results, traced, batch, self._word)

    def _read(self, size: int) -> npt.NDArray[np.int32]:
        assert self.process.stdout is not None
        data = self.process.stdout.read(size)
        if len(data) < size:
            code, said = self.process.wait(), self._log.read_text(errors="replace")
            text = f"{said}\nthe process ended with exit code {code}"
            raise SimulationFailed(failure("verilator run failed", text))
        return np.frombuffer(data, dtype=np.int32)

    def close(self) -> None:
        """End the process."""
        assert self.process.stdin is not None and self.process.stdout is not None
        self.process.kill()
        self.process.wait()
        with contextlib.suppress(OSError):  # what it has not read any more
            self.process.stdin.close()
        self.process.stdout.close()
        self.folder.cleanup()

    def __enter__(self) -> Self:
        """Itself."""
        return self

    def __exit__(self, *error: object) -> None:
        """Close."""
        self.close()


def _packed(batch: Batch) -> bytes:
    """A batch as `harness.cpp` reads it."""
    head = (len(batch.inputs), len(batch.bus_writes), batch.stall, batch.trace, batch.limit)
    counted = np.arange(batch.inputs.shape[1]) < batch.n_in[:, None]
    writes = [x for w in batch.bus_writes for x in (w.record, w.address, w.word)]
    words = np.concatenate([batch.n_in, batch.inputs[counted], np.array(writes, dtype=np.int64)])
    return np.array(head, dtype=np.int64).tobytes() + words.astype(np.int32).tobytes()


def _unpacked(
    data: npt.NDArray[np.int32], traced: npt.NDArray[np.int32], batch: Batch, word: int
) -> RtlRun:
    """What the core did, from results as `harness.cpp` writes them.

    Raises
    ------
    ReplayFailed
        A word too many, or an update that did not complete.
    """
    mask, steps = (1 << word) - 1, len(batch.inputs)
    writes = tuple(
        RegisterWrite(int(lane), int(address), int(value) & mask, int(cycle))
        for lane, address, value, cycle in traced.reshape(-1, 4)
    )
    n_out = batch.n_out
    ends = np.cumsum(2 * n_out + 3)
    starts = ends - (2 * n_out + 3)
    # The first record that is not as expected is the last one that is where it is looked for.
    there = int(np.searchsorted(ends, len(data), side="right"))
    good = (data[starts[:there]] == n_out[:there]) & (data[starts[:there] + 2] >= 0)
    if there < steps or not good.all():
        k = there if good.all() else int(np.argmin(good))
        j, at = int(n_out[k]), int(starts[k])
        if at < len(data) and data[at] > j:
            text = f"{data[at + 3 + j] & mask:0{-(-word // 4)}x} {data[at + 3 + data[at] + j]}"
            raise ReplayFailed(f"verilator: unexpected output word: O {k} {j} {text}", writes)
        raise ReplayFailed(f"verilator: update {k} of {steps} did not complete", writes)
    columns = np.arange(n_out.max())
    real = columns < n_out[:, None]
    places = starts[:, None] + 3 + columns
    outputs, latency = np.zeros((2, *real.shape), dtype=np.int64)
    outputs[real] = data[places[real]]
    latency[real] = data[(places + n_out[:, None])[real]] + 1
    flags = data[starts + 1] != 0
    return RtlRun(outputs, flags, latency, data[starts + 2].astype(np.int64), writes)
