"""Random programs: legal, and busy in every corner of the machine.

The same seed gives the same program. Used to compare interpreter, C and core word for word.
"""

from __future__ import annotations

import random
from dataclasses import dataclass, field, replace

from boresight.model.lowering.lower import watched
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


def random_program(
    seed: int,
    *,
    word: int = 32,
    n_ops: int = 40,
    n_inputs: int | None = None,
    n_outputs: int | None = None,
    n_states: int | None = None,
    recent: float = 0.5,
) -> Program:
    """A random legal program.

    Parameters
    ----------
    seed : int
        Same seed, same program.
    word : int, 18..32
        Bits of a word.
    n_ops : int, >= 1
        Number of operations (a table bundle counts as its groups).
    n_inputs, n_outputs : int, >= 1, optional
        Length of the records. Default: random.
    n_states : int, >= 0, optional
        Default: random.
    recent : float, 0..1
        Share of operands taken from the latest results: larger is a deeper program.
    """
    if n_ops < 1:
        raise ValueError(f"n_ops must be at least 1, not {n_ops!r}")
    if not 0.0 <= recent <= 1.0:
        raise ValueError(f"recent must be 0 to 1, not {recent!r}")
    return _Builder(random.Random(seed), Arithmetic(word), recent).build(
        f"random_{seed}_{word}_{n_ops}", n_ops, n_inputs, n_outputs, n_states
    )


def with_ranges(program: Program, seed: int) -> Program:
    """The program with random ranges of its inputs, which it watches."""
    rng = random.Random(seed)
    first, last = program.arithmetic.min_int, program.arithmetic.max_int
    values = list(program.values)
    for n in program.inputs:
        a, b = sorted(_word(rng, program.arithmetic) for _ in range(2))
        high = min(max(abs(a), 1), last)
        low, high = rng.choice(((a, b), (first, b), (a, last), (-high, high), (0, high)))
        form = program.format(n)
        values[n] = replace(values[n], low=float(form.real(low)), high=float(form.real(high)))
    return watched(replace(program, values=tuple(values)), program.inputs)


def random_programs(
    seed: int, count: int, *, word: int = 32, n_ops: int = 20, n_states: int | None = None
) -> list[Program]:
    """Random programs for one core: the same function tables, as many inputs and outputs."""
    rng = random.Random(seed)
    n_inputs, n_outputs = rng.randint(1, 6), rng.randint(1, 4)
    programs = [
        random_program(
            rng.getrandbits(32),
            word=word,
            n_ops=rng.randint(1, 2 * n_ops),
            n_inputs=n_inputs,
            n_outputs=n_outputs,
            n_states=n_states,
        )
        for _ in range(count)
    ]
    programs = [
        replace(p, name=f"random{k}", table_memory=programs[0].table_memory)
        for k, p in enumerate(programs)
    ]
    return programs


def random_inputs(program: Program, seed: int, steps: int) -> list[list[int]]:
    """``steps`` records of input words: small ones, large ones, the extremes, zero, ends."""
    rng = random.Random(seed)
    arith, ranges = program.arithmetic, program.input_ranges.T.tolist()

    def word(low: int, high: int) -> int:
        ends = [x for x in (low - 1, high + 1) if arith.min_int <= x <= arith.max_int]
        return rng.choice([low, high, *ends]) if ends and rng.random() < 0.3 else _word(rng, arith)

    return [[word(*ends) for ends in ranges] for _ in range(steps)]


def _word(rng: random.Random, arith: Arithmetic) -> int:
    """A random word; sometimes an extreme one."""
    if rng.random() < 0.15:
        return rng.choice(
            (
                0,
                -1,
                1,
                arith.min_int,
                arith.max_int,
                1 << (arith.word - 2),
                -(1 << (arith.word - 2)),
            )
        )
    bits = rng.randint(2, arith.word)
    return rng.randint(-(1 << (bits - 1)), (1 << (bits - 1)) - 1)


