"""Single or double precision: type, literals and functions of the emitted C."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from boresight.model.ops import OPERATIONS

#: Functions of ``math.h`` that are called, as in double precision; two in helpers alone.
FUNCTIONS = {
    *("atan2", "floor"),
    *(name for o in OPERATIONS.values() for name in re.findall(r"(\w+)f\(", o.c)),
}


@dataclass(frozen=True)
class Precision:
    """A floating-point type of C."""

    #: Name of the type in C.
    type: str
    #: The same type in numpy.
    numpy: Any
    #: Suffix of literals and of the names of functions in ``math.h``.
    suffix: str

    def literal(self, number: float) -> str:
        """The constant nearest to ``number``, in the fewest digits.

        A constant below every normal number, which guards a division, becomes the least of these.

        Raises
        ------
        ValueError
            The number is not finite, or too large.
        """
        least = float(np.finfo(self.numpy).tiny)
        if 0.0 < abs(number) < least:
            number = float(np.copysign(least, number))
        with np.errstate(over="ignore"):
            rounded = self.numpy(number)
        if not np.isfinite(rounded):
            raise ValueError(f"number must be finite in a {self.type}, not {number!r}")
        text = np.format_float_scientific(rounded, trim="-", exp_digits=1)
        plain = np.format_float_positional(rounded, trim="0")
        return (plain if len(plain) <= len(text) + 3 else text) + self.suffix

    def of_single(self, text: str) -> str:
        """Convert C for ``float`` to this precision: type, literals, functions."""
        if self.suffix == "f":
            return text
        text = re.sub(r"\bfloat\b", self.type, text)
        text = re.sub(r"\b(\d+\.\d+)f\b", rf"\1{self.suffix}", text)
        return re.sub(rf"\b({'|'.join(FUNCTIONS)})f\(", rf"\1{self.suffix}(", text)


SINGLE = Precision("float", np.float32, "f")
DOUBLE = Precision("double", np.float64, "")
