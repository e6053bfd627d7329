"""Groups: from a form to a multiply-accumulate operation with proven shifts and binary point.

A product of words with f_a and f_b fraction bits reaches an accumulator of f + G fraction bits by
the shift f_a + f_b - (f + G). It must lie in 0..31 (after the normalisation count is taken off),
and the sum of the largest magnitudes must stay inside the accumulator; both are proven here for
every group, for all words whatever their declared range. A binary point f that does not allow it is
made coarser; where the format is prescribed (binary angles, purposeful clamps, states) the group
is split instead.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias

from boresight.model.errors import InputError, placed, require
from boresight.model.words import tables
from boresight.model.words.fixed import Arithmetic, Format
from boresight.model.words.program import Kind, Negate, Op, Overflow, Scale, Term, Value, When
from boresight.model.words.rounded import binary_exponent

#: Binary points down to which a group is made coarser before it is refused.
_COARSEST_FRAC = -200
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
        return self.b is None and self.coefficient is None

    def times_power(self, power: float) -> Product:
        """The product times a power of two of either sign."""
        negate = OPPOSITE[self.negate] if power < 0 else self.negate
        exponent, limit = self.exponent + binary_exponent(power), self.limit * abs(power)
        return replace(self, exponent=exponent, limit=limit, negate=negate)


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
        pairs = ((self.flag, other.flag), (self.norm, other.norm))
        return all(a is None or b is None or a == b for a, b in pairs)

    def join(self, other: Form, sign: int) -> None:
        """Add (or subtract) a form that `joins`; table look-ups never come here."""
        assert other.table is None
        self.flag = self.flag or other.flag
        self.norm = other.norm if self.norm is None else self.norm
        self.constant += sign * other.constant
        for p in other.products:
            self.products.append(p if sign > 0 else replace(p, negate=OPPOSITE[p.negate]))


@dataclass(frozen=True)
class Target:
    """A group's result before its format is chosen; ``line`` is its author's."""

    name: str
    low: float
    high: float
    source: str
    unit: str = ""
    overflow: Overflow = Overflow.SAT
    line: str = ""


#: A product with its shift; a number at its end: it is multiplied by the word 2^number.
_Placed: TypeAlias = tuple[Product, int, int | None]


class Groups:
    """The values and operations of a program in the making."""

    def __init__(self, name: str, arith: Arithmetic) -> None:
        self.name = name
        self.arith = arith
        self.values: list[Value] = []
        self.ops: list[Op] = []
        self._names: set[str] = set()
        self._constants: dict[tuple[int, int], int] = {}
        self._coarse: dict[tuple[int, int], int] = {}
        #: Forms of operations, and products computed as values of their own, by value number.
        self.forms: dict[int, Form] = {}
        self.separate_products: dict[int, Product] = {}

    # -- values ---------------------------------------------------------------------------------

    def value(self, value: Value) -> int:
        """Append a value, its name made unique; return its number."""
        name, k = value.name, 1
        while name in self._names:
            k += 1
            name = f"{value.name}_{k}"
        self._names.add(name)
        self.values.append(replace(value, name=name))
        return len(self.values) - 1

    def constant(self, c: float, frac: int) -> int:
        """The constant nearest to ``c`` with ``frac`` fraction bits."""
        word = int(Format(self.arith.word, frac).quantise(c))
        return self._constant(f"const_{c:.6g}", word, frac)

    def unit(self, frac: int) -> int:
        """The word 2^frac: multiplication by it is a pure shift."""
        return self._constant(f"one_{frac}", 1 << frac, frac)

    def _constant(self, name: str, word: int, frac: int) -> int:
        if (word, frac) not in self._constants:
            real = math.ldexp(word, -frac)
            value = Value(name, Kind.CONST, frac, real, real, "constant", "", word)
            self._constants[word, frac] = self.value(value)
        return self._constants[word, frac]

    def frac(self, number: int) -> int:
        return self.values[number].frac

    # -- groups ---------------------------------------------------------------------------------

    def group(
        self, form: Form, target: Target, *, frac: int | None = None, exact: bool = False
    ) -> int:
        """Append the group that computes ``form``; return its value.

        ``frac`` asks for a binary point (default: the finest that holds the range); with
        ``exact`` it must be met.
        """
        where, span = placed(target.line, f"value {target.name}"), (target.low, target.high)
        fix = "declare it with ops.bounded, or limit it with ops.clip"
        require(math.isfinite(sum(span)), where, "a finite range", span, fix)
        if frac is None:
            frac = Format.for_range(self.arith.word, target.low, target.high).frac
        products = list(form.products)
        while True:
            terms = self._place(form, products, frac)
            if isinstance(terms, int):
                p = products[terms]
                is_single = len(products) == 1 and form.constant == 0.0
                if (is_single and p.scale is not Scale.NONE) or self._constant_of(p) is not None:
                    products[terms] = self._coarser(form, p, frac, target)
                else:
                    products[terms] = self._separate(form, p, target)
            elif terms is not None:
                return self._append(replace(form, products=products), terms, target, frac)
            elif exact:
                worst = self._coarsest(form, products)
                if worst is None:
                    return self._raised(replace(form, products=products), target, frac)
                p = products[worst]
                if p.scale is not Scale.NONE and math.isinf(p.limit):
                    fix = "a root or reciprocal in it has no upper bound: declare the product's "
                    fix += "range with ops.bounded"
                    raise self._too_large(form, p, target, fix)
                products[worst] = self._separate(form, p, target)
            elif frac > _COARSEST_FRAC:
                frac -= 1
            else:
                largest = max(products, key=lambda p: self._magnitude(form, p))
                fix = "narrow its factors, or choose units in which they are smaller"
                raise self._too_large(form, largest, target, fix)

    def _too_large(self, form: Form, p: Product, target: Target, fix: str) -> InputError:
        """Name a product's factors, what it reaches, and by how many bits that is too much."""
        arith, reached = self.arith, self._magnitude(form, p)
        root = form.norm if p.scale is not Scale.NONE else None
        factors = [self.values[n] for n in (p.a, p.b, root) if n is not None]
        variable = [v for v in factors if v.range_source not in ("constant", "table")]
        names = [v.name.removesuffix("_aligned") for v in variable]
        ranges = [f"{n} [{v.low:g}, {v.high:g}]" for n, v in zip(names, variable, strict=True)]
        if root is not None:
            names[-1] = "its root"
        names += [f"2^{p.exponent}"] if p.exponent else []
        frac = Format.for_range(arith.word, target.low, target.high).frac
        capacity = math.ldexp(1.0, arith.acc_width - 1 - arith.guard - frac)
        excess = -binary_exponent(capacity / reached) if math.isfinite(reached) else 0
        bits = f", {excess} bits too many" * (excess > 0)
        return InputError.at(
            placed(target.line, f"{self.name}, value {target.name}"),
            wanted=f"terms up to {capacity:.3g} in a value of [{target.low:g}, {target.high:g}]",
            found=f"{' * '.join(names)} up to {reached:.3g}{bits}",
            fix=f"{fix} ({' and '.join(ranges)})",
        )

    def _place(
        self, form: Form, products: Sequence[Product], frac: int
    ) -> list[_Placed] | int | None:
        """Shifts for a result of ``frac`` fraction bits.

        Returns the number of a product that needs a group of its own, or None if the binary point
        is too fine.
        """
        arith = self.arith
        total = 1 << (arith.guard - 1)
        placed: list[_Placed] = []
        for number, p in self._counted(form, products, frac):
            slack = self._slack(p.scale)
            # shift = (fraction bits of the product) - (those of the accumulator)
            frac_a = arith.fraction_bits if p.fraction_a else self.frac(p.a)
            shift = frac_a - p.exponent - frac - arith.guard
            unit = None
            if p.times_one:
                unit = min(arith.word - 2, arith.shift_max - shift)
                frac_b, bound_b = unit, 1 << max(unit, 0)
            else:
                frac_b, bound_b = self._second(form, p)
            shift += frac_b
            if shift > arith.shift_max or (unit is not None and unit < 0):
                return number
            if shift < slack:
                return None
            if slack and (form.norm == p.a or p.within) and unit is not None:
                total += 1 << (arith.word - 1 + arith.guard)  # normalised: inside the word
            else:
                # Largest magnitude of floor(x / 2^shift).
                total += -(-self._bound(p.a, p.fraction_a) * bound_b >> shift - slack)
            placed.append((p, shift, unit))
        return placed if total < 1 << (arith.acc_width - 1) else None

    def _counted(
        self, form: Form, products: Sequence[Product], frac: int
    ) -> Iterator[tuple[int, Product]]:
        """Products that reach the accumulator, by number; then the constant, or 0 if none does."""
        last = frac + self.arith.guard
        empty = True
        for number, p in enumerate(products):
            if math.ldexp(self._magnitude(form, p), last) >= 1.0:
                empty = False
                yield number, p
        if form.constant != 0.0 or empty:
            constant_frac = Format.for_range(self.arith.word, form.constant, form.constant).frac
            yield len(products), Product(self.constant(form.constant, min(constant_frac, last)))

    def _append(self, form: Form, placed: Sequence[_Placed], target: Target, frac: int) -> int:
        terms = self._terms(placed)
        conditional = any(t.conditional for t in terms)
        flag, flag_quarter = (form.flag if conditional else None) or (None, False)
        norm = form.norm if any(t.scale is not Scale.NONE for t in terms) else None
        table = form.table.block if form.table else None
        (index, quarter), t = form.index or (None, False), target
        number = self.value(Value(t.name, Kind.OP, frac, t.low, t.high, t.source, t.unit))
        self.forms[number] = form
        op = Op(number, terms, t.overflow, flag, flag_quarter, norm, index, quarter, table)
        self.ops.append(op)
        return number

    def _terms(self, placed: Sequence[_Placed]) -> tuple[Term, ...]:
        terms = []
        for p, shift, unit in placed:
            b = p.b if unit is None else self.unit(unit)
            flags = p.negate, p.when, p.fraction_a, p.fraction_b, p.scale
            terms.append(Term(p.a, b, shift, p.coefficient, *flags))
        return tuple(terms)

    def exchanged(self, op: Op, products: list[Product]) -> Op | None:
        """An operation with other products in its sum; None: no word of its format holds it."""
        form = replace(self.forms[op.dest], products=products)
        placed = self._place(form, products, self.frac(op.dest))
        if placed is None:
            return None
        assert not isinstance(placed, int)  # the products are no finer than those in their place
        self.forms[op.dest] = form
        return replace(op, terms=self._terms(placed))

    def _raised(self, form: Form, target: Target, frac: int) -> int:
        """``form`` in the finest format that works, then shifted up to ``frac`` step by step."""
        if target.overflow is Overflow.WRAP:  # a coarser word wraps at a multiple of the period
            fmt = Format(self.arith.word, frac - 1)
            wide_target = replace(target, low=fmt.min, high=fmt.max)
        else:
            sizes = [self._magnitude(form, p) for p in form.products]
            bound = math.fsum([abs(form.constant), *sizes])
            wide_target = replace(target, low=-bound, high=bound)
        part_name, step = f"{target.name}_part", min(self.arith.norm_max, self.arith.headroom - 1)
        part = self.group(form, replace(wide_target, name=part_name))
        part_target = replace(target, name=part_name)
        while (next_frac := self.frac(part) + step) < frac:
            part = self.group(Form([Product(part)]), part_target, frac=next_frac, exact=True)
        return self.group(Form([Product(part)]), target, frac=frac, exact=True)

    def _separate(self, form: Form, p: Product, target: Target) -> Product:
        """Compute one product as a value of its own; return the product that adds it."""
        bound = self._magnitude(form, p)
        low, high = -bound, bound
        if p.scale is Scale.NONE and p.b is not None:
            a, b = self.values[p.a], self.values[p.b]
            corners = [x * y for x in (a.low, a.high) for y in (b.low, b.high)]
            low, high = (math.ldexp(edge, p.exponent) for edge in (min(corners), max(corners)))
        separate = Form([replace(p, negate=Negate.NO, when=When.ALWAYS)], norm=form.norm)
        part = Target(f"{target.name}_part", low, high, "interval", line=target.line)
        number = self.group(separate, part)
        self.separate_products[number] = p
        return Product(number, negate=p.negate, when=p.when)

    def _coarser(self, form: Form, p: Product, frac: int, target: Target) -> Product:
        """A product that is too fine for its result, with a coarser copy of its last factor.

        Or with a coarser constant: its error is half of the accumulator's last bit.
        """
        excess = self.excess(p, 0 if p.times_one else self._second(form, p)[0], frac)
        if (constant := self._constant_of(p)) is not None:
            value = self.values[constant]
            coarse = self.constant(math.ldexp(value.initial, -value.frac), value.frac - excess)
            return replace(p, a=coarse) if constant == p.a else replace(p, b=coarse)
        if p.b is None:
            return replace(p, a=self.coarse(p.a, excess, target.line))
        return replace(p, b=self.coarse(p.b, excess, target.line))

    def excess(self, p: Product, frac_b: int, frac: int) -> int:
        """Bits of a product that no shift brings to a result of ``frac`` fraction bits."""
        return self.frac(p.a) + frac_b - p.exponent - frac - self.arith.guard - self.arith.shift_max

    def coarse(self, number: int, bits: int, line: str = "") -> int:
        """A copy of a value with fewer bits."""
        frac = self.frac(number) - bits
        if (number, frac) not in self._coarse:
            v = self.values[number]
            target = Target(f"{v.name}_coarse", v.low, v.high, v.range_source, v.unit, line=line)
            form = Form([Product(number)])
            self._coarse[number, frac] = self.group(form, target, frac=frac, exact=True)
        return self._coarse[number, frac]

    def _constant_of(self, p: Product) -> int | None:
        factors = () if p.b is None else (p.b, p.a)
        return next((n for n in factors if self.values[n].kind is Kind.CONST), None)

    def _coarsest(self, form: Form, products: Sequence[Product]) -> int | None:
        """The product of two words with the fewest fraction bits, to be computed separately."""
        bits = {
            k: self.frac(p.a) + self._second(form, p)[0] - p.exponent - self._slack(p.scale)
            for k, p in enumerate(products)
            if not p.times_one
        }
        return min(bits, key=lambda k: bits[k]) if bits else None

    # -- bounds ---------------------------------------------------------------------------------

    def _slack(self, scale: Scale) -> int:
        """Largest number of bits by which the normalisation count lessens a shift."""
        largest = self.arith.norm_max
        return {Scale.NONE: 0, Scale.HALF: largest // 2}.get(scale, largest)

    def _bound(self, number: int, is_fraction: bool) -> int:
        """Largest magnitude of the word, whatever its declared range."""
        if is_fraction:
            return 1 << self.arith.fraction_bits
        v = self.values[number]
        return abs(v.initial) if v.kind is Kind.CONST else 1 << (self.arith.word - 1)

    def _second(self, form: Form, p: Product) -> tuple[int, int]:
        """(fraction bits, largest word) of the second factor; not for times one."""
        if p.coefficient is not None:
            assert form.table is not None
            fmt = tables.coefficient_formats(form.table, self.arith)[p.coefficient]
            return fmt.frac, 1 << (self.arith.word - 1)
        assert p.b is not None
        frac = self.arith.fraction_bits if p.fraction_b else self.frac(p.b)
        return frac, self._bound(p.b, p.fraction_b)

    def _magnitude(self, form: Form, p: Product) -> float:
        """Largest magnitude of a product, from the ranges of its factors."""
        size = 1.0 if p.fraction_a else max(abs(self.values[p.a].low), abs(self.values[p.a].high))
        if p.coefficient is not None:
            frac_b, bound_b = self._second(form, p)
            size *= math.ldexp(bound_b, -frac_b)
        elif p.b is not None and not p.fraction_b:
            size *= max(abs(self.values[p.b].low), abs(self.values[p.b].high))
        return min(math.ldexp(size, p.exponent + self._slack(p.scale)), p.limit)
