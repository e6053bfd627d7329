"""Copies: every state gets a separate next value, so that the machine can write it.

The machine writes a next state as the result of a group. A state whose next value is something
else (itself, an input, a constant, or a result that already is another state's next value) gets a
copy: one group of one term, value * 2^k >> (k - G).
"""

from __future__ import annotations

from dataclasses import replace

from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import Kind, Op, Overflow, Program, Term, Value


def copy_shift(word: int, arith: Arithmetic) -> int | None:
    """Shift that makes a product with the constant ``word`` a copy; None if impossible."""
    k = word.bit_length() - 1
    shift = k - arith.guard
    exact = word > 0 and word == 1 << k and k <= arith.word - 2
    return shift if exact and 0 <= shift <= arith.shift_max else None


def with_copies(program: Program) -> Program:
    """Return ``program`` with copies added after its values and ops.

    Outputs, saturation and states are those of ``program`` word for word.
    """
    arith = program.arithmetic
    values = list(program.values)
    ops = list(program.ops)
    names = {v.name for v in values}
    computed: set[int] = set()
    states: list[tuple[int, int]] = []

    def add(value: Value) -> int:
        name = value.name
        while name in names:
            name += "_"
        values.append(replace(value, name=name))
        return len(values) - 1

    unit: int | None = None
    for state, after in program.states:
        if values[after].kind is not Kind.OP or after in computed:
            if unit is None:
                usable = (
                    n
                    for n in program.of_kind(Kind.CONST)
                    if copy_shift(values[n].initial, arith) is not None
                )
                unit = next(usable, None)
            if unit is None:
                frac = arith.guard
                unit = add(Value("one", Kind.CONST, frac, 1.0, 1.0, "constant", initial=1 << frac))
            shift = copy_shift(values[unit].initial, arith)
            assert shift is not None
            source = after
            after = add(
                replace(values[source], name=f"{values[state].name}.next", kind=Kind.OP, initial=0)
            )
            ops.append(Op(after, (Term(source, unit, shift),), Overflow.WRAP))
        computed.add(after)
        states.append((state, after))
    return replace(program, values=tuple(values), ops=tuple(ops), states=tuple(states))
