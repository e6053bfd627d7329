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


def test_twice_the_registers_and_nothing_else() -> None:
    large = [m for m in ALL_CONFIGS.values() if m not in CONFIGS.values()]
    assert [m.name for m in large] == ["small-1024", "fast-1024"]
    for few, many in zip(CONFIGS.values(), large, strict=True):
        assert (many.register_words, few.register_words) == (1024, 512)
        assert many.bank_depth == 2 * few.bank_depth
        assert many.state_slots == 2 * few.state_slots
        assert (many.lanes, many.latency) == (few.lanes, few.latency)
        wider = {"a_addr", "b_addr", "dest"}
        for a, b in zip(few.fields(), many.fields(), strict=True):
            assert b.width == a.width + (a.name[:-1] in wider)
            assert (a.name, a.stage, a.meaning) == (b.name, b.stage, b.meaning)


@pytest.mark.parametrize("words", [0, 511, 768, 2048])
def test_512_registers_or_1024(words: int) -> None:
    with pytest.raises(ValueError, match=f"^register_words must be 512 or 1024, not {words}$"):
        Machine("odd", 1, register_words=words)


def test_who_has_more_registers() -> None:
    assert SMALL.remedy == "; config small-1024 has more"
    assert FAST.remedy == "; config fast-1024 has more"
    assert ALL_CONFIGS["small-1024"].remedy == ALL_CONFIGS["fast-1024"].remedy == ""


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


def test_memories_side_by_side_hold_a_microword() -> None:
    for machine in ALL_CONFIGS.values():
        for depth in (256, 1024):
            assert machine.rom_columns(depth) == (machine.word_bits,)
    assert ALL_CONFIGS["small-1024"].rom_columns(2048) == (54, 3)
    assert SMALL.rom_columns(2048) == (54,)
    assert FAST.rom_columns(4096) == (101,)
    assert ALL_CONFIGS["fast-1024"].rom_columns(4096) == (107,)


def test_every_field_stands_once_and_works_in_a_stage_of_the_pipeline() -> None:
    for machine in ALL_CONFIGS.values():
        fields = machine.fields()
        assert len({f.name for f in fields}) == len(fields)
        assert {f.stage for f in fields} <= set(range(machine.stages.write + 1))
        assert all(f.width > 0 and f.meaning for f in fields)
    # A result's place is an offset in the lane's own bank: a bit less than a register's address.
    width = {f.name: f.width for f in (*SMALL.fields(), *FAST.fields())}
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
