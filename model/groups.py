"""Groups: from a form to a multiply-accumulate operation with proven shifts and binary point.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from model import tables
from model.errors import InputError
from model.fixed import Arithmetic, Format
from model.forms import Form, Product
from model.program import Kind, Negate, Op, Overflow, Scale, Term, Value, When

__all__ = ["Groups"]

_LARGEST_COUNT = {Scale.NONE: 0.0, Scale.FULL: 1.0, Scale.EVEN: 1.0, Scale.HALF: 0.5}


class Groups:
    """The values and operations of a program in the making."""

    def __init__(self, name: str, arith: Arithmetic) -> None:
        self.name = name
        self.arith = arith
        self.values: list[Value] = []
        self.ops: list[Op] = []
        self._names: set[str] = set()
        self._constants: dict[tuple[int, int], int] = {}


    def value(self, value: Value) -> int:
        name, k = value.name, 1
        while name in self._names:
            k += 1
            name = f"{value.name}_{k}"
        self._names.add(name)
        self.values.append(replace(value, name=name))
        return len(self.values) - 1

    def constant(self, c: float, frac: int) -> int:
        word = int(Format(self.arith.word, frac).quantise(c))
        if (word, frac) not in self._constants:
            real = math.ldexp(word, -frac)
            self._constants[word, frac] = self.value(
                Value(f"const_{c:.6g}", Kind.CONST, frac, real, real, "constant", "", word))
        return self._constants[word, frac]

    def one(self, frac: int) -> int:
        """The word 2^frac: multiplication by it is a pure shift."""
        key = (1 << frac, frac)
        if key not in self._constants:
            self._constants[key] = self.value(
                Value(f"one_{frac}", Kind.CONST, frac, 1.0, 1.0, "constant", "", 1 << frac))
        return self._constants[key]

    def bound(self, number: int, is_fraction: bool) -> int:
        """Largest magnitude the word can have, whatever happens."""
        if is_fraction:
            return 1 << self.arith.fraction_bits
        v = self.values[number]
        return abs(v.initial) if v.kind is Kind.CONST else 1 << (self.arith.word - 1)

    def frac(self, number: int) -> int:
        return self.values[number].frac

    def group(self, form: Form, *, name: str, low: float, high: float, source: str,
              unit: str = "", overflow: Overflow = Overflow.SAT, frac: int | None = None,
              exact_frac: bool = False) -> int:
        """Append the group that computes ``form``; return its value.

        ``frac`` asks for a binary point; with ``exact_frac`` it must be met.
        """
        word = self.arith.word
        if frac is None:
            if not (math.isfinite(low) and math.isfinite(high)):
                raise InputError(f"{self.name}: value {name}: range [{low:g}, {high:g}] is not "
                                 "finite; declare it with model.ops.bounded")
            frac = Format.for_range(word, low, high).frac
        protos = list(form.products)
        while True:
            terms = self._terms(form, protos, frac)
            if terms is not None:
                break
            if exact_frac:
                worst = self._coarsest(form, protos)
                if worst is not None:
                    protos[worst] = self._separate(form, protos[worst], name)
                    continue
                return self._raised(form, name=name, low=low, high=high, source=source,
                                    unit=unit, overflow=overflow, frac=frac)
            frac -= 1
            if frac < -200:
                raise InputError(f"{self.name}: value {name} would pass 63 bits: no binary point "
                                 "keeps its terms inside the accumulator")
        number = self.value(Value(name, Kind.OP, frac, low, high, source, unit))
        has_condition = any(t.when is not When.ALWAYS or t.negate in (Negate.IF, Negate.UNLESS)
                            for t in terms)
        flag = form.flag if has_condition else None
        self.ops.append(Op(
            number, tuple(terms), overflow,
            flag=flag[0] if flag else None, flag_quarter=flag[1] if flag else False,
            norm=form.norm if any(t.scale is not Scale.NONE for t in terms) else None,
            index=form.index[0] if form.index else None,
            index_quarter=form.index[1] if form.index else False,
            table=form.table.block if form.table else None))
        return number

    def _raised(self, form: Form, *, name: str, low: float, high: float, source: str, unit: str,
                overflow: Overflow, frac: int) -> int:
        """``form`` in the finest format that works, then shifted up to ``frac`` step by step."""
        natural = self._magnitude(form) if overflow is not Overflow.WRAP else 1.0
        part = self.group(form, name=f"{name}_part", low=-natural, high=natural, source=source,
                          unit=unit, overflow=Overflow.CLIP if overflow is Overflow.CLIP
                          else Overflow.SAT)
        step = self.arith.word - 2 - self.arith.guard
        while self.frac(part) + step < frac:
            part = self.group(Form([Product(part)]), name=f"{name}_part", low=low, high=high,
                              source=source, unit=unit, overflow=overflow,
                              frac=self.frac(part) + step, exact_frac=True)
        return self.group(Form([Product(part)]), name=name, low=low, high=high, source=source,
                          unit=unit, overflow=overflow, frac=frac, exact_frac=True)

    def _slack(self, scale: Scale) -> int:
        return int(self.arith.norm_max * _LARGEST_COUNT[scale])

    def _operand_b(self, form: Form, p: Product) -> tuple[int, int]:
        """(fraction bits, magnitude bound) of the second factor; not for times one."""
        if p.coefficient is not None:
            assert form.table is not None
            fmt = tables.coefficient_formats(form.table, self.arith)[p.coefficient]
            return fmt.frac, 1 << (self.arith.word - 1)
        assert p.b is not None
        return (self.arith.fraction_bits if p.fraction_b else self.frac(p.b),
                self.bound(p.b, p.fraction_b))

    def _terms(self, form: Form, protos: Sequence[Product], frac: int) -> list[Term] | None:
        """Terms with shifts for a result of ``frac`` fraction bits; None if not expressible."""
        arith = self.arith
        total = 1 << (arith.guard - 1)
        out: list[Term] = []
        for p in protos:
            slack = self._slack(p.scale)
            frac_a = arith.fraction_bits if p.fraction_a else self.frac(p.a)
            bound_a = self.bound(p.a, p.fraction_a)
            # shift = (fraction bits of the product) - (those of the accumulator)
            base = frac_a - p.exponent - frac - arith.guard
            one = p.times_one
            if one:
                k = min(arith.word - 2, arith.shift_max - base)
                if k < 0:  # below 2^-G of a result bit whatever the word: nothing to add
                    if slack:
                        return None
                    continue
                shift, bound_b, b = base + k, 1 << k, self.one(k)
            else:
                frac_b, bound_b = self._operand_b(form, p)
                shift, b = base + frac_b, p.b
                if shift > arith.shift_max:
                    out_p = self._separate(form, p, "product")
                    part = self._terms(form, [out_p], frac)
                    if part is None:
                        return None
                    for t in part:
                        total += (self.bound(t.a, False) << arith.word) >> t.shift
                    out += part
                    continue
            if shift < slack:
                return None
            if slack and form.norm == p.a and one:  # self-normalised: stays inside the word
                total += 1 << (arith.word - 1 + arith.guard)
            else:
                total += (bound_a * bound_b) >> (shift - slack)
            out.append(Term(p.a, b, shift, p.coefficient, p.negate, p.when, p.fraction_a,
                            p.fraction_b, p.scale))
        if form.constant != 0.0:
            fmt = Format(arith.word, min(frac, Format.for_range(
                arith.word, form.constant, form.constant).frac))
            number = self.constant(form.constant, fmt.frac)
            k = min(arith.word - 2, arith.shift_max - (fmt.frac - frac - arith.guard))
            shift = fmt.frac + k - frac - arith.guard
            if shift < 0:
                return None
            total += (abs(self.values[number].initial) << k) >> shift
            out.append(Term(number, self.one(k), shift))
        return out if total < 1 << (arith.acc_width - 1) else None

    def _coarsest(self, form: Form, protos: Sequence[Product]) -> int | None:
        """The term whose product has the fewest fraction bits: the one to compute apart."""
        best, found = math.inf, None
        for k, p in enumerate(protos):
            if p.times_one:
                continue
            bits = self.frac(p.a) + self._operand_b(form, p)[0] - p.exponent - self._slack(p.scale)
            if bits < best:
                best, found = bits, k
        return found

    def _separate(self, form: Form, p: Product, name: str) -> Product:
        """Compute one product as a value of its own; return the term that adds it."""
        assert p.b is not None and not (p.fraction_a or p.fraction_b)
        va, vb = self.values[p.a], self.values[p.b]
        corners = [math.ldexp(x * y, p.exponent) for x in (va.low, va.high)
                   for y in (vb.low, vb.high)]
        if p.scale is not Scale.NONE:
            raise InputError(f"{self.name}: value {name}: a normalised factor needs a wider range")
        number = self.group(Form([replace(p, negate=Negate.NO, when=When.ALWAYS)]),
                            name=f"{name}_part", low=min(corners), high=max(corners),
                            source="interval")
        return Product(number, negate=p.negate, when=p.when)

    def _magnitude(self, form: Form) -> float:
        """Largest magnitude of the sum, from the ranges of its operands."""
        total = abs(form.constant)
        for p in form.products:
            a = self.values[p.a]
            size = math.ldexp(max(abs(a.low), abs(a.high)), p.exponent)
            if p.b is not None:
                b = self.values[p.b]
                size *= max(abs(b.low), abs(b.high))
            total += size
        return total
