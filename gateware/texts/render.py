"""Render the templates of this folder."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from boresight.gateware.description import Word
from boresight.gateware.registers import Register
from boresight.model.tools.c_names import comment, identifier, unique
from boresight.model.words.fixed import Format


def render(template: str, **context: Any) -> str:
    """The text of ``template``, a file name without ``.txt``."""
    return _environment().get_template(f"{template}.txt").render(context)


@cache
def _environment() -> Environment:
    """Environment with marks that do not occur in Verilog, VHDL, C or Python."""
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent),
        undefined=StrictUndefined,
        autoescape=False,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        block_start_string="[%",
        block_end_string="%]",
        variable_start_string="[[",
        variable_end_string="]]",
        comment_start_string="[#",
        comment_end_string="#]",
    )
    environment.globals.update(
        span=lambda bits: f"[{bits - 1}:0] " if bits > 1 else "",
        type=lambda bits: f"std_logic_vector({bits - 1} downto 0)" if bits > 1 else "std_logic",
        fixed=lambda word, frac: str(Format(word, frac)),
        table=_table,
        unique=unique,
    )
    environment.filters.update(
        cell=lambda text: text.replace("|", "\\|"),
        comment=comment,
        default_value=_default_value,
        example=_example,
        identifier=identifier,
        mhz=lambda hz: f"{hz / 1e6:g} MHz",
        number=lambda n: "INT32_MIN" if n == -(2**31) else f"({n})" if n < 0 else str(n),
        sentence=lambda text: text[0].upper() + text[1:].replace("\n", " "),
        # An extended identifier for names that are illegal as plain ones (two underscores).
        vhdl=lambda name: f"\\{name}\\" if "__" in name else name,
    )
    return environment


def _default_value(parameter: Register) -> float:
    """The default of a parameter in its unit, after rounding to its word."""
    assert parameter.frac is not None and parameter.reset is not None
    return float(Format(32, parameter.frac).real(parameter.reset))


def _table(rows: Sequence[Sequence[object]]) -> str:
    """Columns, left-aligned."""
    texts = [[str(cell) for cell in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(*texts, strict=True)]
    return "\n".join(
        "  " + "  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip()
        for row in texts
    )


def _example(word: Word, bits: int) -> str:
    """A value in the middle of an input's range, but not 0, and its word."""
    low, high = word.low or 0.0, word.high or 0.0
    real = float(f"{(low + high) / 2 or high / 2:g}")
    quantised = int(Format(bits, word.frac).quantise(real)) & ((1 << bits) - 1)
    value = f"`{word.name}` = {real:g} {word.unit}".rstrip()
    return f"{value} is the word `0x{quantised:0{-(-bits // 4)}x}`"
