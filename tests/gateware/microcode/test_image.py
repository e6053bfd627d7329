"""Microwords: assembly, images, layout."""

from dataclasses import replace

import pytest

from boresight.gateware.machine import ALL_CONFIGS, CONFIGS, Machine
from boresight.gateware.microcode.image import Image, decode, encode

# -- what an image must be to fit its machine -----------------------------------------------------

MACHINE = CONFIGS["small"]


def bit(name: str) -> int:
    return encode(MACHINE, {name: 1})


GOOD = Image(rom=[bit("get"), 0, bit("home")], registers=[0] * 512, tables=[0] * 1536, lengths=(3,))


@pytest.mark.parametrize(
    "change",
    [
        {"rom": [0, 0, bit("home")]},
        {"rom": [bit("get") | bit("emit"), 0, bit("home")]},
        {"rom": [bit("get"), 0, 0]},
        {"rom": [bit("get") | bit("home"), 0, bit("home")]},
        {"lengths": (2,)},
        {"rom": [bit("get"), 0, bit("home")] * 2, "restarts": (3,)},
    ],
)
def test_bad_images(change) -> None:
    GOOD.check(MACHINE)
    with pytest.raises(ValueError, match=r"^microcode from word [03] on breaks docs/engine\.md$"):
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
