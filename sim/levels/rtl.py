"""The core's Verilog as a level: replayed for records, live for closed loops."""

from __future__ import annotations

import contextlib
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import numpy.typing as npt

from boresight.gateware.core import Core
from boresight.gateware.registers.core import PROGRAM
from boresight.sim.levels.integer import words_of
from boresight.sim.levels.level import Run, run_of_words
from boresight.sim.rtl.compiled import Compiled, build
from boresight.sim.rtl.cosim import RtlSimulation
from boresight.sim.rtl.memories import split_memories
from boresight.sim.rtl.sharing import selection
from boresight.sim.rtl.simulators import SimulationFailed

__all__ = ["Simulated"]

FloatArray = npt.NDArray[np.float64]

#: Cycles, in intervals, after which an update counts as hung.
_PATIENCE = 4


class Simulated:
    """The core's Verilog, compiled by Verilator, with random start values.

    ``run`` replays records from the core's reset on in one go (`sim.rtl.cosim`); ``step`` feeds a
    core that lives in a process of its own, started by the first step after `reset`.

    Parameters
    ----------
    core : Core
        Its program at hand runs.

    Raises
    ------
    ToolMissing
        Verilator, or what it needs, is not installed.
    SimulationFailed
        The build failed.
    """

    name = "rtl"

    def __init__(self, core: Core) -> None:
        self._built: Compiled | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self.core, self.program = core, core.program
        self._verilog = core.verilog(instances=False)

    def reset(self) -> None:
        """Begin anew, with the states' start words."""
        self.close()

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            assert self._process.stdin is not None and self._process.stdout is not None
            self._process.kill()
            self._process.wait()
            with contextlib.suppress(OSError):  # what it has not read any more
                self._process.stdin.close()
            self._process.stdout.close()
            self._process = None
        if self._folder is not None:
            self._folder.cleanup()
            self._folder = None

    def __del__(self) -> None:
        """End the process."""
        self.close()

    def run(self, records: FloatArray) -> Run:
        """Updates from the core's reset on; latencies and intervals are counted.

        Raises
        ------
        SimulationFailed
            Hung, an unknown value, or fewer words than expected.
        """
        simulation = RtlSimulation(
            self._verilog,
            word=self.program.arithmetic.word,
            n_inputs=len(self.program.inputs),
            n_outputs=len(self.program.outputs),
            lanes=self.core.machine.lanes,
        )
        found = simulation.run(
            words_of(self.program, records),
            max_interval=self.core.schedule.interval,
            bus_writes=selection(self.core),
        )
        return run_of_words(
            self.program,
            found.outputs,
            found.saturated,
            latency_cycles=found.latency_cycles,
            interval_cycles=found.interval_cycles,
        )

    def step(self, record: FloatArray) -> dict[str, float]:
        """One update.

        Raises
        ------
        SimulationFailed
            The update did not end, gave another number of words, or took other cycles than the
            schedule says; or the process has ended.
        """
        if self._process is None:
            self._start()
        process, n = self._process, len(self.program.outputs)
        assert process is not None and process.stdin is not None and process.stdout is not None
        try:
            process.stdin.write(words_of(self.program, record[None, :]).astype("<i4").tobytes())
            process.stdin.flush()
        except OSError as error:
            raise SimulationFailed("rtl: the simulation has ended") from error
        head = process.stdout.read(4)
        count = int(np.frombuffer(head, dtype="<i4")[0]) if len(head) == 4 else -1
        rest = process.stdout.read(4 * (max(count, 0) + 2))
        words = np.frombuffer(rest, dtype="<i4").astype(np.int64)
        if count != n or len(words) != n + 2:
            raise SimulationFailed(f"rtl: {n} output words expected, {count} came")
        if words[-1] != self.core.schedule.interval:
            raise SimulationFailed(
                f"rtl: the update took {words[-1]} cycles, the schedule says "
                f"{self.core.schedule.interval}"
            )
        sign = 1 << (self.program.arithmetic.word - 1)
        signed = ((words[:n] & (2 * sign - 1)) ^ sign) - sign
        outputs = run_of_words(self.program, signed[None, :], np.array([bool(words[n])])).outputs
        return {name: float(value[0]) for name, value in outputs.items()}

    def _start(self) -> None:
        text, memories = split_memories(self._verilog)
        word = self.program.arithmetic.word
        here = Path(__file__)
        if self._built is None:
            self._built = build(
                "live",
                {"core.v": text, "live.sv": here.with_name("live.sv").read_text()},
                parameters={"WORD": word},
                main=here.with_name("live.cpp").read_text(),
            )
        self._folder = tempfile.TemporaryDirectory(prefix="boresight-live-")
        for file, contents in memories.items():
            (Path(self._folder.name) / file).write_text(contents)
        several = len(self.core.parts) > 1
        arguments = (
            len(self.program.inputs),
            word,
            PROGRAM if several else -1,
            self.core.number,
            _PATIENCE * self.core.schedule.interval + 64,
        )
        self._process = subprocess.Popen(
            [str(self._built.program), *map(str, arguments)],
            cwd=self._folder.name,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
