"""Restart and reset: the next update equals that of a fresh core, whenever they come."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from boresight.gateware.core import Core, build_core, build_shared_core
from boresight.gateware.registers import PROGRAM
from boresight.gateware.schedule.slots import ScheduleError
from boresight.model.estimator import Estimator
from boresight.model.words.interpreter import Interpreter
from boresight.sim.rtl.simulation import BusWrite, Reset, RtlSimulation
from tests.support.estimators import ALL, Leaky, core_of
from tests.support.random_program import random_inputs


def check(core: Core, events: list[tuple[int, Reset | None]]) -> None:
    """Compare the RTL with models that begin anew, for updates of these programs.

    Parameters
    ----------
    events : list of (int, Reset or None)
        Program of each update, and what comes in the course of it or behind it; the record of the
        event does not count.
    """
    programs = [part.program for part in core.parts]
    streams = [random_inputs(p, 1, len(events)) for p in programs]
    width = max(len(stream[0]) for stream in streams)
    rows, bus = [], list[BusWrite | Reset]()
    for k, (number, event) in enumerate(events):
        rows.append((streams[number][k] + [0] * width)[:width])
        bus += [BusWrite(k, PROGRAM, number)] if len(programs) > 1 else []
        bus += [Reset(k, event.cycle, event.restart)] if event else []
    run = RtlSimulation(core).run(
        np.array(rows), numbers=np.array([number for number, _ in events]), bus_writes=bus
    )
    models = [Interpreter(p) for p in programs]
    for k, (number, event) in enumerate(events):
        interval, n = core.parts[number].schedule.interval, len(programs[number].outputs)
        wanted = models[number].update(np.array(streams[number][k])[:, None])[0][:, 0]
        if event and not event.restart and event.cycle < interval - 1:
            n = int((run.latency_cycles[k] > 0).sum())  # abandoned
        assert np.array_equal(run.outputs[k, :n], wanted[:n]), (k, number, event)
        for other, program in enumerate(programs):
            if event and (not event.restart or other == number):
                models[other] = Interpreter(program)
        if event and event.restart and event.cycle < interval - 2:
            routine = core.image.restarts[number] + core.machine.prefetch + 2
            assert run.interval_cycles[k] == interval + routine


def in_cycle(cycle: int, number: int = 0) -> list[tuple[int, Reset | None]]:
    """Updates of a program with a reset and a restart in this cycle of the second and fourth."""
    events = [None, Reset(0, cycle), None, Reset(0, cycle, restart=True), None]
    return [(number, event) for event in events]


@pytest.mark.parametrize("config", ["small", "fast", "small-d9"])
def test_every_cycle(config: str) -> None:
    core = build_core(Leaky().compile(), config)
    cycles = range(1, core.schedule.interval + 12)
    check(core, [event for cycle in cycles for event in in_cycle(cycle)])


def started(name: str, start: float) -> Estimator:
    """An estimator like `Leaky` that starts elsewhere."""
    (state,) = Leaky.states
    members: dict[str, Any] = {"states": (type(state)("y", -2.0, 2.0, "m", start),), "name": name}
    return type(name, (Leaky,), members)()  # type: ignore[no-any-return]


@pytest.mark.parametrize("config", ["small", "fast"])
def test_every_cycle_of_several_programs(config: str) -> None:
    """The others keep their states in a restart."""
    kinds = [started("a", 1.0), started("b", -1.5), started("c", 0.0)]
    core = build_shared_core([kind.compile() for kind in kinds], config)
    events: list[tuple[int, Reset | None]] = []
    for cycle in range(1, core.schedule.interval + 12):
        restart = Reset(0, cycle, restart=True)
        events += [(0, None), (1, None), (2, None), (cycle % 3, restart)]
        events += [(2, None), (1, None), (0, None), (1 + cycle % 2, Reset(0, cycle))]
    check(core, [*events, (2, None), (1, None), (0, None)])


def test_what_an_idle_bus_carries() -> None:
    """The bench's idle bus shows any register of the second lane; nothing is written there."""
    check(
        core_of("battery", "fast"),
        [event for cycle in range(1, 300, 15) for event in in_cycle(cycle)],
    )


@pytest.mark.parametrize("name", sorted(ALL))
def test_shipped_programs(name: str) -> None:
    """In 20 cycles spread over an update."""
    for config in ("small", "small-1024", "small-2048"):
        try:
            core = core_of(name, config)
            break
        except ScheduleError:
            continue
    spread = np.linspace(1, core.schedule.interval + 8, 20).astype(int)
    check(core, [event for cycle in spread.tolist() for event in in_cycle(cycle)])
