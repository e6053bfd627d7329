"""A core's Verilog in a simulator: Verilator, or Icarus, hundreds of times slower.

The bench (`bench.sv`) and the formats are the same in both. The simulated core has its own process
and stands still between batches of records: a log is one batch, a closed loop one batch for each
update. Verilator is two-valued, and unknown start values are random; in Icarus an unknown one (X)
that counts is an error.
"""

from __future__ import annotations

import contextlib
import re
import shutil
import subprocess
import tempfile
import weakref
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from boresight.gateware.core import Core
from boresight.gateware.registers import PROGRAM
from boresight.model.arrays import BoolArray
from boresight.model.tools.external import failure
from boresight.model.tools.files import Cache
from boresight.model.words.fixed import IntArray
from boresight.sim.rtl.simulators import SimulationFailed, build, require, run_tool, version


class BusWrite(NamedTuple):
    """A word written on the bus before the first word of ``record`` is offered."""

    record: int
    address: int
    word: int


class Reset(NamedTuple):
    """A reset of one cycle, ``cycle`` cycles after the first input word of ``record`` was taken.

    With ``restart`` it is a pulse of ``restart`` instead. If the update is complete before, it
    comes then.
    """

    record: int
    cycle: int
    restart: bool = False


@dataclass(frozen=True)
class RtlRun:
    """Result of a replay."""

    outputs: IntArray  #: (steps, n_outputs): words in stream order, padded with 0.
    #: (steps,): a result was clamped; an input word was beyond its declared range.
    saturated: BoolArray
    beyond: BoolArray
    #: (steps, n_outputs): cycles from the first input word taken to each output word taken, both
    #: inclusive; 0 for a word that was not given.
    latency_cycles: IntArray
    #: (steps,): cycles from the first input word taken until the next record could begin; -2: a
    #: `Reset` came before.
    interval_cycles: IntArray


@dataclass(frozen=True, eq=False)
class Batch:
    """Records for a bench."""

    inputs: IntArray  #: (steps, widest): words of each record, padded; the first ``n_in`` count.
    n_in: IntArray  #: (steps,): numbers of input and output words of each record.
    n_out: IntArray
    #: In the order of records, the reset of one behind its writes.
    bus_writes: Sequence[BusWrite | Reset]
    stall: int  #: 0: no pauses of input and output. Otherwise the seed of a pattern of pauses.
    limit: int  #: cycles after which the core counts as hung.

    def text(self) -> str:
        """The batch as numbers in the order of `bench.sv`."""
        head = (len(self.inputs), len(self.bus_writes), self.stall, self.limit)
        valid = np.arange(self.inputs.shape[1]) < self.n_in[:, None]
        orders = [
            (w.record, -1 - w.restart, w.cycle) if isinstance(w, Reset) else w
            for w in self.bus_writes
        ]
        numbers = np.concatenate([head, self.n_in, self.inputs[valid], np.ravel(orders)])
        return " ".join(map(str, numbers.astype(np.int64).tolist())) + "\n"

    def result(self, lines: Sequence[bytes], unknown: str, word: int, tool: str) -> RtlRun:
        """Read the result of a bench: ``lines`` as `bench.sv` defines them.

        ``unknown`` is the unknown value that ended the batch, or empty; ``word`` the width in bits.
        Raises SimulationFailed for it, a wrong number of words, or an update that did not end.
        """
        rows = np.array(b"".join(lines).split(), dtype=np.int64).reshape(-1, 3)
        ends, sign = rows[:, 0] == 0, 1 << (word - 1)
        words, cycles = rows[~ends, 1:].T
        words = (words ^ sign) - sign
        flags, intervals = rows[ends, 1:].T
        counts = np.diff(np.cumsum(~ends)[ends], prepend=0)
        was_reset = intervals == -2
        n_out = np.where(was_reset, counts, self.n_out[: len(counts)])
        mismatches = (counts != n_out) | ((intervals < 0) & ~was_reset)
        fault = f"unknown value (X): {unknown}" if unknown else ""
        if mismatches.any() and not fault:
            k = int(np.argmax(mismatches))
            fault = f"update {k} gave {counts[k]} output words, {n_out[k]} expected"
            if intervals[k] < 0:
                fault = f"update {k} of {len(self.n_out)} did not complete"
        if fault:
            raise SimulationFailed(f"{tool}: {fault}")
        valid = np.arange(self.n_out.max()) < n_out[:, None]
        outputs, latency = np.zeros((2, *valid.shape), dtype=np.int64)
        outputs[valid], latency[valid] = words, cycles + 1
        return RtlRun(outputs, flags & 1 == 1, flags > 1, latency, intervals)


