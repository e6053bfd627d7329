"""The register map as a C99 header."""

from __future__ import annotations

from collections.abc import Iterable

from boresight.gateware.registers.model import Register, RegisterMap
from boresight.model.tools.c_names import comment, identifier, unique
from boresight.model.words.fixed import Format

__all__ = ["to_header"]

_RULE = "//" + 78 * "-"

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
    return base[address] & UINT32_C({read_mask:#x});
}}

// Reads a register as a signed word.
static inline int32_t {name}_reg_read_signed(const volatile uint32_t *base, uint32_t address)
{{
    return {name}_reg_signed(base[address]);
}}
"""

_FIELDS = """
// width bits (1 to 32) of a register from bit lsb on.
static inline uint32_t {name}_reg_field(uint32_t bits, unsigned lsb, unsigned width)
{{
    return bits >> lsb & UINT32_C(0xffffffff) >> (32U - width);
}}

// The same as a signed number.
static inline int32_t {name}_reg_field_signed(uint32_t bits, unsigned lsb, unsigned width)
{{
    uint32_t value = {name}_reg_field(bits, lsb, width);
    uint32_t sign = UINT32_C(1) << (width - 1U);
    return value < sign ? (int32_t)value : (int32_t)(value - sign) + (-1 - (int32_t)(sign - 1U));
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
        "/**",
        " * @file registers.h",
        f" * @brief Registers of the {registers.title}: word k of its bus, at byte 4 k of a memory "
        "map.",
        " *",
        " * Generated from "
        + ", ".join(f'"{comment(s.program)}"' for s in registers.streams)
        + "; do not edit.",
        f" * Digest: {registers.digest}",
        " */",
        "",
        f"#ifndef {macro}_REGISTERS_H",
        f"#define {macro}_REGISTERS_H",
        "",
        _RULE,
        "// Includes",
        "",
        "#include <stdint.h>",
        "",
        _RULE,
        "// Definitions",
        "",
        f"#define {macro}_WORD {registers.word} // bits of a word",
    ]
    for register in registers.registers:
        lines += _register(f"{macro}_{names[register.address].upper()}", register)
    lines += ["", "// What the build registers read"]
    lines += [
        f"#define {macro}_BUILD_{part}_VALUE UINT32_C({value:#010x})"
        for part, value in zip(("LOW", "HIGH"), registers.build, strict=True)
    ]
    lines += _streams(registers, macro)
    lines += [
        "",
        _RULE,
        "// Functions",
        "",
        _ACCESSORS.format(
            name=name,
            word=registers.word,
            mask=registers.mask,
            extend=_extension(registers.word),
            read_mask=max(map(registers.mask_of, registers.registers)),
        ),
    ]
    if any(r.width for r in registers.registers):
        lines.append(_FIELDS.format(name=name))
    return "\n".join([*lines, "#endif", "", _RULE, "// End of file", ""])


def _register(stem: str, register: Register) -> Iterable[str]:
    """Macros of a register."""
    yield from ("", f"// {comment(_title(register))}", f"#define {stem}_ADDR {register.address}")
    yield from _ranges(stem, register) if register.is_parameter else _shape(stem, register)
    for bit in register.fields:
        name = f"{stem}_{bit.name.upper()}"
        clear = "; write 1 to clear" if bit.clear else ""
        yield f"#define {name} UINT32_C({bit.mask:#x}) // {comment(bit.meaning)}{clear}"
        if bit.width > 1:
            yield f"#define {name}_LSB {bit.bit}"
            yield f"#define {name}_WIDTH {bit.width}"
    for k, choice in enumerate(unique(register.names, taken=("ADDR", "WIDTH", "DEFAULT"))):
        yield f"#define {stem}_{choice.upper()} {k}"


def _streams(registers: RegisterMap, macro: str) -> Iterable[str]:
    """Fraction bits of the words of every record."""
    taken = set(registers.identifiers.values())
    for streams in registers.streams:
        several = len(registers.streams) > 1
        of = f"{identifier(streams.program)}_" if several else ""
        program = f" of {comment(streams.program)}" if several else ""
        for title, kind, ports in (
            ("input", "IN", streams.inputs),
            ("output", "OUT", streams.outputs),
        ):
            yield from ("", f"// Words of an {title} record{program}: fraction bits")
            stems = unique((f"{of}{kind}_{port.name}" for port in ports), taken=taken)
            taken.update(stems)
            for port, stem in zip(ports, stems, strict=True):
                unit = f" // {comment(port.unit)}" if port.unit else ""
                yield f"#define {macro}_{stem.upper()}_FRAC {_number(port.frac)}{unit}"


def _title(register: Register) -> str:
    """Meaning and unit."""
    return register.meaning + (f" [{register.unit}]" if register.unit else "")


def _shape(stem: str, register: Register) -> Iterable[str]:
    """Macros of another register: bits, format, value."""
    if register.width is not None:
        signed = "; signed: read with _reg_field_signed" if register.signed else ""
        yield f"#define {stem}_WIDTH {register.width} // bits{signed}"
    if register.frac is not None:
        yield f"#define {stem}_FRAC {_number(register.frac)} // value = word * 2^-FRAC"
    if register.reset is not None:
        yield f"#define {stem}_DEFAULT UINT32_C({register.reset:#x}) // after power-up"


def _number(value: int) -> str:
    return f"({value})" if value < 0 else str(value)


def _ranges(stem: str, register: Register) -> Iterable[str]:
    """Macros of a parameter: format, range and default."""
    assert register.frac is not None
    yield f"#define {stem}_FRAC {_number(register.frac)} // value = word * 2^-FRAC"
    for suffix, word, value in (
        ("MIN", register.minimum, register.low),
        ("MAX", register.maximum, register.high),
        ("DEFAULT", register.reset, None),
    ):
        assert word is not None
        real = Format(32, register.frac).real(word) if value is None else value
        unit = f" {comment(register.unit)}" if register.unit else ""
        text = "INT32_MIN" if word == -(2**31) else _number(word)
        yield f"#define {stem}_{suffix} {text} // {real:.6g}{unit}"


def _extension(word: int) -> str:
    """Body of the sign extension: no conversion whose result C leaves open."""
    if word == 32:
        return (
            "return bits <= UINT32_C(0x7fffffff) ? (int32_t)bits\n"
            "        : (int32_t)(bits - UINT32_C(0x80000000)) + INT32_MIN;"
        )
    sign = 1 << word - 1
    return (
        f"return (int32_t)((bits & UINT32_C({2 * sign - 1:#x})) ^ UINT32_C({sign:#x})) - "
        f"INT32_C({sign:#x});"
    )
