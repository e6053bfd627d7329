"""What an image must be to fit its machine."""

from dataclasses import replace

import pytest

from boresight.gateware.machine import CONFIGS
from boresight.gateware.microcode.image import Image, rom_pieces
from boresight.gateware.microcode.layout import microword_layout

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
        ({"rom": [bit("get")] * 4097}, r"^rom must have at most 4096 words, not 4097$"),
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
    tables = [7] * 1536
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
