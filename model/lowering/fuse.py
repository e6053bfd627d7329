"""Fusion: which nodes become groups of their own, and which part of the group that uses them.

Every node that is needed as a word becomes one multiply-accumulate group; products, signs,
selections and the last step of a function fuse into the group that consumes them.
`model.lowering.groups` gives each group its shifts and its binary point.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

from boresight.model.errors import InputError, require
from boresight.model.lowering.graph import LEAVES, Graph, Node
from boresight.model.lowering.groups import CONDITIONAL, Form, Groups, Product, Target
from boresight.model.words import tables
from boresight.model.words.fixed import Arithmetic, Format
from boresight.model.words.program import Kind, Negate, Overflow, Scale, Value, When
from boresight.model.words.rounded import binary_exponent

#: Bits that the arguments of a reciprocal may span: those of the widest word.
_WIDEST = Arithmetic(word=32).norm_max
#: Kinds of nodes that are always words.
_ALONE = ("rsqrt", "reciprocal", "normalised")


class Fusion:
    def __init__(self, graph: Graph, arith: Arithmetic) -> None:
        self.graph = graph
        self.groups = Groups(graph.name, arith)
        self._of_node: dict[int, int] = {}
        self._copies: dict[tuple[int, int], int] = {}
        self._limits: dict[int, Value] = {}
        #: Parts of functions of words, each expanded once.
        self._squares: dict[int, int] = {}
        self._segments: dict[tuple[str, int, bool], tuple[int, int]] = {}
        self._mantissas: dict[tuple[str, int], int] = {}

    def holders(self, node: Node) -> list[int]:
        """Values that hold a node: its own, then copies with other binary points."""
        number = self._of_node.get(node.number)
        copies = [copy for (of, _), copy in self._copies.items() if of == number]
        return [] if number is None else [number, *copies]

    def leaf(
        self, node: Node, default: float = 0.0, meaning: str = "", frac: int | None = None
    ) -> int:
        """The value of an input, parameter or state; ``frac`` is the binary point it comes with."""
        word = self.groups.arith.word
        fmt = Format.declared(word, node.low, node.high, node.unit)
        if frac is not None:
            fmt = Format(word, frac)
        span = node.low, node.high, node.source, node.unit
        kind, initial = Kind(node.kind), int(fmt.quantise(default))
        value = Value(node.label, kind, fmt.frac, *span, initial, meaning)
        self._of_node[node.number] = self.groups.value(value)
        return self._of_node[node.number]

    def limit(self, node: Node, state: int) -> None:
        """Hold ``node``, which replaces a state, in that state's range and format.

        It is limited there in any case. Of several states the widest counts; a node whose interval
        has as fine a format keeps it.
        """
        said = self.groups.values[state]
        known = self._limits.get(node.number)
        inside = said.low <= node.low and node.high <= said.high
        if inside or node.kind == "saturated" or not math.isfinite(sum(node.span)):
            return
        own = Format.for_range(self.groups.arith.word, *node.span)
        if own.frac < said.frac and (known is None or said.frac < known.frac):
            self._limits[node.number] = said

    def replacing(self, node: Node, state: int) -> int:
        """The value that replaces a state: ``node``, in the state's format.

        Of a node that `limit` holds in it and that is read besides, a copy: an output leaves three
        cycles earlier where an operation reads it.
        """
        frac, number = self.groups.frac(state), self._of_node.get(node.number)
        if number is not None and node.number in self._limits:
            return self._copy(node, number, frac)
        return self.word(node, frac=frac)

    def word(self, node: Node, *, frac: int | None = None, odd: bool | None = None) -> int:
        """The value that holds ``node``; InputError if no word does, or none that can take part.

        ``frac`` asks for an exact binary point, ``odd`` for an odd or even one.
        """
        try:
            return self._word(node, frac, odd)
        except (OverflowError, RecursionError) as error:  # formats without end
            where, found = node.line or self.groups.name, f"{node.description} in {node.range}"
            wanted = "numbers of a size that words can be shifted to"
            fix = "declare ranges, or scale constants, nearer to 1"
            raise InputError.at(where, wanted=wanted, found=found, fix=fix) from error

    def _word(self, node: Node, frac: int | None, odd: bool | None) -> int:
        if node.kind == "const":
            fmt = Format.for_range(self.groups.arith.word, node.value, node.value)
            if frac is not None:
                fmt = Format(fmt.word, frac)
            if not fmt.min - fmt.lsb <= node.value <= fmt.max + fmt.lsb:
                raise OverflowError
            return self.groups.constant(node.value, fmt.frac)
        number = self._of_node.get(node.number)
        if number is None:
            number = self._of_node[node.number] = self._create(node, frac, odd)
        have = self.groups.frac(number)
        want = have if frac is None else frac
        if odd is not None and (want % 2 == 1) != odd:
            want -= 1
        return number if want == have else self._copy(node, number, want)

    def _copy(self, node: Node, number: int, frac: int) -> int:
        """The value that holds ``node``, as ``number`` does, with this binary point."""
        if (number, frac) not in self._copies:
            v = self.groups.values[number]
            target = Target(f"{v.name}_aligned", v.low, v.high, v.range_source, v.unit)
            target = replace(target, line=node.line)
            form = Form([Product(number)])
            self._copies[number, frac] = self.groups.group(form, target, frac=frac, exact=True)
        return self._copies[number, frac]

    def _create(self, node: Node, frac: int | None, odd: bool | None) -> int:
        form = self.form(node, top=True)
        word = self.groups.arith.word
        low, high = node.span
        found, finite = f"{node.description} in {node.range}", math.isfinite(low + high)
        fix = "declare it with ops.bounded, or limit it with ops.clip"
        require(finite, node.line or self.groups.name, "a finite range", found, fix)
        target = Target(node.label, low, high, node.source, node.unit, line=node.line)
        if node.kind in ("wrap", "normalised", "saturated"):
            wraps = node.kind == "wrap"
            target = replace(target, overflow=Overflow.WRAP if wraps else Overflow.CLIP)
            frac = word - 1 - binary_exponent(node.high if wraps else node.value or 1.0)
            return self.groups.group(form, target, frac=frac, exact=True)
        if (said := self._limits.get(node.number)) is not None:
            low, high = (min(max(edge, said.low), said.high) for edge in (low, high))
            target = replace(target, low=low, high=high)
            return self.groups.group(form, target, frac=said.frac if frac is None else frac)
        if odd is not None:
            frac = Format.for_range(word, low, high).frac
            frac -= (frac % 2 == 1) != odd
        return self.groups.group(form, target, frac=frac)

    def form(self, node: Node, *, top: bool = False, wrapped: float = 0.0) -> Form:
        """``node`` as terms of a sum. ``top``: of its own group. ``wrapped``: a free period."""
        if node.kind == "const":
            return Form(constant=node.value)
        if node.number in self._of_node or (not top and not self._fuses(node, wrapped)):
            return Form([Product(self.word(node))])
        build: Callable[[Node, float], Form] = getattr(self, f"_form_{node.kind}")
        return build(node, wrapped)

    def _fuses(self, node: Node, wrapped: float = 0.0) -> bool:
        if node.name is not None or node.kind in (*LEAVES, "bounded", "saturated"):
            return False
        if node.kind == "wrap":
            return wrapped > 0.0 and node.value % wrapped == 0.0 and node.uses == 1
        if node.kind == "mul" or (node.kind == "sum" and len(node.args) == 1):
            return node.uses <= 2
        return node.uses == 1 and node.kind not in _ALONE

    def _form_sum(self, node: Node, wrapped: float) -> Form:
        total = Form()
        for arg, sign in zip(node.args, node.signs, strict=True):
            form = self.form(arg, wrapped=wrapped)
            if not total.joins(form):
                form = Form([Product(self.word(arg))])
            total.join(form, sign)
        return total

    def _form_mul(self, node: Node, wrapped: float) -> Form:
        args, power = self._peel(node)
        if len(args) == 1 and self._fuses(args[0]):
            form = self.form(args[0])
            form.constant *= power
            form.products = [p.times_power(power) for p in form.products]
            return form
        return self._product(args, power, max(-node.low, node.high))

    def _product(self, args: Sequence[Node], power: float = 1.0, limit: float = math.inf) -> Form:
        """One product of one or two factors; one of them may be a root, reciprocal or magnitude."""
        form = Form()
        factors: list[int] = []
        exponent, scale, negate = 0, Scale.NONE, Negate.NO
        for arg in args:
            fresh = arg.number not in self._of_node
            is_root = arg.kind == "rsqrt" or (arg.kind == "reciprocal" and form.flag is None)
            if fresh and form.norm is None and is_root:
                number, more, form.norm = self._mantissa(arg)
                exponent += more
                scale = Scale.HALF if arg.kind == "rsqrt" else Scale.FULL
                factors.append(number)
                if arg.args[0].low < 0.0:  # as no root's is
                    form.flag = (form.norm, False)
                    negate = CONDITIONAL[negate]
            elif fresh and arg.kind == "abs" and form.flag is None:
                factors.append(self.word(arg.args[0]))
                form.flag = (factors[-1], False)
                negate = CONDITIONAL[negate]
            else:
                factors.append(self.word(arg))
        second = factors[1] if len(factors) > 1 else None
        product = Product(factors[0], second, exponent, negate=negate, scale=scale)
        form.products.append(replace(product.times_power(power), limit=limit))
        return form

    def _form_abs(self, node: Node, wrapped: float) -> Form:
        return self._product([node])

    _form_rsqrt = _form_reciprocal = _form_abs

    def _peel(self, node: Node) -> tuple[list[Node], float]:
        """Factors of a product, powers of two taken out of them (and of nested products)."""
        args: list[Node] = []
        power = 1.0
        for arg in node.args:
            while (
                arg.kind == "mul"
                and arg.name is None
                and arg.number not in self._of_node
                and _power_of_two(arg.args[1])
            ):
                power *= arg.args[1].value
                arg = arg.args[0]
            if _power_of_two(arg):
                power *= arg.value
            else:
                args.append(arg)
        return args, power

    def _form_select(self, node: Node, wrapped: float) -> Form:
        condition, yes, no = node.args
        total = Form(flag=(self.word(condition), False))
        for arg, when in ((yes, When.IF), (no, When.UNLESS)):
            total.products += [replace(p, when=when) for p in self._flagged(arg, node, wrapped)]
        return total

    def _form_flip(self, node: Node, wrapped: float) -> Form:
        condition, arg = node.args
        products = self._flagged(arg, node, wrapped)
        negated = [replace(p, negate=CONDITIONAL[p.negate]) for p in products]
        return Form(negated, flag=(self.word(condition), False))

    def _flagged(self, arg: Node, node: Node, wrapped: float) -> list[Product]:
        """Terms of ``arg`` under the flag of ``node``'s group.

        A constant is as fine as the accumulator can use.
        """
        form = self.form(arg, wrapped=wrapped)
        if form.flag is not None or form.norm is not None:
            return [Product(self.word(arg))]
        if (c := form.constant) != 0.0:
            arith, bound = self.groups.arith, max(*map(abs, node.span), abs(c))
            largest = Format.for_range(arith.word, -bound, bound).frac + arith.guard
            frac = min(Format.for_range(arith.word, c, c).frac, largest)
            form.products.append(Product(self.groups.constant(c, frac)))
        return form.products

    def _form_normalised(self, node: Node, wrapped: float) -> Form:
        """a 2^n of the count n of leading sign bits that the second word has."""
        number, size = (self.word(arg) for arg in node.args)
        exponent = self.groups.frac(size) - (self.groups.arith.word - 1)
        product = Product(number, exponent=exponent, scale=Scale.FULL, limit=1.0, within=True)
        return Form([product], norm=size)

    def _form_wrap(self, node: Node, wrapped: float) -> Form:
        return self.form(node.args[0], wrapped=node.value)

    def _form_bounded(self, node: Node, wrapped: float) -> Form:
        arg = node.args[0]
        joins = arg.uses == 1 and arg.name is None
        return self.form(arg, top=joins and arg.kind not in ("wrap", "saturated", *LEAVES))

    _form_saturated = _form_bounded

    def _form_sin(self, node: Node, wrapped: float) -> Form:
        x = self.word(node.args[0], frac=self.groups.arith.word - 1)
        products = self._cubic(tables.SIN, x, node.quarter)
        return Form([replace(p, negate=Negate.IF) for p in products], flag=(x, node.quarter))

    def _form_asin(self, node: Node, wrapped: float) -> Form:
        x = self.word(node.args[0], frac=self.groups.arith.word - 2)
        return Form(self._cubic(tables.ASIN, x))

    def _cubic(self, table: tables.Table, x: int, quarter: bool = False) -> list[Product]:
        """The two products w * 1 and t * u of a tabulated function of the word ``x``.

        The function is ``w + t * u`` (see `model.words.tables`)::

            u = p * p      w = c0 + c1 * p      t = c2 + c3 * p      p: position in the segment
        """
        key = (table.name, x, quarter)
        if key not in self._segments:
            self._segments[key] = self._expand(table, x, quarter)
        w, t = self._segments[key]
        return [Product(w), Product(t, self._squares[x])]

    def _expand(self, table: tables.Table, x: int, quarter: bool) -> tuple[int, int]:
        groups, arith = self.groups, self.groups.arith
        label = f"{'cos' if quarter else table.name}_{groups.values[x].name}"
        if x not in self._squares:
            form = Form([Product(x, x, fraction_a=True, fraction_b=True)], index=(x, quarter))
            target = Target(f"{label}_u", 0.0, 1.0, "table", overflow=Overflow.CLIP)
            self._squares[x] = groups.group(form, target, frac=arith.word - 1)
        c = table.coefficients
        parts = {}
        for first, part in ((2, "t"), (0, "w")):
            low = float((c[:, first] + c[:, first + 1].clip(max=0.0)).min())
            high = float((c[:, first] + c[:, first + 1].clip(min=0.0)).max())
            frac = tables.part_format(table, arith, low, high).frac
            constant = Product(groups.unit(arith.word - 2), coefficient=first)
            slope = Product(x, coefficient=first + 1, fraction_a=True)
            form = Form([constant, slope], index=(x, quarter), table=table)
            target = Target(f"{label}_{part}", low, high, "table", overflow=Overflow.CLIP)
            parts[part] = groups.group(form, target, frac=frac)
        return parts["w"], parts["t"]

    def _mantissa(self, node: Node) -> tuple[int, int, int]:
        """(value m', exponent e, normalised value x) of an rsqrt or reciprocal node.

        x = X 2^-f, X shifted left by its normalisation count n gives m = X 2^n / 2^(W-1); then

        * 1/sqrt(x) = m' 2^e 2^(n/2), m' = m^(-1/2), e = (f - (W-1)) / 2, n even, f - (W-1) even;
        * 1/x = m' 2^e 2^n, m' = 1/|m|, e = f - (W-1), with the sign of x.

        The exponent comes back as a term's scale (`model.words.program.Scale`).
        """
        groups, arith, kind, arg = self.groups, self.groups.arith, node.kind, node.args[0]
        root = kind == "rsqrt"
        x = self.word(arg, odd=(arith.word - 1) % 2 == 1 if root else None)
        if not root:
            self.graph.line = node.line
            x = self._far_from_zero(arg, x)
        table = tables.RSQRT if root else tables.RECIPROCAL
        exponent = groups.frac(x) - (arith.word - 1)
        if (kind, x) not in self._mantissas:
            name = groups.values[x].name
            negative = groups.values[x].low < 0.0 and not root
            scale, negate = Scale.EVEN if root else Scale.FULL, Negate.IF if negative else Negate.NO
            product = Product(x, scale=scale, exponent=exponent, negate=negate)
            form = Form([product], norm=x, flag=(x, False) if negative else None)
            target = Target(f"{name}_m", 0.0, 1.0, "normalised", overflow=Overflow.CLIP)
            m = groups.group(form, target, frac=arith.word - 1, exact=True)
            form = Form(self._cubic(table, m))
            limits = table.low, table.high, "table"
            target = Target(f"{kind}_{name}", *limits, overflow=Overflow.CLIP)
            frac = table.result_format(arith).frac
            self._mantissas[kind, x] = groups.group(form, target, frac=frac, exact=True)
        return self._mantissas[kind, x], exponent // 2 if root else exponent, x

    def _far_from_zero(self, arg: Node, x: int) -> int:
        """The word ``x`` of a reciprocal's argument, at least what the word can normalise.

        A range that the widest word could hold is limited from below where this one cannot, so
        that an estimator is legal at every width or at none.
        """
        arith = self.groups.arith
        smallest = min(abs(arg.low), abs(arg.high))
        floor = math.ldexp(1.0, arith.guard - self.groups.frac(x))
        if smallest >= floor:
            return x
        if not arg.low > 0.0 or not floor <= arg.high <= math.ldexp(smallest, _WIDEST):
            wanted = f"a divisor whose range, and word, span at most 2^{_WIDEST}"
            raise self.graph.outside(arg, wanted, "divide by ops.clip(x, SMALLEST, LARGEST)")
        g = self.graph
        limit = g.const(floor)
        limited = g.select(g.less(arg, limit), limit, arg)
        return self.word(g.bounded(limited, floor, arg.high, "what the word can normalise"))


def _power_of_two(node: Node) -> bool:
    return node.kind == "const" and math.frexp(abs(node.value))[0] == 0.5
