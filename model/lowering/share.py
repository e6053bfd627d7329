"""Products that are too fine for their sums: one coarser factor for several of them.

The shift of a term has an end, so `model.lowering.groups` computes a product that is much finer
than its sum as a value of its own. Where several such products have a factor in common, one coarser
copy of it takes them back into their sums: one operation for many. What it leaves out is at most
the accumulator's last bit.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace

from boresight.model.lowering.forms import Product
from boresight.model.lowering.groups import Groups
from boresight.model.words.program import Scale

__all__ = ["FEWEST", "share"]

#: Products that a copy serves at least.
FEWEST = 4


@dataclass(frozen=True)
class _Separate:
    """A product with a value of its own: that, the value of its sum, and the excess bits."""

    number: int
    of: int
    product: Product
    excess: int

    @property
    def copies(self) -> set[tuple[int, int]]:
        """Coarser factors that return it to its sum; an even number of bits is removed."""
        assert self.product.b is not None
        bits = self.excess + self.excess % 2
        return {(self.product.a, bits), (self.product.b, bits)}


def share(groups: Groups) -> None:
    """Take products back into their sums where `FEWEST` or more share a coarser factor."""
    candidates = [*_separate_products(groups)]
    while candidates:
        [(copy, count)] = Counter(c for a in candidates for c in sorted(a.copies)).most_common(1)
        if count < FEWEST:
            break
        _merge(groups, *copy, [a for a in candidates if copy in a.copies])
        candidates = [a for a in candidates if copy not in a.copies]


def _separate_products(groups: Groups) -> Iterator[_Separate]:
    """Products of two words that have values of their own and are added once."""
    readers: dict[int, list[int]] = {}
    for op in groups.ops:
        for operand in op.operands():
            if operand in groups.separate_products:
                readers.setdefault(operand, []).append(op.dest)
    for number, p in groups.separate_products.items():
        sums = readers.get(number, [])
        if len(sums) == 1 and p.b is not None and p.scale is Scale.NONE:
            excess = groups.excess(p, groups.frac(p.b), groups.frac(sums[0]))
            if excess > 0:
                yield _Separate(number, sums[0], p, excess)


def _merge(groups: Groups, factor: int, bits: int, candidates: list[_Separate]) -> None:
    """Exchange what the sums add for products with a copy of ``factor``, made before the first."""
    before = len(groups.ops)
    copy = groups.coarse(factor, bits)
    copy_ops = groups.ops[before:]
    del groups.ops[before:]
    place = {op.dest: k for k, op in enumerate(groups.ops)}
    first = before
    for a in candidates:
        k = place[a.of]
        p = a.product
        coarser = replace(p, a=copy) if p.a == factor else replace(p, b=copy)
        terms = groups.forms[a.of].products
        op = groups.exchanged(groups.ops[k], [coarser if t.a == a.number else t for t in terms])
        if op is not None:
            groups.ops[k] = op
            first = min(first, k)
    groups.ops[first:first] = copy_ops
