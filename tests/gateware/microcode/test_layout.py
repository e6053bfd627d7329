"""The microword as a layout: the machine's fields, bit by bit."""

import pytest

from boresight.gateware.machine import CONFIGS
from boresight.gateware.microcode.layout import lane_fields, microword_layout


@pytest.mark.parametrize("config", sorted(CONFIGS))
def test_layout_is_that_of_the_machine(config: str) -> None:
    machine = CONFIGS[config]
    layout = microword_layout(machine)
    assert layout.size == machine.word_bits
    offset = 0
    for f in machine.fields():
        assert (layout[f.name].offset, layout[f.name].width) == (offset, f.width)
        offset += f.width


def test_fields_of_a_lane() -> None:
    machine = CONFIGS["fast"]
    fields = lane_fields(machine)
    assert {f"{name}0" for name in fields} | {f"{name}1" for name in fields} == {
        f.name for f in machine.fields() if f.name[-1] in "01"
    }
    assert {**fields, "dest": 0} == {**lane_fields(CONFIGS["small"]), "dest": 0}
    assert fields["shift"].stage == 3 and fields["dest"].width == 8
    assert "get" not in fields
