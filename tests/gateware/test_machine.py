"""The configurations, in the figures that docs/engine.md gives of them."""

from dataclasses import astuple

import pytest

from boresight.gateware.machine import ALL_CONFIGS, CONFIGS, MACHINES, Machine, machine_named
from boresight.model.errors import InputError

SMALL, FAST = CONFIGS["small"], CONFIGS["fast"]


def test_figures() -> None:
    assert [(m.name, m.lanes) for m in CONFIGS.values()] == [("small", 1), ("fast", 2)]
    assert [m.bank_depth for m in (SMALL, FAST)] == [512, 256]
    assert [m.state_slots for m in (SMALL, FAST)] == [128, 64]
    assert [m.depth for m in (SMALL, FAST)] == [7, 7]
    assert [m.word_bits for m in (SMALL, FAST)] == [54, 101]


def test_who_has_enough_registers() -> None:
    assert SMALL.remedy(129, 128) == "; config small-1024 has more"
    assert SMALL.remedy(256, 128) == "; config small-1024 has more"
    assert SMALL.remedy(257, 128) == "; config small-2048 has more"
    assert FAST.remedy(129, 128) == "; config fast-1024 has more"
    assert ALL_CONFIGS["fast-1024"].remedy(257, 256) == "; config fast-2048 has more"
    for config, wanted in (("small", 513), ("small-1024", 513), ("fast-2048", 513)):
        machine = ALL_CONFIGS[config]
        room = machine.lanes * machine.state_slots
        assert machine.remedy(wanted, room) == "; no configuration has as many"


def test_stages_at_every_depth() -> None:
    """Read, condition, amount, shift, accumulate, limit, write, as docs/engine.md has them."""
    stages = {depth: astuple(Machine("m", 1, depth=depth).stages) for depth in Machine.DEPTHS}
    assert stages == {
        7: (1, 2, 3, 4, 5, 6, 6),
        9: (2, 3, 4, 5, 6, 7, 8),
        10: (2, 3, 4, 6, 7, 8, 9),
        12: (2, 3, 4, 7, 9, 10, 11),
    }
    for name, machine in MACHINES.items():
        assert machine.name == name and machine_named(name) is machine
        assert machine.depth == machine.stages.write + 1


def test_depth_is_part_of_the_name() -> None:
    with pytest.raises(InputError, match="2048, followed by -d9, -d10 or -d12 for another depth"):
        machine_named("small-d7")
