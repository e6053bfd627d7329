"""Forms: what one multiply-accumulate group computes, before its shifts are known."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

from boresight.model.words import tables
from boresight.model.words.program import Negate, Scale, Term, When
from boresight.model.words.rounded import binary_exponent

#: Sign of a product that is subtracted instead of added.
OPPOSITE = {
    Negate.NO: Negate.YES,
    Negate.YES: Negate.NO,
    Negate.IF: Negate.UNLESS,
    Negate.UNLESS: Negate.IF,
}
#: Sign of a product that turns over when the group's flag is set.
CONDITIONAL = {Negate.NO: Negate.IF, Negate.YES: Negate.UNLESS}


@dataclass(frozen=True)
class Product:
    """A term before its shift is known: sign * a * b * 2^exponent.

    ``b`` None without ``coefficient`` means "times one". ``limit`` is the product's largest
    magnitude where that is less than its factors' ranges say. ``within``: ``a`` is no larger than
    the word whose count scales it. The rest is as in `model.words.program.Term`.
    """

    a: int
    b: int | None = None
    exponent: int = 0
    coefficient: int | None = None
    negate: Negate = Negate.NO
    when: When = When.ALWAYS
    fraction_a: bool = False
    fraction_b: bool = False
    scale: Scale = Scale.NONE
    limit: float = math.inf
    within: bool = False

    @property
    def times_one(self) -> bool:
        """Whether there is no second factor."""
        return self.b is None and self.coefficient is None

    def term(self, shift: int, unit: int | None) -> Term:
        """The term with this shift; ``unit`` is the second factor where there is no other."""
        return Term(
            self.a,
            self.b if unit is None else unit,
            shift,
            self.coefficient,
            self.negate,
            self.when,
            self.fraction_a,
            self.fraction_b,
            self.scale,
        )

    def times_power(self, power: float) -> Product:
        """The product times a power of two of either sign."""
        return replace(
            self,
            exponent=self.exponent + binary_exponent(power),
            limit=self.limit * abs(power),
            negate=OPPOSITE[self.negate] if power < 0 else self.negate,
        )


@dataclass
class Form:
    """A sum of products that one group can compute: all share one flag, count and segment.

    ``flag`` and ``index`` are (value, whether a quarter of the range is added first).
    """

    products: list[Product] = field(default_factory=list)
    constant: float = 0.0
    flag: tuple[int, bool] | None = None
    norm: int | None = None
    index: tuple[int, bool] | None = None
    table: tables.Table | None = None

    def joins(self, other: Form) -> bool:
        """Whether one group can compute the sum of both."""

        def differs(a: object, b: object) -> bool:
            return a is not None and b is not None and a != b

        return not (differs(self.flag, other.flag) or differs(self.norm, other.norm))

    def join(self, other: Form, sign: int) -> None:
        """Add (or subtract) a form that `joins`; table look-ups never come here."""
        assert other.table is None
        self.flag = self.flag or other.flag
        self.norm = other.norm if self.norm is None else self.norm
        self.constant += sign * other.constant
        self.products += [
            p if sign > 0 else replace(p, negate=OPPOSITE[p.negate]) for p in other.products
        ]
