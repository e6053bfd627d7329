"""The register map for others: C header, CMSIS-SVD, Markdown."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable, Sequence

from firmware.names import comment, identifier, literal, unique
from gateware.register_map import Access, Port, Register, RegisterMap
from model.fixed import Format

__all__ = ["to_header", "to_markdown", "to_svd"]

_RULE = "//" + 78 * "-"


# -- C ----------------------------------------------------------------------------------------

_ACCESSORS = """\
// The word in the low {word} bits of a register, sign-extended.
static inline int32_t {name}_reg_signed(uint32_t bits)
{{
    {extend}
}}

// A word as the bits of a register.
static inline uint32_t {name}_reg_bits(int32_t word)
{{
    return (uint32_t)word & UINT32_C({mask:#x});
}}

// Writes a word; address is one of the _ADDR.
static inline void {name}_reg_write(volatile uint32_t *base, uint32_t address, int32_t word)
{{
    base[address] = {name}_reg_bits(word);
}}

// Reads a register that is unsigned: status, updates, build.
static inline uint32_t {name}_reg_read(const volatile uint32_t *base, uint32_t address)
{{
    return base[address] & UINT32_C({mask:#x});
}}

// Reads a register as a signed word.
static inline int32_t {name}_reg_read_signed(const volatile uint32_t *base, uint32_t address)
{{
    return {name}_reg_signed(base[address]);
}}
"""


def to_header(registers: RegisterMap) -> str:
    """A C99 header: addresses, formats, ranges and bits as macros, and accessors.

    It goes together with the header of `firmware.emit_c` for the same program.
    """
    name = identifier(registers.name)
    macro = name.upper()
    names = registers.identifiers
    lines = [
        "/**", f" * @file {name}_registers.h",
        " * @brief Registers of the core: word k of its bus, at byte 4 k of a memory map.", " *",
        f" * Generated from the program \"{comment(registers.name)}\"; do not edit.",
        f" * Program digest: {registers.digest}", " */", "",
        f"#ifndef {macro}_REGISTERS_H", f"#define {macro}_REGISTERS_H", "",
        _RULE, "// Includes", "", "#include <stdint.h>", "", _RULE, "// Definitions", "",
        f"#define {macro}_WORD {registers.word} // bits of a word",
    ]
    for register in registers.registers:
        stem = f"{macro}_{names[register.name].upper()}"
        lines += ["", f"// {comment(_title(register))}", f"#define {stem}_ADDR {register.address}"]
        if register.is_parameter:
            lines += _ranges(stem, register)
        for bit in register.fields:
            lines.append(f"#define {stem}_{bit.name.upper()} UINT32_C({1 << bit.bit:#x}) // "
                         f"{comment(bit.meaning)}{'; write 1 to clear' if bit.clear else ''}")
    lines += ["", "// What the build registers read"]
    lines += [f"#define {macro}_BUILD_{part}_VALUE UINT32_C({value:#010x})"
              for part, value in zip(("LOW", "HIGH"), registers.build, strict=True)]
    for title, kind, ports in (("input", "IN", registers.inputs),
                               ("output", "OUT", registers.outputs)):
        lines += ["", f"// Words of an {title} record: fraction bits"]
        for port, stem in zip(ports, unique([p.name for p in ports], fold=True), strict=True):
            lines.append(f"#define {macro}_{kind}_{stem.upper()}_FRAC {_number(port.frac)}"
                         f"{' // ' + comment(port.unit) if port.unit else ''}")
    lines += ["", _RULE, "// Functions", "", _ACCESSORS.format(
        name=name, word=registers.word, mask=registers.mask, extend=_extension(registers.word))]
    return "\n".join([*lines, "#endif", ""])


def _title(register: Register) -> str:
    """Meaning and unit."""
    return register.meaning + (f" [{register.unit}]" if register.unit else "")


def _number(value: int) -> str:
    return f"({value})" if value < 0 else str(value)


def _ranges(stem: str, register: Register) -> Iterable[str]:
    """Macros of a parameter: format, range and default."""
    assert register.frac is not None
    yield f"#define {stem}_FRAC {_number(register.frac)} // value = word * 2^-FRAC"
    for suffix, word, value in (("MIN", register.minimum, register.low),
                                ("MAX", register.maximum, register.high),
                                ("DEFAULT", register.reset, None)):
        assert word is not None
        real = Format(32, register.frac).real(word) if value is None else value
        unit = f" {comment(register.unit)}" if register.unit else ""
        text = literal(word) if word >= 0 or word == -(2**31) else f"({word})"
        yield f"#define {stem}_{suffix} {text} // {real:.6g}{unit}"


def _extension(word: int) -> str:
    """Body of the sign extension: no conversion whose result C leaves open."""
    if word == 32:
        return ("return bits <= UINT32_C(0x7fffffff) ? (int32_t)bits\n"
                "        : (int32_t)(bits - UINT32_C(0x80000000)) + INT32_MIN;")
    sign = 1 << word - 1
    return (f"return (int32_t)((bits & UINT32_C({2 * sign - 1:#x})) ^ UINT32_C({sign:#x})) - "
            f"INT32_C({sign:#x});")


# -- CMSIS-SVD --------------------------------------------------------------------------------

def to_svd(registers: RegisterMap, *, base_address: int = 0) -> str:
    """A CMSIS-SVD 1.3 description, for a bus that is mapped to memory at ``base_address``."""
    if not isinstance(base_address, int) or not 0 <= base_address < 2**32 or base_address % 4:
        raise ValueError(f"base_address must be a multiple of 4 from 0 to 2^32 - 4, "
                         f"not {base_address!r}")
    name, names = identifier(registers.name), registers.identifiers
    device = ET.Element("device", {
        "schemaVersion": "1.3", "xmlns:xs": "http://www.w3.org/2001/XMLSchema-instance",
        "xs:noNamespaceSchemaLocation": "CMSIS-SVD.xsd"})
    _add(device, vendor="Boresight", name=f"{name}_core", version="1.0",
         description=f"core {registers.name}, program {registers.digest}", addressUnitBits=8,
         width=32, size=32, access="read-write", resetValue="0x0", resetMask="0x0")
    peripheral = ET.SubElement(ET.SubElement(device, "peripherals"), "peripheral")
    _add(peripheral, name=name.upper(), description="parameters and status",
         baseAddress=f"{base_address:#010x}")
    _add(ET.SubElement(peripheral, "addressBlock"), offset="0x0", size="0x1000", usage="registers")
    parent = ET.SubElement(peripheral, "registers")
    known = dict(zip(("build_low", "build_high"), registers.build, strict=True))
    for register in registers.registers:
        element = ET.SubElement(parent, "register")
        _add(element, name=names[register.name].upper(), description=_description(register),
             addressOffset=f"{4 * register.address:#x}", size=32, access=register.access.value)
        reset = known.get(register.name) if register.reset is None else register.reset
        if reset is not None:
            _add(element, resetValue=f"{reset & registers.mask:#x}",
                 resetMask=f"{registers.mask:#x}")
        if register.minimum is not None and register.minimum >= 0:  # SVD has no negative limits
            limits = ET.SubElement(ET.SubElement(element, "writeConstraint"), "range")
            _add(limits, minimum=register.minimum, maximum=register.maximum)
        fields = ET.SubElement(element, "fields")
        if not register.fields:
            _add(ET.SubElement(fields, "field"), name="WORD", bitOffset=0, bitWidth=registers.word)
        for bit in register.fields:
            field = ET.SubElement(fields, "field")
            access = Access.READ_WRITE if bit.clear else Access.READ_ONLY
            _add(field, name=bit.name.upper(), description=bit.meaning, bitOffset=bit.bit,
                 bitWidth=1, access=access.value)
            if bit.clear:
                _add(field, modifiedWriteValues="oneToClear")
    ET.indent(device)
    text = ET.tostring(device, encoding="unicode")
    return f'<?xml version="1.0" encoding="utf-8"?>\n{text}\n'


def _add(parent: ET.Element, **children: object) -> None:
    """Child elements with a text each."""
    for tag, value in children.items():
        ET.SubElement(parent, tag).text = str(value)


def _description(register: Register) -> str:
    """Meaning, format and range in words."""
    text = register.meaning
    if register.frac is not None:
        unit = f" {register.unit}" if register.unit else ""
        text += (f"; value = signed word * 2^{-register.frac}{unit}, {register.low:g} to "
                 f"{register.high:g}")
    return text


# -- Markdown ---------------------------------------------------------------------------------

def to_markdown(registers: RegisterMap) -> str:
    """A page: parameters, registers and their bits, words of the streams."""
    build = " and ".join(f"`{value:#010x}`" for value in registers.build)
    parameters = [(str(r.address), f"`{r.name}`", _format(registers, r.frac), r.unit,
                   f"{r.low:g} to {r.high:g}", f"{_default(r):.6g}", r.meaning)
                  for r in registers.parameters]
    others = [(str(r.address), f"`{r.name}`", r.access.value, r.meaning)
              for r in registers.registers if not r.is_parameter]
    bits = [(f"`{r.name}`", str(f.bit), f"`{f.name}`",
             f.meaning + ("; write 1 to clear" if f.clear else ""))
            for r in registers.registers for f in r.fields]

    def ports(words: Sequence[Port]) -> str:
        return _table(("word", "name", "format", "unit"),
                      [(str(k), f"`{p.name}`", _format(registers, p.frac), p.unit)
                       for k, p in enumerate(words)])

    return "\n".join([
        f"# Registers of the core `{registers.name}`", "",
        f"Program `{registers.digest}`; words of {registers.word} bits. Addresses count words; in "
        "a memory map word k stands at byte 4 k. `fixed<W,I>` has W bits, I of them before the "
        f"binary point, with the sign. `build_low` and `build_high` read {build}.", "",
        "## Parameters", "",
        "Write only. A write waits until the update at work has ended.", "",
        _table(("address", "name", "format", "unit", "range", "default", "meaning"), parameters),
        "## Status", "",
        _table(("address", "name", "access", "meaning"), others),
        _table(("register", "bit", "name", "meaning"), bits),
        "## Input record", "", ports(registers.inputs),
        "## Output record", "", ports(registers.outputs),
    ]).rstrip("\n") + "\n"


def _format(registers: RegisterMap, frac: int | None) -> str:
    assert frac is not None
    return f"`{Format(registers.word, frac)}`"


def _default(register: Register) -> float:
    assert register.frac is not None and register.reset is not None
    return float(Format(32, register.frac).real(register.reset))


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table and a blank line."""
    def line(cells: Sequence[str]) -> str:
        return "| " + " | ".join(c.replace("|", "\\|") for c in cells) + " |"

    return "\n".join([line(head), line(["---"] * len(head)), *map(line, rows), ""])
