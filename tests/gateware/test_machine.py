"""The configurations, in the figures that docs/engine.md gives of them."""

from dataclasses import astuple

import pytest

from boresight.gateware.machine import (
    ALL_CONFIGS,
    CONFIGS,
    MACHINES,
    Machine,
    at_depth,
    machine_named,
)
from boresight.model.errors import InputError

SMALL, FAST = CONFIGS["small"], CONFIGS["fast"]


def test_figures() -> None:
    assert [(m.name, m.lanes) for m in CONFIGS.values()] == [("small", 1), ("fast", 2)]
    assert [m.bank_depth for m in (SMALL, FAST)] == [512, 256]
    assert [m.state_slots for m in (SMALL, FAST)] == [128, 64]
    assert [m.latency for m in (SMALL, FAST)] == [7, 7]
    assert [m.word_bits for m in (SMALL, FAST)] == [54, 101]


@pytest.mark.parametrize(("words", "bits"), [(1024, 1), (2048, 2)])
def test_more_registers_and_nothing_else(words: int, bits: int) -> None:
    for few in CONFIGS.values():
        many = ALL_CONFIGS[f"{few.name}-{words}"]
        assert (many.register_words, few.register_words) == (words, 512)
        assert many.bank_depth == few.bank_depth << bits
        assert many.state_slots == few.state_slots << bits
        assert (many.lanes, many.latency) == (few.lanes, few.latency)
        wider = {"a_addr", "b_addr", "dest"}
        for a, b in zip(few.fields, many.fields, strict=True):
            assert b.width == a.width + bits * (a.name[:-1] in wider)
            assert (a.name, a.stage, a.meaning) == (b.name, b.stage, b.meaning)
    assert len(ALL_CONFIGS) == 6


@pytest.mark.parametrize("words", [0, 511, 768, 4096])
def test_other_numbers_of_registers_are_refused(words: int) -> None:
    wanted = f"^register_words must be one of 512, 1024, 2048, not {words}$"
    with pytest.raises(ValueError, match=wanted):
        Machine("odd", 1, register_words=words)


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


def test_parameters_have_the_addresses_of_the_bus() -> None:
    room = {name: m.parameter_room for name, m in ALL_CONFIGS.items() if m.lanes == 1}
    assert room == {"small": 256, "small-1024": 512, "small-2048": 512}
    fast = ALL_CONFIGS["fast-2048"]
    assert fast.parameter_room == 256 and fast.parameter_register(191) == 191
    assert [fast.parameter_register(k) for k in (192, 447)] == [1024, 1279]
    assert fast.parameter_address(1279) == 511


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
        assert machine.latency == machine.depth == machine.stages.write + 1
    with pytest.raises(ValueError, match="^depth must be one of 7, 9, 10, 12, not 8$"):
        Machine("odd", 1, depth=8)


def test_depth_is_part_of_the_name() -> None:
    assert at_depth("small", None) == at_depth("small", 7) == "small"
    assert at_depth("fast-1024", 12) == at_depth("fast-1024-d12", 12) == "fast-1024-d12"
    for config, depth in (("small", 8), ("small-d9", 10), ("small-d9", 7), ("tiny", 9)):
        with pytest.raises(InputError, match="^(depth|config): "):
            at_depth(config, depth)
    with pytest.raises(InputError, match="2048, behind it -d9, -d10 or -d12 for another depth"):
        machine_named("small-d7")


def test_memories_side_by_side_hold_a_microword() -> None:
    for machine in ALL_CONFIGS.values():
        for depth in (256, 1024):
            assert machine.rom_columns(depth) == (machine.word_bits,)
    assert ALL_CONFIGS["small-1024"].rom_columns(2048) == (54, 3)
    assert SMALL.rom_columns(2048) == (54,)
    assert FAST.rom_columns(4096) == (101,)
    assert ALL_CONFIGS["fast-1024"].rom_columns(4096) == (107,)
    assert ALL_CONFIGS["fast-2048"].rom_columns(4096) == (113,)  # 5 beyond a multiple of 9


def test_every_field_stands_once_and_works_in_a_stage_of_the_pipeline() -> None:
    for machine in ALL_CONFIGS.values():
        fields = machine.fields
        assert len({f.name for f in fields}) == len(fields)
        assert {f.stage for f in fields} <= set(range(machine.stages.write + 1))
        assert all(f.width > 0 and f.meaning for f in fields)
        first = {f.name.rstrip("0123") for f in fields if f.stage == 0}
        assert first == {"a_addr", "b_addr", "table"}  # what the memories need
    # A result's place is an offset in the lane's own bank: a bit less than a register's address.
    width = {f.name: f.width for f in (*SMALL.fields, *FAST.fields)}
    assert SMALL.register_bits == width["a_addr1"] == width["b_addr0"] == 9
    assert 1 << width["dest1"] == FAST.bank_depth


def test_parameters_fill_three_eighths_of_the_lower_half_then_the_next_bank() -> None:
    assert [SMALL.parameter_register(k) for k in (0, 95, 96, 200)] == [0, 95, 96, 200]
    assert [FAST.parameter_register(k) for k in (0, 47, 48, 200)] == [0, 47, 256, 408]
    large = ALL_CONFIGS["fast-1024"]
    assert [large.parameter_register(k) for k in (0, 95, 96, 200)] == [0, 95, 512, 616]


def test_the_bus_has_the_lower_half_of_every_bank_below_512() -> None:
    for name, wanted in (
        ("small", {0: 0, 255: 255}),
        ("small-1024", {0: 0, 511: 511}),
        ("fast", {127: 127, 256: 256, 383: 383}),
        ("fast-1024", {0: 0, 255: 255, 512: 256, 767: 511}),
    ):
        machine = ALL_CONFIGS[name]
        assert {register: machine.parameter_address(register) for register in wanted} == wanted


@pytest.mark.parametrize("lanes", [0, 3])
def test_one_lane_or_two(lanes: int) -> None:
    with pytest.raises(ValueError, match=f"^lanes must be 1 or 2, not {lanes}$"):
        Machine("odd", lanes)


def test_least_microwords() -> None:
    assert Machine("tiny", 1, rom_words=16).rom_words == 16
    with pytest.raises(ValueError, match="^rom_words must be 16 or more, not 15$"):
        Machine("tiny", 1, rom_words=15)
