"""Longest paths and lower bounds of small programs."""

from __future__ import annotations

from boresight.gateware.machine import CONFIGS
from boresight.gateware.schedule.priorities import paths, slots_after
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import Kind, Op, Program, Scale, Term, Value, When


def chain(*ops: Op, outputs: tuple[int, ...]) -> Program:
    kinds = [Kind.INPUT, Kind.PARAM] + [Kind.OP] * len(ops)
    values = tuple(Value(f"x{k}", kind, 31, -1, 1, "test") for k, kind in enumerate(kinds))
    return Program(
        "chain",
        Arithmetic(),
        values,
        ops,
        (0,),
        outputs,
        tuple(f"o{k}" for k in range(len(outputs))),
        (),
        (),
    )


def test_chain() -> None:
    """Input in cycle 0, ops end in 1, 8, 16 (two slots wait for the second), emit 23, counted."""
    p = chain(
        Op(2, (Term(0, 1, 23),)),
        Op(3, (Term(2, 1, 23),)),
        Op(4, (Term(3, 1, 23), Term(3, 3, 23), Term(1, 1, 23))),
        outputs=(4,),
    )
    far = paths(p, CONFIGS["fast"], 1)
    assert far.urgent == (22, 15, 7, 0)
    assert far.slots == (1, 1, 3, 1)
    assert far.latency_bound == 1 + 22 + 2
    assert far.length_bound == 25


def test_not_urgent() -> None:
    p = chain(Op(2, (Term(0, 1, 23),)), Op(3, (Term(0, 1, 23),)), outputs=(2, 3))
    far = paths(p, CONFIGS["fast"], 1)
    assert far.urgent == (7, None, 0, None)
    assert far.total == (10, 9, 3, 2)


def test_slots_after() -> None:
    table = Op(9, (Term(0, None, 23, 0), Term(1, None, 23, 1)), index=1, table=0)
    assert [slots_after(table, v) for v in (0, 1)] == [1, 3]
    choice = Op(
        9, (Term(0, 1, 23, when=When.IF), Term(1, 1, 23, when=When.UNLESS), Term(2, 2, 23)), flag=3
    )
    assert [slots_after(choice, v) for v in (0, 1, 2, 3)] == [1, 2, 1, 3]
    scaled = Op(9, (Term(0, 1, 23, scale=Scale.FULL),), norm=0)
    assert [slots_after(scaled, v) for v in (0, 1)] == [1, 1]
