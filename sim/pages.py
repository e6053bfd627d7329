"""Pages: self-contained HTML files, from templates beside the code that fills them."""

from __future__ import annotations

from importlib.resources import files
from typing import Any

__all__ = ["UNKNOWN", "number", "page", "unit"]

#: Text for an unknown value.
UNKNOWN = "\N{EM DASH}"


def number(x: Any, digits: int = 4) -> str:
    """Format a number with grouped thousands and its significant digits."""
    if x is None:
        return UNKNOWN
    if x == 0 or 1e-3 <= abs(x) < 1e9:
        whole = isinstance(x, int) or float(x).is_integer() or abs(x) >= 10 ** (digits - 1)
        text = f"{x:,.0f}".replace(",", "\N{NARROW NO-BREAK SPACE}") if whole else f"{x:.{digits}g}"
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
    return text.replace("^2", "\N{SUPERSCRIPT TWO}").replace("uT", "\N{MICRO SIGN}T")


def page(package: str, name: str, /, **values: Any) -> str:
    """Render the jinja2 template in file ``name`` of a package.

    Templates have the filters ``number`` and ``unit``. A missing value is an error; values are
    escaped.
    """
    import jinja2

    environment = jinja2.Environment(
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {"number": number, "unit": unit}
    text = files(package).joinpath(name).read_text(encoding="utf-8")
    return environment.from_string(text).render(values)
