"""The two configurations, in the figures that docs/engine.md gives of them."""

import pytest

from boresight.gateware.machine import CONFIGS, Machine

SMALL, FAST = CONFIGS["small"], CONFIGS["fast"]


def test_figures() -> None:
    assert [(m.name, m.lanes) for m in CONFIGS.values()] == [("small", 1), ("fast", 2)]
    assert [m.bank_depth for m in (SMALL, FAST)] == [512, 256]
    assert [m.state_slots for m in (SMALL, FAST)] == [128, 64]
    assert [m.latency for m in (SMALL, FAST)] == [7, 7]
    assert [m.word_bits for m in (SMALL, FAST)] == [54, 101]


def test_every_field_stands_once_and_works_in_a_stage_of_the_pipeline() -> None:
    for machine in CONFIGS.values():
        fields = machine.fields()
        assert len({f.name for f in fields}) == len(fields)
        assert {f.stage for f in fields} <= set(range(machine.STAGE_WRITE + 1))
        assert all(f.width > 0 and f.meaning for f in fields)
    # A result's place is an offset in the lane's own bank: a bit less than a register's address.
    width = {f.name: f.width for f in (*SMALL.fields(), *FAST.fields())}
    assert SMALL.register_bits == width["a_addr1"] == width["b_addr0"] == 9
    assert 1 << width["dest1"] == FAST.bank_depth


def test_parameters_fill_three_eighths_of_the_lower_half_then_the_next_bank() -> None:
    assert [SMALL.parameter_register(k) for k in (0, 95, 96, 200)] == [0, 95, 96, 200]
    assert [FAST.parameter_register(k) for k in (0, 47, 48, 200)] == [0, 47, 256, 408]


@pytest.mark.parametrize("lanes", [0, 3])
def test_one_lane_or_two(lanes: int) -> None:
    with pytest.raises(ValueError, match=f"^lanes must be 1 or 2, not {lanes}$"):
        Machine("odd", lanes)


def test_least_microwords() -> None:
    assert Machine("tiny", 1, rom_words=16).rom_words == 16
    with pytest.raises(ValueError, match="^rom_words must be 16 or more, not 15$"):
        Machine("tiny", 1, rom_words=15)
