"""Render the templates of this folder."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from boresight.gateware.description import Word
from boresight.gateware.registers.model import Register
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
        span=_span, type=_vhdl_type, fixed=_fixed, table=_table, unique=unique
    )
    environment.filters.update(
        cell=_cell,
        comment=comment,
        default_value=_default_value,
        example=_example,
        identifier=identifier,
        mhz=_mhz,
        number=_number,
        sentence=_sentence,
        vhdl=_vhdl_name,
    )
    return environment


def _span(bits: int) -> str:
    """``[7:0] `` in Verilog, nothing for a single bit."""
    return f"[{bits - 1}:0] " if bits > 1 else ""


def _vhdl_type(bits: int) -> str:
    return f"std_logic_vector({bits - 1} downto 0)" if bits > 1 else "std_logic"


def _vhdl_name(name: str) -> str:
    """An extended identifier for names that are illegal as plain ones (two underscores)."""
    return f"\\{name}\\" if "__" in name else name


def _fixed(word: int, frac: int) -> str:
    return str(Format(word, frac))


def _number(value: int) -> str:
    """A number for a C expression."""
    return "INT32_MIN" if value == -(1 << 31) else f"({value})" if value < 0 else str(value)


def _default_value(parameter: Register) -> float:
    """The default of a parameter in its unit, after rounding to its word."""
    assert parameter.frac is not None and parameter.reset is not None
    return float(Format(32, parameter.frac).real(parameter.reset))


def _mhz(hz: float) -> str:
    return f"{hz / 1e6:g} MHz"


def _table(rows: Sequence[Sequence[object]]) -> str:
    """Columns, left-aligned."""
    texts = [[str(cell) for cell in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(*texts, strict=True)]
    return "\n".join(
        "  " + "  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip()
        for row in texts
    )


def _example(word: Word, bits: int) -> str:
    """An example value of an input, and its word."""
    real = (word.high or 0.0) / 2 or (word.low or 0.0) / 2
    quantised = int(Format(bits, word.frac).quantise(real)) & ((1 << bits) - 1)
    value = f"`{word.name}` = {real:g} {word.unit}".rstrip()
    return f"{value} is the word `0x{quantised:0{-(-bits // 4)}x}`"


def _cell(text: str) -> str:
    """A cell of a Markdown table."""
    return text.replace("|", "\\|")


def _sentence(text: str) -> str:
    """Lines as one, which begins with a capital."""
    line = text.replace("\n", " ")
    return line[0].upper() + line[1:]
