"""The register map as a Markdown page."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from boresight.gateware.registers.model import Port, Register, RegisterMap
from boresight.model.words.fixed import Format

__all__ = ["to_markdown"]


_INTRODUCTION = """\
{programs} `{digest}`; words of {word} bits. Addresses count words; in a memory map word k stands \
at byte 4 k. `fixed<W,I>` has W bits, I of them before the binary point, with the sign. \
`build_low` and `build_high` read {build}.
"""

_CHOICE = (
    "A write of `program` waits until the update at work has ended; a number without a program is "
    "ignored. Each program keeps its states while others run.",
    "",
)


def to_markdown(registers: RegisterMap) -> str:
    """A page: parameters, registers and their bits, words of the streams."""
    is_core = registers.title == "core"
    choices = _choices(registers)
    page = [
        f"# Registers of the {registers.title} `{registers.name}`",
        "",
        _INTRODUCTION.format(
            programs="Program" if len(registers.streams) == 1 else "Programs",
            digest=registers.digest,
            word=registers.word,
            build=" and ".join(f"`{value:#010x}`" for value in registers.build),
        ),
        "## Parameters",
        "",
        "Write only. A write waits until the update at work has ended.",
        "",
        _parameters(registers),
        "## Status" if is_core else "## Status, settings, results, counters",
        "",
        _others(registers),
        _fields(registers),
        *([_table(("register", "value", "name"), choices)] if choices else []),
        *(_CHOICE if is_core and choices else []),
    ]
    for streams in registers.streams:
        of = f" of `{streams.program}`" if len(registers.streams) > 1 else ""
        page += [f"## Input record{of}", "", _ports(registers, streams.inputs)]
        page += [f"## Output record{of}", "", _ports(registers, streams.outputs)]
    return "\n".join(page).rstrip("\n") + "\n"


def _parameters(registers: RegisterMap) -> str:
    return _table(
        ("address", "name", "format", "unit", "range", "default", "meaning"),
        (
            (
                str(r.address),
                f"`{r.name}`",
                _format(registers, r.frac),
                r.unit,
                f"{r.low:g} to {r.high:g}",
                f"{_default(r):.6g}",
                r.meaning,
            )
            for r in registers.parameters
        ),
    )


def _others(registers: RegisterMap) -> str:
    """All other registers."""
    return _table(
        ("address", "name", "access", "format", "unit", "value", "meaning"),
        (
            (
                str(r.address),
                f"`{r.name}`",
                r.access.value,
                _bits(registers, r),
                r.unit,
                _reset(r),
                r.meaning,
            )
            for r in registers.registers
            if not r.is_parameter
        ),
    )


def _fields(registers: RegisterMap) -> str:
    """Bits with names."""
    return _table(
        ("register", "bit", "name", "meaning"),
        (
            (
                f"`{r.name}`",
                f"{f.bit + f.width - 1}:{f.bit}" if f.width > 1 else str(f.bit),
                f"`{f.name}`",
                f.meaning + ("; write 1 to clear" if f.clear else ""),
            )
            for r in registers.registers
            for f in r.fields
        ),
    )


def _choices(registers: RegisterMap) -> list[tuple[str, str, str]]:
    """Values with names."""
    return [
        (f"`{r.name}`", str(k), f"`{name}`")
        for r in registers.registers
        for k, name in enumerate(r.names)
    ]


def _ports(registers: RegisterMap, words: Sequence[Port]) -> str:
    """Words of a record."""
    return _table(
        ("word", "name", "format", "unit"),
        ((str(k), f"`{p.name}`", _format(registers, p.frac), p.unit) for k, p in enumerate(words)),
    )


def _format(registers: RegisterMap, frac: int | None) -> str:
    assert frac is not None
    return f"`{Format(registers.word, frac)}`"


def _bits(registers: RegisterMap, register: Register) -> str:
    """Format of a register that is no parameter."""
    width = register.width or registers.word
    if register.frac is not None:
        return _format(registers, register.frac)
    return f"{width} bit{'s' * (width > 1)}" + (", signed" if register.signed else "")


def _reset(register: Register) -> str:
    """What it reads after power-up, if that is certain."""
    if register.reset is None:
        return ""
    return str(register.reset) if register.reset < 1024 else f"{register.reset:#x}"


def _default(register: Register) -> float:
    assert register.frac is not None and register.reset is not None
    return float(Format(32, register.frac).real(register.reset))


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table and a blank line."""

    def line(cells: Sequence[str]) -> str:
        return "| " + " | ".join(c.replace("|", "\\|") for c in cells) + " |"

    return "\n".join([line(head), line(["---"] * len(head)), *map(line, rows), ""])
