"""A program with more results alive at once than the lower half of the register file has room for.

Every result is a factor of one that needs the sum of them all first, and next states come last: so
until then the registers of the next states are free.
"""

from __future__ import annotations

from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import Kind, Op, Program, Term, Value

__all__ = ["crowded_program"]


def crowded_program(
    name: str = "crowded", *, results: int = 140, constants: int = 150, states: int = 60
) -> Program:
    """``results`` alive at once beside ``constants``; ``states`` that sum up products of them."""
    values = [Value(n, Kind.INPUT, 31, -1.0, 1.0, "test") for n in ("x", "y")]
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
        Value(f"s{k}", Kind.STATE, 31, -1.0, 1.0, "test", initial=k << 20) for k in range(states)
    ]
    made = [
        op(
            f"v{k}",
            Term(k % 2, first + k % constants, 23),
            Term(1, first + (7 * k) % constants, 25),
        )
        for k in range(results)
    ]
    total = op("total", *(Term(n, first + k % constants, 23) for k, n in enumerate(made)))
    after = [
        op(f"s{k}.next", Term(kept + k, first, 23), Term(made[k % results], total, 23))
        for k in range(states)
    ]
    last = op("last", *(Term(n, total, 28) for n in made))
    return Program(
        name,
        Arithmetic(),
        tuple(values),
        tuple(ops),
        (0, 1),
        (last, after[0]),
        ("last", "state"),
        tuple((kept + k, n) for k, n in enumerate(after)),
        (),
    )
