"""Microwords: assembly, images, layout."""

from dataclasses import replace

import pytest

from boresight.gateware.machine import ALL_CONFIGS, CONFIGS, Machine
from boresight.gateware.microcode.assemble import decode, encode
from boresight.gateware.microcode.image import Image
from boresight.gateware.microcode.layout import microword_layout

# -- what an image must be to fit its machine -----------------------------------------------------

MACHINE = CONFIGS["small"]
LAYOUT = microword_layout(MACHINE)


def bit(name: str) -> int:
    return 1 << LAYOUT[name].offset


GOOD = Image(rom=[bit("get"), 0, bit("home")], registers=[0] * 512, tables=[0] * 1536, lengths=(3,))


@pytest.mark.parametrize(
    "change, message",
    [
        ({"rom": [bit("get")] * 16385}, r"^rom must have at most 16384 words, not 16385$"),
        ({"rom": [1 << 54, 0, bit("home")]}, r"^rom\[0\] must be below 0x40000000000000, not \d+$"),
        ({"rom": [0, 0, bit("home")]}, r"^rom must get at least one input word in program 0$"),
        (
            {"rom": [bit("get") | bit("emit"), 0, bit("home")]},
            r"^rom\[0\] must not get and emit in the same cycle$",
        ),
        (
            {"rom": [bit("get"), 0, 0]},
            r"^rom\[2\] must have home = 1, not 0: only the last word of",
        ),
        (
            {"rom": [bit("get") | bit("home"), 0, bit("home")]},
            r"^rom\[0\] must have home = 0, not 1",
        ),
        ({"lengths": (2,)}, r"^lengths must be 3 or more each, not \(2,\)$"),
        ({"lengths": ()}, r"^lengths must be 3 or more each, not \(\)$"),
        ({"lengths": (4,)}, r"^lengths must be 3 or less together, not 4$"),
        ({"registers": [0] * 511}, r"^registers must have 512 words, not 511$"),
        ({"tables": [1 << 32] * 1536}, r"^tables\[0\] must be below 0x100000000, not 4294967296$"),
        ({"registers": [-1] * 512}, r"^registers\[0\] must be below 0x100000000, not -1$"),
        ({"digest": -1}, r"^digest must not be negative, not -1$"),
    ],
)
def test_bad_images(change, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        replace(GOOD, **change).check(MACHINE)


# -- microwords: skew, fields, errors -------------------------------------------------------------

MACHINES = pytest.mark.parametrize("machine", ALL_CONFIGS.values(), ids=ALL_CONFIGS)


@MACHINES
def test_decode_inverts_encode(machine: Machine) -> None:
    fields = {
        f.name: (1 << f.width) - 1 if k % 3 else k % (1 << f.width)
        for k, f in enumerate(machine.fields)
    }
    assert decode(machine, encode(machine, fields)) == fields
