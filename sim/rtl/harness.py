"""The bench of a core: C++ around its Verilog, compiled by Verilator, no Python in the simulator.

Records and results pass through pipes as binary data (`harness.cpp`). The simulated core
has its own process and stands still between batches of records: a log is one batch, a
closed loop one batch for each update. Verilator is two-valued; unknown start values are random.
"""

from __future__ import annotations

import contextlib
import shutil
import subprocess
import tempfile
import weakref
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Self

from boresight.gateware.core import Core
from boresight.model.tools.failure import failure
from boresight.model.words.fixed import IntArray
from boresight.sim.rtl.compiled import RESET_CYCLES, build
from boresight.sim.rtl.replay import Batch, RtlRun, RtlSimulation
from boresight.sim.rtl.simulators import SimulationFailed


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
        Verilator, or a tool that it needs, is not installed.
    SimulationFailed
        The build failed.
    """

    def __init__(self, core: Core, *, cache: Path | None = None) -> None:
        super().__init__(core)
        main, stepped = (
            Path(__file__).with_name(name).read_text() for name in ("harness.cpp", "stepped.sv")
        )
        self._program = build(
            "stepped",
            {**self.sources, "stepped.sv": stepped},
            parameters=self.parameters,
            main=main.replace("RESET_CYCLES", str(RESET_CYCLES)),
            cache=cache,
        ).program

    def power_on(self, states: IntArray | None = None) -> CoreProcess:
        """Start a process with the core after its reset; the caller closes it.

        Parameters
        ----------
        states : int64 (n_states,), optional
            State words of the selected program; by default those that it begins with.
        """
        return CoreProcess(self, None if states is None else self._memories_with(states))

    @cached_property
    def _started(self) -> dict[str, list[tuple[int, int | None]]]:
        """Memories of a core that does not restart: word, and number of the register that it is.

        The words of two images differ where these number their registers differently, and in the
        restart routines.
        """
        core, count = self.core, len(self.core.image.registers)
        low, high = (
            self.design(replace(core, image=replace(image, registers=[*numbers]), files={}))[1]
            for image, numbers in (
                (core.image.without_restarts(core.machine), range(count)),
                (core.image, range(count, 2 * count)),
            )
        )
        memories: dict[str, list[tuple[int, int | None]]] = {}
        for name, text in self.memories.items():
            words = [[int(w, 16) for w in each.split()] for each in (text, low[name], high[name])]
            memories[name] = [
                (word, None) if a == b else (a, None if name.startswith("rom") else a)
                for word, a, b in zip(*words, strict=True)
            ]
        return memories

    def _memories_with(self, states: IntArray) -> dict[str, str]:
        """`memories` in which the states of the selected program begin with these words."""
        registers = self.core.registers_with(states)
        return {
            name: "".join(f"{w if n is None else registers[n]:x}\n" for w, n in words)
            for name, words in self._started.items()
        }

    def _replay(self, batch: Batch) -> RtlRun:
        with self.power_on() as process:
            return process.replay(batch)


class CoreProcess:
    """A simulated core in its own process."""

    def __init__(
        self, simulation: CompiledSimulation, memories: Mapping[str, str] | None = None
    ) -> None:
        self._word = simulation.word
        self.folder = Path(tempfile.mkdtemp(prefix="boresight-rtl-"))
        self._remove = weakref.finalize(self, shutil.rmtree, self.folder, ignore_errors=True)
        for file, contents in (memories or simulation.memories).items():
            (self.folder / file).write_text(contents)
        self._log = self.folder / "run.log"
        with self._log.open("wb") as log:
            self.process = subprocess.Popen(
                [simulation._program, str(self._word), str(simulation.core.machine.lanes)],
                cwd=self.folder,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
            )

    def replay(self, batch: Batch) -> RtlRun:
        """Run records, continuing after the last batch.

        Raises
        ------
        ReplayFailed
            The core hung or gave an unexpected number of words.
        SimulationFailed
            The process has ended.
        """
        assert self.process.stdin is not None and self.process.stdout is not None
        with contextlib.suppress(OSError):  # the exit code tells the cause
            self.process.stdin.write(batch.packed())
            self.process.stdin.flush()
        return batch.result(self._read, word=self._word, tool="verilator")

    def _read(self, size: int) -> bytes:
        assert self.process.stdout is not None
        data = self.process.stdout.read(size)
        if len(data) < size:
            code, output = self.process.wait(), self._log.read_text(errors="replace")
            text = f"{output}\nthe process ended with exit code {code}"
            raise SimulationFailed(failure("verilator run failed", text))
        return data

    def close(self) -> None:
        """End the process."""
        assert self.process.stdin is not None and self.process.stdout is not None
        self.process.kill()
        self.process.wait()
        with contextlib.suppress(OSError):  # input that it has not read
            self.process.stdin.close()
        self.process.stdout.close()
        self._remove()

    def __enter__(self) -> Self:
        """Itself."""
        return self

    def __exit__(self, *error: object) -> None:
        """Close."""
        self.close()
