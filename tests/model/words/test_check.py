"""Incomplete programs are refused with a reason."""

from dataclasses import replace
from typing import Any

import pytest

from boresight.model.words.check import check_complete, check_program
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import Kind, Negate, Op, Program, Scale, Term, Value, When

VALUES = (
    Value("x", Kind.INPUT, 31, -1, 1, "test"),
    Value("s", Kind.STATE, 31, -1, 1, "test"),
    Value("y", Kind.OP, 31, -1, 1, "test"),
    Value("z", Kind.OP, 31, -1, 1, "test"),
)
GOOD = Program(
    "good",
    Arithmetic(),
    VALUES,
    (Op(2, (Term(0, 1, 22),)), Op(3, (Term(2, 2, 22),))),
    (0,),
    (3,),
    ("z",),
    ((1, 2),),
    (0,) * 512,
)


def op(*, term: dict[str, Any] | None = None, **options: Any) -> Program:
    first = Op(2, (Term(**{"a": 0, "b": 1, "shift": 22, **(term or {})}),), **options)
    return replace(GOOD, ops=(first, GOOD.ops[1]))


def test_complete_program_passes() -> None:
    check_complete(GOOD)
    check_program(GOOD)


def test_a_file_may_not_hold_what_no_author_writes() -> None:
    check_complete(replace(GOOD, name="*/"))
    with pytest.raises(ValueError, match=r"^the name '\*/'$"):
        check_program(replace(GOOD, name="*/"))


@pytest.mark.parametrize(
    ("program", "message"),
    [
        (op(term={"b": 3}), r"^operation 0 \(y\) must read what is known before it, not value 3$"),
        (
            replace(GOOD, ops=(*GOOD.ops, GOOD.ops[0])),
            r"^operation 2 \(y\) must be the only writer of a value of kind op, not of value 2$",
        ),
        (op(term={"shift": 32}), r"^operation 0 \(y\): shift must be 0 to 31, not 32$"),
        (op(term={"shift": -1}), r"^operation 0 \(y\): shift must be 0 to 31, not -1$"),
        (
            op(term={"negate": Negate.IF}),
            r"^operation 0 \(y\) must name a flag, for a term asks for it$",
        ),
        (
            op(term={"when": When.UNLESS}),
            r"^operation 0 \(y\) must name a flag, for a term asks for it$",
        ),
        (
            op(term={"scale": Scale.HALF}),
            r"^operation 0 \(y\) must name a norm, for a term asks for it$",
        ),
        (op(term={"b": None}), r"^operation 0 \(y\): a term must have either b or a coefficient$"),
        (
            op(term={"coefficient": 0}),
            r"^operation 0 \(y\): a term must have either b or a coefficient$",
        ),
        (
            op(term={"b": None, "coefficient": 0}, table=0),
            r"^operation 0 \(y\) must name index and table, for a term asks for them$",
        ),
        (
            op(term={"b": None, "coefficient": 4}, table=0, index=0),
            r"^operation 0 \(y\): coefficient must be 0 to 3, not 4$",
        ),
        (
            op(term={"b": None, "coefficient": 0, "fraction_b": True}, table=0, index=0),
            r"^operation 0 \(y\): fraction_b must be unset where b is a coefficient$",
        ),
        (op(table=1, index=0), r"^operation 0 \(y\) must name a table below 1, not 1$"),
        (replace(GOOD, ops=GOOD.ops[:1]), r"^value 3 \(z\) must be computed$"),
        (replace(GOOD, inputs=()), r"^inputs must list every value of kind input once, not \[\]$"),
        (replace(GOOD, states=()), r"^states must list every value of kind state once, not \[\]$"),
        (replace(GOOD, output_names=()), r"^output_names must be 1 names, not 0$"),
        (
            replace(GOOD, arithmetic=Arithmetic(18), table_memory=(2**17,)),
            r"^words must be -131072 to 131071, not 131072$",
        ),
    ],
)
def test_incomplete_program(program: Program, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        check_complete(program)
