"""A core that lives in a process of its own, for closed loops: one record in, its words out."""

from __future__ import annotations

import contextlib
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from boresight.gateware.core import Core
from boresight.gateware.registers.core import PROGRAM
from boresight.model.words.fixed import IntArray
from boresight.sim.rtl.compiled import build
from boresight.sim.rtl.memories import split_memories
from boresight.sim.rtl.simulators import SimulationFailed

__all__ = ["LiveCore"]

#: Cycles, in intervals, after which an update counts as hung.
_PATIENCE = 4


class LiveCore:
    """The core's Verilog, compiled by Verilator, with random start values; its program at hand.

    Raises
    ------
    ToolMissing
        Verilator, or what it needs, is not installed.
    SimulationFailed
        The build failed.
    """

    def __init__(self, core: Core) -> None:
        self.core = core
        text, memories = split_memories(core.verilog(instances=False))
        word, here = core.machine.arithmetic.word, Path(__file__)
        built = build(
            "live",
            {"core.v": text, "live.sv": here.with_name("live.sv").read_text()},
            parameters={"WORD": word},
            main=here.with_name("live.cpp").read_text(),
        )
        self.folder = tempfile.TemporaryDirectory(prefix="boresight-live-")
        for file, contents in memories.items():
            (Path(self.folder.name) / file).write_text(contents)
        arguments = (
            len(core.program.streamed),
            word,
            PROGRAM if len(core.parts) > 1 else -1,
            core.number,
            _PATIENCE * core.schedule.interval + 64,
        )
        self.process = subprocess.Popen(
            [str(built.program), *map(str, arguments)],
            cwd=self.folder.name,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )

    def update(self, words: IntArray) -> tuple[IntArray, bool]:
        """Output words (n_outputs,) of input words (n_inputs,), and the saturation flag.

        Raises
        ------
        SimulationFailed
            The update did not end, gave another number of words, or took other cycles than the
            schedule says; or the process has ended.
        """
        process, n, wanted = self.process, len(self.core.program.outputs), self.core.schedule
        assert process.stdin is not None and process.stdout is not None
        try:
            process.stdin.write(words.astype("<i4").tobytes())
            process.stdin.flush()
        except OSError as error:
            raise SimulationFailed("rtl: the simulation has ended") from error
        head = process.stdout.read(4)
        count = int(np.frombuffer(head, dtype="<i4")[0]) if len(head) == 4 else -1
        rest = process.stdout.read(4 * (max(count, 0) + 2))
        found = np.frombuffer(rest, dtype="<i4").astype(np.int64)
        if count != n or len(found) != n + 2:
            raise SimulationFailed(f"rtl: {n} output words expected, {count} came")
        if found[-1] != wanted.interval:
            raise SimulationFailed(
                f"rtl: the update took {found[-1]} cycles, the schedule says {wanted.interval}"
            )
        sign = 1 << (self.core.machine.arithmetic.word - 1)
        return ((found[:n] & (2 * sign - 1)) ^ sign) - sign, bool(found[n])

    def close(self) -> None:
        """End the process."""
        assert self.process.stdin is not None and self.process.stdout is not None
        self.process.kill()
        self.process.wait()
        with contextlib.suppress(OSError):  # what it has not read any more
            self.process.stdin.close()
        self.process.stdout.close()
        self.folder.cleanup()