@dataclass
class _Builder:
    """Grows one program."""

    rng: random.Random
    arith: Arithmetic
    recent: float
    values: list[Value] = field(default_factory=list)
    ops: list[Op] = field(default_factory=list)

    def build(
        self,
        name: str,
        n_ops: int,
        n_inputs: int | None,
        n_outputs: int | None,
        n_states: int | None,
    ) -> Program:
        rng = self.rng
        inputs = self.leaves(Kind.INPUT, "in", n_inputs or rng.randint(1, 12))
        states = self.leaves(
            Kind.STATE, "state", rng.randint(0, 6) if n_states is None else n_states
        )
        self.leaves(Kind.PARAM, "param", rng.randint(0, 4))
        self.leaves(Kind.CONST, "const", rng.randint(1, 5))
        one = len(self.values)
        self.value("one", Kind.CONST, 1 << (self.arith.word - 2))
        while len(self.ops) < n_ops:
            if rng.random() < 0.12 and n_ops - len(self.ops) >= 4:
                self.bundle(one)
            else:
                self.op()
        every = range(len(self.values))
        results = [op.dest for op in self.ops]
        outputs = tuple(
            rng.choice(results[-8:]) if rng.random() < 0.7 else rng.choice(every)
            for _ in range(n_outputs or rng.randint(1, 8))
        )
        after = [
            (s, rng.choice(results) if rng.random() < 0.75 else rng.choice(every)) for s in states
        ]
        table = tuple(_word(rng, self.arith) for _ in range(3 * 512))
        return Program(
            name=name,
            arithmetic=self.arith,
            values=tuple(self.values),
            ops=tuple(self.ops),
            inputs=tuple(inputs),
            outputs=outputs,
            output_names=tuple(f"out{k}" for k in range(len(outputs))),
            states=tuple(after),
            table_memory=table,
        )

    def value(self, name: str, kind: Kind, initial: int = 0) -> int:
        frac = self.arith.word - 1
        self.values.append(Value(name, kind, frac, -1.0, 1.0, "random", initial=initial))
        return len(self.values) - 1

    def leaves(self, kind: Kind, name: str, count: int) -> list[int]:
        return [
            self.value(f"{name}{k}", kind, 0 if kind is Kind.INPUT else _word(self.rng, self.arith))
            for k in range(count)
        ]

    def pick(self) -> int:
        """A value that exists already."""
        if self.rng.random() < self.recent:
            return self.rng.randrange(max(0, len(self.values) - 12), len(self.values))
        return self.rng.randrange(len(self.values))

    def least_shift(self, terms: int, lost: int = 0) -> int:
        """Smallest shift with which ``terms`` products cannot leave the accumulator.

        ``lost`` is by how much a scale may lessen the shift.
        """
        room = self.arith.acc_width - 2  # bits of a magnitude, half of it for the rounding word
        return max(0, 2 * self.arith.word - 2 + terms.bit_length() - room + lost)

    def shift(self, terms: int, lost: int = 0) -> int:
        """A legal shift, mostly one that keeps the results' size."""
        low, high = self.least_shift(terms, lost), self.arith.shift_max
        usual = self.arith.word - 1 - self.arith.guard
        if self.rng.random() < 0.8:
            return max(low, min(high, usual + self.rng.randint(-3, 3)))
        return self.rng.randint(low, high)

    def op(self) -> None:
        """A group of random terms."""
        rng = self.rng
        n = rng.choice((1, 1, 2, 2, 2, 3, 3, 4, rng.randint(1, 9)))
        a = [self.pick() for _ in range(n)]
        flag = rng.choice((None, self.pick(), rng.choice(a)))
        norm = None if rng.random() < 0.75 else rng.choice((self.pick(), rng.choice(a)))
        table = rng.randrange(3) if rng.random() < 0.15 else None
        terms = []
        for k in range(n):
            coefficient = rng.randrange(4) if table is not None and rng.random() < 0.6 else None
            b = None if coefficient is not None else rng.choice((a[k], self.pick()))
            fraction_a = rng.random() < 0.1
            fraction_b = b is not None and rng.random() < 0.1
            scale, shift = self.scale(n, norm, a[k], fraction_a)
            terms.append(
                Term(
                    a[k],
                    b,
                    shift,
                    coefficient,
                    negate=rng.choice(list(Negate))
                    if flag is not None
                    else rng.choice((Negate.NO, Negate.YES)),
                    when=rng.choice(list(When))
                    if flag is not None and rng.random() < 0.5
                    else When.ALWAYS,
                    fraction_a=fraction_a,
                    fraction_b=fraction_b,
                    scale=scale,
                )
            )
        self.add(
            tuple(terms),
            flag=flag,
            norm=norm,
            table=table,
            index=None if table is None else rng.choice((self.pick(), rng.choice(a))),
        )

    def scale(self, terms: int, norm: int | None, a: int, fraction: bool) -> tuple[Scale, int]:
        """Scale and shift of a term: a normalised value cannot overflow, others need room."""
        if norm is None or self.rng.random() < 0.3:
            return Scale.NONE, self.shift(terms)
        scale = self.rng.choice((Scale.FULL, Scale.EVEN, Scale.HALF))
        if a == norm and not fraction:
            return scale, self.shift(terms)
        lost = self.arith.norm_max // 2 if scale is Scale.HALF else self.arith.norm_max
        if self.least_shift(terms, lost) > self.arith.shift_max:
            return Scale.NONE, self.shift(terms)
        return scale, self.shift(terms, lost)

    def bundle(self, one: int) -> None:
        """A function of a table: u = f f, t = c2 + c3 f, w = c0 + c1 f, y = w + t u."""
        x, table = self.pick(), self.rng.randrange(3)
        quarter = self.rng.random() < 0.3
        s = self.arith.word - 1 - self.arith.guard
        square = Term(x, x, s, fraction_a=True, fraction_b=True)
        u = self.add((square,), index=x, quarter=quarter)
        halves = []
        for low in (2, 0):
            unit = Term(one, None, max(s, self.least_shift(2)), low)
            slope = Term(x, None, max(s, self.least_shift(2)), low + 1, fraction_a=True)
            halves.append(self.add((unit, slope), index=x, quarter=quarter, table=table))
        t, w = halves
        self.add((Term(w, one, s - 1), Term(t, u, max(s, self.least_shift(2)))))

    def add(
        self,
        terms: tuple[Term, ...],
        *,
        flag: int | None = None,
        norm: int | None = None,
        index: int | None = None,
        quarter: bool | None = None,
        table: int | None = None,
    ) -> int:
        """Append one op and its value."""
        rng = self.rng
        dest = self.value(f"v{len(self.ops)}", Kind.OP)
        self.ops.append(
            Op(
                dest,
                terms,
                rng.choice((Overflow.SAT, Overflow.CLIP, Overflow.WRAP)),
                flag=flag,
                flag_quarter=flag is not None and rng.random() < 0.3,
                norm=norm,
                index=index,
                index_quarter=quarter
                if quarter is not None
                else index is not None and rng.random() < 0.3,
                table=table,
            )
        )
        return dest
