"""Microwords: assembly, images, layout."""

import dataclasses
from dataclasses import replace

import pytest

from boresight.gateware.machine import ALL_CONFIGS, CONFIGS, Machine
from boresight.gateware.microcode.assemble import assemble, decode, encode
from boresight.gateware.microcode.image import Image
from boresight.gateware.microcode.layout import microword_layout
from boresight.gateware.schedule.allocate import allocate
from boresight.gateware.schedule.scheduler import ScheduleError, schedule
from tests.support.random_program import random_program

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


def test_errors() -> None:
    machine = CONFIGS["small"]
    with pytest.raises(ValueError, match=r"^field shift0 must be 0 to 31, not 32$"):
        encode(machine, {"shift0": 32})
    with pytest.raises(ValueError, match=r"^fields must be those of the machine, not \['x'\]$"):
        encode(machine, {"x": 0})
    with pytest.raises(ValueError, match=r"^word must have \d+ bits, not more$"):
        decode(machine, 1 << machine.word_bits)
    s = schedule(random_program(1), machine)
    a = allocate(s)
    with pytest.raises(ScheduleError, match=r"falls behind the program's \d+ words$"):
        assemble(dataclasses.replace(s, length=s.length - 1), a)
    long = dataclasses.replace(s.program, table_memory=(0,) * 2048)
    with pytest.raises(ScheduleError, match=r"table memory must be 1536 words or fewer, not 2048"):
        assemble(dataclasses.replace(s, program=long), a)
