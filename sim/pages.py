"""Pages: self-contained HTML files with one style sheet (``base.html``).

A page of text, tables and plots consists of `Section`; one with more has a template beside the code
that fills it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Any, NamedTuple

#: Text for an unknown value.
UNKNOWN = "\N{EM DASH}"


class Verdict(NamedTuple):
    """A text in green if it is good, else in red."""

    text: str
    good: bool

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True, kw_only=True)
class Section:
    """A part of a page.

    Attributes
    ----------
    title, text : str
    columns : sequence of str
        Head of its table.
    rows : sequence of sequences
        Cells: text, a `Verdict`, or numbers, which are formatted by `number`.
    figures : sequence of (caption, SVG)
        See `sim.plotting.svg`.
    """

    title: str = ""
    text: str = ""
    columns: Sequence[str] = ()
    rows: Sequence[Sequence[str | float | Verdict]] = ()
    figures: Sequence[tuple[str, str]] = ()


def number(x: Any, digits: int = 4) -> str:
    """Format a number with grouped thousands and its significant digits; NaN as None, unknown."""
    if x is None or math.isnan(x):
        return UNKNOWN
    if math.isinf(x):
        return ("" if x > 0 else "\N{MINUS SIGN}") + "\N{INFINITY}"
    if x == 0 or 1e-3 <= abs(x) < 1e9:
        whole = isinstance(x, int) or float(x).is_integer() or abs(x) >= 10 ** (digits - 1)
        text = (
            f"{x:z,.0f}".replace(",", "\N{NARROW NO-BREAK SPACE}") if whole else f"{x:z.{digits}g}"
        )
    else:
        mantissa, exponent = f"{x:.{min(digits, 3) - 1}e}".split("e")
        mantissa = mantissa.rstrip("0").rstrip(".")
        text = f"{mantissa}\N{MULTIPLICATION SIGN}10" + str(int(exponent)).translate(_RAISED)
    return text.replace("-", "\N{MINUS SIGN}")


_RAISED = str.maketrans(
    "-0123456789",
    "\N{SUPERSCRIPT MINUS}"
    + "".join(
        chr(c) for c in (0x2070, 0xB9, 0xB2, 0xB3, 0x2074, 0x2075, 0x2076, 0x2077, 0x2078, 0x2079)
    ),
)


def unit(text: str) -> str:
    """Format a unit."""
    text = "half turns" if text == "ht" else text
    text = re.sub(r"\((\w+)\)\^", r"\1^", text)
    text = re.sub(r"\^(-?\d+)", lambda power: power[1].translate(_RAISED), text)
    return text.replace("uT", "\N{MICRO SIGN}T")


def page(package: str, name: str, /, **values: Any) -> str:
    """Render the jinja2 template in file ``name`` of a package.

    Templates have the filters ``number`` and ``unit``. A missing value is an error; values are
    escaped.
    """
    import jinja2

    def source(template_name: str) -> str:
        """Text of a template in the package, or of one that all pages share."""
        path = files(package).joinpath(template_name)
        template = path if path.is_file() else files("boresight.sim").joinpath(template_name)
        return template.read_text(encoding="utf-8")

    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(source),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {"number": number, "unit": unit}
    return environment.get_template(name).render(values)


def section_of(title: str, rows: Sequence[Mapping[str, Any]]) -> Section:
    """A section with a table of rows by column; columns without any value are left out."""
    columns = [*dict.fromkeys(name for row in rows for name, v in row.items() if v is not None)]
    cells = [[_cell(row.get(column)) for column in columns] for row in rows]
    return Section(title=title[:1].upper() + title[1:], columns=columns, rows=cells)


def _cell(value: Any) -> str | float | Verdict:
    if isinstance(value, Verdict):
        return value
    if isinstance(value, bool):
        return Verdict("yes" if value else "no", value)
    if isinstance(value, int | float):
        return value
    return "" if value is None else str(value)


def page_of(
    title: str, intro: Sequence[str | Verdict], sections: Sequence[Section], *, note: str = ""
) -> str:
    """The text of a page of paragraphs, sections and a note at its end."""
    values = {"title": title, "intro": intro, "sections": sections, "note": note}
    return page("boresight.sim", "sections.html", **values)
