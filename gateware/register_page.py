"""The register map as a Markdown page."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from gateware.register_model import Port, Register, RegisterMap
from model.fixed import Format

__all__ = ["to_markdown"]


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
