"""Microwords: assembly, images, layout."""

import dataclasses
from dataclasses import replace

import pytest

from boresight.gateware.machine import ALL_CONFIGS, CONFIGS, Machine
from boresight.gateware.microcode.assemble import assemble, decode, encode
from boresight.gateware.microcode.image import Image, rom_pieces
from boresight.gateware.microcode.layout import lane_fields, microword_layout
from boresight.gateware.schedule.allocate import allocate
from boresight.gateware.schedule.scheduler import ScheduleError, schedule
from tests.support.random_program import random_program

# -- what an image must be to fit its machine -----------------------------------------------------

MACHINE = CONFIGS["small"]
LAYOUT = microword_layout(MACHINE)


def bit(name: str) -> int:
    return 1 << LAYOUT[name].offset


GOOD = Image(rom=[bit("get"), 0, bit("home")], registers=[0] * 512, tables=[0] * 1536, lengths=(3,))


def test_a_good_image() -> None:
    GOOD.check(MACHINE)
    assert GOOD.hardware_rom(MACHINE) == ([bit("get") | bit("home")] + [0] * 511,)


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


@pytest.mark.parametrize(
    "words, pieces",
    [
        (1, (512,)),
        (512, (512,)),
        (513, (512, 256)),
        (769, (1024,)),
        (1024, (1024,)),
        (1025, (1024, 256)),
        (1546, (1024, 512, 256)),
        (2560, (2048, 512)),
        (2861, (2048, 1024)),
        (4096, (4096,)),
    ],
)
def test_rom_pieces(words: int, pieces: tuple[int, ...]) -> None:
    assert rom_pieces(words) == pieces


def several() -> Image:
    """Three programs, the second so long that the last begins in another memory."""
    lengths = (3, 600, 4)
    rom = [w for n in lengths for w in (bit("get"), *[bit("shift0")] * (n - 2), bit("home"))]
    return replace(GOOD, rom=rom, lengths=lengths)


def test_several_programs() -> None:
    image = several()
    image.check(MACHINE)
    assert image.bases == (0, 3, 603)
    assert image.program(2) == [bit("get"), bit("shift0"), bit("shift0"), bit("home")]
    first, second = image.hardware_rom(MACHINE)
    assert (len(first), len(second)) == (512, 256)
    whole = first + second
    assert [k for k, w in enumerate(whole) if w & bit("home")] == [0, 600, 604]
    assert not any(whole[607:])
    assert [w & ~bit("home") for w in whole[:607]] == [w & ~bit("home") for w in image.rom]


@pytest.mark.parametrize(
    "at, word, message",
    [
        (602, 0, r"^rom\[602\] must have home = 1, not 0"),
        (3, 1, r"^rom must get at least one input word in program 1$"),
        (604, bit("home"), r"^rom\[604\] must have home = 0, not 1"),
        (605, bit("get") | bit("emit"), r"^rom\[605\] must not get and emit"),
    ],
)
def test_every_program_is_checked(at: int, word: int, message: str) -> None:
    image = several()
    image.rom[at] = word
    with pytest.raises(ValueError, match=message):
        image.check(MACHINE)


def test_join() -> None:
    assert Image.join([GOOD], digest=GOOD.digest) == GOOD
    tables = [7, *[0] * 1535]
    other = replace(several(), tables=tables)
    for images in ([GOOD, other], [other, GOOD]):
        both = Image.join(images, digest=5)
        assert both.rom == images[0].rom + images[1].rom
        assert both.lengths == images[0].lengths + images[1].lengths
        assert both.tables == tables and both.digest == 5
    with pytest.raises(ValueError, match=r"^function tables of the programs must be the same$"):
        Image.join([other, replace(GOOD, tables=[8] * 1536)], digest=0)
    with pytest.raises(ValueError, match=r"^registers of the programs must be common$"):
        Image.join([other, replace(GOOD, registers=[1] * 512)], digest=0)


# -- microwords: skew, fields, errors -------------------------------------------------------------

MACHINES = pytest.mark.parametrize("machine", ALL_CONFIGS.values(), ids=ALL_CONFIGS)


@MACHINES
def test_decode_inverts_encode(machine: Machine) -> None:
    fields = {
        f.name: (1 << f.width) - 1 if k % 3 else k % (1 << f.width)
        for k, f in enumerate(machine.fields)
    }
    assert decode(machine, encode(machine, fields)) == fields


@MACHINES
def test_fields_stand_in_the_word_of_their_stage(machine: Machine) -> None:
    for seed in range(8):
        p = random_program(seed)
        s = schedule(p, machine)
        a = allocate(s)
        where = a.addresses()
        image = assemble(s, a)
        words = [decode(machine, w) for w in image.rom]
        assert len(words) == s.length and image.lengths == (s.length,)
        for slot in s.slots:
            k = slot.lane
            assert words[slot.cycle][f"a_addr{k}"] == where[slot.a]
            assert words[slot.cycle + 1][f"cap_flag{k}"] == slot.cap_flag
            if slot.emit is not None:
                assert words[slot.cycle + 1]["emit"] == 1
                assert words[slot.cycle + 1]["emit_last"] == (slot.emit == len(p.outputs) - 1)
            if slot.op is None:
                continue
            op = s.program.ops[slot.op]
            assert words[slot.cycle + 5][f"first{k}"] == slot.first
            assert words[slot.cycle + 6][f"we{k}"] == slot.last
            if slot.last:
                assert words[slot.cycle + 6][f"dest{k}"] == where[op.dest] % machine.bank_depth
            if slot.term is not None:
                assert words[slot.cycle + 3][f"shift{k}"] == op.terms[slot.term].shift
        assert [c for c, w in enumerate(words) if w["get"]] == list(s.gets)
        assert [c for c, w in enumerate(words) if w["get_last"]] == [s.gets[-1]]
        assert [c for c, w in enumerate(words) if w["home"]] == [s.length - 1]


@MACHINES
def test_digest_is_the_programs(machine: Machine) -> None:
    p = random_program(1)
    s = schedule(p, machine)
    assert f"{assemble(s, allocate(s)).digest:064x}" == p.digest


def test_a_table_memory_that_is_not_full() -> None:
    s = schedule(random_program(1), CONFIGS["small"])
    few = dataclasses.replace(s.program, table_memory=(7, -1))
    tables = assemble(dataclasses.replace(s, program=few), allocate(s)).tables
    assert tables == [7, (1 << 32) - 1, *[0] * 1534]


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


# -- the microword as a layout: the machine's fields, bit by bit ----------------------------------


@pytest.mark.parametrize("config", sorted(CONFIGS))
def test_layout_is_that_of_the_machine(config: str) -> None:
    machine = CONFIGS[config]
    layout = microword_layout(machine)
    assert layout.size == machine.word_bits
    offset = 0
    for f in machine.fields:
        assert (layout[f.name].offset, layout[f.name].width) == (offset, f.width)
        offset += f.width


def test_fields_of_a_lane() -> None:
    machine = CONFIGS["fast"]
    fields = lane_fields(machine)
    assert {f"{name}0" for name in fields} | {f"{name}1" for name in fields} == {
        f.name for f in machine.fields if f.name[-1] in "01"
    }
    assert {**fields, "dest": 0} == {**lane_fields(CONFIGS["small"]), "dest": 0}
    assert fields["shift"].stage == 3 and fields["dest"].width == 8
    assert "get" not in fields
