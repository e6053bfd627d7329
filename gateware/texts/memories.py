"""The memories in the Verilog of a core, read back and compared with its image."""

from __future__ import annotations

import re
from collections.abc import Sequence

from boresight.gateware.machine import Machine
from boresight.gateware.microcode.image import Image, encode
from boresight.model.words.terms import Refuted

_WORD = re.compile(r"(?m)^\s+(\w+)\[(\d+)\] = \d+'(h|d)([0-9a-f]+);$")
_ROM = re.compile(r"rom(\d+)(?:_(\d+))?")


def check_memories(machine: Machine, image: Image, verilog: str) -> None:
    """Raise Refuted unless the memories of ``verilog`` hold the image's words.

    The layout is that of `docs/engine.md`: every lane has copies of every bank for both operands,
    the tables follow the registers of operand b or have memories of their own, ``home`` stands
    `Machine.prefetch` words earlier than in the image, and ``bases`` are `Image.starts`.
    """
    memories: dict[str, list[int]] = {}
    for name, at, base, digits in _WORD.findall(verilog):
        words = memories.setdefault(name, [])
        if int(at) != len(words):
            raise Refuted(f"core.v: word {at} of memory {name} follows word {len(words) - 1}")
        words.append(int(digits, 16 if base == "h" else 10))
    roms = {name: memories.pop(name) for name in list(memories) if _ROM.fullmatch(name)}
    wanted = data_memories(machine, image) | {"bases": image.starts}
    for name in sorted(wanted.keys() | memories.keys()):
        _compare(name, memories.get(name, []), wanted.get(name, []))
    _check_rom(machine, image, roms)


def data_memories(machine: Machine, image: Image) -> dict[str, list[int]]:
    """Words of the register and table memories of a core, every copy, by name."""
    depth, block, lanes = machine.bank_depth, machine.TABLE_BLOCK, range(machine.lanes)
    registers, tables = image.registers, image.tables
    if machine.lanes == 1:
        shared = 4 * block - len(registers)
        out = {
            **{"a0": registers, "b0": registers + tables[:shared]},
            **{"tables0": tables[shared : 2 * block], "tables2": tables[max(shared, 2 * block) :]},
        }
        return {name: words for name, words in out.items() if words}
    out = {
        f"{side}{lane}_bank{bank}": registers[bank * depth : (bank + 1) * depth]
        for side in "ab"
        for lane in lanes
        for bank in lanes
    }
    return out | {"tables0": tables[: 2 * block], "tables1": tables[2 * block :]}


def _check_rom(machine: Machine, image: Image, roms: dict[str, list[int]]) -> None:
    """Compare the microwords, with ``home`` where the hardware expects it."""
    pieces: dict[int, list[int]] = {}
    for name, column in sorted(roms.items()):
        match = _ROM.fullmatch(name)
        assert match is not None
        piece, high = int(match[1]), match[2]
        columns = machine.rom_columns(len(column))
        shift = sum(columns[: int(high)]) if high else 0
        before = pieces.setdefault(piece, [0] * len(column))
        pieces[piece] = [a | b << shift for a, b in zip(before, column, strict=True)]
    words = [word for k in sorted(pieces) for word in pieces[k]]
    home = encode(machine, {"home": 1})
    returns = {end - 1 - machine.prefetch for end in image.ends}
    wanted = [w & ~home | (k in returns) * home for k, w in enumerate(image.rom)]
    _compare("rom", words[: len(wanted)], wanted)
    _compare("rom, behind the programs,", words[len(wanted) :], [0] * (len(words) - len(wanted)))


def _compare(name: str, words: Sequence[int], wanted: Sequence[int]) -> None:
    if len(words) != len(wanted):
        raise Refuted(f"core.v: memory {name} must have {len(wanted)} words, not {len(words)}")
    for k, (word, expected) in enumerate(zip(words, wanted, strict=True)):
        if word != expected:
            raise Refuted(f"core.v: word {k} of memory {name} must be {expected:#x}, not {word:#x}")
