"""Programs, as written and as random."""

import dataclasses
import enum
from typing import Any

from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import (
    InPort,
    Kind,
    Negate,
    Op,
    Overflow,
    Port,
    Program,
    Scale,
    Term,
    Value,
    When,
)
from tests.support.random_program import random_program

# -- the program as a record: text form, identity, look-ups ---------------------------------------


def small() -> Any:
    """A program that uses every field once."""
    value = (
        Value("a", Kind.INPUT, 17, -1.0, 1.0, "declared", "m"),
        Value("p", Kind.PARAM, 16, 0.0, 2.0, "declared", "", 5),
        Value("s", Kind.STATE, 15, -4.0, 4.0, "declared", "ht", -3),
        Value("c", Kind.CONST, 14, 1.0, 1.0, "constant", "", 1 << 14),
        Value("y", Kind.OP, 15, -4.0, 4.0, "interval"),
        Value("z", Kind.OP, 15, -4.0, 4.0, "table"),
    )
    ops = (
        Op(
            4,
            (
                Term(0, 1, 3),
                Term(2, 3, 14, negate=Negate.IF, when=When.UNLESS),
                Term(0, 3, 7, scale=Scale.HALF),
            ),
            Overflow.SAT,
            flag=2,
            flag_quarter=True,
            norm=0,
        ),
        Op(
            5,
            (
                Term(3, None, 2, coefficient=1, negate=Negate.YES),
                Term(4, 4, 9, fraction_a=True, fraction_b=True),
            ),
            Overflow.WRAP,
            index=4,
            index_quarter=True,
            table=2,
        ),
    )
    return Program(
        "small",
        Arithmetic(word=18),
        value,
        ops,
        (0,),
        (5, 4),
        ("zed", "why"),
        ((2, 4),),
        tuple(range(1536)),
        (Port("zed", "m", 0.5, "meant"),),
        1,
    )


def variants(x: Any) -> Any:
    """``x`` with one thing changed, in every way the types allow."""
    if isinstance(x, enum.Enum):
        yield from (y for y in type(x) if y is not x)
    elif isinstance(x, bool):
        yield not x
    elif isinstance(x, int):
        yield x + 1
    elif isinstance(x, float):
        yield x + 0.5
    elif isinstance(x, str):
        yield x + "_"
    elif x is None:
        yield 0
    elif isinstance(x, tuple):
        yield x[:-1]
        for k, item in enumerate(x[:6]):
            yield from ((*x[:k], y, *x[k + 1 :]) for y in variants(item))
    elif dataclasses.is_dataclass(x) and not isinstance(x, type):
        for f in dataclasses.fields(x):
            yield from (dataclasses.replace(x, **{f.name: y}) for y in variants(getattr(x, f.name)))


def said(p: Any) -> Any:
    """What is only said: names and ranges of values in between, sources, meanings, ports."""
    return [
        (v.range_source, v.meaning)
        if v.kind in (Kind.INPUT, Kind.PARAM, Kind.STATE)
        else (v.name, v.low, v.high, v.range_source, v.unit, v.meaning)
        for v in p.values
    ] + [p.ports, p.in_ports, p.urgent]


def test_the_digest_sees_what_the_hardware_does_and_nothing_else() -> None:
    p = dataclasses.replace(small(), in_ports=(InPort(0.5, ("b",)),))
    seen = {p.digest}
    same = 0
    for changed in variants(p):
        kinds = [v.kind for v in changed.values]
        if kinds == [v.kind for v in p.values] and said(changed) != said(p):
            same += 1
            assert changed.digest == p.digest
        else:
            assert changed.digest not in seen
            seen.add(changed.digest)
    assert len(seen) > 140 and same == 3 * 2 + 3 * 6 + 6 + 4 + 1


# -- random programs are legal and varied ---------------------------------------------------------


def test_everything_occurs() -> None:
    ops = [op for seed in range(40) for op in random_program(seed).ops]
    terms = [t for op in ops for t in op.terms]
    assert {op.overflow for op in ops} == set(Overflow) - {Overflow.RANGE}  # see `with_ranges`
    assert {t.negate for t in terms} == set(Negate)
    assert {t.when for t in terms} == set(When)
    assert {t.scale for t in terms} == set(Scale)
    assert {t.coefficient for t in terms} == {None, 0, 1, 2, 3}
    assert {op.table for op in ops} == {None, 0, 1, 2}
    assert {op.flag_quarter for op in ops} == {op.index_quarter for op in ops} == {False, True}
