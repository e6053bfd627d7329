"""Functions on words: table look-ups expanded into multiply-accumulate groups.

A tabulated function of the word x is ``w + t * u`` (see `model.words.tables`) with three groups::

    u = p * p        w = c0 + c1 * p        t = c2 + c3 * p        p: position in the segment

Roots and reciprocals first normalise their argument to a mantissa; the exponent comes back as a
term's scale (`model.words.program.Scale`) where the result is used.
"""

from __future__ import annotations

from boresight.model.lowering.forms import Form, Product
from boresight.model.lowering.groups import Groups, Target
from boresight.model.words import tables
from boresight.model.words.program import Negate, Overflow, Scale


class Functions:
    """Expands functions; the same function of the same word is expanded once."""

    def __init__(self, groups: Groups) -> None:
        self._groups = groups
        self._squares: dict[int, int] = {}
        self._segments: dict[tuple[str, int, bool], tuple[int, int]] = {}
        self._mantissas: dict[tuple[str, int], int] = {}

    def cubic(self, table: tables.Table, x: int, quarter: bool) -> list[Product]:
        """The two products w * 1 and t * u of a tabulated function of the word ``x``."""
        key = (table.name, x, quarter)
        if key not in self._segments:
            self._segments[key] = self._expand(table, x, quarter)
        w, t = self._segments[key]
        return [Product(w), Product(t, self._squares[x])]

    def _expand(self, table: tables.Table, x: int, quarter: bool) -> tuple[int, int]:
        groups, arith = self._groups, self._groups.arith
        label = f"{'cos' if quarter else table.name}_{groups.values[x].name}"
        if x not in self._squares:
            self._squares[x] = groups.group(
                Form([Product(x, x, fraction_a=True, fraction_b=True)], index=(x, quarter)),
                Target(f"{label}_u", 0.0, 1.0, "table", overflow=Overflow.CLIP),
                frac=arith.word - 1,
            )
        c = table.coefficients
        parts = {}
        for first, part in ((2, "t"), (0, "w")):
            low = float((c[:, first] + c[:, first + 1].clip(max=0.0)).min())
            high = float((c[:, first] + c[:, first + 1].clip(min=0.0)).max())
            frac = tables.part_format(table, arith, low, high).frac
            unit = groups.unit(arith.word - 2)
            parts[part] = groups.group(
                Form(
                    [
                        Product(unit, coefficient=first),
                        Product(x, coefficient=first + 1, fraction_a=True),
                    ],
                    index=(x, quarter),
                    table=table,
                ),
                Target(f"{label}_{part}", low, high, "table", overflow=Overflow.CLIP),
                frac=frac,
            )
        return parts["w"], parts["t"]

    def mantissa(self, kind: str, x: int) -> tuple[int, int]:
        """(value m', exponent e) of rsqrt or reciprocal of the word ``x``.

        x = X 2^-f, X shifted left by its normalisation count n gives m = X 2^n / 2^(W-1); then

        * 1/sqrt(x) = m' 2^e 2^(n/2), m' = m^(-1/2), e = (f - (W-1)) / 2, n even, f - (W-1) even;
        * 1/x = m' 2^e 2^n, m' = 1/|m|, e = f - (W-1), with the sign of x.
        """
        groups, arith = self._groups, self._groups.arith
        root = kind == "rsqrt"
        table = tables.RSQRT if root else tables.RECIPROCAL
        exponent = groups.frac(x) - (arith.word - 1)
        if (kind, x) not in self._mantissas:
            name = groups.values[x].name
            negative = groups.values[x].low < 0.0 and not root
            m = groups.group(
                Form(
                    [
                        Product(
                            x,
                            scale=Scale.EVEN if root else Scale.FULL,
                            exponent=exponent,
                            negate=Negate.IF if negative else Negate.NO,
                        )
                    ],
                    norm=x,
                    flag=(x, False) if negative else None,
                ),
                Target(f"{name}_m", 0.0, 1.0, "normalised", overflow=Overflow.CLIP),
                frac=arith.word - 1,
                exact=True,
            )
            self._mantissas[kind, x] = groups.group(
                Form(self.cubic(table, m, False)),
                Target(f"{kind}_{name}", table.low, table.high, "table", overflow=Overflow.CLIP),
                frac=table.result_format(arith).frac,
                exact=True,
            )
        return self._mantissas[kind, x], exponent // 2 if root else exponent