_BLOCK = re.compile(
    r"  initial begin\n((?:    (?P<name>[^\s\[]+)\[\d+\] = \d+'[dhb][0-9a-fx]+;\n)+)  end\n"
)
_WORD = re.compile(r"\[(\d+)\] = \d+'([dhb])([0-9a-f]+);")
_BASE = {"d": 10, "h": 16, "b": 2}


def split_memories(verilog: str) -> tuple[str, dict[str, str]]:
    """Verilog that reads its memories from files, and the files by name."""
    files: dict[str, str] = {}

    def replace(match: re.Match[str]) -> str:
        file = f"memory{len(files)}.hex"
        words = _WORD.findall(match[1])
        files[file] = "".join(f"@{int(n):x} {int(x, _BASE[base]):x}\n" for n, base, x in words)
        return f'  initial $readmemh("{file}", {match["name"]});\n'

    return _BLOCK.sub(replace, verilog), files


class RtlSimulation:
    """A built simulation of one core in one of `SIMULATORS`, for any number of runs.

    The build depends on the machine, not on the program (`split_memories`), and is kept in a
    cache. Raises ToolMissing, or SimulationFailed if the build failed.
    """

    def __init__(self, core: Core, simulator: str = "verilator") -> None:
        require(simulator)
        self.core, self.simulator, self.word = core, simulator, core.machine.arithmetic.word
        text, self.memories = split_memories(core.verilog(instances=False))
        bench = Path(__file__).with_name("bench.sv").read_text()
        sources = {**core.files, "core.v": text, "bench.sv": bench}
        if simulator == "icarus":

            def make(folder: Path) -> None:
                for name, text in sources.items():
                    (folder / name).write_text(text)
                command = ["iverilog", "-g2012", "-s", "bench", f"-Pbench.WORD={self.word}"]
                run_tool("icarus build failed", [*command, "-o", "bench", *sources], folder)

            identity = repr((sources, self.word, version("icarus")))
            entry = Cache().get("rtl-icarus", identity, make)
            self.command = ["vvp", "-n", str(entry / "bench")]
        else:
            program = build("bench", sources, parameters={"WORD": self.word}).program
            self.command = [str(program), f"+max_cycles={1 << 63}"]

    def power_on(self) -> CoreProcess:
        """Start a process with the core after its reset; the caller closes it."""
        return CoreProcess(self)

    def run(self, inputs: IntArray, **options: Any) -> RtlRun:
        """Run input words (steps, n_inputs) from the core's reset on; see `batch` and `replay`."""
        with contextlib.closing(self.power_on()) as process:
            return process.replay(self.batch(inputs, **options))

    def batch(
        self,
        inputs: IntArray,
        numbers: IntArray | None = None,
        bus_writes: Sequence[BusWrite | Reset] = (),
        *,
        stall: int = 0,
    ) -> Batch:
        """The batch for these records.

        ``numbers`` (steps,) are the program of each record, when several take turns (`bus_writes`
        must select them), by default the selected one; what a record does not need of its row is
        left out.
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
        return Batch(inputs, n_in, n_out, bus_writes, stall, limit)


class CoreProcess:
    """A simulated core in its own process."""

    def __init__(self, simulation: RtlSimulation) -> None:
        self._word, self._tool = simulation.word, simulation.simulator
        self.folder = Path(tempfile.mkdtemp(prefix="boresight-rtl-"))
        for file, contents in simulation.memories.items():
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

        Raises SimulationFailed if the core hung, gave an unknown value (X) or too few words, or
        the process has ended.
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


def _end(process: subprocess.Popen[bytes], folder: Path) -> None:
    assert process.stdin is not None and process.stdout is not None
    process.kill()
    process.wait()
    with contextlib.suppress(OSError):  # input that it has not read
        process.stdin.close()
    process.stdout.close()
    shutil.rmtree(folder, ignore_errors=True)
