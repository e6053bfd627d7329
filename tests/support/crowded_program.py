"""A program with more results alive at once than the lower half of the register file has room for.

Every result is a factor of one that needs the sum of them all first, and next states come last: so
until then the registers of the next states are free.
"""

from __future__ import annotations

from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import Kind, Op, Program, Term, Value


def crowded_program(
    name: str = "crowded",
    *,
    inputs: int = 2,
    results: int = 140,
    constants: int = 150,
    states: int = 60,
) -> Program:
    """``inputs`` and ``results`` alive at once beside ``constants``; ``states`` sum up products."""
    values = [Value(f"x{k}", Kind.INPUT, 31, -1.0, 1.0, "test") for k in range(inputs)]
    ops: list[Op] = []

    def op(label: str, *terms: Term) -> int:
        values.append(Value(label, Kind.OP, 31, -1.0, 1.0, "test"))
        ops.append(Op(len(values) - 1, terms))
        return len(values) - 1

    words = [1 + 0x4000_0000 // (k + 2) for k in range(constants)]
    first = len(values)
    values += [
        Value(f"c{k}", Kind.CONST, 31, 0.0, 1.0, "constant", initial=w) for k, w in enumerate(words)
    ]
    kept = len(values)
    values += [
        Value(f"s{k}", Kind.STATE, 31, -1.0, 1.0, "test", initial=k % 8 << 20)
        for k in range(states)
    ]
    made = [
        op(
            f"v{k}",
            Term(k % inputs, first + k % constants, 23),
            Term(1, first + (7 * k) % constants, 25),
        )
        for k in range(results)
    ]
    alive = (*range(inputs), *made)
    total = op("total", *(Term(n, first + k % constants, 23) for k, n in enumerate(alive)))
    after = [
        op(f"s{k}.next", Term(kept + k, first, 23), Term(made[k % results], total, 23))
        for k in range(states)
    ]
    last = op("last", *(Term(n, total, 28) for n in alive))
    return Program(
        name,
        Arithmetic(),
        tuple(values),
        tuple(ops),
        tuple(range(inputs)),
        (last, after[0]),
        ("last", "state"),
        tuple((kept + k, n) for k, n in enumerate(after)),
        (),
    )
