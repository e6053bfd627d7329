"""Programs and a plain reference that the tests of the emitted C share."""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Sequence
from itertools import product

import pytest

from boresight.firmware.layout import definitions
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import (
    Kind,
    Negate,
    Op,
    Overflow,
    Program,
    Scale,
    Term,
    Value,
    When,
)

Rows = list[list[int]]


class Plain:
    """The docstrings of `model.words.fixed` and `model.words.program` in plain integers."""

    def __init__(self, program: Program) -> None:
        self.program = program
        self.words = {n: v.initial for n, v in enumerate(program.values)}

    def update(self, row: Sequence[int]) -> tuple[list[int], bool, dict[int, int]]:
        """Outputs, saturated, and every word with the states as they were."""
        p, w = self.program, self.words
        w.update(zip(p.inputs, row, strict=True))
        saturated = False
        for op in p.ops:
            w[op.dest], clamped = self.run(op)
            saturated |= clamped and op.overflow is Overflow.SAT
        before = dict(w)
        w.update({state: before[source] for state, source in p.states})
        return [before[n] for n in p.outputs], saturated, before

    def bits(self, word: int) -> str:
        """Two's complement digits, sign bit first."""
        width = self.program.arithmetic.word
        return format(word % 2**width, f"0{width}b")

    def run(self, op: Op) -> tuple[int, bool]:
        arith, w = self.program.arithmetic, self.words
        quarter = 2 ** (arith.word - 2)
        acc = 2 ** (arith.guard - 1)
        flag = op.flag is not None and self.bits(w[op.flag] + quarter * op.flag_quarter)[0] == "1"
        n = 0
        if op.norm is not None:
            bits = self.bits(w[op.norm])
            n = min(len(bits) - len(bits.lstrip(bits[0])) - 1, arith.norm_max)
        for t in op.terms:
            if t.b is None:
                assert op.table is not None and op.index is not None
                index = int(self.bits(w[op.index] + quarter * op.index_quarter)[1:8], 2)
                b = self.program.table_memory[512 * op.table + 4 * index + (t.coefficient or 0)]
            else:
                b = int(self.bits(w[t.b])[8:], 2) if t.fraction_b else w[t.b]
            a = int(self.bits(w[t.a])[8:], 2) if t.fraction_a else w[t.a]
            less = {Scale.NONE: 0, Scale.FULL: n, Scale.EVEN: n - n % 2, Scale.HALF: n // 2}
            part = a * b // 2 ** max(t.shift - less[t.scale], 0)
            if (
                t.negate is Negate.YES
                or (t.negate is Negate.IF and flag)
                or (t.negate is Negate.UNLESS and not flag)
            ):
                part = -part
            if t.when is When.ALWAYS or (t.when is When.IF) == flag:
                acc += part
        q = acc // 2**arith.guard
        if op.overflow in (Overflow.WRAP, Overflow.RANGE):
            return (q - arith.min_int) % 2**arith.word + arith.min_int, False
        word = max(arith.min_int, min(arith.max_int, q))
        return word, word != q


def _corner(word: int) -> Program:
    """Every option of a term and of an operation, each with every other that concerns it."""
    arith = Arithmetic(word)
    low, high, rng = arith.min_int, arith.max_int, random.Random(word)
    values: list[Value] = []
    ops: list[Op] = []

    def value(name: str, kind: Kind, initial: int = 0) -> int:
        values.append(Value(name, kind, word - 1, -1.0, 1.0, "test", "half turns", initial))
        return len(values) - 1

    x, y = value("x", Kind.INPUT), value("y", Kind.INPUT)
    gain, bias = value("gain", Kind.PARAM, low), value("bias", Kind.PARAM, high)
    left, right = value("left", Kind.STATE, low), value("right", Kind.STATE, high)
    last, kept = value("last", Kind.STATE, -1), value("kept", Kind.STATE, 5)
    least, one = value("least", Kind.CONST, low), value("one", Kind.CONST, 1 << (word - 2))

    def op(*terms: Term, **options: object) -> int:
        dest = value(f"r{len(ops)}", Kind.OP)
        overflow = list(Overflow)[len(ops) % 3]
        ops.append(Op(dest, terms, **{"overflow": overflow, **options}))  # type: ignore[arg-type]
        return dest

    usual = word - 1 - arith.guard
    for k, (negate, when, scale, quarter) in enumerate(product(Negate, When, Scale, (False, True))):
        op(
            Term(x, y, (usual, 0, 31, usual + 4)[k % 4], negate=negate, when=when, scale=scale),
            flag=(y, x, left)[k % 3],
            flag_quarter=quarter,
            norm=(x, last)[k % 2],
        )
    for overflow, (a, b), shift in product(
        list(Overflow)[:3], ((x, y), (x, least), (gain, right), (x, x)), (0, usual - 1, 31)
    ):
        op(Term(a, b, shift), overflow=overflow)
    for coefficient, quarter, fraction, block in product(
        range(4), (False, True), (False, True), range(2)
    ):
        op(
            Term(one, None, usual, coefficient),
            Term(x, y, usual, fraction_a=fraction, fraction_b=quarter),
            Term(y, None, usual, (coefficient + 1) % 4, fraction_a=fraction, negate=Negate.YES),
            index=x,
            index_quarter=quarter,
            table=block,
        )
    many = op(
        *(
            Term(a, b, usual, negate=negate)
            for a, b, negate in product((x, gain, left), (y, bias), (Negate.NO, Negate.YES))
        )
    )
    outputs = (*(o.dest for o in ops), left, kept, one, x, many)
    table = tuple(rng.choice((low, high, 0, -1, rng.randint(low, high))) for _ in range(1024))
    return Program(
        f"corner_{word}",
        arith,
        tuple(values),
        tuple(ops),
        inputs=(x, y),
        outputs=outputs,
        output_names=tuple(f"out{k}" for k in range(len(outputs))),
        states=((left, right), (right, left), (last, many), (kept, kept)),
        table_memory=table,
    )


def _corner_rows(word: int) -> Rows:
    arith, rng = Arithmetic(word), random.Random(word)
    low, high, quarter = arith.min_int, arith.max_int, 1 << (word - 2)
    edges = [0, 1, -1, low, high, low + 1, high - 1, quarter, quarter - 1, -quarter, -quarter - 1]
    rows = [[a, b] for a in edges for b in edges]
    for _ in range(400):
        rows.append([rng.randint(low, high) >> rng.randrange(word) for _ in range(2)])
    return rows


def _odd_names() -> Program:
    """Names that are no identifiers, collide, or would end a comment."""
    names = ["int", "2nd", "q.w", "q_w", "*/ int x; /*", "back\\", "??/", "Δψ", "", "_Bool"]
    names += ["INT32_MAX", "saturated", "line\nbreak", "int32_t", "SELF", "acc", "P_H", "P_WORD"]
    names += re.findall(r"#define (\w+)", definitions(Arithmetic()))
    kinds = [Kind.INPUT, Kind.PARAM, Kind.STATE, Kind.CONST]
    values = [
        Value(name, kind, frac, -1e9, 1.0, "test", unit="µT \\", initial=k)
        for k, (name, kind, frac) in enumerate(product(names, kinds, (-3,)))
    ]
    values += [Value(name, Kind.OP, 40, -1e-9, 1.0, "test") for name in names]
    numbers = {kind: tuple(n for n, v in enumerate(values) if v.kind is kind) for kind in Kind}
    ops = tuple(
        Op(dest, (Term(a, b, 22), Term(c, s, 22, negate=Negate.YES)))
        for dest, a, b, c, s in zip(
            *(numbers[k] for k in (Kind.OP, Kind.INPUT, Kind.PARAM, Kind.CONST, Kind.STATE)),
            strict=True,
        )
    )
    results = numbers[Kind.OP]
    return Program(
        "0 odd/*name*/",
        Arithmetic(),
        tuple(values),
        ops,
        numbers[Kind.INPUT],
        results,
        tuple(names),
        tuple(zip(numbers[Kind.STATE], results, strict=True)),
        (),
    )


def _empty() -> Program:
    return Program("empty", Arithmetic(), (), (), (), (), (), (), ())


@pytest.fixture(scope="session")
def plain() -> type[Plain]:
    return Plain


@pytest.fixture(scope="session")
def corner() -> Callable[[int], Program]:
    return _corner


@pytest.fixture(scope="session")
def corner_rows() -> Callable[[int], Rows]:
    return _corner_rows


@pytest.fixture(scope="session")
def odd_names() -> Program:
    return _odd_names()


@pytest.fixture(scope="session")
def empty() -> Program:
    return _empty()
