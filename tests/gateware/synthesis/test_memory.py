"""Block RAM of a core, counted before synthesis."""

import pytest

from boresight.gateware.machine import ALL_CONFIGS
from boresight.gateware.microcode.image import Image
from boresight.gateware.synthesis.routed import check_memory, core_blocks, least_blocks
from boresight.gateware.synthesis.targets import TARGETS
from boresight.model.errors import InputError

ECP5, SPARTAN6, ICE40 = (
    TARGETS[name].family.memory_shapes for name in ("ecp5-25k", "xc6slx9", "ice40-up5k")
)


def image(machine, words):
    """Microcode in which every bit varies."""
    rom = [k % 2 * ((1 << machine.word_bits) - 1) for k in range(words)]
    return Image(rom, [0] * machine.register_words, [0] * 1536, (words,))


def test_a_memory_is_made_of_columns():
    assert least_blocks(512, 36, ECP5) == 1 and least_blocks(512, 37, ECP5) == 2
    assert least_blocks(2048, 54, ECP5) == 6  # of 2,048 x 9
    assert least_blocks(2049, 9, ECP5) == 2
    assert least_blocks(512, 54, SPARTAN6) == 1.5  # of 512 x 36 and, half a block, 512 x 18
    assert least_blocks(512, 32, ICE40) == 4
    assert least_blocks(512, 0, ECP5) == 0


@pytest.mark.parametrize(
    ("config", "data"),
    [
        *(("small", 5), ("small-1024", 7), ("small-2048", 11)),
        *(("fast", 7), ("fast-1024", 11), ("fast-2048", 19)),
    ],
)
def test_registers_and_tables_take_what_docs_engine_says(config, data):
    machine = ALL_CONFIGS[config]
    assert core_blocks(machine, image(machine, 512), SPARTAN6)[1] == data


def test_bits_that_do_not_vary_take_nothing():
    machine = ALL_CONFIGS["small"]
    whole = image(machine, 512)
    half = Image([w & (1 << 27) - 1 for w in whole.rom], whole.registers, whole.tables, (512,))
    assert core_blocks(machine, whole, ICE40)[0] == 7
    assert core_blocks(machine, half, ICE40)[0] == 4  # with home, 28 bits


def test_a_part_with_too_little_memory_and_the_one_that_would_do():
    machine = ALL_CONFIGS["small"]
    check_memory(machine, image(machine, 2048), TARGETS["xc6slx4"])
    with pytest.raises(InputError) as error:
        check_memory(machine, image(machine, 16384), TARGETS["xc6slx9"])
    assert str(error.value) == (
        "target xc6slx9: wanted 32 RAMB16, block RAM of 18 Kbit, found 53 (21 too many); "
        "16,384 microwords of 54 bits take 48, 512 registers and the tables 5: choose xc6slx45"
    )
    with pytest.raises(InputError, match="another family or a narrower --word, or compile less$"):
        check_memory(machine, image(machine, 16384), TARGETS["ice40-up5k"])
