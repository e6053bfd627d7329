"""A few RV32I instructions as words, so that the soft core runs programs without a compiler.

One instruction or ``label:`` a line, registers ``x0`` to ``x31``, operands apart by spaces::

    li x1 0x80000000      always two words
    lw x2 8(x1)           lw lb lbu lh lhu sw sb sh
    addi x2 x2 -1         addi andi; add sub
    bne x2 x0 label       beq bne blt bltu; j label; jr x1
    csrw 0x305 x1         csrw csrs; csrr x1 0x342
    mret, .word 0x500F
"""

from __future__ import annotations

import re
from collections.abc import Mapping

#: funct3 of what has an opcode in common.
_LOADS = {"lb": 0, "lh": 1, "lw": 2, "lbu": 4, "lhu": 5}
_STORES = {"sb": 0, "sh": 1, "sw": 2}
_BRANCHES = {"beq": 0, "bne": 1, "blt": 4, "bltu": 6}
_IMMEDIATE = {"addi": 0, "andi": 7}
_REGISTERS = {"add": 0, "sub": 0x20}


def assemble(text: str) -> list[int]:
    """Words of a program that begins at address 0."""
    lines = [line for raw in text.splitlines() if (line := raw.split("#")[0].strip())]
    labels: dict[str, int] = {}
    address = 0
    for line in lines:
        if line.endswith(":"):
            labels[line[:-1]] = address
        else:
            address += 8 if line.split()[0] == "li" else 4
    words: list[int] = []
    for line in lines:
        if not line.endswith(":"):
            words += _encode(line.split(), 4 * len(words), labels)
    return words


def image(words: list[int]) -> str:
    """The memory's file."""
    return "".join(f"{word:08x}\n" for word in words)


def _encode(parts: list[str], here: int, labels: Mapping[str, int]) -> list[int]:
    name, *values = parts

    def number(text: str) -> int:
        return labels[text] if text in labels else int(text, 0)

    def register(text: str) -> int:
        return int(text.removeprefix("x"))

    def at(text: str) -> tuple[int, int]:
        match = re.fullmatch(r"(-?\w+)\((x\d+)\)", text)
        assert match is not None, text
        offset, base = match.groups()
        return int(offset, 0) & 0xFFF, register(base)

    if name == ".word":
        return [number(values[0])]
    if name == "mret":
        return [0x30200073]
    if name == "li":
        rd, value = register(values[0]), number(values[1]) & 0xFFFF_FFFF
        upper = (value + 0x800) & 0xFFFF_F000
        return [upper | rd << 7 | 0x37, (value & 0xFFF) << 20 | rd << 15 | rd << 7 | 0x13]
    if name in _LOADS:
        offset, base = at(values[1])
        return [offset << 20 | base << 15 | _LOADS[name] << 12 | register(values[0]) << 7 | 0x03]
    if name in _STORES:
        offset, base = at(values[1])
        upper, lower = offset >> 5, offset & 31
        source = register(values[0]) << 20 | base << 15
        return [upper << 25 | source | _STORES[name] << 12 | lower << 7 | 0x23]
    if name in _IMMEDIATE:
        rd, rs = register(values[0]), register(values[1])
        word = (number(values[2]) & 0xFFF) << 20 | rs << 15 | _IMMEDIATE[name] << 12
        return [word | rd << 7 | 0x13]
    if name in _REGISTERS:
        rd, a, b = (register(r) for r in values)
        return [_REGISTERS[name] << 25 | b << 20 | a << 15 | rd << 7 | 0x33]
    if name in _BRANCHES:
        a, b, far = register(values[0]), register(values[1]), number(values[2]) - here
        sides = (far >> 12 & 1) << 31 | (far >> 5 & 63) << 25 | (far >> 1 & 15) << 8
        return [sides | (far >> 11 & 1) << 7 | b << 20 | a << 15 | _BRANCHES[name] << 12 | 0x63]
    if name == "j":
        far = number(values[0]) - here
        sides = (far >> 20 & 1) << 31 | (far >> 1 & 0x3FF) << 21 | (far >> 11 & 1) << 20
        return [sides | (far >> 12 & 0xFF) << 12 | 0x6F]
    if name == "jr":
        return [register(values[0]) << 15 | 0x67]
    if name in ("csrw", "csrs"):
        return [
            number(values[0]) << 20
            | register(values[1]) << 15
            | (1 + (name == "csrs")) << 12
            | 0x73
        ]
    if name == "csrr":
        return [number(values[1]) << 20 | 2 << 12 | register(values[0]) << 7 | 0x73]
    raise ValueError(f"no such instruction: {' '.join(parts)}")
