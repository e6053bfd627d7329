"""Lowering: from the traced graph to the fixed-point program.

Every node that somebody needs as a word becomes one multiply-accumulate group; products, signs,
selections and the last step of a function fuse into the group that consumes them. Formats are
chosen here: the finest binary point that holds the value's range, made coarser only where a shift or
the accumulator could not express it (which the code below proves for every group).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from model import tables
from model.errors import InputError
from model.fixed import Arithmetic, Format
from model.graph import LEAVES, Node
from model.program import Kind, Negate, Op, Overflow, Program, Scale, Term, Value, When

__all__ = ["lower"]

_FLIP = {Negate.NO: Negate.YES, Negate.YES: Negate.NO, Negate.IF: Negate.UNLESS,
         Negate.UNLESS: Negate.IF}
_CONDITIONAL = {Negate.NO: Negate.IF, Negate.YES: Negate.UNLESS}
_LARGEST_COUNT = {Scale.NONE: 0.0, Scale.FULL: 1.0, Scale.EVEN: 1.0, Scale.HALF: 0.5}


@dataclass(frozen=True)
class _Proto:
    """A term before its shift is known: sign * a * b * 2^exponent.

    ``b`` None without coefficient means "times one".
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


@dataclass
class _Form:
    """A sum of terms that one group can compute."""

    terms: list[_Proto] = field(default_factory=list)
    constant: float = 0.0
    flag: tuple[int, bool] | None = None
    norm: int | None = None
    index: tuple[int, bool] | None = None
    table: tables.Table | None = None

    def bound(self, low: _Lowering) -> float:
        """Largest magnitude of the sum, from the ranges of its operands."""
        total = abs(self.constant)
        for p in self.terms:
            a = low.values[p.a]
            size = math.ldexp(max(abs(a.low), abs(a.high)), p.exponent)
            if p.b is not None:
                b = low.values[p.b]
                size *= max(abs(b.low), abs(b.high))
            total += size
        return total

    def conditional(self) -> bool:
        """Whether the flag of the group is taken."""
        return self.flag is not None


