"""The core's Verilog as a level, for records and for closed loops; records for a plain bench."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from boresight.gateware.core import Core
from boresight.gateware.registers import PROGRAM
from boresight.gateware.schedule.slots import Schedule
from boresight.model.arrays import FloatArray
from boresight.model.words.fixed import IntArray
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import InPort, Program
from boresight.sim.levels.build import Build, Level, Run, run_of_words, words_of
from boresight.sim.rtl.simulation import BusWrite, CoreProcess, RtlRun, RtlSimulation
from boresight.sim.rtl.simulators import SimulationFailed

if TYPE_CHECKING:
    from boresight.gateware.texts.core import Recorded

#: Cycles of Icarus in a check: enough for a comparison, few enough for its speed.
ICARUS_CYCLES = 10_000


class Simulated(Level):
    """The core's Verilog in a simulator (`sim.rtl.simulation`).

    The first run after `reset` starts it. What cannot be built or run raises ToolMissing or
    SimulationFailed then.
    """

    name, tool = "rtl", "verilator"
    _process: CoreProcess | None = None

    @cached_property
    def core(self) -> Core:
        return self.build.core.select(self.number)

    @cached_property
    def simulation(self) -> RtlSimulation:
        return RtlSimulation(self.core, self.tool)

    @property
    def schedule(self) -> Schedule:
        return self.core.schedule

    @property
    def record_limit(self) -> int | None:
        """Maximum number of records within `ICARUS_CYCLES`."""
        cycles = sum(part.schedule.interval for part in self.core.parts)
        return max(1, ICARUS_CYCLES // cycles) if self.tool == "icarus" else None

    def reset(self) -> None:
        self.close()

    def close(self) -> None:
        if self._process is not None:
            self._process.close()
            self._process = None

    def run(self, records: FloatArray) -> Run:
        """Updates; latencies and intervals are counted. Raises as `CoreProcess.replay`."""
        return self._run_of(self._replayed(words_of(self.program, records)))

    def _replayed(self, words: IntArray, **options: Any) -> RtlRun:
        """Replay input words; ``options`` of `RtlSimulation.batch`."""
        if self._process is None:
            self._process = self.simulation.power_on()
        return self._process.replay(self.simulation.batch(words, **options))

    def _run_of(self, replayed: RtlRun) -> Run:
        late = (replayed.latency_cycles != np.array(self.schedule.latencies)).any()
        return run_of_words(
            self.program,
            replayed.outputs,
            replayed.saturated,
            beyond=replayed.beyond,
            latency_cycles=replayed.latency_cycles,
            interval_cycles=replayed.interval_cycles,
            fault="output cycles differ from the schedule" if late else "",
        )

    def advance(self, records: FloatArray) -> Run:
        """Updates; SimulationFailed, too, if one took other cycles than the schedule says."""
        replayed = self._replayed(words_of(self.program, records))
        wanted = self.schedule.interval
        for took in replayed.interval_cycles[replayed.interval_cycles != wanted][:1]:
            raise SimulationFailed(
                f"rtl: the update took {took} cycles, the schedule says {wanted}"
            )
        run = self._run_of(replayed)
        if run.fault:
            raise SimulationFailed(f"rtl: {run.fault}")
        return run

    @classmethod
    def run_together(
        cls,
        levels: Sequence[Level],
        records: Sequence[FloatArray],
        *,
        anew: bool = True,
        seed: int = 0,
    ) -> list[Run]:
        """All programs of the core in turns, in random pieces of their records."""
        if len(levels) == 1:
            return super().run_together(levels, records, anew=anew)
        simulated = [level for level in levels if isinstance(level, Simulated)]
        for level in simulated if anew else ():
            level.reset()
        words = [words_of(x.program, rows) for x, rows in zip(simulated, records, strict=True)]
        first = simulated[0]
        replayed = run_in_turns(first.simulation, words, seed=seed, replay=first._replayed)
        return [level._run_of(run) for level, run in zip(simulated, replayed, strict=True)]


def run_in_turns(
    simulation: RtlSimulation,
    streams: Sequence[IntArray],
    *,
    seed: int = 0,
    stall: int = 0,
    longest: int = 40,
    replay: Callable[..., RtlRun] | None = None,
) -> list[RtlRun]:
    """Run every program of a core on its own stream, in turns.

    At random times the host also writes a number without a program, which must have no effect.
    Turns are random (``seed``), of at most ``longest`` records of (steps, n_inputs) words, until
    every stream has ended. ``replay`` runs the records, by default `RtlSimulation.run`: from a
    reset on. Returns the run of each program, as if it had run alone.
    """
    rng, parts = random.Random(seed), simulation.core.parts
    widest = max(s.shape[1] for s in streams)
    rows, writes, numbers, at = [], list[BusWrite](), list[int](), [0] * len(streams)
    while left := [k for k, stream in enumerate(streams) if at[k] < len(stream)]:
        k = rng.choice(left)
        writes.append(BusWrite(len(numbers), PROGRAM, k))
        if rng.random() < 0.25:
            writes.append(BusWrite(len(numbers), PROGRAM, rng.choice((len(parts), -1))))
        piece = streams[k][at[k] : at[k] + rng.randint(1, longest)]
        at[k] += len(piece)
        rows.append(np.pad(piece, ((0, 0), (0, widest - piece.shape[1]))))
        numbers += [k] * len(piece)
    run = (replay or simulation.run)(
        np.concatenate(rows), numbers=np.array(numbers), stall=stall, bus_writes=writes
    )
    out = []
    for k, part in enumerate(parts):
        mine, n_out = np.array(numbers) == k, len(part.program.outputs)
        words, latency = run.outputs[mine, :n_out], run.latency_cycles[mine, :n_out]
        flags = run.saturated[mine], run.beyond[mine]
        out.append(RtlRun(words, *flags, latency, run.interval_cycles[mine]))
    return out


#: Cycles of all records of a program together; minimum and maximum number of records.
_CYCLES, _RECORDS = 10_000, (6, 60)
#: A generated input moves by 1/8 of its range per record at most, and is missing in 1 of 8 records.
_MOVES, _MISSING = 8, 8


def recorded(build: Build) -> list[Recorded]:
    """Return records of every program from power-up on.

    Inputs are random walks within the declared ranges, the same on every machine; in the last
    record but one each input word is the largest one. All records of one program come before those
    of the next.
    """
    from boresight.gateware.texts.core import Recorded  # it imports Amaranth

    records = []
    for number, program in enumerate(build.programs):
        interval = build.core.parts[number].schedule.interval
        count = min(max(_CYCLES // interval, _RECORDS[0]), _RECORDS[1])
        rng = random.Random(program.name)
        ports = dict(zip(program.inputs, program.in_ports, strict=False))
        walks = [
            list(_walk(program, n, ports.get(n, InPort()), count, rng)) for n in program.inputs
        ]
        words = np.array(walks, dtype=np.int64).T
        words[-2] = program.arithmetic.max_int
        outputs, saturated = Interpreter(program).run(words[:, :, None])
        flags = saturated[:, 0], program.beyond(words)
        records.append(Recorded(number, words, outputs[:, :, 0], *flags))
    return records


def _walk(
    program: Program, number: int, port: InPort, count: int, rng: random.Random
) -> Iterator[int]:
    """One input: steps within its range, at times the word for a missing sample."""
    value, form = program.values[number], program.format(number)
    low, high = int(form.quantise(value.low)), int(form.quantise(value.high))
    at = rng.randint(low, high)
    for _ in range(count):
        step = (high - low) // _MOVES
        at = min(max(at + rng.randint(-step, step), low), high)
        if port.flags:
            yield rng.choice((low, high))
        elif isinstance(port.missing, float) and not rng.randrange(_MISSING):
            yield int(form.quantise(port.missing))
        else:
            yield at
