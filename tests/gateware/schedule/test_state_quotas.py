"""Shares of the state registers."""

from dataclasses import replace

import pytest

from boresight.gateware.machine import CONFIGS
from boresight.gateware.schedule.slots import ScheduleError
from boresight.gateware.schedule.state_quotas import state_quotas
from tests.support.random_program import random_program

PROGRAM = random_program(1, n_ops=1, n_states=1)


def programs(*counts: int):
    return [replace(PROGRAM, states=PROGRAM.states * n) for n in counts]


@pytest.mark.parametrize("config", sorted(CONFIGS))
@pytest.mark.parametrize(
    "counts",
    [
        (1,),
        (128,),
        (127,),
        (0, 0),
        (1, 1, 1),
        (16, 20, 45, 47),
        (16, 15, 39, 44),
        (1, 126, 1),
        (64, 63),
        (3, 0, 5, 7, 9),
    ],
)
def test_everybody_finds_room(config: str, counts: tuple[int, ...]) -> None:
    machine = CONFIGS[config]
    rooms = state_quotas(programs(*counts), machine)
    assert len(rooms) == len(counts)
    for room, count in zip(rooms, counts, strict=True):
        assert len(room) == machine.lanes and sum(room) >= count
        assert max(room) - min(room) <= 1
    for lane in range(machine.lanes):
        assert sum(room[lane] for room in rooms) <= machine.state_slots


def test_a_single_program_has_it_all() -> None:
    assert state_quotas(programs(16), CONFIGS["fast"]) == [(64, 64)]
    assert state_quotas(programs(16), CONFIGS["small"]) == [(128,)]


def test_too_many() -> None:
    name = PROGRAM.name
    with pytest.raises(
        ScheduleError,
        match=rf"^{name} 100, {name} 29: 129 states, the small machine has "
        r"room for 128; config small-1024 has more$",
    ):
        state_quotas(programs(100, 29), CONFIGS["small"])
