"""Random programs through interpreter, C, proof of the microcode and RTL.

A case draws programs that share a core, its machine and width, the outputs that come first, and a
sequence of updates, parameter writes and changes of the program, with pauses of both streams,
resets and restarts of the RTL.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from boresight.firmware.build import CModel
from boresight.gateware.core import Core, build_shared_core
from boresight.gateware.machine import MACHINES
from boresight.gateware.registers import PROGRAM
from boresight.gateware.schedule.slots import ScheduleError
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Kind
from boresight.sim.rtl.simulation import BusWrite, Reset, RtlRun, RtlSimulation
from boresight.sim.rtl.simulators import SimulationFailed
from tests.support.random_program import random_inputs, random_programs, with_ranges

__all__ = ["Case", "check", "drawn"]

#: Machines and widths whose RTL is built: a build takes a minute and serves all programs.
RTL = (("small", 32), ("fast", 32), ("small-d9", 24), ("fast-d12", 18))


@dataclass(frozen=True)
class Case:
    """What a case is drawn from; equal cases do the same.

    Attributes
    ----------
    seed : int
        Of programs and events.
    config : str
        One of `MACHINES`.
    word : int
        Width.
    programs, n_ops : int
        Programs of the core; about half of the most operations of each.
    urgent : int
        Outputs that come first, at most; 0: as the program says.
    updates : int
    stall : int
        Seed of the pauses of both streams in the RTL; 0: none.
    rtl : bool
        Whether the RTL runs, too.
    resets : int
        Of 8 updates so many are followed or interrupted by a reset or a restart, in the RTL.
    """

    seed: int
    config: str
    word: int
    programs: int
    n_ops: int
    urgent: int
    updates: int
    stall: int
    rtl: bool
    resets: int = 0

    def __str__(self) -> str:
        rtl = f", RTL with pauses {self.stall}, {self.resets}/8 resets" if self.rtl else ""
        return (
            f"seed {self.seed}: {self.programs} programs of up to {2 * self.n_ops} operations "
            f"on {self.config}, W = {self.word}, {self.updates} updates{rtl}"
        )


def drawn(seed: int, *, rtl: bool = False) -> Case:
    """The case of a seed."""
    rng = random.Random(seed)
    config, word = rng.choice([*MACHINES]), rng.randint(18, 32)
    if rtl:
        config, word = rng.choice(RTL)
    programs = rng.choice((1, 2, 3))
    return Case(
        seed,
        config,
        word,
        programs=programs,
        n_ops=rng.choice((1, 5, 20, 40)),
        urgent=rng.randrange(4),
        updates=rng.choice((3, 20, 60)),
        stall=rng.choice((0, rng.randrange(1, 1 << 16))),
        rtl=rtl,
        resets=rng.choice((0, 1, 4)) if rtl else 0,
    )


def check(case: Case) -> str:
    """What is wrong; empty: all forms agree. A case that does not fit its machine is good."""
    programs = [
        with_ranges(program, case.seed + k)
        for k, program in enumerate(
            random_programs(case.seed, case.programs, word=case.word, n_ops=case.n_ops)
        )
    ]
    programs = [replace(p, urgent=min(case.urgent, len(p.outputs)) or None) for p in programs]
    try:
        core = build_shared_core(programs, case.config)
    except ScheduleError:
        return ""
    return next(_differences(case, core), "")


def _differences(case: Case, core: Core) -> Iterator[str]:
    """Of the forms of a core that run the same events."""
    rng = random.Random(case.seed + 1)
    parts = [part.program for part in core.parts]
    models = [Interpreter(p) for p in parts]
    c = [CModel(p) for p in parts]
    streams = [iter(random_inputs(p, case.seed + k, case.updates)) for k, p in enumerate(parts)]
    numbers, rows, wanted = list[int](), list[list[int]](), list[_Update]()
    bus = list[BusWrite | Reset]()
    for k in range(case.updates):
        number = rng.randrange(len(parts))
        program = parts[number]
        if len(parts) > 1:
            bus.append(BusWrite(k, PROGRAM, number))
        where = core.parts[number].allocation.addresses
        for value in program.of_kind(Kind.PARAM) if rng.random() < 0.3 else ():
            name = program.values[value].name
            word = random_inputs(program, rng.randrange(1 << 30), 1)[0][0]
            address = core.machine.parameter_address(where[value])
            models[number].params[value] = word
            c[number].set_param(name, word)
            bus.append(BusWrite(k, address, word))
        row, begun = next(streams[number]), list[int]()
        numbers.append(number)
        rows.append(row)
        if case.rtl and rng.randrange(8) < case.resets:
            reset = _reset(rng, k, core.parts[number].schedule.interval, case)
            bus.append(reset)
            begun = [number] if reset.restart else list(range(len(parts)))
            if not reset.restart and reset.cycle < core.parts[number].schedule.interval - 1:
                wanted.append(_Update(*_updated(models[number], row), abandoned=True))
                _begin(begun, models, c)
                continue
        words, flags = _updated(models[number], row)
        c_out, c_saturated = c[number].update([row])
        if (c_out[0].tolist(), [*c_saturated, *c[number].beyond]) != (words, flags):
            yield f"C: update {k} of {program.name}: {c_out[0].tolist()}, not {words}"
        whole = bool(bus) and bus[-1] == Reset(k, core.parts[number].schedule.interval - 1)
        wanted.append(_Update(words, flags, in_last_cycle=whole))
        _begin(begun, models, c)
    if case.rtl:
        width = max(map(len, rows))
        inputs = np.array([row + [0] * (width - len(row)) for row in rows], dtype=np.int64)
        simulation = RtlSimulation(core)
        try:
            run = simulation.run(
                inputs, numbers=np.array(numbers), bus_writes=bus, stall=case.stall
            )
        except SimulationFailed as error:
            yield f"RTL: {error}"
            return
        yield from _beside(run, wanted)


def _begin(numbers: list[int], models: list[Interpreter], c: list[CModel]) -> None:
    """Load the initial states of these programs; their parameters stay."""
    for number in numbers:
        models[number].states = Interpreter(models[number].program).states
        c[number].reset()


def _updated(model: Interpreter, row: list[int]) -> tuple[list[int], list[bool]]:
    """Output words of an update; whether a result saturated, an input was beyond its range."""
    words, saturated = model.update([[word] for word in row])
    return words[:, 0].tolist(), [bool(saturated[0]), bool(model.program.beyond(np.array(row)))]


@dataclass(frozen=True)
class _Update:
    """Words and flags of an update, of which a reset may leave the first words alone."""

    words: list[int]
    flags: list[bool]
    abandoned: bool = False
    in_last_cycle: bool = False


def _reset(rng: random.Random, record: int, interval: int, case: Case) -> Reset:
    """A reset or restart in any cycle of an update before its last, in that, or after it.

    With pauses the last cycle is not known beforehand, but it is no sooner.
    """
    cycles = [rng.randrange(1, max(2, interval - 1)), rng.randrange(1, max(2, interval - 1))]
    cycle = rng.choice([*cycles, 1 << 30, interval - 1 if not case.stall else 1])
    return Reset(record, cycle, restart=rng.random() < 0.5)


def _beside(run: RtlRun, wanted: list[_Update]) -> Iterator[str]:
    """Differences of the RTL's updates."""
    for k, update in enumerate(wanted):
        got = run.outputs[k, : int((run.latency_cycles[k] > 0).sum())].tolist()
        cut = update.abandoned or update.in_last_cycle
        words = update.words[: len(got)] if update.abandoned else update.words
        if got != words or (run.interval_cycles[k] == -2) != cut:
            yield f"RTL: update {k}: {got}, not {words}; interval {run.interval_cycles[k]}"
        elif not cut and [run.saturated[k], run.beyond[k]] != update.flags:
            yield f"RTL: flags of update {k}, not {update.flags}"
