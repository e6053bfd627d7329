"""Incomplete programs, and what a file may hold, are refused with a reason."""

import json
from dataclasses import replace
from typing import Any

import pytest

from boresight.model.attitude import ESTIMATORS
from boresight.model.words.check import check_complete, check_program
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import (
    InPort,
    Kind,
    Negate,
    Op,
    Program,
    Scale,
    Term,
    Value,
    When,
)

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


def changed(data: Any, *path: Any) -> Any:
    """A copy of JSON with the value at a path replaced by the last of it."""
    out = json.loads(json.dumps(data))
    *way, key, value = path
    at = out
    for step in way:
        at = at[step]
    at[key] = value
    return out


def op(*, term: dict[str, Any] | None = None, **options: Any) -> Program:
    first = Op(2, (Term(**{"a": 0, "b": 1, "shift": 22, **(term or {})}),), **options)
    return replace(GOOD, ops=(first, GOOD.ops[1]))


def test_complete_program_passes() -> None:
    check_complete(GOOD)
    check_program(GOOD)


@pytest.mark.parametrize(
    "program",
    [
        op(term={"shift": 0}),
        op(term={"shift": 31}),
        op(term={"b": None, "coefficient": 3}, table=0, index=0),
        op(term={"negate": Negate.UNLESS, "when": When.IF, "scale": Scale.FULL}, flag=0, norm=0),
        replace(GOOD, values=(replace(VALUES[0], frac=128), *VALUES[1:])),
        replace(GOOD, values=(replace(VALUES[0], frac=-128), *VALUES[1:])),
        replace(GOOD, arithmetic=Arithmetic(18), table_memory=(2**17 - 1, -(2**17)) * 256),
    ],
)
def test_limits_themselves_are_allowed(program: Program) -> None:
    check_program(program)


@pytest.mark.parametrize(
    ("program", "message"),
    [
        (replace(GOOD, inputs=()), "no inputs or no outputs"),
        (replace(GOOD, outputs=(), output_names=()), "no inputs or no outputs"),
        (
            replace(GOOD, values=(replace(VALUES[0], frac=-129), *VALUES[1:])),
            "a value without a binary point near its word",
        ),
        (
            replace(GOOD, values=(replace(VALUES[0], frac=129), *VALUES[1:])),
            "a value without a binary point near its word",
        ),
        (
            replace(GOOD, in_ports=(InPort(),) * 2),
            "ports that are not those of its inputs and outputs",
        ),
        (
            replace(GOOD, arithmetic=Arithmetic(18), table_memory=(-(2**17) - 1,) * 512),
            "words must be -131072 to 131071, not -131073",
        ),
        (replace(GOOD, outputs=(4,)), "a reference to a value that does not exist"),
        (op(term={"b": None, "coefficient": -1}, table=0, index=0), ".* 0 to 3, not -1"),
        (op(table=-1, index=0), ".* a table below 1, not -1"),
        (op(term={"b": None, "coefficient": 0}, index=0), ".* name index and table, for .*"),
    ],
)
def test_beyond_the_limits(program: Program, message: str) -> None:
    with pytest.raises(ValueError, match=f"^{message}$"):
        check_program(program)


@pytest.mark.parametrize("of", ["values", "ops", "table_memory"])
def test_size_of_a_program(monkeypatch: pytest.MonkeyPatch, of: str) -> None:
    large = {"values": VALUES * 200, "ops": GOOD.ops * 400, "table_memory": (0,) * 1024}[of]
    monkeypatch.setattr("boresight.model.words.check._LIMIT", 512)
    check_program(GOOD)
    with pytest.raises(ValueError, match=r"^a program too large for any core$"):
        check_program(replace(GOOD, **{of: large}))


def test_a_file_may_not_hold_what_no_author_writes() -> None:
    check_complete(replace(GOOD, name="*/"))
    with pytest.raises(ValueError, match=r"^the name '\*/'$"):
        check_program(replace(GOOD, name="*/"))


@pytest.mark.parametrize(
    ("program", "message"),
    [
        (op(term={"b": 3}), r"^operation 0 \(y\) must read values defined before it, not value 3$"),
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


@pytest.mark.parametrize(
    ("path", "message"),
    [
        (("name", "a*/b"), "the name"),
        (("name", 5), "a name that is not a text"),
        (("arithmetic", "headroom", 3), "an arithmetic without a core"),
        (("arithmetic", "word", 40), "word must be 18 to 32"),
        (("values", 0, "frac", "1"), "value with frac '1'"),
        (("values", 0, "frac", True), "value with frac 'True'"),
        (("values", 0, "initial", 2**40), "words must be -131072 to 131071"),
        (("values", 0, "kind", "const"), "inputs must list every value of kind input once"),
        (("values", 0, "kind", "none"), "not a valid Kind"),
        (("inputs", 0, 10**6), "a reference to a value that does not exist"),
        (("outputs", 0, 1.5), "a reference that is not a number"),
        (("outputs", []), "outputs without a name"),
        (("ops", 0, "terms", []), "an operation without terms"),
        (("ops", 0, "terms", 0, "shift", 32), "shift must be 0 to 31, not 32"),
        (("ops", 0, "terms", 0, "a", -1), "a reference to a value that does not exist"),
        (("ops", 0, "terms", 0, "b", None), "a term must have either b or a coefficient"),
        (("ops", 0, "dest", 0), "must be the only writer of a value of kind op, not of value 0"),
        (("ops", 0, "table", 99), "must name a table below 3, not 99"),
        (("ops", []), "a value that no operation computes"),
        (("table_memory", [0] * 511), "a table that does not exist"),
        (("ports", 0, "tolerance", "1"), "port with tolerance '1'"),
        (("ports", [{"name": "a"}]), "ports that are not those of its inputs and outputs"),
        (("in_ports", 0, "missing", [1]), r"port with missing '\[1\]'"),
        (("states", 0, [0, 0]), "states must list every value of kind state once"),
    ],
)
def test_programs_that_no_level_can_run(path, message: str) -> None:
    program = ESTIMATORS["complementary"]().compile(word=18)
    check_program(program)
    data = json.loads(program.to_json())
    with pytest.raises(ValueError, match=message):
        check_program(Program.from_json(json.dumps(changed(data, *path))))