class _Lowering:
    def __init__(self, name: str, arith: Arithmetic) -> None:
        self.name = name
        self.arith = arith
        self.values: list[Value] = []
        self.ops: list[Op] = []
        self._names: set[str] = set()
        self._of_node: dict[int, int] = {}
        self._copies: dict[tuple[int, int], int] = {}
        self._constants: dict[tuple[int, int], int] = {}
        self._functions: dict[tuple[object, ...], int] = {}

    # -- values ---------------------------------------------------------------------------------

    def value(self, value: Value) -> int:
        name, k = value.name, 1
        while name in self._names:
            k += 1
            name = f"{value.name}_{k}"
        self._names.add(name)
        self.values.append(replace(value, name=name))
        return len(self.values) - 1

    def leaf(self, node: Node, kind: Kind, default: float = 0.0) -> int:
        fmt = Format.for_range(self.arith.word, node.low, node.high)
        if node.unit == "ht":
            fmt = Format(self.arith.word, self.arith.word - 1)
        number = self.value(Value(node.label, kind, fmt.frac, node.low, node.high, node.source,
                                  node.unit, int(fmt.quantise(default))))
        self._of_node[node.number] = number
        return number

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

    # -- groups ---------------------------------------------------------------------------------

    def group(self, form: _Form, *, name: str, low: float, high: float, source: str,
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
        protos = list(form.terms)
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

    def _raised(self, form: _Form, *, name: str, low: float, high: float, source: str, unit: str,
                overflow: Overflow, frac: int) -> int:
        """``form`` in the finest format that works, then shifted up to ``frac`` step by step."""
        natural = form.bound(self) if overflow is not Overflow.WRAP else 1.0
        part = self.group(form, name=f"{name}_part", low=-natural, high=natural, source=source,
                          unit=unit, overflow=Overflow.CLIP if overflow is Overflow.CLIP
                          else Overflow.SAT)
        step = self.arith.word - 2 - self.arith.guard
        while self.frac(part) + step < frac:
            part = self.group(_Form([_Proto(part)]), name=f"{name}_part", low=low, high=high,
                              source=source, unit=unit, overflow=overflow,
                              frac=self.frac(part) + step, exact_frac=True)
        return self.group(_Form([_Proto(part)]), name=name, low=low, high=high, source=source,
                          unit=unit, overflow=overflow, frac=frac, exact_frac=True)

    def _slack(self, scale: Scale) -> int:
        return int(self.arith.norm_max * _LARGEST_COUNT[scale])

    def _operand_b(self, form: _Form, p: _Proto) -> tuple[int, int]:
        """(fraction bits, magnitude bound) of the second factor; not for times one."""
        if p.coefficient is not None:
            assert form.table is not None
            fmt = tables.coefficient_formats(form.table, self.arith)[p.coefficient]
            return fmt.frac, 1 << (self.arith.word - 1)
        assert p.b is not None
        return (self.arith.fraction_bits if p.fraction_b else self.frac(p.b),
                self.bound(p.b, p.fraction_b))

    def _terms(self, form: _Form, protos: Sequence[_Proto], frac: int) -> list[Term] | None:
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
            one = p.b is None and p.coefficient is None
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

    def _coarsest(self, form: _Form, protos: Sequence[_Proto]) -> int | None:
        """The term whose product has the fewest fraction bits: the one to compute apart."""
        best, found = math.inf, None
        for k, p in enumerate(protos):
            if p.b is None and p.coefficient is None:
                continue
            bits = self.frac(p.a) + self._operand_b(form, p)[0] - p.exponent - self._slack(p.scale)
            if bits < best:
                best, found = bits, k
        return found

    def _separate(self, form: _Form, p: _Proto, name: str) -> _Proto:
        """Compute one product as a value of its own; return the term that adds it."""
        assert p.b is not None and not (p.fraction_a or p.fraction_b)
        va, vb = self.values[p.a], self.values[p.b]
        corners = [math.ldexp(x * y, p.exponent) for x in (va.low, va.high)
                   for y in (vb.low, vb.high)]
        if p.scale is not Scale.NONE:
            raise InputError(f"{self.name}: value {name}: a normalised factor needs a wider range")
        number = self.group(_Form([replace(p, negate=Negate.NO, when=When.ALWAYS)]),
                            name=f"{name}_part", low=min(corners), high=max(corners),
                            source="interval")
        return _Proto(number, negate=p.negate, when=p.when)

    # -- nodes ----------------------------------------------------------------------------------

    def word(self, node: Node, *, frac: int | None = None, odd: bool | None = None) -> int:
        """The value that holds ``node``.

        ``frac`` asks for an exact binary point, ``odd`` for an odd or even one.
        """
        number = self._of_node.get(node.number)
        if number is None and node.kind == "const":
            f = Format.for_range(self.arith.word, node.value, node.value).frac
            return self.constant(node.value, f if frac is None else frac)
        if number is None:
            number = self._create(node, frac, odd)
            self._of_node[node.number] = number
        have = self.frac(number)
        want = have if frac is None else frac
        if odd is not None and (want % 2 == 1) != odd:
            want -= 1
        if want == have:
            return number
        if (number, want) not in self._copies:
            v = self.values[number]
            self._copies[number, want] = self.group(
                _Form([_Proto(number)]), name=f"{v.name}_aligned", low=v.low, high=v.high,
                source=v.range_source, unit=v.unit, frac=want, exact_frac=True)
        return self._copies[number, want]

    def _create(self, node: Node, frac: int | None, odd: bool | None) -> int:
        form = self.form(node, top=True)
        word = self.arith.word
        if node.kind == "wrap":
            return self.group(form, name=node.label, low=-1.0, high=1.0, source="half turns",
                              unit="ht", overflow=Overflow.WRAP, frac=word - 1, exact_frac=True)
        if node.kind == "saturated":
            own = word - 1 - int(math.log2(node.value))
            return self.group(form, name=node.label, low=node.low, high=node.high,
                              source=node.source, unit=node.unit, overflow=Overflow.CLIP,
                              frac=own, exact_frac=True)
        if frac is None and math.isfinite(node.low) and math.isfinite(node.high):
            frac = Format.for_range(word, node.low, node.high).frac
            if odd is not None and (frac % 2 == 1) != odd:
                frac -= 1
        return self.group(form, name=node.label, low=node.low, high=node.high,
                          source=node.source, unit=node.unit, frac=frac)

    def form(self, node: Node, *, top: bool = False, wrapped: bool = False) -> _Form:
        """``node`` as terms of a sum. ``top``: of its own group. ``wrapped``: modulo 2 is free."""
        if node.kind == "const":
            return _Form(constant=node.value)
        if node.number in self._of_node or (not top and not self._fuses(node, wrapped)):
            return _Form([_Proto(self.word(node))])
        return getattr(self, f"_form_{node.kind}")(node, wrapped or node.kind == "wrap")

    def _fuses(self, node: Node, wrapped: bool) -> bool:
        if node.name is not None or node.kind in (*LEAVES, "bounded", "saturated"):
            return False
        if node.kind == "wrap":
            return wrapped and node.uses == 1
        if node.kind == "mul" or (node.kind == "sum" and len(node.args) == 1):
            return node.uses <= 2
        if node.kind in ("rsqrt", "reciprocal"):
            return False
        return node.uses == 1

    def _form_sum(self, node: Node, wrapped: bool) -> _Form:
        total = _Form()
        for arg, sign in zip(node.args, node.signs, strict=True):
            form = self.form(arg, wrapped=wrapped)
            if not self._joins(total, form):
                form = _Form([_Proto(self.word(arg))])
            self._join(total, form, sign)
        return total

    def _joins(self, total: _Form, form: _Form) -> bool:
        def differs(a: object, b: object) -> bool:
            return a is not None and b is not None and a != b
        return not (differs(total.flag, form.flag) or differs(total.norm, form.norm)
                    or differs(total.index, form.index))

    def _join(self, total: _Form, form: _Form, sign: int) -> None:
        total.flag = total.flag or form.flag
        total.norm = form.norm if total.norm is None else total.norm
        total.constant += sign * form.constant
        total.terms += [p if sign > 0 else replace(p, negate=_FLIP[p.negate])
                        for p in form.terms]

    def _form_mul(self, node: Node, wrapped: bool) -> _Form:
        form = _Form()
        factors: list[int] = []
        scale = Scale.NONE
        args, power = self._peel(node)
        if len(args) == 1 and self._fuses(args[0], False):
            form = self.form(args[0])
            form.constant *= power
            form.terms = [replace(p, exponent=p.exponent + int(math.log2(abs(power))),
                                  negate=_FLIP[p.negate] if power < 0 else p.negate)
                          for p in form.terms]
            return form
        exponent = int(math.log2(abs(power)))
        negate = Negate.YES if power < 0 else Negate.NO
        for arg in args:
            if arg.kind in ("rsqrt", "reciprocal") and form.norm is None \
                    and arg.number not in self._of_node and (
                        form.flag is None or arg.kind == "rsqrt"):
                number, more, form.norm = self._mantissa(arg)
                exponent += more
                scale = Scale.HALF if arg.kind == "rsqrt" else Scale.FULL
                factors.append(number)
                if arg.kind == "reciprocal" and arg.args[0].low < 0.0:
                    form.flag = (form.norm, False)
                    negate = _CONDITIONAL[negate]
            elif arg.kind == "abs" and form.flag is None and arg.number not in self._of_node:
                factors.append(self.word(arg.args[0]))
                form.flag = (factors[-1], False)
                negate = _CONDITIONAL[negate]
            else:
                factors.append(self.word(arg))
        form.terms.append(_Proto(factors[0], factors[1] if len(factors) > 1 else None, exponent,
                                 negate=negate, scale=scale))
        return form

    def _peel(self, node: Node) -> tuple[list[Node], float]:
        """Factors of a product, powers of two taken out of them (and of nested products)."""
        args: list[Node] = []
        power = 1.0
        for arg in node.args:
            while True:
                if arg.kind == "const" and _power_of_two(arg.value):
                    power *= arg.value
                    break
                if (arg.kind == "mul" and arg.name is None and arg.number not in self._of_node
                        and arg.args[1].kind == "const" and _power_of_two(arg.args[1].value)):
                    power *= arg.args[1].value
                    arg = arg.args[0]
                    continue
                args.append(arg)
                break
        return args, power

    def _form_select(self, node: Node, wrapped: bool) -> _Form:
        condition, yes, no = node.args
        flag = (self.word(condition), False)
        total = _Form(flag=flag)
        for arg, when in ((yes, When.IF), (no, When.UNLESS)):
            form = self.form(arg, wrapped=wrapped)
            plain = not form.conditional() and all(
                p.when is When.ALWAYS and p.scale is Scale.NONE for p in form.terms)
            if not plain:
                form = _Form([_Proto(self.word(arg))])
            if form.constant != 0.0:
                number = self.constant(form.constant, self._constant_frac(form.constant, node))
                form.terms.append(_Proto(number))
            total.terms += [replace(p, when=when) for p in form.terms]
        return total

    def _constant_frac(self, c: float, node: Node) -> int:
        """Binary point of a constant inside a group: its own, no finer than the result's."""
        word = self.arith.word
        bound = max(abs(node.low), abs(node.high), abs(c))
        return min(Format.for_range(word, c, c).frac, Format.for_range(word, -bound, bound).frac)

    def _form_flip(self, node: Node, wrapped: bool) -> _Form:
        condition, arg = node.args
        form = self.form(arg, wrapped=wrapped)
        if form.conditional() or form.norm is not None:
            form = _Form([_Proto(self.word(arg))])
        if form.constant != 0.0:
            frac = self._constant_frac(form.constant, node)
            form.terms.append(_Proto(self.constant(form.constant, frac)))
            form.constant = 0.0
        form.flag = (self.word(condition), False)
        form.terms = [replace(p, negate=_CONDITIONAL[p.negate]) for p in form.terms]
        return form

    def _form_abs(self, node: Node, wrapped: bool) -> _Form:
        number = self.word(node.args[0])
        return _Form([_Proto(number, negate=Negate.IF)], flag=(number, False))

    def _form_wrap(self, node: Node, wrapped: bool) -> _Form:
        return self.form(node.args[0], wrapped=True)

    def _form_bounded(self, node: Node, wrapped: bool) -> _Form:
        arg = node.args[0]
        return self.form(arg, top=arg.uses == 1 and arg.name is None
                         and arg.kind not in ("wrap", *LEAVES))

    _form_saturated = _form_bounded

    # -- functions ------------------------------------------------------------------------------

    def _cubic(self, table: tables.Table, x: int, quarter: bool) -> list[_Proto]:
        """The two terms w * 1 + t * u of a tabulated function of the word ``x``."""
        w, t = self._segment(table, x, quarter)
        return [_Proto(w), _Proto(t, self._functions["u", x])]

    def _segment(self, table: tables.Table, x: int, quarter: bool) -> tuple[int, int]:
        arith = self.arith
        key = (table.name, x, quarter)
        if key not in self._functions:
            label = f"{table.name}_{self.values[x].name}" if not quarter else \
                f"cos_{self.values[x].name}"
            if ("u", x) not in self._functions:
                self._functions["u", x] = self.group(
                    _Form([_Proto(x, x, fraction_a=True, fraction_b=True)], index=(x, quarter)),
                    name=f"{label}_u", low=0.0, high=1.0, source="table",
                    frac=arith.word - 1, overflow=Overflow.CLIP)
            # The position p counts fractions of a segment: its binary point is fraction_bits.
            c = table.coefficients()
            parts = []
            for first, part in ((2, "t"), (0, "w")):
                low = float((c[:, first] + c[:, first + 1].clip(max=0.0)).min())
                high = float((c[:, first] + c[:, first + 1].clip(min=0.0)).max())
                frac = Format.for_range(arith.word, low, high).frac
                frac = min(frac, table.result_format(arith).frac + arith.guard)
                ones = self.one(arith.word - 2)
                parts.append(self.group(
                    _Form([_Proto(ones, coefficient=first),
                           _Proto(x, coefficient=first + 1, fraction_a=True)],
                          index=(x, quarter), table=table),
                    name=f"{label}_{part}", low=low, high=high, source="table", frac=frac,
                    overflow=Overflow.CLIP))
            self._functions[key] = parts[1]
            self._functions[key, "t"] = parts[0]
        return self._functions[key], self._functions[key, "t"]

    def _form_sin(self, node: Node, wrapped: bool) -> _Form:
        x = self.word(node.args[0], frac=self.arith.word - 1)
        terms = self._cubic(tables.SIN, x, node.quarter)
        return _Form([replace(p, negate=Negate.IF) for p in terms], flag=(x, node.quarter))

    def _form_asin(self, node: Node, wrapped: bool) -> _Form:
        x = self.word(node.args[0], frac=self.arith.word - 2)
        return _Form(self._cubic(tables.ASIN, x, False))

    def _mantissa(self, node: Node) -> tuple[int, int, int]:
        """(mantissa value, exponent, normalised value) of rsqrt or reciprocal.

        x = X 2^-f, X shifted left by n gives m = X 2^n / 2^(W-1); then
        1/sqrt(x) = m^(-1/2) 2^((f-(W-1))/2) 2^(n/2), n even and f-(W-1) even;
        1/x = m^-1 2^(f-(W-1)) 2^n.
        """
        word = self.arith.word
        table = tables.RSQRT if node.kind == "rsqrt" else tables.RECIPROCAL
        odd = (word - 1) % 2 == 1 if node.kind == "rsqrt" else None
        x = self.word(node.args[0], odd=odd)
        more = self.frac(x) - (word - 1)
        exponent = more // 2 if node.kind == "rsqrt" else more
        key = (node.kind, x)
        if key not in self._functions:
            name = self.values[x].name
            negative = self.values[x].low < 0.0 and node.kind == "reciprocal"
            m = self.group(
                _Form([_Proto(x, scale=Scale.EVEN if node.kind == "rsqrt" else Scale.FULL,
                              exponent=self.frac(x) - (word - 1),
                              negate=Negate.IF if negative else Negate.NO)],
                      norm=x, flag=(x, False) if negative else None),
                name=f"{name}_m", low=0.0, high=1.0, source="normalised", frac=word - 1,
                exact_frac=True, overflow=Overflow.CLIP)
            self._functions[key] = self.group(
                _Form(self._cubic(table, m, False)), name=f"{node.kind}_{name}",
                low=table.low, high=table.high, source="table", overflow=Overflow.CLIP,
                frac=table.result_format(self.arith).frac, exact_frac=True)
        return self._functions[key], exponent, x

    def _form_rsqrt(self, node: Node, wrapped: bool) -> _Form:
        number, exponent, x = self._mantissa(node)
        scale = Scale.HALF if node.kind == "rsqrt" else Scale.FULL
        form = _Form([_Proto(number, exponent=exponent, scale=scale)], norm=x)
        if node.kind == "reciprocal" and node.args[0].low < 0.0:
            form.flag = (x, False)
            form.terms = [replace(form.terms[0], negate=Negate.IF)]
        return form

    _form_reciprocal = _form_rsqrt


def _power_of_two(c: float) -> bool:
    return math.frexp(abs(c))[0] == 0.5


def _count_uses(roots: Sequence[Node]) -> None:
    seen: set[int] = set()
    stack = list(roots)
    for node in roots[0].graph.nodes if roots else ():
        node.uses = 0
    for root in roots:
        root.uses += 1
    while stack:
        node = stack.pop()
        if node.number in seen:
            continue
        seen.add(node.number)
        for arg in node.args:
            arg.uses += 1
            stack.append(arg)


def lower(name: str, *, arithmetic: Arithmetic, inputs: Sequence[Node],
          params: Sequence[tuple[Node, float]], states: Sequence[tuple[Node, float, Node]],
          outputs: Mapping[str, Node]) -> Program:
    """Compile a traced step.

    Parameters
    ----------
    inputs, params, states, outputs
        Leaves in stream order; each parameter with its default; each state with its initial value
        and the node that replaces it; named results in stream order.

    Raises
    ------
    InputError
        A range is not finite, or a value would pass 63 bits: the message names it.
    """
    low = _Lowering(name, arithmetic)
    _count_uses([*outputs.values(), *(nxt for _, _, nxt in states)])
    input_values = tuple(low.leaf(n, Kind.INPUT) for n in inputs)
    for node, default in params:
        low.leaf(node, Kind.PARAM, default)
    state_values = [low.leaf(n, Kind.STATE, initial) for n, initial, _ in states]
    output_values = tuple(low.word(n) for n in outputs.values())
    next_values = tuple((s, low.word(nxt, frac=low.frac(s)))
                        for s, (_, _, nxt) in zip(state_values, states, strict=True))
    return Program(name, arithmetic, tuple(low.values), tuple(low.ops), input_values,
                   output_values, tuple(outputs), next_values, tables.table_memory(arithmetic))
