"""Block RAM that the memories of a core take, counted before any synthesis."""

from __future__ import annotations

from collections.abc import Mapping
from functools import reduce
from operator import and_, or_

from boresight.gateware.machine import Machine
from boresight.gateware.microcode.image import Image
from boresight.gateware.synthesis.family import Target
from boresight.gateware.synthesis.targets import smallest
from boresight.gateware.texts.memories import data_memories
from boresight.model.errors import InputError

#: Ways to use a block: (words, bits) -> blocks, halves where a block can be divided.
Shapes = Mapping[tuple[int, int], float]


def least_blocks(words: int, bits: int, shapes: Shapes) -> float:
    """Fewest blocks for a memory, made of columns of blocks of one shape each."""
    columns = [(width, each * -(-words // depth)) for (depth, width), each in shapes.items()]
    cost = [0.0]
    for remaining in range(1, bits + 1):
        cost.append(min(each + cost[max(0, remaining - width)] for width, each in columns))
    return cost[bits]


def core_blocks(machine: Machine, image: Image, shapes: Shapes) -> tuple[float, float]:
    """Blocks of the microcode, and of registers and tables; at least.

    Bits that are the same in all words of a memory of microcode are none of its columns.
    """
    microcode = 0.0
    for words in image.hardware_rom(machine):
        varying = reduce(or_, words) & ~reduce(and_, words)
        microcode += least_blocks(len(words), varying.bit_count(), shapes)
    data = data_memories(machine, image).values()
    word = machine.arithmetic.word
    return microcode, sum(least_blocks(len(words), word, shapes) for words in data)


def check_memory(machine: Machine, image: Image, target: Target) -> None:
    """Raise InputError, with the core's need, if a part has too little block RAM."""
    microcode, data = core_blocks(machine, image, target.family.memory_shapes)
    device = target.device
    room, total = device.capacity(device.memory), microcode + data
    if total <= room:
        return
    fits = smallest(target, lambda part: part.capacity(part.memory) >= total)
    raise InputError.at(
        f"target {target.name}",
        wanted=f"{room} {device.unit(device.memory)}",
        found=f"{total:g} ({total - room:g} too many)",
        fix=f"{len(image.rom):,} microwords of {machine.word_bits} bits take {microcode:g}, "
        f"{machine.register_words:,} registers and the tables {data:g}: "
        f"choose {fits or 'another family, or compile less'}",
    )
