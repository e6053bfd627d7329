"""What an image must be to fit its machine."""

from dataclasses import replace

import pytest

from gateware.image import Image
from gateware.machine import CONFIGS
from gateware.microword import lane_fields, microword_layout

MACHINE = CONFIGS["small"]
LAYOUT = microword_layout(MACHINE)


def bit(name: str) -> int:
    return 1 << LAYOUT[name].offset


GOOD = Image(rom=[bit("get"), 0, bit("home")], registers=[0] * 512, tables=[0] * 1536, length=3)


def test_a_good_image() -> None:
    GOOD.check(MACHINE)
    assert GOOD.rom_early_home(MACHINE) == [bit("get"), bit("home")] + [0] * 510


@pytest.mark.parametrize("change, message", [
    ({"rom": [bit("get")] * 513}, r"^rom must have at most 512 words, not 513$"),
    ({"rom": [1 << 55, 0, bit("home")]}, r"^rom\[0\] must be below 0x80000000000000, not \d+$"),
    ({"rom": [0, 0, bit("home")]}, r"^rom must get at least one input word$"),
    ({"rom": [bit("get") | bit("emit"), 0, bit("home")]},
     r"^rom\[0\] must not get and emit in the same cycle$"),
    ({"rom": [bit("get"), 0, 0]}, r"^rom\[2\] must have home = 1, not 0: only the last word of"),
    ({"rom": [bit("get") | bit("home"), 0, bit("home")]}, r"^rom\[0\] must have home = 0, not 1"),
    ({"length": 1}, r"^length must be 2 to 3, not 1$"),
    ({"length": 4}, r"^length must be 2 to 3, not 4$"),
    ({"registers": [0] * 511}, r"^registers must have 512 words, not 511$"),
    ({"tables": [1 << 32] * 1536}, r"^tables\[0\] must be below 0x100000000, not 4294967296$"),
    ({"registers": [-1] * 512}, r"^registers\[0\] must be below 0x100000000, not -1$"),
    ({"digest": -1}, r"^digest must not be negative, not -1$"),
])
def test_bad_images(change, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        replace(GOOD, **change).check(MACHINE)


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
    fields = lane_fields(CONFIGS["fast"])
    assert fields["shift"].stage == 3 and fields["dest"].width == 8
    assert "get" not in fields
