"""The register map as a Markdown page."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from boresight.gateware.registers.model import Port, Register, RegisterMap
from boresight.model.words.fixed import Format

__all__ = ["to_markdown"]


def to_markdown(registers: RegisterMap) -> str:
    """A page: parameters, registers and their bits, words of the streams."""
    build = " and ".join(f"`{value:#010x}`" for value in registers.build)
    parameters = [
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
    ]
    others = [
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
    ]
    bits = [
        (
            f"`{r.name}`",
            f"{f.bit + f.width - 1}:{f.bit}" if f.width > 1 else str(f.bit),
            f"`{f.name}`",
            f.meaning + ("; write 1 to clear" if f.clear else ""),
        )
        for r in registers.registers
        for f in r.fields
    ]

    choices = [
        (f"`{r.name}`", str(k), f"`{name}`")
        for r in registers.registers
        for k, name in enumerate(r.names)
    ]

    def ports(words: Sequence[Port]) -> str:
        return _table(
            ("word", "name", "format", "unit"),
            [
                (str(k), f"`{p.name}`", _format(registers, p.frac), p.unit)
                for k, p in enumerate(words)
            ],
        )

    records = []
    for streams in registers.streams:
        of = f" of `{streams.program}`" if len(registers.streams) > 1 else ""
        records += [
            f"## Input record{of}",
            "",
            ports(streams.inputs),
            f"## Output record{of}",
            "",
            ports(streams.outputs),
        ]
    programs = "Program" if len(registers.streams) == 1 else "Programs"
    return (
        "\n".join(
            [
                f"# Registers of the {registers.title} `{registers.name}`",
                "",
                f"{programs} `{registers.digest}`; words of {registers.word} bits. Addresses count "
                "words; in a memory map word k stands at byte 4 k. `fixed<W,I>` has W bits, I of "
                f"them before the binary point, with the sign. `build_low` and `build_high` read "
                f"{build}.",
                "",
                "## Parameters",
                "",
                "Write only. A write waits until the update at work has ended.",
                "",
                _table(
                    ("address", "name", "format", "unit", "range", "default", "meaning"), parameters
                ),
                "## Status"
                if registers.title == "core"
                else "## Status, settings, results, counters",
                "",
                _table(("address", "name", "access", "format", "unit", "value", "meaning"), others),
                _table(("register", "bit", "name", "meaning"), bits),
                *([_table(("register", "value", "name"), choices)] if choices else []),
                *(
                    [
                        "A write of `program` waits until the update at work has ended; a number "
                        "without a program is ignored. Each program keeps its states while others "
                        "run.",
                        "",
                    ]
                    if registers.title == "core" and choices
                    else []
                ),
                *records,
            ]
        ).rstrip("\n")
        + "\n"
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
